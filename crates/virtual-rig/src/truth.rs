//! The truth file: the real set-up behind a virtual rig, as opposed to the assumed one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use toml::Spanned;

use super::effects::{Effect, EffectTables};
use super::face_motion::FaceMotion;
use super::gestures::HandTruth;
use super::sealed_truth;
use fieldgap_acoustics::transducer::DescribedTransducer;
use fieldgap_input::{Fault, Finite, Length, NonNegative, Positive, TomlSource, literal};
use fieldgap_records::TransducerFile;

/// The physical world of a virtual rig.
///
/// Without a section its defaults hold: pistons of the thesis's transducer's face and a receiver of its family, no noise, no effects.
#[derive(Debug)]
pub struct Truth {
    /// The real elements.
    pub source: TrueSource,
    /// Pressure of one nominal element on its axis at 0.1 m, times 0.1 m, rms, Pa: that at 1 m where it falls as 1/d.
    pub pressure_pa_at_1_m: Positive,
    /// The real microphone.
    pub microphone: MicrophoneTruth,
    /// The noise of every reading.
    pub noise: NoiseTruth,
    /// The clock of the drives as a receiver that has it sees it.
    pub phase: PhaseTruth,
    /// The causes at work, with their ids.
    pub effects: Vec<(&'static str, Box<dyn Effect>)>,
    /// A hand that moves over the array, if any.
    pub hand: Option<HandTruth>,
    path: PathBuf,
}

/// The real elements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TrueSource {
    /// Radius of the vibrating face of every element, m; `None`: as assumed.
    pub face_radius_m: Option<f64>,
    /// How each radiates; `None`: by the integral over its face.
    pub transducer: Option<Arc<DescribedTransducer>>,
    /// How the face moves, where the integral over it is taken.
    pub motion: FaceMotion,
}

/// `[source]`
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct SourceTable {
    /// The thesis's transducer: 120 dB at 0.3 m and 10 V rms by its data sheet, which is 6 Pa at 1 m; less at the
    /// thesis's drive.
    pressure_pa_at_1_m: Positive,
    face_radius_mm: Option<Length>,
    transducer: Option<Spanned<String>>,
}

impl SourceTable {
    /// Reads the transducer's file, which is looked for from the folder of `source` as a rig file's is.
    fn true_source(&self, source: &TomlSource) -> Result<TrueSource, Fault> {
        let named = self.transducer.as_ref();
        let file = named.map(|name| TransducerFile::named(name, source)).transpose()?;
        let stated_m = self.face_radius_mm.map(|radius_mm| radius_mm.get() * 1e-3);
        Ok(TrueSource {
            face_radius_m: stated_m.or(file.as_ref().and_then(TransducerFile::face_radius_m)),
            transducer: file.map(|file| Arc::clone(file.transducer())),
            motion: FaceMotion::default(),
        })
    }
}

/// `[microphone]`
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MicrophoneTruth {
    /// Reading for a pressure on its axis, V/Pa.
    pub sensitivity_v_pa: Positive,
}

/// `[noise]`
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseTruth {
    /// Relative standard deviation of each sample's level.
    pub multiplicative: NonNegative0,
    /// Standard deviation of each quadrature of the noise that adds to the signal before it is rectified, V.
    /// A silent field then reads about 1.25 times this (Rayleigh's distribution).
    pub additive_v: NonNegative0,
}

/// `[phase]`: the clock of the drives as a receiver that has it sees it. Only an I/Q receiver does.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PhaseTruth {
    /// Phase of a reading beyond that of the field, rad, at the rig's power-up.
    pub offset_rad: Finite,
    /// Its drift, rad/h.
    pub drift_rad_h: Finite,
    /// Standard deviation of the phase noise of each sample, rad.
    pub noise_rad: NonNegative0,
}

impl Default for PhaseTruth {
    fn default() -> Self {
        let zero = literal(0.0);
        Self { offset_rad: zero, drift_rad_h: zero, noise_rad: NonNegative0::default() }
    }
}

/// A number not below zero that is zero if it is not given.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(transparent)]
pub struct NonNegative0(NonNegative);

impl NonNegative0 {
    /// The number.
    pub fn get(self) -> f64 {
        self.0.get()
    }
}

