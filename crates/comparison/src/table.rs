//! A comparison as a table: text for a terminal, CSV for other programs. (JSON is the comparison itself, serialised.)

use std::fmt::Write as _;

use super::comparison::{Comparison, PlaneComparison, Uncertain};
use super::levels_table::COLUMNS as LEVELS;
use fieldgap_text::paragraph;

/// A column: its heading in the text table, its name in CSV (with the unit), and what stands in it.
struct Column {
    heading: &'static str,
    name: &'static str,
    cell: Cell,
    /// Whether it stands in the table of 80 columns too.
    narrow: bool,
}

/// How a column is read off a plane.
enum Cell {
    /// Something counted, or a ratio, with so many decimals.
    Plain(usize, fn(&PlaneComparison) -> Option<f64>),
    /// A reading with its error, in the scan's unit.
    Reading(fn(&PlaneComparison) -> Uncertain),
    /// A length in metres with its error, shown in millimetres.
    Length(fn(&PlaneComparison) -> Option<Uncertain>),
}

impl Cell {
    /// The value in the column's unit, and its standard error where it has one.
    fn of(&self, plane: &PlaneComparison) -> (Option<f64>, Option<f64>) {
        match self {
            Self::Plain(_, of) => (of(plane), None),
            Self::Reading(of) => (Some(of(plane).value), Some(of(plane).standard_error)),
            Self::Length(of) => of(plane).map(|m| (m.value * 1e3, m.standard_error * 1e3)).unzip(),
        }
    }

    /// The unit below the heading.
    fn unit<'a>(&self, reading_unit: &'a str) -> &'a str {
        match self {
            Self::Plain(..) => "",
            Self::Reading(_) => reading_unit,
            Self::Length(_) => "mm",
        }
    }

    fn has_error(&self) -> bool {
        !matches!(self, Self::Plain(..))
    }

    /// For a reader; a dash where there is no number.
    fn in_text(&self, plane: &PlaneComparison) -> String {
        /// Readings may be volts or counts: significant digits, not decimals.
        const DIGITS_OF_READING: usize = 4;
        let (value, error) = self.of(plane);
        let Some(value) = value.filter(|value| value.is_finite()) else { return "-".to_owned() };
        match (self, error) {
            (Self::Plain(decimals, _), _) => format!("{value:.decimals$}"),
            (Self::Reading(_), _) => significant(value, DIGITS_OF_READING),
            (Self::Length(_), Some(error)) if error.is_finite() => {
                format!("{value:.2} ±{error:.2}")
            }
            (Self::Length(_), _) => format!("{value:.2}"),
        }
    }
}

/// All columns after drive and height, in order.
const COLUMNS: [Column; 16] = {
    use Cell::{Length, Plain, Reading};
    const fn column(heading: &'static str, name: &'static str, cell: Cell) -> Column {
        Column { heading, name, cell, narrow: false }
    }
    const fn narrow(heading: &'static str, name: &'static str, cell: Cell) -> Column {
        Column { heading, name, cell, narrow: true }
    }
    [
        column("points", "points", Plain(0, |p| Some(p.points as f64))),
        narrow("corr.", "correlation", Plain(3, |p| Some(p.agreement.correlation))),
        narrow(
            "residual",
            "residual_rms_ratio",
            Plain(3, |p| Some(p.agreement.residual_rms_ratio)),
        ),
        narrow("level", "gain_ratio", Plain(3, |p| Some(p.agreement.gain_ratio))),
        column("scan peak", "scan_peak", Reading(|p| p.scan.peak)),
        column("sim peak", "simulation_peak", Reading(|p| p.simulation.peak)),
        column("scan x", "scan_peak_x_mm", Length(|p| Some(p.scan.peak_position_m[0]))),
        column("scan y", "scan_peak_y_mm", Length(|p| Some(p.scan.peak_position_m[1]))),
        column("sim x", "simulation_peak_x_mm", Length(|p| Some(p.simulation.peak_position_m[0]))),
        column("sim y", "simulation_peak_y_mm", Length(|p| Some(p.simulation.peak_position_m[1]))),
        narrow("peaks apart", "peak_distance_mm", Length(|p| Some(p.discrepancy.peak_distance_m))),
        narrow(
            "scan radius",
            "scan_focal_radius_mm",
            Length(|p| p.scan.focal_radius.as_ref()?.radius_m),
        ),
        narrow(
            "sim radius",
            "simulation_focal_radius_mm",
            Length(|p| p.simulation.focal_radius.as_ref()?.radius_m),
        ),
        column("wider by", "focal_radius_difference_mm", Length(|p| p.discrepancy.focal_radius_m)),
        column(
            "scan sub-peaks",
            "scan_sub_peaks",
            Plain(0, |p| p.scan.sub_peaks.map(|n| n as f64)),
        ),
        column(
            "sim sub-peaks",
            "simulation_sub_peaks",
            Plain(0, |p| p.simulation.sub_peaks.map(|n| n as f64)),
        ),
    ]
};

