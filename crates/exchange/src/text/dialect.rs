//! How a text separates its cells and writes its numbers.

use std::fmt;

use super::number::{is_missing, number};

/// Lines from which the dialect is determined.
const EXAMINED: usize = 1000;

/// What separates the cells of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// A tab.
    Tab,
    /// A semicolon.
    Semicolon,
    /// A comma.
    Comma,
    /// A vertical bar.
    Bar,
    /// Any number of blanks and tabs.
    Blanks,
}

/// The decimal mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decimal {
    /// As in 1.5.
    Point,
    /// As in 1,5.
    Comma,
}

/// How a text separates its cells and writes its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dialect {
    /// What separates cells.
    pub delimiter: Delimiter,
    /// The decimal mark.
    pub decimal: Decimal,
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.delimiter {
            Delimiter::Tab => "separated by tabs",
            Delimiter::Semicolon => "separated by semicolons",
            Delimiter::Comma => "separated by commas",
            Delimiter::Bar => "separated by vertical bars",
            Delimiter::Blanks => "separated by blanks",
        })?;
        f.write_str(match self.decimal {
            Decimal::Point => "",
            Decimal::Comma => ", with decimal commas",
        })
    }
}

/// A cell and the byte of its line at which it starts.
pub(super) type Cell<'l> = (usize, &'l str);

impl Dialect {
    /// Every dialect. Where a text fits several alike, the first of them is right: integers separated by tabs fit four.
    const ALL: [Self; 10] = {
        use Decimal::{Comma, Point};
        const fn with(delimiter: Delimiter, decimal: Decimal) -> Dialect {
            Dialect { delimiter, decimal }
        }
        [
            with(Delimiter::Tab, Point),
            with(Delimiter::Semicolon, Point),
            with(Delimiter::Comma, Point),
            with(Delimiter::Bar, Point),
            with(Delimiter::Blanks, Point),
            with(Delimiter::Tab, Comma),
            with(Delimiter::Semicolon, Comma),
            // Cells with a decimal comma stand in quotes between commas.
            with(Delimiter::Comma, Comma),
            with(Delimiter::Bar, Comma),
            with(Delimiter::Blanks, Comma),
        ]
    };

    /// The dialect in which most lines are rows of numbers, and the number of cells of most of them. `None` if no line is a row of two
    /// numbers or more.
    pub(super) fn of<'l>(lines: impl Iterator<Item = &'l str> + Clone) -> Option<(Self, usize)> {
        let mut best: Option<(usize, Self, usize)> = None;
        for dialect in Self::ALL {
            let mut rows_by_width: Vec<(usize, usize)> = Vec::new();
            for line in lines.clone().take(EXAMINED) {
                let Some(width) = dialect.width_of_numbers(line) else { continue };
                match rows_by_width.iter_mut().find(|(known, _)| *known == width) {
                    Some((_, rows)) => *rows += 1,
                    None => rows_by_width.push((width, 1)),
                }
            }
            // Of widths that are equally frequent the larger: a table is wider than the numbers before it.
            let most = rows_by_width.into_iter().max_by_key(|(width, rows)| (*rows, *width));
            if let Some((width, rows)) = most
                && best.is_none_or(|(known, ..)| rows > known)
            {
                best = Some((rows, dialect, width));
            }
        }
        best.map(|(_, dialect, width)| (dialect, width))
    }

    /// The number of cells of a line, if at least two are numbers and all others are missing.
    pub(super) fn width_of_numbers(self, line: &str) -> Option<usize> {
        let (mut width, mut numbers) = (0, 0);
        for (_, cell) in self.cells(line) {
            width += 1;
            number(cell, self.decimal)?;
            numbers += usize::from(!is_missing(cell));
        }
        (numbers >= 2).then_some(width)
    }

    /// The cells of a line, without the blanks and quotes around them.
    pub(super) fn cells<'l>(self, line: &'l str) -> Vec<Cell<'l>> {
        let separator = match self.delimiter {
            Delimiter::Tab => '\t',
            Delimiter::Semicolon => ';',
            Delimiter::Comma => ',',
            Delimiter::Bar => '|',
            Delimiter::Blanks => return blank_separated(line),
        };
        let mut cells = Vec::new();
        let (mut start, mut quoted) = (0, false);
        for (at, c) in line.char_indices() {
            match c {
                '"' => quoted = !quoted,
                _ if c == separator && !quoted => {
                    cells.push(trimmed(line, start, at));
                    start = at + c.len_utf8();
                }
                _ => {}
            }
        }
        cells.push(trimmed(line, start, line.len()));
        cells
    }
}

fn blank_separated(line: &str) -> Vec<Cell<'_>> {
    let mut cells = Vec::new();
    let (mut start, mut quoted) = (None, false);
    for (at, c) in line.char_indices() {
        quoted ^= c == '"';
        match (start, c.is_whitespace() && !quoted) {
            (None, false) => start = Some(at),
            (Some(from), true) => {
                cells.push(trimmed(line, from, at));
                start = None;
            }
            _ => {}
        }
    }
    if let Some(from) = start {
        cells.push(trimmed(line, from, line.len()));
    }
    cells
}

fn trimmed(line: &str, start: usize, end: usize) -> Cell<'_> {
    let cell = &line[start..end];
    let lead = cell.len() - cell.trim_start().len();
    (start + lead, cell.trim().trim_matches('"').trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detected(text: &str) -> Option<(Dialect, usize)> {
        Dialect::of(text.lines())
    }

    #[test]
    fn the_dialect_is_that_of_most_rows() {
        for (text, delimiter, decimal, width) in [
            ("1.5,2,3,4\n", Delimiter::Comma, Decimal::Point, 4),
            ("x;y\n1,5;2,5\n1;2\n", Delimiter::Semicolon, Decimal::Comma, 2),
            ("1;2\n3;4\n", Delimiter::Semicolon, Decimal::Point, 2),
            ("1\t2,5\n", Delimiter::Tab, Decimal::Comma, 2),
            ("  1.0   2.0  -3\n", Delimiter::Blanks, Decimal::Point, 3),
            ("1,5 2,5\n", Delimiter::Blanks, Decimal::Comma, 2),
            ("\"1,5\",\"2,5\"\n", Delimiter::Comma, Decimal::Comma, 2),
            ("1, 2, 3\n", Delimiter::Comma, Decimal::Point, 3),
            ("1|2\n", Delimiter::Bar, Decimal::Point, 2),
            ("0,0,0\n1,2,3,4\n", Delimiter::Comma, Decimal::Point, 4),
        ] {
            let expected = Some((Dialect { delimiter, decimal }, width));
            assert_eq!(detected(text), expected, "{text:?}");
        }
        for none in ["", "hello\n", "1\n2\n", "a,b\nc,d\n", "nan,nan\n"] {
            assert_eq!(detected(none), None, "{none:?}");
        }
    }

    #[test]
    fn cells_are_located() {
        let comma = Dialect { delimiter: Delimiter::Comma, decimal: Decimal::Point };
        assert_eq!(comma.cells("a, \"b,c\" ,d"), [(0, "a"), (3, "b,c"), (10, "d")]);
        let blanks = Dialect { delimiter: Delimiter::Blanks, decimal: Decimal::Point };
        assert_eq!(blanks.cells(" 1\t22 "), [(1, "1"), (3, "22")]);
    }
}
