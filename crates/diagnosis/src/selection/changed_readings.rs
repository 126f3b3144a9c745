//! What a change of some elements would make of the readings, by the noise scale alone in place of the receiver's own formulas.
//!
//! A reading follows its level as on the scale of the noise, times the ratio of the slopes that the receiver and the scale have where nothing is
//! changed: one, but for a receiver that compresses or adds a floor. Thousands of changes are compared so; the best are then scored by the
//! receiver's own formulas.

use num_complex::Complex64;

use crate::selection::cost_by_gain::{CostByGain, Slope};
use crate::statistics::noise_scale::NoiseScale;

/// Some readings of one drive.
pub(super) struct ChangedReadings<'s> {
    scale: &'s NoiseScale,
    /// From a pressure to a level of the scale.
    gain: f64,
    readings: Vec<Response>,
    /// What each element adds to each of them.
    contributions: Vec<Vec<Complex64>>,
}

/// How one reading follows its pressure.
struct Response {
    pressure: Complex64,
    residual: f64,
    /// The level as it is, on the scale.
    before: f64,
    /// Units of the residual to one of the scale.
    by_scale: f64,
}

impl<'s> ChangedReadings<'s> {
    /// Of readings with their slopes, each with its standard deviation over that of a reading of usual length, of a scan with this scale, from
    /// pressures of so much gain, and what each element adds to them.
    pub fn of(
        slopes: impl Iterator<Item = (Slope, f64)>,
        scale: &'s NoiseScale,
        gain: f64,
        contributions: Vec<Vec<Complex64>>,
    ) -> Self {
        let of_reading = |(slope, deviation): (Slope, f64)| {
            let Slope { residual, by_gain, pressure } = slope;
            let (before, of_scale) = scale.of_level(gain * pressure.norm());
            let by_scale = if of_scale > 0.0 { by_gain / of_scale } else { deviation.recip() };
            Response { pressure, residual, before, by_scale }
        };
        Self { scale, gain, readings: slopes.map(of_reading).collect(), contributions }
    }

    /// How many readings there are.
    pub fn len(&self) -> usize {
        self.readings.len()
    }

    /// What an element adds to each.
    pub fn of_element(&self, element: usize) -> &[Complex64] {
        &self.contributions[element]
    }

    /// The change of each pressure, by a relative change of each element.
    pub fn change(&self, changes: &[Complex64]) -> Vec<Complex64> {
        let mut change = vec![Complex64::ZERO; self.readings.len()];
        for (element, by) in changes.iter().enumerate() {
            self.change_further(&mut change, element, *by);
        }
        change
    }

    /// Changes one element further.
    pub fn change_further(&self, change: &mut [Complex64], element: usize, by: Complex64) {
        for (change, part) in change.iter_mut().zip(&self.contributions[element]) {
            *change += by * part;
        }
    }

    /// Adds the readings with changed pressures to the sums of a cost.
    #[inline]
    pub fn add_to(&self, sums: &mut CostByGain, change: impl Iterator<Item = Complex64>) {
        for (reading, change) in self.readings.iter().zip(change) {
            // (The library's norm guards against overflow, at five times the time.)
            let level = self.gain * (reading.pressure + change).norm_sqr().sqrt();
            let (value, by_gain) = self.scale.of_level(level);
            let rise = reading.by_scale * (value - reading.before);
            sums.add(reading.residual - rise, reading.by_scale * by_gain);
        }
    }
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Excitation, Vec3};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::effects::testing::{Bench, nuisance};
    use crate::fit::joint_fit::Fit;
    use crate::selection::quick_scores::QuickScores;
    use crate::statistics::scatter::Scatter;

    /// A silenced, a reversed and a weak element, and all elements turned by up to an eighth of a turn, in a focus and beside it.
    #[test]
    fn large_changes_cost_what_the_receiver_makes_of_them() {
        let bench = Bench::new();
        let mut draws = ChaCha8Rng::seed_from_u64(11);
        let mut normal = || -> f64 { StandardNormal.sample(&mut draws) };
        let places: Vec<Vec3> =
            (0..300).map(|_| Vec3::new(normal(), normal(), 10.0 + normal()) * 1e-2).collect();
        let focused = bench.believed().excitation.clone();
        let mut observations =
            bench.observations(&[(focused, places.clone()), (Excitation::Uniform, places)]);
        let fit = Fit::of_nothing(vec![nuisance()]);
        // Many readings are in the noise, as between lobes.
        let levels = fit.model(&bench.context).expected_readings(&observations, &fit.nuisance);
        let largest = levels.into_iter().fold(0.0, f64::max);
        let scatter = Scatter { share: 0.02, additive: 0.05 * largest, ..Scatter::default() };
        observations.scans[0].set_scatter(scatter);
        let quick = QuickScores::of(&fit, &observations, &bench.context);
        for (drive, readings) in quick.drives.iter().zip(quick.all()) {
            let elements = drive.contributions.len();
            let changed = |element: usize, by: f64| {
                let mut changes = vec![Complex64::ZERO; elements];
                changes[element] = Complex64::new(by, 0.0);
                changes[(element + 3) % elements] = Complex64::new(0.0, 0.5);
                changes
            };
            let turned = drive.phases_rad.iter().map(|phase_rad| {
                let step_rad = std::f64::consts::FRAC_PI_2;
                Complex64::cis((phase_rad / step_rad).round() * step_rad - phase_rad) - 1.0
            });
            for changes in [
                changed(0, -1.0),
                changed(5, -2.0),
                changed(elements - 1, -0.5),
                turned.collect::<Vec<_>>(),
            ] {
                let change = readings.change(&changes);
                let mut exact = CostByGain::default();
                let see = |slope: Slope| exact.add(slope.residual, slope.by_gain);
                quick.evaluate_drive(drive, 1, |i| change[i], see);
                let exactly = exact.cost();
                let mut sums = CostByGain::default();
                readings.add_to(&mut sums, change.into_iter());
                assert!((sums.cost() / exactly - 1.0).abs() < 0.01, "{} {exactly}", sums.cost());
            }
        }
    }
}
