//! `[hand]` in a truth file.

use serde::Deserialize;

use fieldgap_input::{Fraction, NonNegative, Positive};

/// Two numbers above zero, the first not above the second.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "[Positive; 2]")]
pub struct Between([f64; 2]);

impl Between {
    /// The first.
    pub fn least(self) -> f64 {
        self.0[0]
    }

    /// The second.
    pub fn most(self) -> f64 {
        self.0[1]
    }

    /// The number at a share of the way, 0 to 1.
    pub fn at(self, share: f64) -> f64 {
        self.0[0] + (self.0[1] - self.0[0]) * share
    }

    /// The number at a share of the way between the logarithms.
    pub fn at_logarithm(self, share: f64) -> f64 {
        self.0[0] * (self.0[1] / self.0[0]).powf(share)
    }
}

impl TryFrom<[Positive; 2]> for Between {
    type Error = String;
    fn try_from(pair: [Positive; 2]) -> Result<Self, String> {
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

/// `[hand]`: what swipes are drawn from, each time anew. Every key has a default.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HandTruth {
    /// Speed, m/s, evenly in its logarithm: as many slow ones as fast ones.
    pub speed_m_s: Between,
    /// Pause without a hand before each, s.
    pub pause_s: Between,
    /// Height over the array, mm.
    pub height_mm: Between,
    /// Width of the hand, along its way, mm.
    pub width_mm: Between,
    /// Length of the hand, across its way, mm.
    pub length_mm: Between,
    /// Farthest from the array's middle across its way, mm.
    pub aside_mm: NonNegative,
    /// Largest tilt about either axis, degrees.
    pub tilt_deg: NonNegative,
    /// Tremor of its height, amplitude, mm, 8 to 12 times a second.
    pub tremor_mm: NonNegative,
    /// Share of the amplitude that it throws back: skin nearly all, but a hand is no mirror.
    pub reflection: Between,
    /// Share of gestures that come down from above and go up again instead of passing.
    pub pushes: Fraction,
    /// Slow change of what leaks from element to element, relative amplitude.
    pub drift: Fraction,
}

impl Default for HandTruth {
    fn default() -> Self {
        let not_below_zero = |value| NonNegative::new(value).expect("a literal");
        let share = |value| Fraction::new(value).expect("a literal");
        Self {
            speed_m_s: Between([0.1, 1.0]),
            pause_s: Between([0.8, 4.0]),
            height_mm: Between([50.0, 120.0]),
            width_mm: Between([70.0, 100.0]),
            length_mm: Between([120.0, 190.0]),
            aside_mm: not_below_zero(30.0),
            tilt_deg: not_below_zero(8.0),
            tremor_mm: not_below_zero(0.3),
            reflection: Between([0.3, 0.9]),
            pushes: share(0.0),
            drift: share(0.05),
        }
    }
}
