//! How large the gap is: root mean square residual over that of the scan, over all readings and over some kept out of the fit.

use super::effects::Context;
use super::fit::{Fit, Start, fit as fit_again};
use super::likelihood::{Nuisance, first_gain, pressures};
use super::observations::{Observations, Visit};
use super::supposed::Supposed;
use fieldgap_acoustics::least_squares::Stopping;

/// Side of the blocks of points that are kept out together, m: beyond that neighbours know nothing of each other.
const BLOCK_M: f64 = 8e-3;

/// Whether a point is kept out of the fit: one block in five.
pub(super) fn is_held_out(visit: &Visit) -> bool {
    let block = |m: f64, side_m: f64| (m / side_m).floor() as i64;
    let [x, y] = [visit.at_m.x, visit.at_m.y].map(|m| block(m, BLOCK_M));
    (x + 2 * y + block(visit.at_m.z, 1e-3)).rem_euclid(5) == 0
}

/// Expected readings under a fit, in the order of the observations.
pub(super) fn expected(
    observations: &Observations,
    supposed: &Supposed,
    nuisance: &[Nuisance],
) -> Vec<f64> {
    let pressures = pressures(observations, supposed, nuisance);
    let mut expected = Vec::with_capacity(observations.len());
    for ((scan, pressures), nuisance) in observations.scans.iter().zip(&pressures).zip(nuisance) {
        let gain = nuisance.log_gain.exp();
        for (drive, pressures) in scan.drives.iter().zip(pressures) {
            let first = expected.len();
            let of = |visit: &Visit, pressure| {
                supposed.expected(pressure, gain, visit.progress, scan).reading
            };
            let (visits, others) = pressures.split_at(drive.visits.len());
            expected.extend(drive.visits.iter().zip(visits).map(|(visit, p)| of(visit, p)));
            // Where nobody knows how the robot came, the way that fits best.
            for ((index, visit), pressure) in drive.otherwise.iter().zip(others) {
                let (other, reading) = (of(visit, pressure), drive.readings[*index]);
                let taken = &mut expected[first + index];
                if (other - reading).abs() < (*taken - reading).abs() {
                    *taken = other;
                }
            }
        }
    }
    expected
}

/// The believed set-up at the gain that fits best, and no shift.
pub(super) fn as_believed(observations: &Observations) -> Vec<Nuisance> {
    first_gain(observations, &Supposed::default())
}

/// Rms residual over rms reading.
pub(super) fn gap(observations: &Observations, expected: &[f64]) -> f64 {
    let readings = observations.readings();
    let squares: f64 = readings.iter().zip(expected).map(|(r, e)| (r - e).powi(2)).sum();
    (squares / readings.iter().map(|r| r * r).sum::<f64>()).sqrt()
}

/// What noise alone leaves, in the same unit.
pub(super) fn noise_floor(observations: &Observations) -> f64 {
    let (mut noise, mut power) = (0.0, 0.0);
    for scan in &observations.scans {
        for reading in scan.drives.iter().flat_map(|drive| &drive.readings) {
            noise += scan.scale.slope(*reading).powi(-2);
            power += reading * reading;
        }
    }
    (noise / power).sqrt()
}

/// Gaps over points kept out of the fit.
pub(super) struct HeldOut {
    pub training: Observations,
    pub kept_out: Observations,
}

impl HeldOut {
    pub fn of(observations: &Observations) -> Self {
        Self {
            training: observations.only(|_, visit| !is_held_out(visit)),
            kept_out: observations.only(|_, visit| is_held_out(visit)),
        }
    }

    /// Of the believed set-up, its gain from the training points.
    pub fn before(&self) -> f64 {
        let nuisance = as_believed(&self.training);
        gap(&self.kept_out, &expected(&self.kept_out, &Supposed::default(), &nuisance))
    }

    /// Of a fit, made anew on the training points; the spread of random departures stays what it was.
    pub fn after(&self, fit: &Fit, context: &Context) -> f64 {
        let start = Start {
            instances: fit.instances.clone(),
            values: fit.values.clone(),
            spreads: fit.spreads.clone(),
            nuisance: Some(fit.nuisance.clone()),
        };
        let few = Stopping { iterations: 4, step: 1e-2, fall: 1e-6 };
        let again = fit_again(&self.training, context, start, few);
        let supposed = again.supposed(context);
        gap(&self.kept_out, &expected(&self.kept_out, &supposed, &again.nuisance))
    }
}
