//! HDF5: one dataset for each array, with unit, name and labels of its dimensions.

use std::io;

use hdf5_pure::{AttrValue, FileBuilder};

use crate::dataset::{Attribute, Dataset, Values};

/// A dataset as the bytes of a file.
///
/// Arrays name their dimensions (`DIMENSION_LABELS`), and the positions along a dimension are the array of its name. They are no dimension scales
/// as HDF5 defines them: the library writes neither the null-terminated text that marks one, nor the references that attach it.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] with the reason of the library.
pub(super) fn bytes(dataset: &Dataset) -> io::Result<Vec<u8>> {
    let mut file = FileBuilder::new();
    // Texts of variable length: the libraries of Python give them as texts, and those of fixed length as bytes.
    for (name, value) in &dataset.attributes {
        file.set_attr(
            name,
            match value {
                Attribute::Text(text) => AttrValue::VarLenString(text.clone()),
                Attribute::Number(number) => AttrValue::F64(*number),
                Attribute::Numbers(numbers) => AttrValue::F64Array(numbers.clone()),
            },
        );
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
        array.set_attr("long_name", AttrValue::VarLenString(variable.long_name.clone()));
        if let Some(unit) = &variable.unit {
            array.set_attr("units", AttrValue::VarLenString(unit.clone()));
        }
        if let Some(coordinates) = &variable.coordinates {
            array.set_attr("coordinates", AttrValue::VarLenString(coordinates.clone()));
        }
        if !variable.dimensions.is_empty() {
            let labels =
                dataset.dimension_names(variable).iter().map(|name| (*name).to_owned()).collect();
            array.set_attr("DIMENSION_LABELS", AttrValue::VarLenStringArray(labels));
        }
    }
    file.finish().map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error.to_string()))
}
