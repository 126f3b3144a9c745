//! `maps/scale.json`: the one colour scale of all small maps, and what was drawn with it.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::super::error::ReportError;
use super::kept::put;

/// Name of the file.
const FILE: &str = "scale.json";

/// The format; another one is drawn anew.
const FORMAT: u32 = 1;

/// Drive and height of a map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Place {
    pub focus: usize,
    /// Height in the scan's coordinates, mm.
    pub z_mm: f64,
}

/// A map that was drawn, or why there is none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// When its cell was measured: another time means another record.
    pub at: String,
    #[serde(flatten)]
    pub result: Outcome,
}

/// What came of drawing a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Outcome {
    /// It was drawn.
    Drawn {
        #[serde(flatten)]
        place: Place,
        unit: String,
        /// Largest reading of the map, in the unit.
        peak: f64,
        /// Extent along x and y, mm.
        extent_mm: [f64; 2],
    },
    /// It could not be, for this reason.
    None(String),
}

/// The file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct MapFile {
    format: u32,
    /// The reading of the lightest colour, by unit.
    pub tops: BTreeMap<String, f64>,
    /// Where each setting is shown.
    pub places: BTreeMap<String, Place>,
    /// By cell.
    pub maps: BTreeMap<String, Entry>,
}

impl MapFile {
    /// The file in a folder; empty if it is absent, damaged or of another format.
    pub fn read(folder: &Path) -> Self {
        let text = std::fs::read(folder.join(FILE)).unwrap_or_default();
        let read: Option<Self> = serde_json::from_slice(&text).ok();
        let usable =
            |file: &Self| file.format == FORMAT && file.tops.values().all(|top| *top > 0.0);
        read.filter(usable).unwrap_or(Self { format: FORMAT, ..Self::default() })
    }

    /// Writes it into a folder.
    pub fn write(&self, folder: &Path) -> Result<(), ReportError> {
        put(&folder.join(FILE), &serde_json::to_vec_pretty(self)?)
    }

    /// Makes the scale of a unit reach a peak; every map of the unit is then to be drawn again. Gives whether it had to change.
    pub fn reach(&mut self, unit: &str, peak: f64) -> bool {
        if self.tops.get(unit).is_some_and(|top| *top >= peak) {
            return false;
        }
        self.tops.insert(unit.to_owned(), round_top(peak));
        self.maps.retain(
            |_, entry| !matches!(&entry.result, Outcome::Drawn { unit: of, .. } if of == unit),
        );
        true
    }
}

/// The next round number that is not below a peak. As each is at least a fifth above the one before, maps are rarely drawn again.
fn round_top(peak: f64) -> f64 {
    const ROUND: [f64; 8] = [1.0, 1.2, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0];
    // Where no reading is above zero, any scale shows as much.
    if !(peak.is_finite() && peak > 0.0) {
        return 1.0;
    }
    let power = 10f64.powf(peak.log10().floor());
    let next =
        ROUND.into_iter().chain([10.0, 12.0]).map(|step| step * power).find(|top| *top >= peak);
    next.unwrap_or(peak)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_larger_peak_makes_its_unit_be_drawn_again() {
        let mut file = MapFile::default();
        assert!(file.reach("V", 2.7) && file.tops["V"] == 3.0);
        for (cell, unit) in [("a", "V"), ("b", "Pa")] {
            let place = Place { focus: 0, z_mm: 100.0 };
            let result =
                Outcome::Drawn { place, unit: unit.to_owned(), peak: 2.7, extent_mm: [24.0, 24.0] };
            file.maps.insert(cell.to_owned(), Entry { at: String::new(), result });
        }
        assert!(!file.reach("V", 3.0) && file.maps.len() == 2);
        assert!(file.reach("V", 3.1) && file.tops["V"] == 4.0);
        assert_eq!(file.maps.keys().collect::<Vec<_>>(), ["b"]);
    }

    #[test]
    fn the_file_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut file = MapFile::read(folder.path());
        file.reach("V", 0.1);
        let place = Place { focus: 1, z_mm: 99.95 };
        file.places.insert("focus=left".to_owned(), place);
        let drawn =
            Outcome::Drawn { place, unit: "V".to_owned(), peak: 0.1, extent_mm: [24.0, 20.0] };
        for (cell, result) in [("a", drawn), ("b", Outcome::None("no samples".to_owned()))] {
            file.maps.insert(cell.to_owned(), Entry { at: "now".to_owned(), result });
        }
        file.write(folder.path()).expect("written");
        assert_eq!(MapFile::read(folder.path()), file);
        std::fs::write(folder.path().join(FILE), "{\"format\": 2}").expect("written");
        assert!(MapFile::read(folder.path()).maps.is_empty());
    }

    proptest! {
        #[test]
        fn a_top_is_a_little_above_its_peak(peak in 1e-9..1e9f64) {
            let top = round_top(peak);
            prop_assert!(top >= peak && top <= 1.5 * peak, "{peak}: {top}");
        }

        #[test]
        fn no_bytes_are_too_odd_to_read(bytes: Vec<u8>) {
            let folder = tempfile::tempdir().expect("a folder");
            std::fs::write(folder.path().join(FILE), bytes).expect("written");
            prop_assert_eq!(MapFile::read(folder.path()).format, FORMAT);
        }
    }
}
