//! A plane as a grid of readings: a CSV file with one line for each row of points and nothing else.

use std::path::Path;

use super::MADE_UP_SECONDS_A_POINT;
use crate::sample::RecordedSample;
use crate::table::{Row, Table};
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Fault, Positive};

/// A grid of readings as in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct GridCsv {
    columns: usize,
    /// Row by row; `None` where nothing was measured.
    readings: Vec<Option<f64>>,
}

/// The side of the plane that the first line of the file belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FirstRow {
    /// The largest y, as in a picture.
    Top,
    /// The smallest y.
    Bottom,
}

/// The position of a grid in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Anchor {
    /// Its centre, millimetres.
    Centre([f64; 2]),
    /// The point of smallest x and y, millimetres.
    LeastCorner([f64; 2]),
}

/// The position of the grid, which the file does not contain. The first column is that of the smallest x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridPlacement {
    /// Height, millimetres, array frame.
    pub z_mm: f64,
    /// Steps along x and y, millimetres.
    pub step_mm: Exact<Positive, 2>,
    /// Position in the plane.
    pub anchor: Anchor,
    /// The side of the first line.
    pub first_row: FirstRow,
}

impl GridCsv {
    /// Reads a grid: numbers, zero or above, separated by commas, semicolons or tabs. An empty cell or `NaN` is a point that was not
    /// measured.
    ///
    /// # Errors
    /// A [`Fault`] at the first invalid cell, at a row with more or fewer cells than the first, or of the file, if it has no reading.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        Self::of(&Table::read(path)?)
    }

    fn of(table: &Table) -> Result<Self, Fault> {
        let rows: Vec<Row<'_>> = table.rows(delimiter(table.text())).collect();
        let nothing = || {
            Fault::of_file(
                table.path(),
                "has no reading",
                "write a line of numbers for each row of points, separated by commas",
            )
        };
        let (first, last) = rows.first().zip(rows.last()).ok_or_else(nothing)?;
        let wanted = first.len();
        if let Some(row) = rows.iter().find(|row| row.len() != wanted) {
            return Err(row.fault(
                row.len().min(wanted),
                format!("the row has {} cells where the first has {wanted}", row.len()),
                "give all rows the same number of cells; a point that was not measured is an empty cell or NaN",
            ));
        }
        table.refuse_cut_end(last)?;
        // Some programs write a delimiter at the end of every line; it is not a column.
        let ended = wanted > 1 && rows.iter().all(|row| row.cell(wanted - 1).is_empty());
        let columns = if ended { wanted - 1 } else { wanted };
        let mut readings = Vec::with_capacity(columns * rows.len());
        for row in &rows {
            for column in 0..columns {
                readings.push(reading_of(row, column)?);
            }
        }
        if readings.iter().all(Option::is_none) {
            return Err(nothing());
        }
        Ok(Self { columns, readings })
    }

    /// Points in a row; at least one.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows; at least one.
    pub fn rows(&self) -> usize {
        self.readings.len() / self.columns
    }

    /// The readings as samples with a focus, in the order of the file, with assumed times from `first_time_s`.
    pub fn samples(
        &self,
        placement: &GridPlacement,
        focus: usize,
        first_time_s: f64,
    ) -> Vec<RecordedSample> {
        let counts = [self.columns, self.rows()];
        let least_mm = match placement.anchor {
            Anchor::LeastCorner(at_mm) => at_mm,
            Anchor::Centre(at_mm) => [0, 1].map(|axis| {
                at_mm[axis] - placement.step_mm[axis].get() * (counts[axis] - 1) as f64 / 2.0
            }),
        };
        let at_mm =
            |axis: usize, step: usize| least_mm[axis] + placement.step_mm[axis].get() * step as f64;
        let measured = self
            .readings
            .iter()
            .enumerate()
            .filter_map(|(cell, reading)| Some((cell, (*reading)?)));
        measured
            .enumerate()
            .map(|(order, (cell, reading))| {
                let (column, line) = (cell % self.columns, cell / self.columns);
                let row = match placement.first_row {
                    FirstRow::Top => counts[1] - 1 - line,
                    FirstRow::Bottom => line,
                };
                let at_mm = Vec3::new(at_mm(0, column), at_mm(1, row), placement.z_mm);
                let time_s = first_time_s + order as f64 * MADE_UP_SECONDS_A_POINT;
                RecordedSample::measured(time_s, Some(focus), at_mm / 1e3, reading, None)
            })
            .collect()
    }
}

fn reading_of(row: &Row<'_>, column: usize) -> Result<Option<f64>, Fault> {
    let cell = row.cell(column);
    if cell.is_empty() || cell.eq_ignore_ascii_case("nan") {
        return Ok(None);
    }
    match row.number(column, "the reading")? {
        reading if reading >= 0.0 => Ok(Some(reading)),
        _ => Err(row.wrong(column, "the reading", "zero or a number above zero")),
    }
}

