//! The keys of `[array]`, and which of them belong to which layout.

use std::num::NonZeroU32;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::inside::{is_inside, leads_out};
use super::layout::{Layout, Rims};
use super::section::{Key, Section, place, written};
use super::transducer_file::transducer_path;
use fieldgap_input::{Fault, Frequency, Gap, Length, TomlSource};

/// The keys of an `[array]`; [`ArraySection::read`](super::ArraySection::read) checks them.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    transducer: Key<String>,
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
            if !keys.contains(&key) {
                section.refuse_at(key, place)?;
            }
        }
        let count = || section.need("count", &self.count);
        let rings = || section.need("rings", &self.rings);
        let rims = || {
            Ok(Rims {
                diameter_mm: section.need("element_diameter_mm", &self.element_diameter_mm)?,
                spacing_mm: section.need("spacing_mm", &self.spacing_mm)?,
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
        for (name, path) in [elements, transducer].into_iter().flatten() {
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

    /// The keys of a layout and a transducer's name, for writing.
    pub fn of(frequency_hz: Frequency, layout: &Layout, transducer: Option<&str>) -> Self {
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
            transducer: transducer.and_then(|name| written(name.to_owned())),
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
    fn given(&self) -> [(&'static str, Option<Range<usize>>); 8] {
        [
            ("columns", place(&self.columns)),
            ("rows", place(&self.rows)),
            ("count", place(&self.count)),
            ("rings", place(&self.rings)),
            ("seed", place(&self.seed)),
            ("file", place(&self.file)),
            ("element_diameter_mm", place(&self.element_diameter_mm)),
            ("spacing_mm", place(&self.spacing_mm)),
        ]
    }
}

fn listed(keys: &[&str]) -> String {
    keys.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ")
}
