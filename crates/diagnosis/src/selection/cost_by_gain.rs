//! The cost of some readings after a first-order refit of the gain.

use num_complex::Complex64;

/// The cost after a first-order refit of the gain: sums of squares and products of residuals and slopes.
#[derive(Default)]
pub(super) struct CostByGain {
    pub rr: f64,
    pub rg: f64,
    pub gg: f64,
}

impl CostByGain {
    pub fn add(&mut self, residual: f64, by_gain: f64) {
        self.rr += residual * residual;
        self.rg += residual * by_gain;
        self.gg += by_gain * by_gain;
    }

    /// Of the readings of both.
    pub fn join(&mut self, other: &Self) {
        self.rr += other.rr;
        self.rg += other.rg;
        self.gg += other.gg;
    }

    pub fn cost(&self) -> f64 {
        self.rr - self.rg * self.rg / self.gg.max(f64::MIN_POSITIVE)
    }
}

/// A residual, the slope of the expected reading by the logarithm of the gain, and the pressure.
pub(super) struct Slope {
    pub residual: f64,
    pub by_gain: f64,
    pub pressure: Complex64,
}

impl Slope {
    /// The slope of the expected reading by the pressure: its change is the real part of this times a change of pressure.
    pub fn by_pressure(&self) -> Complex64 {
        self.by_gain / self.pressure.norm_sqr().max(f64::MIN_POSITIVE) * self.pressure.conj()
    }
}
