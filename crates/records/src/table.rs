//! Tables of numbers in text, read row by row, with faults at their line and column.
//!
//! Quotes have no meaning except around a cell, where they are removed: one line is one row, and the position of a cell in its line is
//! known exactly. Empty lines are skipped.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use csv::StringRecord;

use fieldgap_input::{Fault, Finite, MOST_TABLE, OutOfRange, Place, read_bytes};

/// Longest part of a line that a fault shows, characters.
const SHOWN_CHARACTERS: usize = 160;

/// Longest line of a table, bytes.
const LONGEST_LINE: usize = 1 << 20;

/// The text of a table.
#[derive(Debug)]
pub struct Table {
    path: PathBuf,
    text: String,
}

impl Table {
    /// Reads a file.
    ///
    /// # Errors
    /// A [`Fault`] if it cannot be read, or at the first byte that is not UTF-8.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        let bytes = read_bytes(path, MOST_TABLE).map_err(|error| {
            Fault::of_file(
                path,
                format!("cannot be read: {error}"),
                "check that the file exists and that you have the permission to read it",
            )
        })?;
        Self::from_bytes(path, bytes)
    }

    /// Takes `bytes` as the contents of `path`.
    ///
    /// # Errors
    /// A [`Fault`] at the first byte that is not UTF-8.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, Fault> {
        match String::from_utf8(bytes) {
            Ok(text) => {
                // A row is read as a whole, beside the table.
                let mut lines = text.split('\n');
                if let Some(number) = lines.position(|line| line.len() > LONGEST_LINE) {
                    return Err(Fault::of_file(
                        path,
                        format!("line {} is longer than {LONGEST_LINE} bytes", number + 1),
                        NOT_TEXT,
                    ));
                }
                Ok(Self::new(path, text))
            }
            Err(error) => {
                let good = error.utf8_error().valid_up_to();
                let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
                Err(Fault::at(path, &text, good..good + 1, "is not UTF-8 text", NOT_TEXT))
            }
        }
    }

    /// Takes `text` as the contents of `path`.
    pub fn new(path: &Path, text: impl Into<String>) -> Self {
        let text: String = text.into();
        let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
        Self { path: path.to_owned(), text }
    }

    /// Where the text came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The text, without a byte order mark.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Checks that the last row ends with a line end. A number that was cut off is still a number, so that only the line end shows
    /// that the row is complete.
    ///
    /// # Errors
    /// A [`Fault`] at the end of the last row.
    pub fn refuse_cut_end(&self, last: &Row<'_>) -> Result<(), Fault> {
        if self.text.ends_with(['\n', '\r']) {
            return Ok(());
        }
        Err(last.fault(
            last.len(),
            "the last line has no line end, so it may have been cut off",
            "if the row is complete, add a line end; if a scan was interrupted here, `fieldgap resume` measures that point again",
        ))
    }

    /// The rows from the top, with cells separated by `delimiter`.
    pub fn rows(&self, delimiter: u8) -> Rows<'_> {
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .quoting(false)
            .delimiter(delimiter)
            .from_reader(self.text.as_bytes());
        Rows { table: self, records: reader.into_records(), counted_to: 0, line: 1 }
    }
}

const NOT_TEXT: &str = "write the table as plain text with numbers and commas";

/// A number of a column, if its quantity can have it: a length (`…_mm`) is within 10 m.
///
/// # Errors
/// [`OutOfRange`].
pub(super) fn in_range(column: &str, value: f64) -> Result<f64, OutOfRange> {
    match column.ends_with("_mm") {
        true => Place::new(value).map(Place::get),
        false => Finite::new(value).map(Finite::get),
    }
}

/// The rows of a [`Table`].
pub struct Rows<'t> {
    table: &'t Table,
    records: csv::StringRecordsIntoIter<&'t [u8]>,
    /// Byte up to which line ends have been counted, and the number of the line that starts there or later.
    counted_to: usize,
    line: usize,
}

impl<'t> Iterator for Rows<'t> {
    type Item = Row<'t>;

    fn next(&mut self) -> Option<Row<'t>> {
        // Reading UTF-8 text from memory, with any number of cells, cannot fail.
        let record = self.records.next()?.ok()?;
        let text = &self.table.text;
        let at = record.position().map_or(self.counted_to, |position| position.byte() as usize);
        // The position may be before empty lines, and before the \n of the \r\n that ended the last row.
        let start =
            at + text[at..].bytes().take_while(|byte| matches!(byte, b'\r' | b'\n')).count();
        self.line += text[self.counted_to..start].matches('\n').count();
        self.counted_to = start;
        let line_text = text[start..].split(['\r', '\n']).next().unwrap_or("");
        Some(Row { path: &self.table.path, line: self.line, text: line_text, record })
    }
}

/// One row of a [`Table`].
pub struct Row<'t> {
    path: &'t Path,
    line: usize,
    text: &'t str,
    record: StringRecord,
}

