//! The keys of `[array]`, and which of them belong to which layout.

use std::num::NonZeroU32;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toml::Spanned;

use super::inside::{is_inside, leads_out};
use super::layout::{Layout, Rims};
use super::section::{Key, Section, place, written};
use super::transducer_file::transducer_path;
use fieldgap_input::{Fault, Frequency, Gap, Length, TomlSource};

/// The keys of an `[array]`, with all that its layout needs; [`ArraySection::read`](super::ArraySection::read) checks them.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, remote = "Self")]
pub struct ArrayTable {
    frequency_hz: Frequency,
    layout: Spanned<LayoutName>,
    columns: Key<NonZeroU32>,
    rows: Key<NonZeroU32>,
    count: Key<NonZeroU32>,
    rings: Key<u32>,
    seed: Key<u32>,
    file: Key<String>,
    element_diameter_mm: Key<Length>,
    spacing_mm: Key<Gap>,
    /// In place of the spacing: the distance between the centres of neighbours.
    #[serde(skip_serializing)]
    pitch_mm: Key<Length>,
    transducer: Key<String>,
    calibration: Key<String>,
    /// Whether the drive is compensated by the calibration; it is unless this says no.
    compensate: Key<bool>,
}

/// The calibration of an array, as its section names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NamedCalibration<'s> {
    /// Path of the file, relative to the section's.
    pub name: &'s str,
    /// Whether the drive is compensated by it.
    pub compensated: bool,
}

impl Serialize for ArrayTable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for ArrayTable {
    /// A key that the layout needs is missing in the same way as one that all layouts need.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = Self::deserialize(deserializer)?;
        match table.missing() {
            Some(key) => Err(D::Error::missing_field(key)),
            None => Ok(table),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum LayoutName {
    Square,
    Linear,
    Hexagonal,
    HexagonalThesis,
    Random,
    Elements,
}

impl LayoutName {
    /// The name of this layout in messages, and its keys, all of them required.
    fn keys(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Square => {
                ("a square array", &["columns", "rows", "element_diameter_mm", "spacing_mm"])
            }
            Self::Linear => ("a linear array", &["count", "element_diameter_mm", "spacing_mm"]),
            Self::Hexagonal => {
                ("a hexagonal array", &["rings", "element_diameter_mm", "spacing_mm"])
            }
            Self::HexagonalThesis => {
                ("a hexagonal-thesis array", &["rings", "element_diameter_mm", "spacing_mm"])
            }
            Self::Random => {
                ("a random array", &["count", "seed", "element_diameter_mm", "spacing_mm"])
            }
            Self::Elements => ("an array of elements", &["file"]),
        }
    }
}

impl ArrayTable {
    /// The layout, after checking that every key belongs to it.
    ///
    /// # Errors
    /// A [`Fault`] at a key that does not belong to the layout, or at the layout, naming a key that is missing.
    pub fn layout(&self, source: &TomlSource) -> Result<Layout, Fault> {
        let name = *self.layout.get_ref();
        let (kind, keys) = name.keys();
        let section = Section::new(source, self.layout.span(), kind, listed(keys));
        for (key, place) in self.given() {
            let stands_for = if key == "pitch_mm" { "spacing_mm" } else { key };
            if !keys.contains(&stands_for) {
                section.refuse_at(key, place)?;
            }
        }
        let count = || section.need("count", &self.count);
        let rings = || section.need("rings", &self.rings);
        let rims = || {
            Ok(Rims {
                diameter_mm: section.need("element_diameter_mm", &self.element_diameter_mm)?,
                spacing_mm: self.spacing(&section, source)?,
            })
        };
        Ok(match name {
            LayoutName::Square => Layout::Square {
                columns: section.need("columns", &self.columns)?,
                rows: section.need("rows", &self.rows)?,
                rims: rims()?,
            },
            LayoutName::Linear => Layout::Linear { count: count()?, rims: rims()? },
            LayoutName::Hexagonal => Layout::Hexagonal { rings: rings()?, rims: rims()? },
            LayoutName::HexagonalThesis => {
                Layout::HexagonalThesis { rings: rings()?, rims: rims()? }
            }
            LayoutName::Random => Layout::Random {
                count: count()?,
                seed: section.need("seed", &self.seed)?,
                rims: rims()?,
            },
            LayoutName::Elements => Layout::Elements { file: section.need("file", &self.file)? },
        })
    }

    /// The first key that the layout needs and that is not given.
    fn missing(&self) -> Option<&'static str> {
        let is_given = |wanted: &str| {
            let given = self.given();
            given.into_iter().any(|(key, place)| key == wanted && place.is_some())
        };
        let (_, keys) = self.layout.get_ref().keys();
        keys.iter()
            .copied()
            .find(|&key| !(is_given(key) || key == "spacing_mm" && is_given("pitch_mm")))
    }