/// The delimiter: the first comma, semicolon or tab in the text.
fn delimiter(text: &str) -> u8 {
    text.bytes().find(|byte| b",;\t".contains(byte)).unwrap_or(b',')
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn parse(text: &str) -> Result<GridCsv, Fault> {
        GridCsv::of(&Table::new(Path::new("grid.csv"), text))
    }

    fn placement(first_row: FirstRow, anchor: Anchor) -> GridPlacement {
        let step_mm = [2.0, 3.0].map(|step| Positive::new(step).expect("above zero")).into();
        GridPlacement { z_mm: 160.0, step_mm, anchor, first_row }
    }

    fn placed(grid: &GridCsv, placement: &GridPlacement) -> Vec<([f64; 3], f64)> {
        let samples = grid.samples(placement, 0, 0.0);
        samples.iter().map(|sample| (sample.position_mm.into(), sample.reading)).collect()
    }

    #[test]
    fn a_grid_is_centred_with_its_first_line_at_the_given_side() {
        let grid = parse("1,2,3\n4,,6\n").expect("good");
        assert_eq!((grid.columns(), grid.rows()), (3, 2));
        let low = |x, reading| ([x, -1.5, 160.0], reading);
        let high = |x, reading| ([x, 1.5, 160.0], reading);
        let centre = Anchor::Centre([0.0, 0.0]);
        assert_eq!(
            placed(&grid, &placement(FirstRow::Bottom, centre)),
            [low(-2.0, 1.0), low(0.0, 2.0), low(2.0, 3.0), high(-2.0, 4.0), high(2.0, 6.0)]
        );
        assert_eq!(
            placed(&grid, &placement(FirstRow::Top, centre)),
            [high(-2.0, 1.0), high(0.0, 2.0), high(2.0, 3.0), low(-2.0, 4.0), low(2.0, 6.0)]
        );
        let corner = placement(FirstRow::Bottom, Anchor::LeastCorner([10.0, 20.0]));
        assert_eq!(placed(&grid, &corner)[4], ([14.0, 23.0, 160.0], 6.0));
    }

    #[test]
    fn other_formats_of_a_grid_give_the_same_grid() {
        let grid = parse("1,NaN\n3,4\n").expect("good");
        for text in ["1;nan\r\n3;4\r\n", "1\t\n3\t4\n", "1,,\n3,4,\n", "\n1,NaN\n\n3,4\n"] {
            assert_eq!(parse(text).expect(text), grid, "{text:?}");
        }
    }

    #[test]
    fn faults_are_placed() {
        let cases = [
            ("1,2\n3\n", Some((2, 2)), "1 cells"),
            ("1,2\n3,4,5\n", Some((2, 5)), "3 cells"),
            ("1,2\n3,-4\n", Some((2, 3)), "`-4`"),
            ("x,y\n3,4\n", Some((1, 1)), "`x`"),
            ("1,inf\n", Some((1, 3)), "finite"),
            ("1,2\n3,4", Some((2, 4)), "line end"),
            (",NaN,\n", None, "no reading"),
            ("", None, "no reading"),
        ];
        for (text, place, said) in cases {
            let fault = parse(text).expect_err(text);
            assert_eq!(fault.line_column(), place, "{text:?}: {fault}");
            assert!(fault.problem().contains(said), "{text:?}: {fault}");
        }
    }

    proptest! {
        #[test]
        fn every_reading_of_the_grid_is_a_sample(
            readings in prop::collection::vec(0.0..1e4f64, 1..40), columns in 1usize..6,
        ) {
            let rows: Vec<&[f64]> = readings.chunks_exact(columns).collect();
            let text: String = rows.iter()
                .map(|row| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n")
                .collect();
            prop_assume!(!rows.is_empty());
            let grid = parse(&text).expect("good");
            let samples =
                grid.samples(&placement(FirstRow::Top, Anchor::Centre([0.0, 0.0])), 0, 0.0);
            let sampled: Vec<f64> = samples.iter().map(|sample| sample.reading).collect();
            prop_assert_eq!(sampled, rows.concat());
            prop_assert!(samples.windows(2).all(|pair| pair[0].time_s < pair[1].time_s));
        }

        #[test]
        fn no_text_makes_the_reader_panic(text in "[-0-9.,;\teNainf\r\n λ]{0,60}") {
            if let Ok(grid) = parse(&text) {
                grid.samples(&placement(FirstRow::Top, Anchor::Centre([0.0, 0.0])), 0, 0.0);
            }
        }
    }
}