impl Default for NonNegative0 {
    fn default() -> Self {
        Self(NonNegative::new(0.0).expect("zero is not below zero"))
    }
}

impl Default for SourceTable {
    fn default() -> Self {
        Self {
            pressure_pa_at_1_m: Positive::new(4.0).expect("a literal above zero"),
            face_radius_mm: None,
            transducer: None,
        }
    }
}

impl Default for MicrophoneTruth {
    fn default() -> Self {
        Self { sensitivity_v_pa: Positive::new(0.006).expect("a literal above zero") }
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct TruthFile {
    source: SourceTable,
    microphone: MicrophoneTruth,
    noise: NoiseTruth,
    phase: PhaseTruth,
    effects: EffectTables,
    hand: Option<HandTruth>,
}

impl Truth {
    /// Reads a truth file, which may be [sealed](super::sealed_truth).
    ///
    /// # Errors
    /// A [`Fault`] at the line of an unknown effect or parameter, or of a value out of range. For a sealed file it does not
    /// reveal the content.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        if !sealed_truth::is_sealed(path) {
            return Self::from_source(&TomlSource::read(path)?);
        }
        let source = TomlSource::new(path, sealed_truth::open(path)?);
        Self::from_source(&source).map_err(|_| {
            let remedy = "seal it again with this version (`fieldgap blind seal-truth`), which shows the fault";
            Fault::of_file(path, "its content is not a truth file", remedy)
        })
    }

    /// Parses a truth file's text.
    ///
    /// # Errors
    /// As [`Truth::read`].
    pub fn from_source(source: &TomlSource) -> Result<Self, Fault> {
        let TruthFile { source: table, microphone, noise, phase, effects, hand } =
            source.parse()?;
        Ok(Self {
            source: table.true_source(source)?,
            pressure_pa_at_1_m: table.pressure_pa_at_1_m,
            microphone,
            noise,
            phase,
            effects: effects.into_effects(),
            hand,
            path: source.path().to_owned(),
        })
    }

    /// A world with these effects, each by its id with its parameters, and defaults for all else.
    ///
    /// # Errors
    /// A [`Fault`] that names an unknown effect or parameter, or a value out of range.
    pub fn of_effects(effects: &toml::Table) -> Result<Self, Fault> {
        let mut truth = toml::Table::new();
        truth.insert("effects".to_owned(), toml::Value::Table(effects.clone()));
        Self::from_source(&TomlSource::new(Path::new("effects"), truth.to_string()))
    }