impl Comparison {
    /// The comparison as text of at most 80 columns: what was registered and why, then one line for each drive and height.
    pub fn to_text(&self) -> String {
        self.header() + &self.lines(|column| column.narrow) + &self.levels_text()
    }

    /// The same with every column of the table.
    pub fn to_wide_text(&self) -> String {
        self.header() + &self.lines(|_| true) + &self.levels_text()
    }

    /// The levels below an empty line, if there are any.
    fn levels_text(&self) -> String {
        self.levels.as_ref().map_or_else(String::new, |levels| format!("\n{}", levels.to_text()))
    }

    fn lines(&self, shown: impl Fn(&Column) -> bool) -> String {
        let columns: Vec<&Column> = COLUMNS.iter().filter(|column| shown(column)).collect();
        let several = self.planes.iter().any(|plane| plane.focus != self.planes[0].focus);
        let row = |drive: &str, height: &str, cells: Vec<String>| {
            let mut row = Vec::from_iter(several.then(|| drive.to_owned()));
            row.push(height.to_owned());
            row.extend(cells);
            row
        };
        let of_columns = |of: &dyn Fn(&Column) -> String| columns.iter().map(|c| of(c)).collect();
        let mut lines = vec![
            row("drive", "height", of_columns(&|column| column.heading.to_owned())),
            row("", "mm", of_columns(&|column| column.cell.unit(&self.reading_unit).to_owned())),
        ];
        lines.extend(self.planes.iter().map(|plane| {
            let height = format!("{:.1}", plane.z_m * 1e3);
            let cells = of_columns(&|column| column.cell.in_text(plane));
            row(&plane.focus.to_string(), &height, cells)
        }));
        let widths: Vec<usize> = (0..lines[0].len())
            .map(|i| lines.iter().map(|line| line[i].chars().count()).max().unwrap_or(0))
            .collect();
        let padded = lines.iter().map(|line| {
            let cells: Vec<String> =
                line.iter().zip(&widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
            cells.join("  ").trim_end().to_owned() + "\n"
        });
        padded.collect()
    }

    fn header(&self) -> String {
        let mut text = paragraph(
            &format!(
                "{} against {}: {} readings, correlation {:.3}, residual {:.3} of the scan's rms",
                self.scan_name,
                self.simulator,
                self.points,
                self.overall.correlation,
                self.overall.residual_rms_ratio
            ),
            0,
            2,
        );
        text += &paragraph(&format!("registration: {}", self.registration.why), 0, 2);
        for left_open in &self.registration.undetermined {
            let parameters = left_open.parameters.join(", ");
            let words = format!("left open ({parameters}): {}", left_open.explanation);
            text += &paragraph(&words, 0, 2);
        }
        text.replace('\u{a0}', " ") + "\n"
    }

    /// The comparison as CSV: one row for each drive and height, units in the names of the columns, readings in
    /// the scan's unit, an empty field where there is no number. Levels follow in further columns, if they are known.
    pub fn to_csv(&self) -> String {
        let mut csv = "focus,z_mm".to_owned();
        for column in &COLUMNS {
            csv += &format!(",{}", column.name);
            if column.cell.has_error() {
                csv += &format!(",{}_error", column.name);
            }
        }
        if self.levels.is_some() {
            csv.extend(LEVELS.map(|(name, _)| format!(",{name}")));
        }
        csv.push('\n');
        for plane in &self.planes {
            csv += &format!("{},{}", plane.focus, plane.z_m * 1e3);
            for column in &COLUMNS {
                let (value, error) = column.cell.of(plane);
                write_number(&mut csv, value);
                if column.cell.has_error() {
                    write_number(&mut csv, error);
                }
            }
            if let Some(levels) = &self.levels {
                let of_plane = levels.of_plane(plane);
                for (_, value) in LEVELS {
                    write_number(&mut csv, of_plane.map(value));
                }
            }
            csv.push('\n');
        }
        csv
    }
}

/// A number with so many significant digits, without an exponent.
fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let before_point = value.abs().log10().floor() as i64 + 1;
    let decimals = (digits as i64 - before_point).max(0) as usize;
    format!("{value:.decimals$}")
}

fn write_number(csv: &mut String, value: Option<f64>) {
    csv.push(',');
    if let Some(value) = value.filter(|value| value.is_finite()) {
        write!(csv, "{value}").expect("a string takes what is written to it");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_keep_their_significant_digits_in_any_unit() {
        assert_eq!(significant(31947.25, 4), "31947");
        assert_eq!(significant(0.0123456, 4), "0.01235");
        assert_eq!(significant(3.0, 4), "3.000");
        assert_eq!(significant(0.0, 4), "0");
    }
}
