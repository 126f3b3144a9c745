//! MATLAB's level 5 MAT-file: a matrix for each array, and the structures `info`, `units`, `long_names` and `dimensions`.
//!
//! *MAT-File Format*, The MathWorks, describes the format. The libraries at hand write neither text nor arrays of three dimensions.

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::dataset::{Attribute, Dataset, Values};
use crate::mat5_tags::{
    CHAR_CLASS, COMPRESSED, DOUBLE, DOUBLE_CLASS, INT8, INT32, INT32_CLASS, MATRIX, SINGLE,
    SINGLE_CLASS, STRUCT_CLASS, UINT16, UINT32,
};

/// Longest name of a field, with its end, bytes.
const FIELD_NAME: usize = 64;

/// Writes a dataset. The last dimension of an array is the second of its matrix (columns), the one before it the first (rows): a grid
/// becomes a matrix of y, x, z.
///
/// # Errors
/// What the writer reports; [`io::ErrorKind::InvalidInput`] if the format cannot hold an array of this size.
pub(super) fn write(dataset: &Dataset, out: &mut dyn Write) -> io::Result<()> {
    let mut header = b"MATLAB 5.0 MAT-file, written by fieldgap".to_vec();
    header.resize(116, b' ');
    header.extend([0; 8]);
    header.extend(0x0100u16.to_le_bytes());
    header.extend(b"IM");
    out.write_all(&header)?;
    for variable in &dataset.variables {
        let shape = dataset.shape(variable);
        let order = matlab_order(shape.len());
        let size = matlab_size(&shape, &order);
        let matrix = match &variable.values {
            Values::Float(values) => matrix(
                &variable.name,
                DOUBLE_CLASS,
                &size,
                DOUBLE,
                &column_major(values, &shape, &order),
            ),
            Values::Single(values) => matrix(
                &variable.name,
                SINGLE_CLASS,
                &size,
                SINGLE,
                &column_major(values, &shape, &order),
            ),
            Values::Integer(values) => matrix(
                &variable.name,
                INT32_CLASS,
                &size,
                INT32,
                &column_major(values, &shape, &order),
            ),
        };
        write_compressed(&matrix?, out)?;
    }
    let info: Vec<(&str, Vec<u8>)> = dataset
        .attributes
        .iter()
        .map(|(name, value)| {
            let field = match value {
                Attribute::Text(text) => text_matrix(text),
                Attribute::Number(number) => matrix("", DOUBLE_CLASS, &[1, 1], DOUBLE, &[*number]),
                Attribute::Numbers(numbers) => {
                    matrix("", DOUBLE_CLASS, &[1, numbers.len()], DOUBLE, numbers)
                }
            };
            Ok((name.as_str(), field?))
        })
        .collect::<io::Result<_>>()?;
    write_compressed(&structure("info", &info)?, out)?;
    let about =
        |of: &dyn Fn(&crate::dataset::Variable) -> String| -> io::Result<Vec<(&str, Vec<u8>)>> {
            let each = dataset.variables.iter();
            each.map(|variable| Ok((variable.name.as_str(), text_matrix(&of(variable))?))).collect()
        };
    let units = about(&|variable| variable.unit.clone().unwrap_or_default())?;
    write_compressed(&structure("units", &units)?, out)?;
    let long_names = about(&|variable| variable.long_name.clone())?;
    write_compressed(&structure("long_names", &long_names)?, out)?;
    let dimensions = about(&|variable| {
        let names = dataset.dimension_names(variable);
        matlab_order(names.len()).iter().map(|&index| names[index]).collect::<Vec<_>>().join(", ")
    })?;
    write_compressed(&structure("dimensions", &dimensions)?, out)
}

/// The dimensions of an array in the order of its matrix: rows, columns, pages.
fn matlab_order(dimensions: usize) -> Vec<usize> {
    match dimensions {
        0 | 1 => (0..dimensions).collect(),
        2 => vec![0, 1],
        // The planes of a stack are its pages.
        _ => [vec![dimensions - 2, dimensions - 1], (0..dimensions - 2).rev().collect()].concat(),
    }
}

fn matlab_size(shape: &[usize], order: &[usize]) -> Vec<usize> {
    let mut size: Vec<usize> = order.iter().map(|&index| shape[index]).collect();
    // A matrix has at least two dimensions: a list is a column.
    size.resize(size.len().max(2), 1);
    size
}

/// Values with the last dimension fastest, as values with the first dimension of `order` fastest.
fn column_major<T: Copy>(values: &[T], shape: &[usize], order: &[usize]) -> Vec<T> {
    if shape.len() < 2 {
        return values.to_vec();
    }
    let mut steps = vec![1; shape.len()];
    for index in (0..shape.len() - 1).rev() {
        steps[index] = steps[index + 1] * shape[index + 1];
    }
    let mut reordered = Vec::with_capacity(values.len());
    let mut counters = vec![0; shape.len()];
    for _ in 0..values.len() {
        let at: usize =
            order.iter().zip(&counters).map(|(&index, count)| steps[index] * count).sum();
        reordered.push(values[at]);
        for (counter, &index) in counters.iter_mut().zip(order) {
            *counter += 1;
            if *counter < shape[index] {
                break;
            }
            *counter = 0;
        }
    }
    reordered
}

