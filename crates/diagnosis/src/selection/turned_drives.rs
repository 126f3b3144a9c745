//! What small turns of the elements of a drive would cost, to first order in the readings.
//!
//! With J the derivatives of the expected readings by the real and the imaginary part of a relative change of each element, changes t make
//! the squared residual |r|² - 2 tᵀJᵀr + tᵀJᵀJ t. The products are formed once, and each of many drives then costs a form of twice as many
//! numbers as there are elements, whatever the number of readings.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::selection::cost_by_gain::CostByGain;
use crate::selection::quick_scores::{QuickScores, ScoredDrive};

/// The readings of one drive, ready for changes of its elements.
pub(super) struct TurnedDrive {
    /// JᵀJ: real parts of all elements first.
    curvature: DMatrix<f64>,
    /// Jᵀr.
    downhill: DVector<f64>,
    /// Jᵀg, with g the derivatives by the logarithm of the gain.
    by_gain: DVector<f64>,
    /// The products of residuals and g without a change.
    unchanged: CostByGain,
}

impl TurnedDrive {
    /// Of every drive, by one reading in `stride`; none where drives have so few readings that the products are no shorter than they.
    pub fn all(quick: &QuickScores<'_>, stride: usize) -> Vec<Self> {
        let is_shorter = |drive: &ScoredDrive| {
            drive.pressures.len().div_ceil(stride) > 2 * drive.contributions.len()
        };
        if !quick.drives.iter().all(is_shorter) {
            return Vec::new();
        }
        quick.drives.par_iter().map(|drive| Self::of(quick, drive, stride)).collect()
    }

    fn of(quick: &QuickScores<'_>, drive: &ScoredDrive, stride: usize) -> Self {
        let elements = drive.contributions.len();
        let readings = drive.pressures.len().div_ceil(stride);
        let mut slopes = DMatrix::zeros(2 * elements, readings);
        let [mut residuals, mut by_gain] = [DVector::zeros(readings), DVector::zeros(readings)];
        let mut unchanged = CostByGain::default();
        let mut number = 0;
        quick.evaluate_drive(
            drive,
            stride,
            |_| Complex64::ZERO,
            |slope| {
                unchanged.add(slope.residual, slope.by_gain);
                residuals[number] = slope.residual;
                by_gain[number] = slope.by_gain;
                let by_pressure = slope.by_pressure();
                for (n, part) in drive.contributions.iter().enumerate() {
                    let change = by_pressure * part[number * stride];
                    slopes[(n, number)] = change.re;
                    slopes[(elements + n, number)] = -change.im;
                }
                number += 1;
            },
        );
        let (downhill, by_gain) = (&slopes * residuals, &slopes * by_gain);
        Self { curvature: &slopes * slopes.transpose(), downhill, by_gain, unchanged }
    }

    /// With a relative change of each element.
    pub fn changed(&self, changes: &[Complex64]) -> Changed<'_> {
        let parts = changes.iter().map(|c| c.re).chain(changes.iter().map(|c| c.im));
        let by = DVector::from_iterator(self.downhill.len(), parts);
        Changed { of: self, curved: &self.curvature * &by, by }
    }
}

/// A drive with its elements changed.
pub(super) struct Changed<'d> {
    of: &'d TurnedDrive,
    /// The changes t.
    by: DVector<f64>,
    /// JᵀJ t.
    curved: DVector<f64>,
}

impl Changed<'_> {
    /// Changes one element further.
    pub fn and(&mut self, element: usize, change: Complex64) {
        let elements = self.by.len() / 2;
        for (number, part) in [(element, change.re), (elements + element, change.im)] {
            self.by[number] += part;
            self.curved.axpy(part, &self.of.curvature.column(number), 1.0);
        }
    }

    /// The products of residuals and derivatives by the gain.
    pub fn sums(&self) -> CostByGain {
        let TurnedDrive { downhill, by_gain, unchanged: CostByGain { rr, rg, gg }, .. } = self.of;
        CostByGain {
            rr: rr - 2.0 * self.by.dot(downhill) + self.by.dot(&self.curved),
            rg: rg - self.by.dot(by_gain),
            gg: *gg,
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
    use crate::selection::cost_by_gain::Slope;

    #[test]
    fn small_changes_cost_what_the_readings_themselves_say_and_may_be_made_one_after_another() {
        let bench = Bench::new();
        let mut draws = ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut draws) };
        let mut places = || -> Vec<Vec3> {
            (0..80).map(|_| Vec3::new(normal(), normal(), 10.0 + normal()) * 1e-2).collect()
        };
        let focused = bench.believed().excitation.clone();
        let drives = [(focused, places()), (Excitation::Uniform, places())];
        let mut observations = bench.observations(&drives);
        let readings =
            observations.scans[0].drives.iter_mut().flat_map(|drive| &mut drive.stabilised);
        readings.for_each(|reading| *reading += normal());
        let fit = Fit::of_nothing(vec![nuisance()]);
        let quick = QuickScores::of(&fit, &observations, &bench.context);
        let turned = TurnedDrive::all(&quick, 1);
        for (drive, turned) in quick.drives.iter().zip(&turned) {
            let changes: Vec<Complex64> = (0..drive.contributions.len())
                .map(|_| 1e-4 * Complex64::new(normal(), normal()))
                .collect();
            let none = vec![Complex64::ZERO; changes.len()];
            let exactly = |changes: &[Complex64]| {
                let (change, mut sums) = (drive.changed(changes), CostByGain::default());
                let see = |slope: Slope| sums.add(slope.residual, slope.by_gain);
                quick.evaluate_drive(drive, 1, |i| change[i], see);
                sums.cost()
            };
            let to_first_order = turned.changed(&changes).sums().cost();
            let gained = exactly(&changes) - exactly(&none);
            let foretold = to_first_order - turned.changed(&none).sums().cost();
            assert!((foretold - gained).abs() < 0.02 * gained.abs() + 1e-3, "{foretold} {gained}");
            let mut further = turned.changed(&none);
            changes.iter().enumerate().for_each(|(n, change)| further.and(n, *change));
            assert!((further.sums().cost() - to_first_order).abs() < 1e-9 * to_first_order);
        }
        // Of few readings the products are no shorter than they.
        assert!(TurnedDrive::all(&quick, 4).is_empty());
    }
}
