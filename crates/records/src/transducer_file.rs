//! A transducer file: the decay on the axis and the directivity of a transducer, and the radius of its face.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::section::{Key, Section, written};
use fieldgap_acoustics::transducer::{DescribedTransducer, Directivity, MeasuredTable, OnAxis};
use fieldgap_input::{Fault, Finite, Length, NonNegative, Positive, TomlSource};

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    /// Where the numbers come from.
    source: Option<String>,
    radius_mm: Option<Length>,
    on_axis: Option<Spanned<OnAxisTable>>,
    directivity: Spanned<DirectivityTable>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum OnAxisLaw {
    Spherical,
    Absorbed,
    Power,
    Exponential,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OnAxisTable {
    law: OnAxisLaw,
    amplitude: Key<Positive>,
    attenuation_db_m: Key<NonNegative>,
    exponent: Key<Finite>,
    decay_per_m: Key<Finite>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum DirectivityLaw {
    Even,
    Gaussian,
    Piston,
    MultiGaussian,
    Rayleigh,
    Table,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DirectivityTable {
    law: DirectivityLaw,
    centre_deg: Key<Finite>,
    width_deg: Key<Positive>,
    angle_deg: Key<Vec<f64>>,
    pressure: Key<Vec<f64>>,
}

/// Decibels per neper.
const DB_PER_NP: f64 = 20.0 / std::f64::consts::LN_10;

/// A transducer file, and its text, which is kept with every record of an array with this transducer.
#[derive(Debug, Clone, PartialEq)]
pub struct TransducerFile {
    name: String,
    face_radius_m: Option<f64>,
    transducer: Arc<DescribedTransducer>,
    text: String,
}

impl TransducerFile {
    /// Reads a transducer file.
    ///
    /// # Errors
    /// A [`Fault`] at the key that does not fit.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        Self::parse(&TomlSource::read(path)?)
    }

    /// Reads the file that a key of `source` names: a file in the folder `transducers` beside `source`, or a path that ends in `.toml`.
    ///
    /// # Errors
    /// A [`Fault`] at the key if there is no such file; and as [`TransducerFile::read`].
    pub fn named(name: &Spanned<String>, source: &TomlSource) -> Result<Self, Fault> {
        let folder = source.path().parent().unwrap_or(Path::new(""));
        let file = folder.join(transducer_path(name.get_ref()));
        if !file.exists() {
            return Err(source.fault(
                name.span(),
                format!("there is no transducer file {}", file.display()),
                "give the name of a file in the folder `transducers` beside this file, without .toml, or a path that ends in .toml",
            ));
        }
        Self::read(&file)
    }

    /// Reads a text as a transducer file.
    ///
    /// # Errors
    /// As [`TransducerFile::read`].
    pub fn parse(source: &TomlSource) -> Result<Self, Fault> {
        let file: File = source.parse()?;
        let directivity = directivity(&file.directivity, source)?;
        let on_axis = match &file.on_axis {
            Some(table) if directivity == Directivity::Rayleigh => {
                return Err(source.fault(
                    table.span(),
                    "the integral over a face determines the decay on the axis itself",
                    "remove [on_axis], or choose another directivity",
                ));
            }
            Some(table) => on_axis(table, source)?,
            None => OnAxis::Spherical,
        };
        Ok(Self {
            name: file.name,
            face_radius_m: file.radius_mm.map(|radius_mm| radius_mm.get() * 1e-3),
            transducer: Arc::new(DescribedTransducer { on_axis, directivity }),
            text: source.text().to_owned(),
        })
    }

    /// The file that describes a transducer: its name, the source of its numbers, and the radius of its face (metres), if it is to
    /// replace that of the elements.
    pub fn describing(
        name: &str,
        source: &str,
        face_radius_m: Option<Positive>,
        transducer: DescribedTransducer,
    ) -> Self {
        let radius_mm = face_radius_m.and_then(|radius_m| Length::new(radius_m.get() * 1e3).ok());
        let file = File {
            name: name.to_owned(),
            source: Some(source.to_owned()),
            radius_mm,
            on_axis: (transducer.directivity != Directivity::Rayleigh)
                .then(|| Spanned::new(0..0, on_axis_table(transducer.on_axis))),
            directivity: Spanned::new(0..0, directivity_table(&transducer.directivity)),
        };
        Self {
            name: name.to_owned(),
            face_radius_m: face_radius_m.map(Positive::get),
            transducer: Arc::new(transducer),
            text: toml::to_string(&file).expect("numbers and texts are TOML"),
        }
    }

    /// Name of the transducer.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The transducer.
    pub fn transducer(&self) -> &Arc<DescribedTransducer> {
        &self.transducer
    }

    /// Radius of its face, metres, if given.
    pub fn face_radius_m(&self) -> Option<f64> {
        self.face_radius_m
    }

    /// The text of the file.
    pub fn text(&self) -> &str {
        &self.text
    }
}

fn on_axis(table: &Spanned<OnAxisTable>, source: &TomlSource) -> Result<OnAxis, Fault> {
    let keys = table.get_ref();
    let (kind, needs) = match keys.law {
        OnAxisLaw::Spherical => ("a spherical law", "no other key"),
        OnAxisLaw::Absorbed => ("an absorbed law", "`attenuation_db_m`, and `amplitude` or none"),
        OnAxisLaw::Power => ("a power law", "`exponent`"),
        OnAxisLaw::Exponential => ("an exponential law", "`decay_per_m`, and `amplitude` or none"),
    };
    let section = Section::new(source, table.span(), kind, needs);
    if matches!(keys.law, OnAxisLaw::Spherical | OnAxisLaw::Power) {
        section.refuse("amplitude", &keys.amplitude)?;
    }
    if keys.law != OnAxisLaw::Absorbed {
        section.refuse("attenuation_db_m", &keys.attenuation_db_m)?;
    }
    if keys.law != OnAxisLaw::Power {
        section.refuse("exponent", &keys.exponent)?;
    }
    if keys.law != OnAxisLaw::Exponential {
        section.refuse("decay_per_m", &keys.decay_per_m)?;
    }
    let amplitude = keys.amplitude.as_ref().map_or(1.0, |amplitude| amplitude.get_ref().get());
    Ok(match keys.law {
        OnAxisLaw::Spherical => OnAxis::Spherical,
        OnAxisLaw::Absorbed => {
            let attenuation_db_m = section.need("attenuation_db_m", &keys.attenuation_db_m)?;
            OnAxis::Absorbed { amplitude, attenuation_np_m: attenuation_db_m.get() / DB_PER_NP }
        }
        OnAxisLaw::Power => {
            OnAxis::Power { exponent: section.need("exponent", &keys.exponent)?.get() }
        }
        OnAxisLaw::Exponential => {
            let decay_per_m = section.need("decay_per_m", &keys.decay_per_m)?.get();
            OnAxis::Exponential { amplitude, decay_per_m }
        }
    })
}

fn directivity(
    table: &Spanned<DirectivityTable>,
    source: &TomlSource,
) -> Result<Directivity, Fault> {
    let keys = table.get_ref();
    let (kind, needs) = match keys.law {
        DirectivityLaw::Even => ("an even directivity", "no other key"),
        DirectivityLaw::Gaussian => {
            ("a Gaussian directivity", "`width_deg`, and `centre_deg` or none")
        }
        DirectivityLaw::Piston => ("a piston's directivity", "no other key"),
        DirectivityLaw::MultiGaussian => ("a multi-Gaussian directivity", "no other key"),
        DirectivityLaw::Rayleigh => ("the integral over a face", "no other key"),
        DirectivityLaw::Table => ("a table", "`angle_deg` and `pressure`"),
    };
    let section = Section::new(source, table.span(), kind, needs);
    if keys.law != DirectivityLaw::Gaussian {
        section.refuse("centre_deg", &keys.centre_deg)?;
        section.refuse("width_deg", &keys.width_deg)?;
    }
    if keys.law != DirectivityLaw::Table {
        section.refuse("angle_deg", &keys.angle_deg)?;
        section.refuse("pressure", &keys.pressure)?;
    }
    Ok(match keys.law {
        DirectivityLaw::Even => Directivity::Even,
        DirectivityLaw::Gaussian => Directivity::Gaussian {
            centre_rad: keys
                .centre_deg
                .as_ref()
                .map_or(0.0, |centre| centre.get_ref().get().to_radians()),
            width_rad: section.need("width_deg", &keys.width_deg)?.get().to_radians(),
        },
        DirectivityLaw::Piston => Directivity::Piston,
        DirectivityLaw::MultiGaussian => Directivity::MultiGaussian,
        DirectivityLaw::Rayleigh => Directivity::Rayleigh,
        DirectivityLaw::Table => {
            let angles_deg = section.need("angle_deg", &keys.angle_deg)?;
            let pressures = section.need("pressure", &keys.pressure)?;
            let measured = MeasuredTable::new(&angles_deg, &pressures).map_err(|wrong| {
                source.fault(
                    table.span(),
                    wrong.to_string(),
                    "list the angles from the axis outwards, each with its pressure relative to that on the axis",
                )
            })?;
            Directivity::Table(measured)
        }
    })
}

/// A number to be written, if it is in the range of the key.
fn number<T: TryFrom<f64>>(value: f64) -> Key<T> {
    T::try_from(value).ok().and_then(written)
}

fn on_axis_table(on_axis: OnAxis) -> OnAxisTable {
    let blank = |law| OnAxisTable {
        law,
        amplitude: None,
        attenuation_db_m: None,
        exponent: None,
        decay_per_m: None,
    };
    match on_axis {
        OnAxis::Spherical => blank(OnAxisLaw::Spherical),
        OnAxis::Absorbed { amplitude, attenuation_np_m } => OnAxisTable {
            amplitude: number(amplitude),
            attenuation_db_m: number(attenuation_np_m * DB_PER_NP),
            ..blank(OnAxisLaw::Absorbed)
        },
        OnAxis::Power { exponent } => {
            OnAxisTable { exponent: number(exponent), ..blank(OnAxisLaw::Power) }
        }
        OnAxis::Exponential { amplitude, decay_per_m } => OnAxisTable {
            amplitude: number(amplitude),
            decay_per_m: number(decay_per_m),
            ..blank(OnAxisLaw::Exponential)
        },
    }
}

fn directivity_table(directivity: &Directivity) -> DirectivityTable {
    let blank = |law| DirectivityTable {
        law,
        centre_deg: None,
        width_deg: None,
        angle_deg: None,
        pressure: None,
    };
    match directivity {
        Directivity::Even => blank(DirectivityLaw::Even),
        Directivity::Piston => blank(DirectivityLaw::Piston),
        Directivity::MultiGaussian => blank(DirectivityLaw::MultiGaussian),
        Directivity::Rayleigh => blank(DirectivityLaw::Rayleigh),
        Directivity::Gaussian { centre_rad, width_rad } => DirectivityTable {
            centre_deg: number(centre_rad.to_degrees()),
            width_deg: number(width_rad.to_degrees()),
            ..blank(DirectivityLaw::Gaussian)
        },
        Directivity::Table(table) => DirectivityTable {
            angle_deg: written(table.angles_rad().iter().map(|angle| angle.to_degrees()).collect()),
            pressure: written(table.pressures().to_vec()),
            ..blank(DirectivityLaw::Table)
        },
    }
}

/// The path of a transducer file: the name itself if it is a path, or a file in the folder `transducers`.
pub(super) fn transducer_path(name: &str) -> PathBuf {
    if name.ends_with(".toml") {
        return PathBuf::from(name);
    }
    Path::new("transducers").join(format!("{name}.toml"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::transducer::Transducer;

    fn parse(text: &str) -> Result<TransducerFile, Fault> {
        TransducerFile::parse(&TomlSource::new(Path::new("t.toml"), text))
    }

    #[test]
    fn each_law_reads_back_as_it_was_described() {
        let table = MeasuredTable::new(&[0.0, 20.0, 60.0], &[1.0, 0.7, 0.1]).expect("a table");
        let laws = [
            Directivity::Even,
            Directivity::Gaussian { centre_rad: 0.0, width_rad: 0.5 },
            Directivity::Gaussian { centre_rad: -0.07, width_rad: 0.6 },
            Directivity::Piston,
            Directivity::MultiGaussian,
            Directivity::Rayleigh,
            Directivity::Table(table),
        ];
        let decays = [
            OnAxis::Spherical,
            OnAxis::Absorbed { amplitude: 0.4, attenuation_np_m: 0.15 },
            OnAxis::Power { exponent: 0.9 },
            OnAxis::Exponential { amplitude: 1.1, decay_per_m: 5.3 },
        ];
        for directivity in laws {
            for on_axis in decays {
                let transducer = DescribedTransducer { on_axis, directivity: directivity.clone() };
                let radius_m = Positive::new(4.5e-3).ok();
                let file = TransducerFile::describing("n", "s", radius_m, transducer);
                let again = parse(file.text()).unwrap_or_else(|fault| panic!("{fault}"));
                assert_eq!(again.name(), "n");
                assert!((again.face_radius_m().expect("written") - 4.5e-3).abs() < 1e-15);
                for theta_rad in [0.0, 0.3, 1.0] {
                    let of = |file: &TransducerFile| {
                        file.transducer().directivity(theta_rad, 4e-3, 700.0)
                    };
                    assert!((of(&again) - of(&file)).abs() < 1e-12, "{}", file.text());
                }
                if directivity != Directivity::Rayleigh {
                    assert_eq!(
                        std::mem::discriminant(&again.transducer().on_axis),
                        std::mem::discriminant(&on_axis)
                    );
                }
            }
        }
    }

    #[test]
    fn a_key_too_many_or_too_few_is_a_fault_at_its_place() {
        let problem =
            |text: &str| parse(&format!("name = \"n\"\n{text}")).expect_err(text).to_string();
        let missing = problem("[directivity]\nlaw = \"gaussian\"\n");
        assert!(missing.contains("`width_deg`"), "{missing}");
        let surplus = problem("[directivity]\nlaw = \"piston\"\nwidth_deg = 3.0\n");
        assert!(surplus.starts_with("t.toml:4") && surplus.contains("width_deg"), "{surplus}");
        let order = problem(
            "[directivity]\nlaw = \"table\"\nangle_deg = [0, 9, 3]\npressure = [1, 1, 1]\n",
        );
        assert!(order.contains("angle 3"), "{order}");
        let integral =
            problem("[on_axis]\nlaw = \"spherical\"\n[directivity]\nlaw = \"rayleigh\"\n");
        assert!(integral.contains("on the axis"), "{integral}");
        let unknown = problem("[directivity]\nlaw = \"bessel\"\n");
        assert!(unknown.contains("t.toml:3"), "{unknown}");
    }
}