/// A number of the format.
trait Number: Copy {
    fn push(self, bytes: &mut Vec<u8>);
}

macro_rules! numbers {
    ($($kind:ty),*) => {$(
        impl Number for $kind {
            fn push(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    )*};
}

numbers!(f64, f32, i32, u16, u32);

fn matrix<T: Number>(
    name: &str,
    class: u32,
    size: &[usize],
    kind: u32,
    values: &[T],
) -> io::Result<Vec<u8>> {
    let mut content = head(name, class, size)?;
    push_element(&mut content, kind, values)?;
    whole(content)
}

fn text_matrix(text: &str) -> io::Result<Vec<u8>> {
    let units: Vec<u16> = text.encode_utf16().collect();
    let rows = usize::from(!units.is_empty());
    matrix("", CHAR_CLASS, &[rows, units.len()], UINT16, &units)
}

fn structure(name: &str, fields: &[(&str, Vec<u8>)]) -> io::Result<Vec<u8>> {
    let mut content = head(name, STRUCT_CLASS, &[1, 1])?;
    push_element(&mut content, INT32, &[FIELD_NAME as i32])?;
    let mut names = Vec::new();
    for (field, _) in fields {
        let mut field = field.as_bytes().to_vec();
        field.resize(FIELD_NAME, 0);
        names.extend(field);
    }
    push_bytes(&mut content, INT8, &names)?;
    for (_, field) in fields {
        content.extend(field);
    }
    whole(content)
}

/// Flags, size and name of a matrix.
fn head(name: &str, class: u32, size: &[usize]) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    push_element(&mut content, UINT32, &[class, 0])?;
    let size: Vec<i32> = size
        .iter()
        .map(|&length| i32::try_from(length).map_err(|_| too_large()))
        .collect::<io::Result<_>>()?;
    push_element(&mut content, INT32, &size)?;
    push_bytes(&mut content, INT8, name.as_bytes())?;
    Ok(content)
}

fn whole(content: Vec<u8>) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(content.len() + 8);
    push_bytes(&mut bytes, MATRIX, &content)?;
    Ok(bytes)
}

fn push_element<T: Number>(bytes: &mut Vec<u8>, kind: u32, values: &[T]) -> io::Result<()> {
    let mut content = Vec::with_capacity(size_of_val(values));
    values.iter().for_each(|value| value.push(&mut content));
    push_bytes(bytes, kind, &content)
}

fn push_bytes(bytes: &mut Vec<u8>, kind: u32, content: &[u8]) -> io::Result<()> {
    // Up to four bytes stand in the tag itself. MATLAB writes no other form, and Octave reads no other.
    if (1..=4).contains(&content.len()) {
        bytes.extend((kind | (content.len() as u32) << 16).to_le_bytes());
        bytes.extend(content);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        return Ok(());
    }
    bytes.extend(kind.to_le_bytes());
    bytes.extend(u32::try_from(content.len()).map_err(|_| too_large())?.to_le_bytes());
    bytes.extend(content);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    Ok(())
}

fn write_compressed(matrix: &[u8], out: &mut dyn Write) -> io::Result<()> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(matrix)?;
    let compressed = encoder.finish()?;
    out.write_all(&COMPRESSED.to_le_bytes())?;
    out.write_all(&u32::try_from(compressed.len()).map_err(|_| too_large())?.to_le_bytes())?;
    out.write_all(&compressed)
}

fn too_large() -> io::Error {
    io::Error::new(
        io::ErrorKind::InvalidInput,
        "an array is larger than the MAT-file format can hold; export .h5",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stack_of_planes_becomes_a_matrix_of_rows_columns_and_pages() {
        // Two planes of two rows and three columns: value 100 z + 10 y + x.
        let values: Vec<f64> = (0..2)
            .flat_map(|z| {
                (0..2).flat_map(move |y| (0..3).map(move |x| f64::from(100 * z + 10 * y + x)))
            })
            .collect();
        let order = matlab_order(3);
        assert_eq!(matlab_size(&[2, 2, 3], &order), [2, 3, 2]);
        let expected = [0, 10, 1, 11, 2, 12, 100, 110, 101, 111, 102, 112].map(f64::from);
        assert_eq!(column_major(&values, &[2, 2, 3], &order), expected);
        assert_eq!(matlab_size(&[5], &matlab_order(1)), [5, 1]);
        assert_eq!(matlab_size(&[], &matlab_order(0)), [1, 1]);
    }
}
