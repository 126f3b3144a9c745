//! A table of numbers in a text: its heading, its rows, and where each stands.

use std::path::{Path, PathBuf};

use fieldgap_input::Fault;

use super::dialect::Dialect;
use super::number::number;
use crate::unit::{LengthUnit, ReadingUnit, name_and_unit};

/// Marks at the start of a line that is not part of the table.
const COMMENTS: [&str; 4] = ["#", "%", "//", "!"];

/// Longest line, bytes.
const LONGEST_LINE: usize = 1 << 20;

/// Longest part of a line that a fault shows, characters.
const SHOWN: usize = 160;

/// A column's heading.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Heading {
    /// The text that heads the column, as it stands; empty if there is none.
    pub text: String,
    /// The name without the unit.
    pub name: String,
    /// The unit, where the heading states one.
    pub unit: Option<String>,
}

/// A table of numbers in a text.
#[derive(Debug)]
pub(crate) struct TextTable {
    path: PathBuf,
    text: String,
    /// What the bytes of the file were, if they were not UTF-8.
    pub encoding: Option<&'static str>,
    pub dialect: Dialect,
    pub headings: Vec<Heading>,
    /// Lines before the table that are neither its heading nor comments nor empty.
    pub preamble: usize,
    /// Number of the line, from 1, and its place in the text, for each row.
    rows: Vec<(usize, std::ops::Range<usize>)>,
}

impl TextTable {
    /// Takes `bytes` as the contents of `path`.
    pub(crate) fn of_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, Fault> {
        let (text, encoding) = decoded(bytes);
        Self::of_text(path, text, encoding)
    }

    fn of_text(path: &Path, text: String, encoding: Option<&'static str>) -> Result<Self, Fault> {
        let lines = Lines::of(&text);
        if let Some((number, _)) = lines.clone().find(|(_, range)| range.len() > LONGEST_LINE) {
            let problem = format!("line {number} is longer than {LONGEST_LINE} bytes");
            return Err(Fault::of_file(path, problem, NO_TABLE_REMEDY));
        }
        let content = lines.clone().filter(|(_, range)| is_content(&text[range.clone()]));
        let (dialect, width) = Dialect::of(content.clone().map(|(_, range)| &text[range]))
            .ok_or_else(|| Fault::of_file(path, "has no row of numbers", NO_TABLE_REMEDY))?;
        let is_row = |range: &std::ops::Range<usize>| {
            dialect.width_of_numbers(&text[range.clone()]) == Some(width)
        };
        let (mut rows, mut before) = (Vec::new(), Vec::new());
        for (number, range) in content {
            if !rows.is_empty() || is_row(&range) {
                rows.push((number, range));
            } else {
                before.push(range);
            }
        }
        let first = rows.first().map_or(text.len(), |(_, range)| range.start);
        let comments: Vec<&str> = lines
            .map(|(_, range)| range)
            .take_while(|range| range.start < first)
            .filter_map(|range| comment(&text[range]))
            .collect();
        let before: Vec<&str> = before.into_iter().map(|range| &text[range]).collect();
        let (headings, heading_lines) = headings(dialect, width, &before, &comments);
        let preamble = before.len() - heading_lines;
        let mut table = Self {
            path: path.to_owned(),
            encoding,
            dialect,
            headings,
            preamble,
            rows,
            text: String::new(),
        };
        table.text = text;
        table.check_widths(width)?;
        table.drop_empty_columns();
        Ok(table)
    }

    /// Where the table came from.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// How many rows there are; at least one.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The number of a row's line, from 1.
    pub(crate) fn line(&self, row: usize) -> usize {
        self.rows[row].0
    }

    /// A column as numbers, NaN where a value is missing.
    pub(crate) fn column(&self, column: usize) -> Result<Vec<f64>, Fault> {
        let mut values = Vec::with_capacity(self.rows.len());
        for (row, (_, range)) in self.rows.iter().enumerate() {
            let cells = self.dialect.cells(&self.text[range.clone()]);
            let cell = cells.get(column).map_or("", |(_, cell)| cell);
            values.push(number(cell, self.dialect.decimal).ok_or_else(|| {
                let problem = format!("`{}` is not a number", shown(cell));
                let remedy = "correct the value, remove the row, or begin the line with # if it is a comment; a complex reading needs \
                              two columns, re,im or amplitude,phase";
                self.fault(row, column, problem, remedy)
            })?);
        }
        Ok(values)
    }