    /// The gap between the rims of neighbours, given itself or by the pitch.
    fn spacing(&self, section: &Section<'_>, source: &TomlSource) -> Result<Gap, Fault> {
        let Some(pitch) = &self.pitch_mm else {
            return section.need("spacing_mm", &self.spacing_mm);
        };
        if self.spacing_mm.is_some() {
            return Err(source.fault(
                pitch.span(),
                "`pitch_mm` and `spacing_mm` are both given",
                "keep one: the pitch is the distance between centres, the spacing the gap between rims",
            ));
        }
        let pitch_mm = pitch.get_ref().get();
        let diameter_mm = section.need("element_diameter_mm", &self.element_diameter_mm)?.get();
        // Two decimal fractions that are equal as written can differ in their last bit.
        let gap_mm = pitch_mm - diameter_mm;
        let gap_mm = if gap_mm.abs() <= 1e-12 * pitch_mm { 0.0 } else { gap_mm };
        Gap::new(gap_mm).map_err(|_| {
            source.fault(
                pitch.span(),
                format!("a pitch of {pitch_mm} mm is smaller than the elements' diameter of {diameter_mm} mm"),
                "correct one of them; the pitch is the distance between the centres of neighbours",
            )
        })
    }

    /// Drive frequency.
    pub fn frequency_hz(&self) -> Frequency {
        self.frequency_hz
    }

    /// The position of the layout's name.
    pub fn layout_place(&self) -> Range<usize> {
        self.layout.span()
    }

    /// Checks that the files that it names lie in the folder of `source`, which is a record's.
    ///
    /// # Errors
    /// A [`Fault`] at the first name that leads out.
    pub fn stays_in_record(&self, source: &TomlSource) -> Result<(), Fault> {
        let folder = source.path().parent().unwrap_or(Path::new(""));
        let elements = self.file.as_ref().map(|name| (name, PathBuf::from(name.get_ref())));
        let transducer =
            self.transducer.as_ref().map(|name| (name, transducer_path(name.get_ref())));
        let calibration =
            self.calibration.as_ref().map(|name| (name, PathBuf::from(name.get_ref())));
        for (name, path) in [elements, transducer, calibration].into_iter().flatten() {
            if !is_inside(folder, &path) {
                let (problem, remedy) = leads_out(name.get_ref());
                return Err(source.fault(name.span(), problem, remedy));
            }
        }
        Ok(())
    }

    /// The name of the transducer, if given.
    pub fn transducer(&self) -> &Key<String> {
        &self.transducer
    }

    /// The name of the calibration file, if given.
    pub fn calibration(&self) -> &Key<String> {
        &self.calibration
    }

    /// Whether the drive is compensated by the calibration.
    ///
    /// # Errors
    /// A [`Fault`] at the key if there is no calibration.
    pub fn is_compensated(&self, source: &TomlSource) -> Result<bool, Fault> {
        match (&self.compensate, &self.calibration) {
            (Some(compensate), None) => Err(source.fault(
                compensate.span(),
                "there is no calibration to compensate the drive by",
                "add `calibration = \"FILE\"`, or remove this key",
            )),
            (compensate, _) => Ok(compensate.as_ref().is_none_or(|key| *key.get_ref())),
        }
    }

    /// The keys of a layout and the names of transducer and calibration, for writing.
    pub fn of(
        frequency_hz: Frequency,
        layout: &Layout,
        transducer: Option<&str>,
        calibration: Option<NamedCalibration<'_>>,
    ) -> Self {
        let blank = |name, rims: Option<Rims>| Self {
            frequency_hz,
            layout: Spanned::new(0..0, name),
            columns: None,
            rows: None,
            count: None,
            rings: None,
            seed: None,
            file: None,
            element_diameter_mm: rims.and_then(|rims| written(rims.diameter_mm)),
            spacing_mm: rims.and_then(|rims| written(rims.spacing_mm)),
            pitch_mm: None,
            transducer: transducer.and_then(|name| written(name.to_owned())),
            calibration: calibration.and_then(|named| written(named.name.to_owned())),
            compensate: calibration.filter(|named| !named.compensated).and_then(|_| written(false)),
        };
        match *layout {
            Layout::Square { columns, rows, rims } => Self {
                columns: written(columns),
                rows: written(rows),
                ..blank(LayoutName::Square, Some(rims))
            },
            Layout::Linear { count, rims } => {
                Self { count: written(count), ..blank(LayoutName::Linear, Some(rims)) }
            }
            Layout::Hexagonal { rings, rims } => {
                Self { rings: written(rings), ..blank(LayoutName::Hexagonal, Some(rims)) }
            }
            Layout::HexagonalThesis { rings, rims } => {
                Self { rings: written(rings), ..blank(LayoutName::HexagonalThesis, Some(rims)) }
            }
            Layout::Random { count, seed, rims } => Self {
                count: written(count),
                seed: written(seed),
                ..blank(LayoutName::Random, Some(rims))
            },
            Layout::Elements { ref file } => {
                Self { file: written(file.clone()), ..blank(LayoutName::Elements, None) }
            }
        }
    }

    /// The keys that only some layouts have, and the positions of their values.
    fn given(&self) -> [(&'static str, Option<Range<usize>>); 9] {
        [
            ("columns", place(&self.columns)),
            ("rows", place(&self.rows)),
            ("count", place(&self.count)),
            ("rings", place(&self.rings)),
            ("seed", place(&self.seed)),
            ("file", place(&self.file)),
            ("element_diameter_mm", place(&self.element_diameter_mm)),
            ("spacing_mm", place(&self.spacing_mm)),
            ("pitch_mm", place(&self.pitch_mm)),
        ]
    }
}

fn listed(keys: &[&str]) -> String {
    keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
}
