//! Readings as a CSV file: one row for each, after a comment with what is known of the record.

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::dataset::{Attribute, Dataset, Values, Variable};

/// Writes the arrays of the first dimension of a dataset, which are the readings; grids and drives need another format.
///
/// # Errors
/// What the writer reports; [`io::ErrorKind::InvalidInput`] if there are no points.
pub(super) fn write(dataset: &Dataset, out: &mut dyn Write) -> io::Result<()> {
    if dataset.dimensions.first().is_none_or(|(name, _)| name != "point") {
        let problem =
            "a volume is no table of points; give --grids, or choose .nc, .h5, .mat or .npz";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    for (name, value) in &dataset.attributes {
        let text = match value {
            Attribute::Text(text) => text.clone(),
            Attribute::Number(number) => format!("{number:?}"),
            Attribute::Numbers(numbers) => format!("{numbers:?}"),
        };
        if text.contains('\n') {
            writeln!(out, "# {name}:")?;
            for line in text.lines() {
                writeln!(out, "#   {}", line.replace('\r', " "))?;
            }
        } else {
            writeln!(out, "# {name}: {}", text.replace('\r', " "))?;
        }
    }
    let columns: Vec<&Variable> =
        dataset.variables.iter().filter(|variable| variable.dimensions == [0]).collect();
    let headings: Vec<String> = columns.iter().map(|variable| heading(variable)).collect();
    writeln!(out, "{}", headings.join(","))?;
    let rows = dataset.dimensions.first().map_or(0, |(_, length)| *length);
    let mut line = String::new();
    for row in 0..rows {
        line.clear();
        for (index, variable) in columns.iter().enumerate() {
            if index > 0 {
                line.push(',');
            }
            // Writing to a string cannot fail. {:?} writes the fewest digits that read back as the same number.
            let _ = match &variable.values {
                Values::Float(values) if values[row].is_nan() => Ok(()),
                Values::Float(values) => write!(line, "{:?}", values[row]),
                Values::Single(values) => write!(line, "{:?}", values[row]),
                Values::Integer(values) => write!(line, "{}", values[row]),
            };
        }
        line.push('\n');
        out.write_all(line.as_bytes())?;
    }
    Ok(())
}

/// `x_mm`: the name and the unit in letters, digits and underscores.
fn heading(variable: &Variable) -> String {
    match &variable.unit {
        None => variable.name.clone(),
        Some(unit) => {
            let unit: String =
                unit.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
            format!("{}_{unit}", variable.name)
        }
    }
}
