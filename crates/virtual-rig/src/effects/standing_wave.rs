//! Sound bounces between receiver and array: a ripple of half a wavelength in z.
//!
//! A wave that returned once from the array has the phase of twice the height: p (1 + Γ exp(2 i k z)). Each further return is
//! weaker by Γ and by the spreading over another 2 z, and is left out.

use num_complex::Complex64;
use serde::Deserialize;

use super::Effect;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Exact, Finite};

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StandingWave {
    /// Γ, real and imaginary part: both reflections and the spreading between them.
    coefficient: Exact<Finite, 2>,
}

impl Effect for StandingWave {
    fn resonance(&self, at_m: Vec3, wavenumber_rad_m: f64) -> Complex64 {
        let [re, im] = self.coefficient.map(Finite::get);
        1.0 + Complex64::new(re, im) * Complex64::from_polar(1.0, 2.0 * wavenumber_rad_m * at_m.z)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_ripple_repeats_every_half_wavelength_and_has_its_depth() {
        let effect = effect::<StandingWave>("coefficient = [0.2, 0.0]");
        let k = 733.0;
        let half = std::f64::consts::PI / k;
        let level = |z: f64| effect.resonance(Vec3::z() * z, k).norm();
        assert!((level(0.1) - level(0.1 + half)).abs() < 1e-9);
        let levels: Vec<f64> = (0..100).map(|i| level(0.1 + half * f64::from(i) / 100.0)).collect();
        let largest = levels.iter().copied().fold(0.0, f64::max);
        let least = levels.iter().copied().fold(9.0, f64::min);
        assert!((largest - 1.2).abs() < 1e-3 && (least - 0.8).abs() < 1e-3);
    }
}
