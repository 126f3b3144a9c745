//! The pressure at one reading.

use num_complex::Complex64;

/// Pressure at one reading, in the simulator's unit: a coherent part, and a random part that differs from reading to reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pressure {
    /// The coherent part: the mean over all readings at this place.
    pub coherent: Complex64,
    /// Mean square magnitude of the random part.
    pub speckle: f64,
    /// Mean square of the random part, a complex number: it tells the part along the coherent pressure from the part across it,
    /// which hardly shows where the coherent pressure is strong.
    pub speckle_square: Complex64,
}

impl Pressure {
    /// A pressure without a random part.
    pub fn steady(coherent: Complex64) -> Self {
        Self { coherent, speckle: 0.0, speckle_square: Complex64::ZERO }
    }

    /// The same at another gain.
    pub fn times(self, gain: f64) -> Self {
        Self {
            coherent: gain * self.coherent,
            speckle: gain * gain * self.speckle,
            speckle_square: gain * gain * self.speckle_square,
        }
    }

    /// The same with its phase turned.
    pub fn turned(self, angle_rad: f64) -> Self {
        Self {
            coherent: self.coherent * Complex64::cis(angle_rad),
            speckle_square: self.speckle_square * Complex64::cis(2.0 * angle_rad),
            ..self
        }
    }

    /// A pressure between this one and another, a share of the way.
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        Self {
            coherent: self.coherent + share * (other.coherent - self.coherent),
            speckle: self.speckle + share * (other.speckle - self.speckle),
            speckle_square: self.speckle_square
                + share * (other.speckle_square - self.speckle_square),
        }
    }

    /// Mean squares of the random part along the coherent pressure and across it.
    pub fn speckle_along_and_across(&self) -> [f64; 2] {
        let power = self.coherent.norm_sqr();
        let along = match power > 0.0 {
            true => (self.speckle_square * self.coherent.conj().powi(2)).re / power,
            false => 0.0,
        };
        [0.5 * (self.speckle + along), 0.5 * (self.speckle - along)].map(|square| square.max(0.0))
    }
}
