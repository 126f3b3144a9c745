//! How large the gap is: root mean square residual over that of the scan, over all readings and over some kept out of the fit.

use fieldgap_acoustics::least_squares::Stopping;

use crate::fit::joint_fit::{Fit, Start, fit as fit_again};
use crate::limits::HELD_OUT_BLOCK_M;
use crate::model::effect::Context;
use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, Visit};

/// Whether a point is kept out of the fit: one block in five.
pub(crate) fn is_held_out(visit: &Visit) -> bool {
    let block = |m: f64, side_m: f64| (m / side_m).floor() as i64;
    let [x, y] = [visit.at_m.x, visit.at_m.y].map(|m| block(m, HELD_OUT_BLOCK_M));
    (x + 2 * y + block(visit.at_m.z, 1e-3)).rem_euclid(5) == 0
}

/// Whether a reading is kept out of the fit where the places do not fall into blocks: one reading in five.
fn is_held_out_by_number(visit: &Visit) -> bool {
    visit.number % 5 == 4
}

/// Whether the blocks keep out some readings of each scan, and not most of them. Places whose step is a multiple of five blocks are all
/// kept out, or none is.
fn in_both_parts(observations: &Observations) -> bool {
    observations.scans.iter().all(|scan| {
        let visits = || scan.drives.iter().flat_map(|drive| &drive.visits);
        let held_out = visits().filter(|visit| is_held_out(visit)).count();
        held_out > 0 && 2 * held_out < visits().count()
    })
}

/// The believed set-up at the gain that fits best, and no shift.
pub(crate) fn as_believed(observations: &Observations) -> Vec<Nuisance> {
    ForwardModel::believed().best_gain(observations, 0.0)
}

/// Rms residual over rms reading.
pub(crate) fn gap(observations: &Observations, expected: &[f64]) -> f64 {
    let readings = observations.readings();
    let squares: f64 = readings.iter().zip(expected).map(|(r, e)| (r - e).powi(2)).sum();
    (squares / readings.iter().map(|r| r * r).sum::<f64>()).sqrt()
}

/// What noise and the scatter of a fit's own effects leave, in the same unit: turbulence explains a residual without predicting it.
pub(crate) fn scatter_beside(observations: &Observations, fit: &Fit, context: &Context) -> f64 {
    let model = fit.model(context);
    if !model.changes_scatter() {
        return noise_floor(observations);
    }
    let expected = model.expected_with_scatter(observations, &fit.nuisance);
    let mut expected = expected.iter();
    let (mut scatter, mut power) = (0.0, 0.0);
    for scan in &observations.scans {
        let readings = scan.drives.iter().flat_map(|drive| &drive.readings);
        for (reading, expected) in readings.zip(&mut expected) {
            let deviation = scan.scale.deviation(expected.reading);
            scatter += expected.variance_ratio * deviation * deviation;
            power += reading * reading;
        }
    }
    (scatter / power).sqrt()
}

/// What noise alone leaves, in the same unit.
pub(crate) fn noise_floor(observations: &Observations) -> f64 {
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
pub(crate) struct HeldOut {
    pub training: Observations,
    pub kept_out: Observations,
}

impl HeldOut {
    pub fn of(observations: &Observations) -> Self {
        let held_out =
            if in_both_parts(observations) { is_held_out } else { is_held_out_by_number };
        Self {
            training: observations.only(|_, visit| !held_out(visit)),
            kept_out: observations.only(|_, visit| held_out(visit)),
        }
    }

    /// Of the believed set-up, its gain from the training points.
    pub fn before(&self) -> f64 {
        let nuisance = as_believed(&self.training);
        gap(&self.kept_out, &ForwardModel::believed().expected_readings(&self.kept_out, &nuisance))
    }

    /// Of a fit, repeated on the training points with the same spread of random departures.
    pub fn after(&self, fit: &Fit, context: &Context) -> f64 {
        let start = Start {
            instances: fit.instances.clone(),
            values: fit.values.clone(),
            spreads: fit.spreads.clone(),
            nuisance: Some(fit.nuisance.clone()),
        };
        let few = Stopping { iterations: 4, step: 1e-2, fall: 1e-6 };
        let again = fit_again(&self.training, context, start, few);
        let model = again.model(context);
        gap(&self.kept_out, &model.expected_readings(&self.kept_out, &again.nuisance))
    }
}
