//! HDF5: one dataset for each array, with unit, name and labels of its dimensions.

use std::io;

use hdf5_pure::{AttrValue, FileBuilder};

use crate::dataset::{Attribute, Dataset, Values};

/// Longest text that is an attribute, bytes: the format limits an attribute to 64 KiB. Longer texts become datasets.
const LONGEST_ATTRIBUTE: usize = 32 << 10;

/// A dataset as the bytes of a file.
///
/// Positions along a dimension are marked as its scale (`CLASS`, `NAME`), and arrays name their dimensions (`DIMENSION_LABELS`). The library
/// writes no variable-length references, so that the list that attaches scales to arrays is not written.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] with the reason of the library.
pub(super) fn bytes(dataset: &Dataset) -> io::Result<Vec<u8>> {
    let mut file = FileBuilder::new();
    let mut long_texts = Vec::new();
    for (name, value) in &dataset.attributes {
        match value {
            Attribute::Text(text) if text.len() > LONGEST_ATTRIBUTE => {
                long_texts.push((name, text))
            }
            Attribute::Text(text) => file.set_attr(name, AttrValue::String(text.clone())),
            Attribute::Number(number) => file.set_attr(name, AttrValue::F64(*number)),
            Attribute::Numbers(numbers) => {
                file.set_attr(name, AttrValue::F64Array(numbers.clone()))
            }
        }
    }
    for (name, text) in long_texts {
        file.create_dataset(name).with_vlen_strings(&[text]);
    }
    for variable in &dataset.variables {
        let shape: Vec<u64> = dataset.shape(variable).iter().map(|&length| length as u64).collect();
        let array = file.create_dataset(&variable.name);
        match &variable.values {
            Values::Float(values) => array.with_f64_data(values),
            Values::Single(values) => array.with_f32_data(values),
            Values::Integer(values) => array.with_i32_data(values),
        };
        array.with_shape(&shape);
        array.set_attr("long_name", AttrValue::String(variable.long_name.clone()));
        if let Some(unit) = &variable.unit {
            array.set_attr("units", AttrValue::String(unit.clone()));
        }
        if let Some(coordinates) = &variable.coordinates {
            array.set_attr("coordinates", AttrValue::String(coordinates.clone()));
        }
        if dataset.is_dimension_scale(variable) {
            array.set_attr("CLASS", AttrValue::AsciiString("DIMENSION_SCALE".to_owned()));
            array.set_attr("NAME", AttrValue::AsciiString(variable.name.clone()));
        } else if !variable.dimensions.is_empty() {
            let labels =
                dataset.dimension_names(variable).iter().map(|name| (*name).to_owned()).collect();
            array.set_attr("DIMENSION_LABELS", AttrValue::VarLenAsciiCharArray(labels));
        }
    }
    file.finish().map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.to_string()))
}
