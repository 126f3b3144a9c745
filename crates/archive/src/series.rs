//! Every figure of a record under a name that stays the same from record to record, so that it can be followed.

use std::borrow::Borrow;
use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;

use fieldgap_text::Uncertain;
use serde::{Deserialize, Serialize};

use crate::figures::{HeightFigures, RecordFigures};

/// Longest name, characters.
const LONGEST: usize = 100;

/// The name of a figure that is followed: `gap`, `z100.focus0.peak_offset_mm`, `sound-speed.c_m_s`. It has letters, digits, `_`, `-` and
/// dots, and no white space.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SeriesName(String);

/// Text that names no figure.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no name of a figure: such a name has letters, digits, `_`, `-` and dots, such as `gap` or `sound-speed.c_m_s`"
)]
pub struct NoSeriesName(String);

impl SeriesName {
    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for SeriesName {
    type Err = NoSeriesName;

    fn from_str(name: &str) -> Result<Self, NoSeriesName> {
        let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
        let parts = |name: &str| name.split('.').all(|part| !part.is_empty());
        if name.len() <= LONGEST && name.chars().all(good) && parts(name) {
            return Ok(Self(name.to_owned()));
        }
        Err(NoSeriesName(name.chars().take(LONGEST).collect()))
    }
}

impl TryFrom<String> for SeriesName {
    type Error = NoSeriesName;

    fn try_from(name: String) -> Result<Self, NoSeriesName> {
        name.parse()
    }
}

impl From<SeriesName> for String {
    fn from(name: SeriesName) -> Self {
        name.0
    }
}

impl Borrow<str> for SeriesName {
    fn borrow(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for SeriesName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

/// Heights nearer than this to a whole millimetre are named by it, mm: a robot's repeated heights scatter, their name must not.
const WHOLE_MM: f64 = 0.25;

impl RecordFigures {
    /// Every figure under its name. Figures that do not exist (NaN) are left out.
    ///
    /// | name | figure |
    /// |---|---|
    /// | `gap`, `noise_floor`, `level`, `correlation` | over all readings |
    /// | `z100.focus0.gap`, `.correlation`, `.peak_ratio`, `.peak_offset_mm`, `.focal_radius_mm` | at a height, mm, of a drive |
    /// | `sound-speed.c_m_s`, ... | the fitted parameters of the named cause |
    /// | `air.temperature_c`, `air.humidity_percent` | means over the scan |
    ///
    /// A height within 0.25 mm of a whole millimetre is named by that, other heights to a tenth.
    pub fn series(&self) -> Vec<(SeriesName, Uncertain)> {
        let mut all = vec![
            ("gap".to_owned(), self.gap),
            ("noise_floor".to_owned(), without_error(self.noise_floor)),
            ("level".to_owned(), self.level),
            ("correlation".to_owned(), self.correlation),
        ];
        for (place, height) in places(&self.heights).into_iter().zip(&self.heights) {
            let mut add = |figure: &str, value: Option<Uncertain>| {
                all.extend(value.map(|value| (format!("{place}.{figure}"), value)));
            };
            add("gap", Some(height.gap));
            add("correlation", Some(height.correlation));
            add("peak_ratio", height.peak_ratio);
            add("peak_offset_mm", height.peak_offset_mm);
            add("focal_radius_mm", height.focal_radius_mm);
        }
        if let Some(cause) = &self.cause {
            all.extend(cause.parameters.iter().map(|(name, value)| (name.clone(), *value)));
        }
        if let Some(air) = &self.air {
            all.push(("air.temperature_c".to_owned(), air.temperature_c));
            all.extend(
                air.humidity_percent.map(|value| ("air.humidity_percent".to_owned(), value)),
            );
        }
        let named = all.into_iter().filter(|(_, figure)| figure.value.is_finite());
        named.filter_map(|(name, figure)| Some((name.parse().ok()?, figure))).collect()
    }
}

fn without_error(value: f64) -> Uncertain {
    Uncertain { value, standard_error: f64::NAN }
}

/// The name of each height of each drive, all different.
fn places(heights: &[HeightFigures]) -> Vec<String> {
    let short: Vec<String> = heights.iter().map(|height| place(height, WHOLE_MM)).collect();
    let mut counts: HashMap<&str, usize> = HashMap::new();
    for name in &short {
        *counts.entry(name).or_default() += 1;
    }
    let name = |(height, short): (&HeightFigures, &String)| match counts[short.as_str()] {
        1 => short.clone(),
        // Two heights of one drive within half a millimetre.
        _ => place(height, 0.0),
    };
    heights.iter().zip(&short).map(name).collect()
}

fn place(height: &HeightFigures, whole_mm: f64) -> String {
    let (z_mm, focus) = (height.z_mm, height.focus);
    let whole = z_mm.round();
    let z = if (z_mm - whole).abs() <= whole_mm { whole } else { (z_mm * 10.0).round() / 10.0 };
    // No minus before a zero.
    format!("z{}.focus{focus}", z + 0.0)
}
