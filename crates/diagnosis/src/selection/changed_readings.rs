//! What a change of some elements would make of the readings, by a short formula in place of the receiver's own.
//!
//! On the noise scale a strong reading follows the logarithm of the level, and one in the noise its square. c/2 · ln(1 - w + w q) does both, with
//! q the ratio of the powers after and before. c is the slope of a strong reading by the logarithm of the level, and w gives the slope at q = 1
//! that the receiver has. Thousands of changes are compared so; the best are then scored by the receiver's own formulas.

use num_complex::Complex64;

use crate::selection::cost_by_gain::{CostByGain, Slope};
use crate::statistics::noise_scale::LEAST_SHARE;

/// Least excess of the slope of a strong reading over that of any: the logarithm stays finite where a change silences a reading.
const STRONGER: f64 = 1e-3;

/// Some readings of one drive.
pub(super) struct ChangedReadings {
    readings: Vec<Response>,
    /// What each element adds to each of them.
    contributions: Vec<Vec<Complex64>>,
}

/// How one reading follows its pressure.
struct Response {
    pressure: Complex64,
    residual: f64,
    by_gain: f64,
    /// c/2.
    half_slope: f64,
    /// 1 - w.
    floor: f64,
    /// w over the power.
    by_power: f64,
}

impl ChangedReadings {
    /// Of readings with their slopes, each with its standard deviation over that of a reading of usual length, of a scan with so much
    /// noise in proportion, and what each element adds to them.
    pub fn of(
        slopes: impl Iterator<Item = (Slope, f64)>,
        share: f64,
        contributions: Vec<Vec<Complex64>>,
    ) -> Self {
        let of_reading = |(slope, deviation): (Slope, f64)| {
            let Slope { residual, by_gain, pressure } = slope;
            let strong = 1.0 / (share.max(LEAST_SHARE) * deviation);
            let strong = strong.max((1.0 + STRONGER) * by_gain.abs());
            let weight = by_gain / strong;
            Response {
                pressure,
                residual,
                by_gain,
                half_slope: 0.5 * strong,
                floor: 1.0 - weight,
                by_power: weight / pressure.norm_sqr().max(f64::MIN_POSITIVE),
            }
        };
        Self { readings: slopes.map(of_reading).collect(), contributions }
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
            let power = (reading.pressure + change).norm_sqr();
            let rise = reading.half_slope * (reading.floor + reading.by_power * power).ln();
            sums.add(reading.residual - rise, reading.by_gain);
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

    /// A silenced, a reversed and an exchanged element, in a focus and beside it.
    #[test]
    fn large_changes_cost_about_what_the_receiver_makes_of_them() {
        let bench = Bench::new();
        let mut draws = ChaCha8Rng::seed_from_u64(11);
        let mut normal = || -> f64 { StandardNormal.sample(&mut draws) };
        let places: Vec<Vec3> =
            (0..300).map(|_| Vec3::new(normal(), normal(), 10.0 + normal()) * 1e-2).collect();
        let focused = bench.believed().excitation.clone();
        let observations =
            bench.observations(&[(focused, places.clone()), (Excitation::Uniform, places)]);
        let fit = Fit::of_nothing(vec![nuisance()]);
        let quick = QuickScores::of(&fit, &observations, &bench.context);
        for (drive, readings) in quick.drives.iter().zip(quick.all()) {
            let elements = drive.contributions.len();
            for (element, by) in [(0, -1.0), (5, -2.0), (elements - 1, -0.5)] {
                let mut changes = vec![Complex64::ZERO; elements];
                changes[element] = Complex64::new(by, 0.0);
                changes[(element + 3) % elements] = Complex64::new(0.0, 0.5);
                let change = readings.change(&changes);
                let mut exact = CostByGain::default();
                let see = |slope: Slope| exact.add(slope.residual, slope.by_gain);
                quick.evaluate_drive(drive, 1, |i| change[i], see);
                let exactly = exact.cost();
                let mut sums = CostByGain::default();
                readings.add_to(&mut sums, change.into_iter());
                assert!((sums.cost() / exactly - 1.0).abs() < 0.1, "{} {exactly}", sums.cost());
            }
        }
    }
}