impl Row<'_> {
    /// How many cells the row has; at least one.
    pub fn len(&self) -> usize {
        self.record.len()
    }

    /// A cell without the blanks and quotes around it; empty if the row is shorter.
    pub fn cell(&self, index: usize) -> &str {
        self.record.get(index).unwrap_or("").trim().trim_matches('"')
    }

    /// All cells, as [`Row::cell`] gives them.
    pub fn cells(&self) -> impl Iterator<Item = &str> {
        (0..self.len()).map(|index| self.cell(index))
    }

    /// A cell as a finite number; `name` is that of the column. Lengths (`…_mm`) are within 10 m.
    ///
    /// # Errors
    /// A [`Fault`] at the cell.
    pub fn number(&self, index: usize, name: &str) -> Result<f64, Fault> {
        let value: f64 = self.parse(index, name, "a number")?;
        in_range(name, value).map_err(|refused| self.wrong(index, name, refused.wanted()))
    }

    /// A cell as any type that parses from text; `wanted` describes what is expected.
    ///
    /// # Errors
    /// A [`Fault`] at the cell.
    pub fn parse<T: FromStr>(&self, index: usize, name: &str, wanted: &str) -> Result<T, Fault> {
        self.cell(index).parse().map_err(|_| self.wrong(index, name, wanted))
    }

    /// The fault of a cell that is not what is `wanted`.
    pub fn wrong(&self, index: usize, name: &str, wanted: &str) -> Fault {
        let seen = match self.cell(index) {
            "" => "is empty".to_owned(),
            cell => format!("is `{}`", clipped(cell)),
        };
        self.fault(
            index,
            format!("{name} {seen}, but {wanted} is expected"),
            "correct the value, or remove the row",
        )
    }

    /// A fault at a cell.
    pub fn fault(
        &self,
        index: usize,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Fault {
        Fault::on_line(
            self.path,
            self.line,
            self.character_of(index),
            &clipped(self.text),
            problem,
            remedy,
        )
    }

    /// Character, from 1, at which a cell's text starts; one past the end of the line if the row is shorter.
    fn character_of(&self, index: usize) -> usize {
        // Quoting is off: the line is the bytes of the cells and one delimiter between neighbours.
        let byte = match self.record.range(index) {
            Some(range) => {
                let cell = &self.record.as_slice()[range.clone()];
                range.start + index + (cell.len() - cell.trim_start().len())
            }
            None => self.text.len(),
        };
        self.text.get(..byte).unwrap_or(self.text).chars().count() + 1
    }
}

fn clipped(text: &str) -> String {
    match text.char_indices().nth(SHOWN_CHARACTERS) {
        Some((end, _)) => format!("{} …", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn table(text: &str) -> Table {
        Table::new(Path::new("t.csv"), text)
    }

    #[test]
    fn lines_are_counted_over_empty_lines_and_both_line_ends() {
        let table = table("\u{feff}a,b\r\n\r\n1,2\n\n\n3,λ ,\"5\"\n");
        let rows: Vec<(usize, Vec<String>)> = table
            .rows(b',')
            .map(|row| (row.line, row.cells().map(str::to_owned).collect()))
            .collect();
        let cells = |cells: &[&str]| cells.iter().map(|c| (*c).to_owned()).collect::<Vec<_>>();
        assert_eq!(
            rows,
            [(1, cells(&["a", "b"])), (3, cells(&["1", "2"])), (6, cells(&["3", "λ", "5"]))]
        );
    }

    #[test]
    fn a_bad_cell_is_located_at_its_first_character() {
        let table = table("λ,1\nλ,  x7\n");
        let row = table.rows(b',').nth(1).expect("two rows");
        let fault = row.number(1, "reading").expect_err("x7 is no number");
        assert_eq!(fault.line_column(), Some((2, 5)));
        assert!(fault.problem().contains("`x7`"), "{fault}");
        let fault = row.number(2, "std").expect_err("there is no third cell");
        assert_eq!(fault.line_column(), Some((2, 7)));
    }

    #[test]
    fn numbers_are_finite() {
        let table = table("NaN,inf,-1e3\n");
        let row = table.rows(b',').next().expect("a row");
        assert!(row.number(0, "a").is_err() && row.number(1, "b").is_err());
        assert_eq!(row.number(2, "c").expect("finite"), -1000.0);
    }

    #[test]
    fn bytes_that_are_not_text_are_located() {
        let fault = Table::from_bytes(Path::new("t.csv"), b"1,2\n3,\xff4\n".to_vec())
            .expect_err("0xff is not UTF-8");
        assert_eq!(fault.line_column(), Some((2, 3)));
    }

    #[test]
    fn a_line_that_is_longer_than_any_row_is_refused() {
        let bytes = [b"1,2\n".to_vec(), vec![b'0'; LONGEST_LINE + 1]].concat();
        let fault = Table::from_bytes(Path::new("t.csv"), bytes).expect_err("too long");
        assert!(fault.problem().starts_with("line 2 is longer"), "{fault}");
    }

    proptest! {
        #[test]
        fn every_line_with_text_is_a_row_at_its_own_line(text in "[0-9,λ \"\r\n]{0,60}") {
            let table = table(&text);
            let lines: Vec<usize> = table.rows(b',').map(|row| row.line).collect();
            // A lone \r ends a row too; lines are counted by \n, as editors show them.
            let expected: Vec<usize> = text
                .split('\n')
                .enumerate()
                .flat_map(|(index, line)| {
                    let rows = line.split('\r').filter(|part| !part.is_empty()).count();
                    std::iter::repeat_n(index + 1, rows)
                })
                .collect();
            prop_assert_eq!(lines, expected);
        }

        #[test]
        fn any_cell_of_any_text_can_be_at_fault(text in "\\PC{0,40}", index in 0usize..6) {
            let table = table(&text);
            for row in table.rows(b',') {
                prop_assert!(row.fault(index, "p", "r").line_column().is_some());
            }
        }
    }
}
