//! NetCDF in its classic format with 64-bit offsets (CDF-2), which every NetCDF library reads.
//!
//! Header and layout: *NetCDF Classic Format Specification*, Unidata. All numbers are big-endian; names, attributes and arrays are padded to
//! four bytes.

use std::io::{self, Write};

use crate::dataset::{Attribute, Dataset, Values, Variable};
use crate::netcdf_tags::{ATTRIBUTES, CHAR, DIMENSIONS, DOUBLE, FLOAT, INT, VARIABLES};

/// Writes a dataset.
///
/// # Errors
/// What the writer reports; [`io::ErrorKind::InvalidInput`] if the format cannot hold an array of this size.
pub(super) fn write(dataset: &Dataset, out: &mut dyn Write) -> io::Result<()> {
    // Twice, because the header states where each array begins, and that depends on the length of the header.
    let length = header(dataset, 0)?.len() as u64;
    out.write_all(&header(dataset, length)?)?;
    for variable in &dataset.variables {
        write_values(&variable.values, out)?;
    }
    Ok(())
}

fn header(dataset: &Dataset, data_at: u64) -> io::Result<Vec<u8>> {
    let mut bytes = b"CDF\x02".to_vec();
    push_count(&mut bytes, 0)?;
    push_list(&mut bytes, DIMENSIONS, dataset.dimensions.len())?;
    for (name, length) in &dataset.dimensions {
        push_text(&mut bytes, name)?;
        push_count(&mut bytes, *length)?;
    }
    push_attributes(&mut bytes, &dataset.attributes)?;
    push_list(&mut bytes, VARIABLES, dataset.variables.len())?;
    let mut begins_at = data_at;
    for variable in &dataset.variables {
        push_text(&mut bytes, &variable.name)?;
        push_count(&mut bytes, variable.dimensions.len())?;
        for dimension in &variable.dimensions {
            push_count(&mut bytes, *dimension)?;
        }
        push_attributes(&mut bytes, &attributes(variable))?;
        let (kind, size) = match variable.values {
            Values::Float(_) => (DOUBLE, 8),
            Values::Single(_) => (FLOAT, 4),
            Values::Integer(_) => (INT, 4),
        };
        let length = variable.values.len() * size;
        bytes.extend(kind.to_be_bytes());
        push_count(&mut bytes, length)?;
        bytes.extend(begins_at.to_be_bytes());
        begins_at += length as u64;
    }
    Ok(bytes)
}

fn attributes(variable: &Variable) -> Vec<(String, Attribute)> {
    let mut attributes =
        vec![("long_name".to_owned(), Attribute::Text(variable.long_name.clone()))];
    if let Some(unit) = &variable.unit {
        attributes.push(("units".to_owned(), Attribute::Text(unit.clone())));
    }
    if let Some(coordinates) = &variable.coordinates {
        attributes.push(("coordinates".to_owned(), Attribute::Text(coordinates.clone())));
    }
    if let Values::Float(_) = variable.values {
        attributes.push(("_FillValue".to_owned(), Attribute::Number(f64::NAN)));
    }
    attributes
}

fn push_attributes(bytes: &mut Vec<u8>, attributes: &[(String, Attribute)]) -> io::Result<()> {
    push_list(bytes, ATTRIBUTES, attributes.len())?;
    for (name, value) in attributes {
        push_text(bytes, name)?;
        let numbers = match value {
            Attribute::Text(text) => {
                bytes.extend(CHAR.to_be_bytes());
                push_text(bytes, text)?;
                continue;
            }
            Attribute::Number(number) => std::slice::from_ref(number),
            Attribute::Numbers(numbers) => numbers,
        };
        bytes.extend(DOUBLE.to_be_bytes());
        push_count(bytes, numbers.len())?;
        bytes.extend(numbers.iter().flat_map(|number| number.to_be_bytes()));
    }
    Ok(())
}

/// A list's tag and length; an empty list has no tag.
fn push_list(bytes: &mut Vec<u8>, tag: u32, length: usize) -> io::Result<()> {
    bytes.extend((if length == 0 { 0 } else { tag }).to_be_bytes());
    push_count(bytes, length)
}

fn push_text(bytes: &mut Vec<u8>, text: &str) -> io::Result<()> {
    push_count(bytes, text.len())?;
    bytes.extend(text.as_bytes());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    Ok(())
}

fn push_count(bytes: &mut Vec<u8>, count: usize) -> io::Result<()> {
    let count = i32::try_from(count).map_err(|_| {
        io::Error::new(
            io::ErrorKind::InvalidInput,
            "an array is larger than NetCDF's classic format can hold; export .h5",
        )
    })?;
    bytes.extend(count.to_be_bytes());
    Ok(())
}

fn write_values(values: &Values, out: &mut dyn Write) -> io::Result<()> {
    match values {
        Values::Float(values) => {
            values.iter().try_for_each(|value| out.write_all(&value.to_be_bytes()))
        }
        Values::Single(values) => {
            values.iter().try_for_each(|value| out.write_all(&value.to_be_bytes()))
        }
        Values::Integer(values) => {
            values.iter().try_for_each(|value| out.write_all(&value.to_be_bytes()))
        }
    }
}
