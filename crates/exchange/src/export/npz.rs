//! NumPy's archive: one .npy file for each array, and `metadata`, a JSON text with attributes, units and dimensions.

use std::io::{self, Seek, Write};

use serde_json::{Map, Value, json};
use zip::write::{SimpleFileOptions, ZipWriter};

use crate::dataset::{Attribute, Dataset, Values};

/// Writes a dataset.
///
/// # Errors
/// What the writer reports.
pub(super) fn write(dataset: &Dataset, out: impl Write + Seek) -> io::Result<()> {
    let mut archive = ZipWriter::new(out);
    // With a fixed date, the same record gives the same bytes.
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default())
        .large_file(true);
    let mut entry =
        |name: &str, header: Vec<u8>, values: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>| {
            archive.start_file(format!("{name}.npy"), options)?;
            archive.write_all(&header)?;
            values(&mut archive)
        };
    for variable in &dataset.variables {
        let shape = dataset.shape(variable);
        match &variable.values {
            Values::Float(values) => entry(&variable.name, header("<f8", &shape), &mut |out| {
                values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
            })?,
            Values::Single(values) => entry(&variable.name, header("<f4", &shape), &mut |out| {
                values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
            })?,
            Values::Integer(values) => entry(&variable.name, header("<i4", &shape), &mut |out| {
                values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
            })?,
        }
    }
    let text = metadata(dataset).to_string();
    let characters = text.chars().count();
    entry("metadata", header(&format!("<U{characters}"), &[]), &mut |out| {
        text.chars().try_for_each(|c| out.write_all(&u32::from(c).to_le_bytes()))
    })?;
    archive.finish()?;
    Ok(())
}

fn metadata(dataset: &Dataset) -> Value {
    let attributes: Map<String, Value> = dataset
        .attributes
        .iter()
        .map(|(name, value)| {
            let value = match value {
                Attribute::Text(text) => json!(text),
                Attribute::Number(number) => json!(number),
                Attribute::Numbers(numbers) => json!(numbers),
            };
            (name.clone(), value)
        })
        .collect();
    let variables: Map<String, Value> = dataset
        .variables
        .iter()
        .map(|variable| {
            let about = json!({
                "units": variable.unit,
                "long_name": variable.long_name,
                "dimensions": dataset.dimension_names(variable),
            });
            (variable.name.clone(), about)
        })
        .collect();
    json!({ "attributes": attributes, "variables": variables })
}

/// The header of the NPY format, version 1.0 (NumPy Enhancement Proposal 1), padded to a multiple of 64 bytes.
fn header(kind: &str, shape: &[usize]) -> Vec<u8> {
    let shape: String = shape.iter().map(|length| format!("{length},")).collect();
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({shape}), }}");
    while !(10 + text.len() + 1).is_multiple_of(64) {
        text.push(' ');
    }
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    // A few dimensions and a type take less than a hundred characters.
    header.extend((text.len() as u16).to_le_bytes());
    header.extend(text.as_bytes());
    header
}
