//! Points of a table in a text.

use fieldgap_input::Fault;

use super::request::{PointsRequest, Source, Units};
use super::rows::{Origin, Role, Rows};
use crate::text::TextTable;

/// The requested columns of a table, their units, and a description of the table.
pub(crate) fn rows_of_text(
    table: TextTable,
    request: &PointsRequest,
) -> Result<(Rows, String, Units), Fault> {
    let Some(columns) = &request.columns else {
        return Err(Fault::of_file(
            table.path(),
            format!("is a table of {} columns: {}", table.headings.len(), listed(&table)),
            "say which are x, y, z and the reading, as --columns x,y,z,reading or --columns 1,2,3,4; a coordinate that all points have in \
             common is written as =100",
        ));
    };
    let mut used: Vec<(Role, usize)> = Vec::new();
    let mut take = |role: Role, name: &str| -> Result<Vec<f64>, Fault> {
        let column = column_of(&table, name)?;
        used.push((role, column));
        table.column(column)
    };
    let mut along = |axis: usize| match &columns.place[axis] {
        Source::Column(name) => take(Role::Place(axis), name),
        Source::Constant(value) => Ok(vec![*value; table.len()]),
    };
    let place = [along(0)?, along(1)?, along(2)?];
    let mut optional =
        |role: Role, name: Option<&String>| name.map(|name| take(role, name)).transpose();
    let reading = optional(Role::Reading, columns.reading.first())?.unwrap_or_default();
    let second = optional(Role::Second, columns.reading.get(1))?;
    let time = optional(Role::Time, request.time.as_ref())?;
    let drive = optional(Role::Drive, request.drive.as_ref())?;
    let spread = match &request.spread {
        Some([std, count]) => Some([
            optional(Role::Spread(0), Some(std))?.unwrap_or_default(),
            optional(Role::Spread(1), Some(count))?.unwrap_or_default(),
        ]),
        None => None,
    };
    let units = units(&table, &used, request, second.is_some())?;
    let format = description(&table);
    let origin = Origin::Text(Box::new(table), used);
    Ok((Rows { place, reading, second, time, drive, spread, origin }, format, units))
}

fn description(table: &TextTable) -> String {
    let mut format = format!("text, {}", table.dialect);
    if let Some(encoding) = table.encoding {
        format += &format!(", in {encoding}");
    }
    match table.preamble {
        0 => {}
        1 => format += "; 1 line before the table is not read",
        lines => format += &format!("; {lines} lines before the table are not read"),
    }
    format
}

/// The columns as a list: `1 x (mm), 2 y (mm), 3`.
fn listed(table: &TextTable) -> String {
    let column = |(index, heading): (usize, &crate::text::Heading)| match heading.text.as_str() {
        "" => format!("{} without a name", index + 1),
        text => format!("{} `{text}`", index + 1),
    };
    table.headings.iter().enumerate().map(column).collect::<Vec<_>>().join(", ")
}

/// A column by its heading, by its heading without the unit, or by its number from 1.
fn column_of(table: &TextTable, name: &str) -> Result<usize, Fault> {
    let matching = |fits: &dyn Fn(&crate::text::Heading) -> bool| -> Vec<usize> {
        (0..table.headings.len()).filter(|&index| fits(&table.headings[index])).collect()
    };
    let tries: [&dyn Fn(&crate::text::Heading) -> bool; 3] =
        [&|heading| heading.text == name, &|heading| heading.name == name, &|heading| {
            heading.name.to_lowercase() == name.to_lowercase()
        }];
    for fits in tries {
        match matching(fits)[..] {
            [] => {}
            [column] => return Ok(column),
            _ => {
                let problem = format!("several columns are named `{name}`: {}", listed(table));
                return Err(Fault::of_file(
                    table.path(),
                    problem,
                    "name them by number, as --columns 1,2,3,4",
                ));
            }
        }
    }
    match name.parse::<usize>() {
        Ok(number) if (1..=table.headings.len()).contains(&number) => Ok(number - 1),
        _ => Err(Fault::of_file(
            table.path(),
            format!("has no column `{name}`; its columns are {}", listed(table)),
            "name columns by their heading or by their number from 1",
        )),
    }
}

/// The units, as requested or as the headings state them; both must agree where both are known.
fn units(
    table: &TextTable,
    used: &[(Role, usize)],
    request: &PointsRequest,
    complex: bool,
) -> Result<Units, Fault> {
    let stated = |role: Role| {
        let column = used.iter().find(|(known, _)| *known == role)?.1;
        table.headings[column].unit.as_deref()
    };
    super::units::units(table.path(), request, complex, &stated)
}
