//! The columns of points as numbers, whatever file they come from, and where each number stands in it.

use std::path::{Path, PathBuf};

use fieldgap_input::Fault;

use crate::text::TextTable;

/// Columns of one length, NaN where a value is missing.
#[derive(Debug)]
pub(crate) struct Rows {
    pub place: [Vec<f64>; 3],
    pub reading: Vec<f64>,
    /// The second part of a complex reading.
    pub second: Option<Vec<f64>>,
    pub time: Option<Vec<f64>>,
    pub drive: Option<Vec<f64>>,
    pub spread: Option<[Vec<f64>; 2]>,
    pub origin: Origin,
}

/// A column of [`Rows`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    Place(usize),
    Reading,
    Second,
    Time,
    Drive,
    Spread(usize),
}

/// Where rows come from.
#[derive(Debug)]
pub(crate) enum Origin {
    /// A table in a text; the columns of the roles.
    Text(Box<TextTable>, Vec<(Role, usize)>),
    /// Arrays of a file; the variables of the roles.
    Arrays(PathBuf, Vec<(Role, String)>),
}

impl Rows {
    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.reading.len()
    }

    /// A fault at a value.
    pub(crate) fn fault(
        &self,
        row: usize,
        role: Role,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Fault {
        match &self.origin {
            Origin::Text(table, columns) => {
                let column = columns.iter().find(|(known, _)| *known == role);
                table.fault(row, column.map_or(0, |(_, column)| *column), problem, remedy)
            }
            Origin::Arrays(path, variables) => {
                let name = variables.iter().find(|(known, _)| *known == role);
                let name = name.map_or("a constant", |(_, name)| name.as_str());
                let problem = format!("{name}, point {}: {}", row + 1, problem.into());
                Fault::of_file(path, problem, remedy)
            }
        }
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        match &self.origin {
            Origin::Text(table, _) => table.path(),
            Origin::Arrays(path, _) => path,
        }
    }

    /// The places of some rows in the file: `line 5`, `lines 5, 7 and 9`, `points 1, 2, 3, 4, 5 and 90 more`.
    pub(crate) fn places(&self, rows: &[usize]) -> String {
        /// Places that are listed.
        const LISTED: usize = 5;
        let word = match &self.origin {
            Origin::Text(..) => "line",
            Origin::Arrays(..) => "point",
        };
        let number = |row: &usize| match &self.origin {
            Origin::Text(table, _) => table.line(*row).to_string(),
            Origin::Arrays(..) => (row + 1).to_string(),
        };
        let listed: Vec<String> = rows.iter().take(LISTED).map(number).collect();
        match (rows.len() - listed.len(), &listed[..]) {
            (0, [one]) => format!("{word} {one}"),
            (0, [first @ .., last]) => format!("{word}s {} and {last}", first.join(", ")),
            (more, _) => format!("{word}s {} and {more} more", listed.join(", ")),
        }
    }
}
