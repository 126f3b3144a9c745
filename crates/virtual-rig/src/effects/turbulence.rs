//! Random phases along the paths, from fluctuations of temperature and wind.
//!
//! In the geometrical regime the phase of a path of length d through many uncorrelated eddies is normal with variance
//! s² d (Ostashev and Wilson, *Acoustics in Moving Inhomogeneous Media*, chapter 7): the coherent part of the
//! field fades as exp(-s² d / 2) and the rest is speckle. The paths of different elements are taken as
//! uncorrelated, and each phase changes within [`EDDY_S`] as eddies drift through. A reading of many samples thus averages
//! some of the speckle, and no two points see the same air.

use std::f64::consts::FRAC_PI_2;

use serde::Deserialize;

use super::Effect;
use crate::counter_rng::CounterRng;
use fieldgap_input::NonNegative;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Turbulence {
    /// Standard deviation of the phase over one metre, rad.
    rad_per_sqrt_m: NonNegative,
}

/// Time in which the air between element and receiver is exchanged, s.
const EDDY_S: f64 = 0.05;

impl Effect for Turbulence {
    fn scintillates(&self) -> bool {
        self.rad_per_sqrt_m.get() > 0.0
    }

    fn scintillation_rad(
        &self,
        element: usize,
        distance_m: f64,
        time_s: f64,
        rng: CounterRng,
    ) -> f64 {
        let rng = rng.substream(element as u64);
        let eddy = (time_s / EDDY_S).max(0.0);
        let (sin, cos) = (FRAC_PI_2 * eddy.fract()).sin_cos();
        // cos² + sin² = 1 keeps the variance the same at every instant.
        let normal = cos * rng.normal(eddy as u64) + sin * rng.normal(eddy as u64 + 1);
        self.rad_per_sqrt_m.get() * distance_m.sqrt() * normal
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    #[test]
    fn the_coherent_part_fades_as_the_variance_says() {
        let effect = effect::<Turbulence>("rad_per_sqrt_m = 2.0");
        let rng = CounterRng::new(3);
        let (distance, n) = (0.3, 40_000);
        let coherent: f64 = (0..n)
            .map(|i| effect.scintillation_rad(i % 36, distance, i as f64 * 0.073, rng).cos())
            .sum::<f64>()
            / n as f64;
        assert!((coherent - (-0.5 * 4.0 * distance).exp()).abs() < 0.01, "{coherent}");
    }

    #[test]
    fn the_phase_does_not_jump() {
        let effect = effect::<Turbulence>("rad_per_sqrt_m = 2.0");
        let at = |time: f64| effect.scintillation_rad(5, 0.3, time, CounterRng::new(3));
        for i in 0..1000 {
            let time = f64::from(i) * EDDY_S;
            assert!((at(time + 1e-9) - at((time - 1e-9).max(0.0))).abs() < 1e-5);
        }
    }
}
