//! The air during a scan: the rows of `environment.csv`.

use std::path::Path;

use fieldgap_input::{MOST_TABLE, read_text};

/// The file, beside `samples.csv`.
pub const FILE: &str = "environment.csv";

/// A row of the file.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct AirRow {
    /// Time of the scan, s.
    pub time_s: f64,
    /// Temperature, °C.
    pub temperature_c: f64,
    /// Relative humidity, %, where the sensor gives it.
    pub humidity_percent: Option<f64>,
}

impl AirRow {
    /// The rows of the record in `folder`, without one that is being written; none without a sensor. Rows of another form are left out.
    pub fn all_of(folder: &Path) -> Vec<Self> {
        let text = read_text(&folder.join(FILE), MOST_TABLE).unwrap_or_default();
        let whole = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
        whole.skip(1).filter_map(Self::parse).collect()
    }

    fn parse(line: &str) -> Option<Self> {
        let mut cells = line
            .trim_end()
            .split(',')
            .map(|cell| cell.parse::<f64>().ok().filter(|value| value.is_finite()));
        Some(Self {
            time_s: cells.next()??,
            temperature_c: cells.next()??,
            humidity_percent: cells.next()?,
        })
    }
}
