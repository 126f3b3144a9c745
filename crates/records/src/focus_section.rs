//! `[[focus]]`: one drive of the array.

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::section::{Key, Section, written};
use fieldgap_acoustics::{Excitation, Vec3};
use fieldgap_input::{Fault, Finite, Place, TomlSource};

/// The keys of a `[[focus]]`; [`FocusSection::read`] checks them.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FocusTable {
    x_mm: Key<Place>,
    y_mm: Key<Place>,
    z_mm: Key<Place>,
    phases: Key<NamedPhases>,
    phases_rad: Key<Vec<Finite>>,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum NamedPhases {
    AllZero,
}

/// One drive of the array.
#[derive(Debug, Clone, PartialEq)]
pub enum FocusSection {
    /// A focus at a point, millimetres, array frame.
    Point(Vec3),
    /// All elements in phase (`phases = "all-zero"`).
    AllZero,
    /// A phase for each element, radians (`phases_rad`).
    Phases(Vec<f64>),
}

impl std::fmt::Display for FocusSection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Point(at_mm) => write!(f, "({}, {}, {}) mm", at_mm.x, at_mm.y, at_mm.z),
            Self::AllZero => f.write_str("all elements in phase"),
            Self::Phases(phases_rad) => write!(f, "{} given phases", phases_rad.len()),
        }
    }
}

/// The number of phases of a drive differs from the number of elements.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`phases_rad` has {phases} phases, and the array has {elements} elements")]
pub struct WrongPhaseCount {
    phases: usize,
    elements: usize,
}

impl FocusSection {
    /// Checks a `[[focus]]` of `source`.
    ///
    /// # Errors
    /// A [`Fault`] at keys that exclude each other, or naming those that are missing.
    pub fn read(table: &Spanned<FocusTable>, source: &TomlSource) -> Result<Self, Fault> {
        let keys = table.get_ref();
        let section = |kind, needs| Section::new(source, table.span(), kind, needs);
        if keys.phases.is_some() {
            let alike = section("a focus given by name", "`phases = \"all-zero\"` alone");
            keys.refuse_point(&alike)?;
            alike.refuse("phases_rad", &keys.phases_rad)?;
            return Ok(Self::AllZero);
        }
        if let Some(phases) = &keys.phases_rad {
            let phased = section("a focus given by phases", "`phases_rad` alone");
            keys.refuse_point(&phased)?;
            return Ok(Self::Phases(phases.get_ref().iter().map(|phase| phase.get()).collect()));
        }
        let point = section(
            "a focus",
            "`x_mm`, `y_mm` and `z_mm`, or `phases = \"all-zero\"`, or `phases_rad` with a phase for \
             each element",
        );
        Ok(Self::Point(Vec3::new(
            point.need("x_mm", &keys.x_mm)?.get(),
            point.need("y_mm", &keys.y_mm)?.get(),
            point.need("z_mm", &keys.z_mm)?.get(),
        )))
    }

    /// Checks that phases, if given, are as many as the elements.
    ///
    /// # Errors
    /// [`WrongPhaseCount`] if they are not.
    pub fn fits(&self, elements: usize) -> Result<(), WrongPhaseCount> {
        match self {
            Self::Phases(phases) if phases.len() != elements => {
                Err(WrongPhaseCount { phases: phases.len(), elements })
            }
            _ => Ok(()),
        }
    }

    /// Reads every `[[focus]]` of a file.
    ///
    /// # Errors
    /// As [`FocusSection::read`], at the first that has a fault; a [`Fault`] of the file if there is none.
    pub fn read_all(
        tables: &[Spanned<FocusTable>],
        source: &TomlSource,
    ) -> Result<Vec<Self>, Fault> {
        if tables.is_empty() {
            return Err(Fault::of_file(
                source.path(),
                "has no [[focus]]: it does not say how the array is driven",
                "add `[[focus]]` with x_mm, y_mm and z_mm, or with phases = \"all-zero\"",
            ));
        }
        tables.iter().map(|table| Self::read(table, source)).collect()
    }

    /// The drive for the simulation.
    pub fn excitation(&self) -> Excitation {
        match self {
            Self::Point(at_mm) => Excitation::Focus(at_mm / 1e3),
            Self::AllZero => Excitation::Uniform,
            Self::Phases(phases_rad) => Excitation::Phases(phases_rad.clone()),
        }
    }

    /// The section for writing. Numbers out of range, which a file cannot contain, are left out.
    pub fn table(&self) -> FocusTable {
        let finite = |value: f64| Finite::new(value).ok();
        let coordinate = |value: f64| Place::new(value).ok();
        match self {
            Self::Point(at_mm) => FocusTable {
                x_mm: coordinate(at_mm.x).and_then(written),
                y_mm: coordinate(at_mm.y).and_then(written),
                z_mm: coordinate(at_mm.z).and_then(written),
                ..FocusTable::default()
            },
            Self::AllZero => {
                FocusTable { phases: written(NamedPhases::AllZero), ..FocusTable::default() }
            }
            Self::Phases(phases_rad) => FocusTable {
                phases_rad: written(phases_rad.iter().copied().filter_map(finite).collect()),
                ..FocusTable::default()
            },
        }
    }
}

impl FocusTable {
    fn refuse_point(&self, section: &Section<'_>) -> Result<(), Fault> {
        section.refuse("x_mm", &self.x_mm)?;
        section.refuse("y_mm", &self.y_mm)?;
        section.refuse("z_mm", &self.z_mm)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[derive(Deserialize)]
    struct File {
        focus: Vec<Spanned<FocusTable>>,
    }

    fn read(text: &str) -> Result<Vec<FocusSection>, Fault> {
        let source = TomlSource::new(Path::new("f.toml"), text);
        let file: File = source.parse()?;
        FocusSection::read_all(&file.focus, &source)
    }

    #[test]
    fn all_three_kinds_are_read() {
        let foci = read(
            "[[focus]]\nx_mm = 17.5\ny_mm = -22\nz_mm = 100.0\n\
             [[focus]]\nphases = \"all-zero\"\n\
             [[focus]]\nphases_rad = [0.5, -1]\n",
        )
        .expect("good");
        assert_eq!(foci[0].excitation(), Excitation::Focus(Vec3::new(0.0175, -0.022, 0.1)));
        assert_eq!(foci[1], FocusSection::AllZero);
        assert_eq!(foci[2], FocusSection::Phases(vec![0.5, -1.0]));
        assert!(foci[2].fits(2).is_ok() && foci[0].fits(7).is_ok());
        let wrong = foci[2].fits(36).expect_err("two phases").to_string();
        assert!(wrong.contains("2 phases") && wrong.contains("36 elements"), "{wrong}");
    }

    #[test]
    fn faults_are_placed() {
        let cases = [
            ("[[focus]]\nx_mm = 1.0\nz_mm = 2.0\n", 1, "`y_mm`"),
            ("[[focus]]\nphases = \"all-zero\"\nx_mm = 1.0\n", 3, "`x_mm`"),
            ("[[focus]]\nphases_rad = [1.0]\nphases = \"all-zero\"\n", 2, "`phases_rad`"),
            ("[[focus]]\nphases = \"none\"\n", 2, "all-zero"),
            ("[[focus]]\nx_mm = nan\n", 2, "within 10 m"),
            ("[[focus]]\nradius = 1\n", 2, "radius"),
        ];
        for (text, line, said) in cases {
            let fault = read(text).expect_err(text);
            assert_eq!(fault.line_column().map(|place| place.0), Some(line), "{fault}");
            assert!(fault.problem().contains(said), "{fault}");
        }
        assert!(read("focus = []\n").is_err());
    }
}
