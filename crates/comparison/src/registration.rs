//! The result of a registration, as data.

use serde::Serialize;

use super::pose::{Mirror, Pose};

/// Which parameters of the registration are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Registering {
    /// None: gain 1, coordinates as recorded.
    None,
    /// The gain only.
    GainOnly,
    /// The gain and a small shift, with a prior of a fraction of a millimetre.
    GainAndShift,
    /// The gain and a shift of any size. It is tried and reported, and never chosen without being requested.
    Shift,
    /// The gain and the pose: mirror, turn, step, shift in x, y and z.
    Pose,
    /// The gain and a small shift, or the pose if it explains the gap.
    #[default]
    Auto,
}

/// A parameter of the registration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Its value.
    pub value: f64,
    /// Its standard error in the same unit, all other parameters free; 0 where it was not estimated.
    pub standard_error: f64,
    /// Whether it was estimated from the data; otherwise it was held at its value.
    pub estimated: bool,
}

/// How the coordinates and the unit of a scan relate to those of its simulation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Registration {
    /// What was requested.
    pub requested: Registering,
    /// What was chosen; never [`Registering::Auto`].
    pub chosen: Registering,
    /// The reason, in a sentence or two for the report.
    pub why: String,
    /// Reading per unit of the simulation.
    pub gain: Estimate,
    /// Which axis of the scan runs against the array's.
    pub mirror: Mirror,
    /// Turn of the scan's axes about z, after the mirror, radians.
    pub turn_rad: Estimate,
    /// True step over recorded step in x and y.
    pub step_ratio: Estimate,
    /// Where the scan's origin lies in the array's coordinates (x, y, z), metres.
    pub shift_m: [Estimate; 3],
    /// Radius of the receiver's face, metres, if the gain falls with the angle of arrival; `None` if one gain holds for all angles.
    pub receiver_face_m: Option<Estimate>,
    /// Every registration that was tried, the simplest first, with its result.
    pub tried: Vec<TriedRegistration>,
    /// Combinations of parameters that these data do not determine.
    pub undetermined: Vec<UndeterminedCombination>,
    /// What the phases of the readings told; `None` where only amplitudes were registered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phases: Option<PhasesUsed>,
}

/// The phases in a registration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PhasesUsed {
    /// Readings whose phase is known.
    pub known: usize,
    /// Standard deviation that a phase was given beside the quadratures' noise: its own noise, and what the simulation leaves of it, radians.
    pub noise_rad: f64,
    /// Largest departure of the reference from its mean over the scan, as fitted, radians.
    pub drift_rad: f64,
}

/// A registration that was tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TriedRegistration {
    /// Which.
    pub registering: Registering,
    /// The pose it found.
    pub pose: Pose,
    /// Pearson's correlation over all readings.
    pub correlation: f64,
    /// Rms of the residual over rms of the scan.
    pub residual_rms_ratio: f64,
}

/// Parameters that the data determine only in combination.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UndeterminedCombination {
    /// Their names: `shift_z`, `step_ratio`, `array_pitch`, `turn`, `mirror`, ...
    pub parameters: Vec<String>,
    /// An explanation with numbers for the report.
    pub explanation: String,
}

impl Registration {
    /// The pose, as numbers to compute with.
    pub fn pose(&self) -> Pose {
        Pose {
            mirror: self.mirror,
            turn_rad: self.turn_rad.value,
            step_ratio: self.step_ratio.value,
            shift_m: nalgebra::Vector3::from(self.shift_m.map(|estimate| estimate.value)),
        }
    }
}