    /// A fault at a cell.
    pub(crate) fn fault(
        &self,
        row: usize,
        column: usize,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Fault {
        let (number, range) = &self.rows[row];
        let line = &self.text[range.clone()];
        let cells = self.dialect.cells(line);
        let at = cells.get(column).map_or(line.len(), |(at, _)| *at);
        let character = line[..at].chars().count() + 1;
        Fault::on_line(&self.path, *number, character, &shown(line), problem, remedy)
    }

    fn check_widths(&self, width: usize) -> Result<(), Fault> {
        for (row, (_, range)) in self.rows.iter().enumerate() {
            let cells = self.dialect.cells(&self.text[range.clone()]).len();
            if cells != width {
                return Err(self.fault(
                    row,
                    cells.min(width),
                    format!("the row has {cells} cells where the table has {width}"),
                    "complete the row, remove it, or begin the line with # if it is a comment",
                ));
            }
        }
        Ok(())
    }

    /// Some programs write separators at the end of every line: the empty cells after them are no columns.
    fn drop_empty_columns(&mut self) {
        while let Some(last) = self.headings.last()
            && last.text.is_empty()
            && self.headings.len() > 2
        {
            let column = self.headings.len() - 1;
            let empty = |(_, range): &(usize, std::ops::Range<usize>)| {
                let cells = self.dialect.cells(&self.text[range.clone()]);
                cells.get(column).is_none_or(|(_, cell)| cell.is_empty())
            };
            if !self.rows.iter().all(empty) {
                return;
            }
            self.headings.pop();
        }
    }
}

const NO_TABLE_REMEDY: &str = "the file must be a table of numbers: one row for each point, with cells separated by commas, semicolons, \
                               tabs, blanks or bars";

/// The fault of a file that the system does not give.
pub(crate) fn unreadable(path: &Path, error: &std::io::Error) -> Fault {
    let remedy = "check that the file exists and that you have the permission to read it";
    Fault::of_file(path, format!("cannot be read: {error}"), remedy)
}

/// Bytes as text, and how they were coded if not as UTF-8: spreadsheets write UTF-16, and instruments Latin-1, with one byte for a degree
/// sign or a \u{b5}.
fn decoded(bytes: Vec<u8>) -> (String, Option<&'static str>) {
    let units = |from_bytes: fn([u8; 2]) -> u16| {
        let units: Vec<u16> =
            bytes[2..].chunks_exact(2).map(|pair| from_bytes([pair[0], pair[1]])).collect();
        String::from_utf16_lossy(&units)
    };
    match bytes.get(..2) {
        Some([0xff, 0xfe]) => return (units(u16::from_le_bytes), Some("UTF-16")),
        Some([0xfe, 0xff]) => return (units(u16::from_be_bytes), Some("UTF-16")),
        _ => {}
    }
    match String::from_utf8(bytes) {
        Ok(text) => match text.strip_prefix('\u{feff}') {
            Some(rest) => (rest.to_owned(), None),
            None => (text, None),
        },
        Err(error) => {
            (error.as_bytes().iter().map(|&byte| char::from(byte)).collect(), Some("Latin-1"))
        }
    }
}

/// The lines of a text with their numbers from 1, whatever ends them.
#[derive(Clone)]
struct Lines<'t> {
    text: &'t str,
    at: usize,
    number: usize,
}

impl<'t> Lines<'t> {
    fn of(text: &'t str) -> Self {
        Self { text, at: 0, number: 0 }
    }
}

impl Iterator for Lines<'_> {
    type Item = (usize, std::ops::Range<usize>);

    fn next(&mut self) -> Option<Self::Item> {
        let rest = &self.text[self.at..];
        if rest.is_empty() {
            return None;
        }
        let length = rest.find(['\n', '\r']).unwrap_or(rest.len());
        let range = self.at..self.at + length;
        let end = &rest[length..];
        self.at += length + if end.starts_with("\r\n") { 2 } else { end.len().min(1) };
        self.number += 1;
        Some((self.number, range))
    }
}

fn is_content(line: &str) -> bool {
    !line.trim().is_empty() && comment(line).is_none()
}

/// The text of a comment.
fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    COMMENTS
        .iter()
        .find_map(|mark| line.strip_prefix(mark))
        .map(|text| text.trim_start_matches(['#', '%']).trim())
}

/// The headings of the columns, and the number of lines that they take up of those `before` the rows. A row of units may follow the names.
/// Some programs write the names as a comment.
fn headings(
    dialect: Dialect,
    width: usize,
    before: &[&str],
    comments: &[&str],
) -> (Vec<Heading>, usize) {
    let row = |line: Option<&&str>| -> Option<Vec<String>> {
        let cells = dialect.cells(line?);
        let fits = cells.len() == width && cells.iter().any(|(_, cell)| !cell.is_empty());
        fits.then(|| cells.iter().map(|(_, cell)| (*cell).to_owned()).collect())
    };
    let is_unit = |cell: &String| {
        let cell = cell.trim_matches(['(', ')', '[', ']']);
        cell.is_empty()
            || ["s", "ms", "Hz"].contains(&cell)
            || cell.parse::<LengthUnit>().is_ok()
            || cell.parse::<ReadingUnit>().is_ok()
    };
    let last = row(before.last());
    let above = row(before.len().checked_sub(2).and_then(|index| before.get(index)));
    if let (Some(units), Some(names)) = (&last, &above)
        && units.iter().all(is_unit)
    {
        let both = names.iter().zip(units).map(|(name, unit)| {
            let unit = unit.trim_matches(['(', ')', '[', ']']);
            let unit = (!unit.is_empty()).then(|| unit.to_owned());
            Heading { text: name.clone(), name: name.clone(), unit }
        });
        return (both.collect(), 2);
    }
    let (names, lines) = match last {
        Some(names) => (Some(names), 1),
        None => (row(comments.last()), 0),
    };
    let heading = |text: String| {
        let (name, unit) = name_and_unit(&text);
        Heading { name: name.to_owned(), unit: unit.map(str::to_owned), text }
    };
    let names = names.unwrap_or_else(|| vec![String::new(); width]);
    (names.into_iter().map(heading).collect(), lines)
}

fn shown(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests;
