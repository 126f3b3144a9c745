//! `[hand]` in a truth file.

use serde::Deserialize;

use fieldgap_input::{Exact, Fraction, Gap, NonNegative, Positive, literal};

/// Two numbers above zero, the first not above the second.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "Exact<Positive, 2>")]
pub struct Range([f64; 2]);

impl Range {
    /// The first.
    pub fn least(self) -> f64 {
        self.0[0]
    }

    /// The second.
    pub fn most(self) -> f64 {
        self.0[1]
    }

    /// Linear interpolation, for a share from 0 to 1.
    pub fn at(self, share: f64) -> f64 {
        self.0[0] + (self.0[1] - self.0[0]) * share
    }

    /// Interpolation between the logarithms, for a share from 0 to 1.
    pub fn at_logarithm(self, share: f64) -> f64 {
        self.0[0] * (self.0[1] / self.0[0]).powf(share)
    }
}

impl TryFrom<Exact<Positive, 2>> for Range {
    type Error = String;
    fn try_from(pair: Exact<Positive, 2>) -> Result<Self, String> {
        let [from, to] = pair.map(Positive::get);
        if from <= to {
            Ok(Self([from, to]))
        } else {
            Err(format!(
                "a range goes from the smaller to the larger value, not from {from} to {to}"
            ))
        }
    }
}

/// `[hand]`: the ranges from which each gesture is drawn. Every key has a default.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HandTruth {
    /// Speed, m/s, uniform in its logarithm.
    pub speed_m_s: Range,
    /// Pause without a hand before each, s.
    pub pause_s: Range,
    /// Height over the array, mm.
    pub height_mm: Range,
    /// Width of the hand along its path, mm.
    pub width_mm: Range,
    /// Length of the hand across its path, mm.
    pub length_mm: Range,
    /// Largest lateral offset from the array's centre, mm.
    pub aside_mm: Gap,
    /// Largest tilt about either axis, degrees.
    pub tilt_deg: NonNegative,
    /// Amplitude of the tremor of its height at 8 to 12 Hz, mm.
    pub tremor_mm: Gap,
    /// Reflected share of the amplitude. Skin reflects nearly all, but a hand is not flat.
    pub reflection: Range,
    /// Share of gestures that are pushes: down from above and up again.
    pub pushes: Fraction,
    /// Relative amplitude of the slow drift of the direct coupling between elements.
    pub drift: Fraction,
}

impl Default for HandTruth {
    fn default() -> Self {
        let share = |value| Fraction::new(value).expect("a literal");
        Self {
            speed_m_s: Range([0.1, 1.0]),
            pause_s: Range([0.8, 4.0]),
            height_mm: Range([50.0, 120.0]),
            width_mm: Range([70.0, 100.0]),
            length_mm: Range([120.0, 190.0]),
            aside_mm: literal(30.0),
            tilt_deg: literal(8.0),
            tremor_mm: literal(0.3),
            reflection: Range([0.3, 0.9]),
            pushes: share(0.0),
            drift: share(0.05),
        }
    }
}
