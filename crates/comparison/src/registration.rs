//! What a registration says: the result, as data.

use serde::Serialize;

use super::pose::{Mirror, Pose};

/// How the scan may be brought to the simulation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Registering {
    /// Nothing is estimated: gain 1, coordinates as recorded.
    None,
    /// The gain only.
    GainOnly,
    /// The gain and a small shift, held near zero by a prior of a fraction of a millimetre.
    GainAndShift,
    /// The gain and the whole pose: mirror, turn, step, shift in x, y and z.
    Pose,
    /// Gain and small shift, unless the whole pose explains the gap.
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

/// How a scan was brought to the coordinates and the unit of its simulation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Registration {
    /// What was asked for.
    pub requested: Registering,
    /// What was done; never [`Registering::Auto`].
    pub chosen: Registering,
    /// Why that, in a sentence or two for the report.
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
    /// Radius of the receiver's face, metres, where the gain was let fall off with the angle of arrival as such a face
    /// makes it; `None` where one gain holds for all angles.
    pub receiver_face_m: Option<Estimate>,
    /// Every registration that was tried, the simplest first, with what it reached.
    pub tried: Vec<TriedRegistration>,
    /// What these data cannot tell apart.
    pub undetermined: Vec<UndeterminedCombination>,
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

/// Parameters that the data fix only together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UndeterminedCombination {
    /// Their names: `shift_z`, `step_ratio`, `array_pitch`, `turn`, `mirror`, ...
    pub parameters: Vec<String>,
    /// What follows from it, with numbers, in words for the report.
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