    /// Checks that the effects fit an array of so many elements.
    ///
    /// # Errors
    /// A [`Fault`] of the file that names the effect.
    pub fn check(&self, elements: usize) -> Result<(), Fault> {
        for (id, effect) in &self.effects {
            effect.check(elements).map_err(|why| {
                let remedy = "elements are numbered from 0, row by row from the top left";
                if sealed_truth::is_sealed(&self.path) {
                    let problem = "its sealed content does not fit the array";
                    return Fault::of_file(&self.path, problem, remedy);
                }
                Fault::of_file(&self.path, format!("effect `{id}`: {why}"), remedy)
            })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth(text: &str) -> Result<Truth, Fault> {
        Truth::from_source(&TomlSource::new(Path::new("truth.toml"), text))
    }

    #[test]
    fn effects_are_read_with_their_ids_in_the_registrys_order() {
        let truth = truth("[effects.offset]\nx_mm = 1\ny_mm = 0\nz_mm = 0\n[effects.sound-speed]\nc_m_s = 347.1\n")
            .expect("valid");
        let ids: Vec<_> = truth.effects.iter().map(|(id, _)| *id).collect();
        assert_eq!(ids, ["sound-speed", "offset"]);
    }

    /// Every physical id of the catalogue of effects, with its parameters.
    const CATALOGUE: &str = "
        [effects.sound-speed]\nc_m_s = 347.1
        [effects.absorption]\ndb_per_m = 1.3
        [effects.flow]\nvx_m_s = 0.5\nvy_m_s = 0.0
        [effects.temperature-gradient]\ngx = 0.0\ngy = 0.0\ngz = 0.01
        [effects.turbulence]\nrad_per_sqrt_m = 0.5
        [effects.spreading]\nexponent = 1.1
        [effects.directivity]\nwidth_ratio = 1.1
        [effects.element-gain]\nspread = 0.1
        [effects.element-phase]\nspread_rad = 0.1
        [effects.dead-elements]\nelements = [3]
        [effects.polarity]\nelements = [4]
        [effects.swapped-channels]\nelements = [5, 6]
        [effects.pitch]\nratio = 1.01
        [effects.array-tilt]\nabout_x_rad = 0.01\nabout_y_rad = 0.0
        [effects.phase-quantisation]\nsteps = 16
        [effects.drive-frequency]\nratio = 1.001
        [effects.offset]\nx_mm = 1.0\ny_mm = 0.0\nz_mm = 0.0
        [effects.rotation]\nrad = 0.01
        [effects.axis-scale]\nx = 1.01\ny = 1.0\nz = 1.0
        [effects.skew]\nrad = 0.01
        [effects.backlash]\nmm = 0.2
        [effects.lag]\ns = 0.01
        [effects.position-jitter]\nx_mm = 0.1\ny_mm = 0.1\nz_mm = 0.05
        [effects.receiver-directivity]\nhalf_angle_deg = 40.0
        [effects.aperture]\nradius_mm = 3.0
        [effects.saturation]\nlevel = 4.0
        [effects.noise-floor]\nlevel = 0.05
        [effects.clipping]\nlevel = 3.0
        [effects.reflection]\nheight_mm = 300.0\ncoefficient = [0.2, 0.1]
        [effects.standing-wave]\ncoefficient = [0.1, 0.0]
        [effects.gain-drift]\nrelative = -0.05\nover_s = 600.0
        [effects.lead-screw]\naxis = \"y\"\namplitude_mm = 0.1\nlead_mm = 8.0\nphase_rad = 0.5
        [effects.crosstalk]\ncoefficient = [0.05, 0.01]
        [effects.wall]\nnormal = [1.0, 0.0, 0.0]\ndistance_mm = 120.0\ncoefficient = [0.3, 0.0]
        [effects.scatterer]\nx_mm = 5.0\ny_mm = 0.0\nz_mm = 40.0\nradius_mm = 3.0
        [effects.temperature-drift]\nk_per_h = 4.0
        [effects.warm-up]\nrelative = 0.05\ntime_constant_s = 120.0
        [effects.bowed-array]\nsagitta_mm = 0.5";

    #[test]
    fn every_physical_effect_of_the_catalogue_is_registered() {
        let truth = truth(CATALOGUE).expect("all are known, with these parameters");
        let mut ids: Vec<_> = truth.effects.iter().map(|(id, _)| *id).collect();
        ids.sort_unstable();
        let mut named: Vec<_> = CATALOGUE
            .lines()
            .filter_map(|line| line.trim().strip_prefix("[effects.")?.strip_suffix(']'))
            .collect();
        named.sort_unstable();
        assert_eq!(ids, named);
        assert_eq!(ids.len(), 38);
    }

    #[test]
    fn an_unknown_effect_or_parameter_and_a_missing_one_are_shown_at_their_line() {
        for (text, line) in [
            ("[noise]\n[effects.sound-sped]\nc_m_s = 347.1\n", 2),
            ("[effects.sound-speed]\nc_m_s = 347.1\nc = 1\n", 3),
            ("[effects.sound-speed]\nc_m_s = -1\n", 2),
            ("[effects.flow]\nvx_m_s = 1\n", 1),
        ] {
            let fault = truth(text).expect_err("faulty");
            assert_eq!(fault.line_column().map(|(line, _)| line), Some(line), "{fault}");
        }
    }

    #[test]
    fn a_defect_of_the_simulator_is_refused_with_its_reason() {
        let fault = truth("[effects.phase-plane]\n").expect_err("no world has it");
        assert!(fault.to_string().contains("defect of the simulator"), "{fault}");
        assert!(fault.line_column().is_some());
    }

    #[test]
    fn elements_that_do_not_exist_are_refused_when_the_array_is_known() {
        let truth = truth("[effects.dead-elements]\nelements = [35, 36]\n").expect("valid so far");
        assert!(truth.check(37).is_ok());
        let fault = truth.check(36).expect_err("there is no element 36");
        assert!(fault.to_string().contains("dead-elements"), "{fault}");
    }
}
