//! The nozzle comes to rest at a slightly different place on every approach: p(x + δ), with δ normal on each axis.
//!
//! Each axis has a standard deviation of its own, in mm: the unidirectional repeatability of ISO 230-2, one standard deviation.
//! Belt and screw drives have 0.02 to 0.3 mm. A reading in a linear field then scatters by √Σ (σᵢ ∂p/∂xᵢ)².
//!
//! The displacement is a function of the distance travelled. At rest it does not change, so all samples of a reading share it,
//! and a place that is visited again has another one. Two readings at least twice [`CELL_MM`] of travel apart are independent.
//! In motion it changes smoothly, and its variance is the same everywhere.

use std::f64::consts::FRAC_PI_2;

use serde::Deserialize;

use super::Effect;
use crate::counter_rng::CounterRng;
use crate::trajectory::Kinematics;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Gap;

/// Its parameters.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PositionJitter {
    /// Standard deviation along x, mm.
    x_mm: Gap,
    /// Standard deviation along y, mm.
    y_mm: Gap,
    /// Standard deviation along z, mm.
    z_mm: Gap,
}

/// Travel from one independent draw to the next, mm. Neighbours of any scan are further apart than twice this.
pub(crate) const CELL_MM: f64 = 0.25;

impl Effect for PositionJitter {
    fn displacement_m(&self, kinematics: &Kinematics, rng: CounterRng) -> Vec3 {
        let cell = (kinematics.travelled_mm / CELL_MM).max(0.0);
        let (sin, cos) = (FRAC_PI_2 * cell.fract()).sin_cos();
        let sigmas_mm = [self.x_mm, self.y_mm, self.z_mm];
        Vec3::from_fn(|axis, _| {
            let rng = rng.substream(axis as u64);
            // cos² + sin² = 1 keeps the variance the same everywhere.
            let normal = cos * rng.normal(cell as u64) + sin * rng.normal(cell as u64 + 1);
            1e-3 * sigmas_mm[axis].get() * normal
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::effect;
    use super::*;

    const DRAWS: usize = 40_000;

    /// Displacements at places a millimetre of travel apart, mm.
    fn displacements_mm() -> Vec<Vec3> {
        let effect = effect::<PositionJitter>("x_mm = 0.1\ny_mm = 0.2\nz_mm = 0.05");
        let after =
            |n: usize| Kinematics { travelled_mm: n as f64 * 1.037, ..Kinematics::resting() };
        (0..DRAWS).map(|n| effect.displacement_m(&after(n), CounterRng::new(3)) * 1e3).collect()
    }

    fn covariance(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
        pairs.map(|(a, b)| a * b).sum::<f64>() / DRAWS as f64
    }

    #[test]
    fn each_axis_scatters_by_its_own_deviation_and_independently() {
        let draws = displacements_mm();
        for (axis, sigma) in [0.1, 0.2, 0.05].into_iter().enumerate() {
            let mean = draws.iter().map(|d| d[axis]).sum::<f64>() / DRAWS as f64;
            let variance = covariance(draws.iter().map(|d| (d[axis], d[axis])));
            assert!(mean.abs() < 0.02 * sigma, "{axis}: {mean}");
            assert!((variance.sqrt() / sigma - 1.0).abs() < 0.015, "{axis}: {variance}");
            let next = covariance(draws.windows(2).map(|two| (two[0][axis], two[1][axis])));
            assert!(next.abs() < 0.02 * sigma * sigma, "{axis}: {next}");
        }
        let xy = covariance(draws.iter().map(|d| (d.x, d.y)));
        assert!(xy.abs() < 0.02 * 0.1 * 0.2, "{xy}");
    }

    #[test]
    fn readings_of_a_linear_field_scatter_by_the_gradient_times_the_deviation() {
        let gradient = Vec3::new(3.0, -1.0, 2.0);
        let readings = displacements_mm().into_iter().map(|d| gradient.dot(&d));
        let scatter = covariance(readings.map(|r| (r, r))).sqrt();
        let expected = gradient.component_mul(&Vec3::new(0.1, 0.2, 0.05)).norm();
        assert!((scatter / expected - 1.0).abs() < 0.015, "{scatter} {expected}");
    }

    #[test]
    fn in_motion_the_displacement_does_not_jump() {
        let effect = effect::<PositionJitter>("x_mm = 0.1\ny_mm = 0.1\nz_mm = 0.1");
        let at = |travelled_mm: f64| {
            let kinematics = Kinematics { travelled_mm, ..Kinematics::resting() };
            effect.displacement_m(&kinematics, CounterRng::new(3))
        };
        for cell in 1..1000 {
            let border_mm = f64::from(cell) * CELL_MM;
            assert!((at(border_mm + 1e-9) - at(border_mm - 1e-9)).norm() < 1e-10);
        }
    }
}
