//! The size of a gap: root mean square over the readings, each in standard deviations of its noise.

use nalgebra::{Matrix4, Vector4};

use super::causes::Causes;
use super::laboratory::{Laboratory, NoiseOfReadings};
use super::world::World;
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::counter_rng::CounterRng;

/// Of the driven readings one in this number is used. It gives the gap to some percent, and includes every height and row.
const ONE_IN: usize = 7;

/// The shift that remains after a careful set-up, m. A smaller one is no gap.
const SMALL_SHIFT_M: f64 = 0.1e-3;

/// Step of the numerical gradient, m.
const STEP_M: f64 = 0.02e-3;

/// The expected readings of a laboratory, and their gradient.
pub(super) struct Believed {
    /// Numbers of the stops that are used.
    pub chosen: Vec<usize>,
    /// Reading for a field of 1/m, V.
    pub volts: f64,
    levels_v: Vec<f64>,
    slopes_v_m: Vec<Vec3>,
    noise: NoiseOfReadings,
}

impl Believed {
    /// The undisturbed field of the pistons, at the gain that gives the expected peak.
    pub fn new(laboratory: &Laboratory) -> Self {
        let none = Causes::none();
        let world = World::new(laboratory, &none, 1.0, CounterRng::new(0));
        let stops = &laboratory.survey.stops;
        let driven = (0..stops.len()).filter(|&n| stops[n].focus.is_some());
        let chosen: Vec<usize> = driven.step_by(ONE_IN).collect();
        let shifted = |by_m: Vec3| {
            let places = chosen.iter().map(|&n| &stops[n]);
            world.magnitudes(
                places.map(|stop| (stop.focus.unwrap_or_default(), stop.at_mm * 1e-3 + by_m)),
            )
        };
        let here = shifted(Vec3::zeros());
        let volts = laboratory.peak_v / here.iter().copied().fold(0.0, f64::max);
        let beside = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| shifted(STEP_M * axis));
        let slopes_v_m = (0..here.len())
            .map(|n| Vec3::from_fn(|axis, _| volts * (beside[axis][n] - here[n]) / STEP_M))
            .collect();
        let levels_v = here.into_iter().map(|level| volts * level).collect();
        Self { chosen, volts, levels_v, slopes_v_m, noise: laboratory.noise() }
    }

    /// The gap of the true readings without noise, at the best gain and the best small shift, in standard deviations of each
    /// reading's noise.
    pub fn gap(&self, true_v: &[f64]) -> f64 {
        let mut matrix = Matrix4::zeros();
        let mut side = Vector4::zeros();
        for (row, target) in self.rows(true_v) {
            matrix += row * row.transpose();
            side += row * target;
        }
        let gain_alone = || side[0] / matrix[(0, 0)];
        let Some(best) = matrix.cholesky().map(|cholesky| cholesky.solve(&side)) else {
            return self.residual(true_v, Vector4::new(gain_alone(), 0.0, 0.0, 0.0));
        };
        let shift_m = best.fixed_rows::<3>(1) / best[0];
        if shift_m.norm() <= SMALL_SHIFT_M {
            return self.residual(true_v, best);
        }
        // Too large: take the largest allowed shift in that direction, and fit the gain again.
        let shift_m = shift_m * (SMALL_SHIFT_M / shift_m.norm());
        let direction = Vector4::new(1.0, shift_m.x, shift_m.y, shift_m.z);
        let gain = direction.dot(&side) / (direction.transpose() * matrix * direction)[0];
        self.residual(true_v, gain * direction)
    }

    /// Rows of the least-squares problem (gain, and gain times shift) and their targets, in standard deviations.
    fn rows<'a>(&'a self, true_v: &'a [f64]) -> impl Iterator<Item = (Vector4<f64>, f64)> + 'a {
        self.levels_v.iter().zip(&self.slopes_v_m).zip(true_v).map(|((&level, slope), &target)| {
            let sigma = self.noise.at_v(target);
            (Vector4::new(level, slope.x, slope.y, slope.z) / sigma, target / sigma)
        })
    }

    fn residual(&self, true_v: &[f64], gain_and_shift: Vector4<f64>) -> f64 {
        let squares: f64 = self
            .rows(true_v)
            .map(|(row, target)| (target - row.dot(&gain_and_shift)).powi(2))
            .sum();
        (squares / true_v.len() as f64).sqrt()
    }
}

/// The gap of a world against the expected readings.
pub(super) fn gap_of(world: &World<'_>, laboratory: &Laboratory, believed: &Believed) -> f64 {
    let levels_v = world.levels_v(&believed.chosen);
    let stops = &laboratory.survey.stops;
    let read_v: Vec<f64> = believed
        .chosen
        .iter()
        .zip(levels_v)
        .map(|(&n, level_v)| world.noiseless_v(&stops[n], level_v))
        .collect();
    believed.gap(&read_v)
}

#[cfg(test)]
mod tests {
    use super::super::random_sequence::RandomSequence;
    use super::*;

    fn believed() -> (Laboratory, Believed) {
        let laboratory = Laboratory::draw(&mut RandomSequence::new(CounterRng::new(6)));
        let believed = Believed::new(&laboratory);
        (laboratory, believed)
    }

    #[test]
    fn a_gain_and_a_small_shift_are_no_gap_and_a_larger_shift_is_one() {
        let (laboratory, believed) = believed();
        let shifted = |by_mm: f64| {
            let offset = toml::toml! { x_mm = (by_mm) y_mm = 0.0 z_mm = 0.0 };
            let causes = Causes::of_catalogue(vec![("offset", offset)]);
            // Another gain than the laboratory's.
            let world = World::new(&laboratory, &causes, 1.3 * believed.volts, CounterRng::new(0));
            gap_of(&world, &laboratory, &believed)
        };
        assert!(shifted(0.0) < 1e-9);
        assert!(shifted(0.08) < 0.03, "{}", shifted(0.08));
        assert!(shifted(1.0) > 0.3 && shifted(2.0) > 2.0 * shifted(1.0));
    }

    #[test]
    fn a_ripple_of_one_deviation_is_a_gap_of_one() {
        let (_, believed) = believed();
        let ripple = |n: usize| if n.is_multiple_of(2) { 1.0 } else { -1.0 };
        let levels = believed.levels_v.iter().enumerate();
        let read_v: Vec<f64> =
            levels.map(|(n, &v)| v + 0.3 * ripple(n) * believed.noise.at_v(v)).collect();
        assert!((believed.gap(&read_v) - 0.3).abs() < 0.02, "{}", believed.gap(&read_v));
    }
}
