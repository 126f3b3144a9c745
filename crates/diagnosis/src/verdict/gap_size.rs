//! How large the gap is: root mean square residual over that of the scan, over some readings.

use crate::fit::joint_fit::Fit;
use crate::model::effect::Context;
use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;

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

/// The gap and its standard error, by the delta method: the readings are taken as drawn at random, each with a residual of its own.
pub(crate) fn gap_with_error(observations: &Observations, expected: &[f64]) -> (f64, f64) {
    let gap = gap(observations, expected);
    let readings = observations.readings();
    // The gap is the ratio g of two sums, Σd² = g² Σr². Its error is that of the sum of the terms d² - g² r², whose mean is zero.
    let terms = readings.iter().zip(expected).map(|(r, e)| (r - e).powi(2) - (gap * r).powi(2));
    let scatter: f64 = terms.map(|term| term * term).sum();
    let power: f64 = readings.iter().map(|r| r * r).sum();
    let n = readings.len().max(2) as f64;
    let error = (scatter * n / (n - 1.0)).sqrt() / (2.0 * gap * power);
    (gap, if gap > 0.0 { error } else { 0.0 })
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
        let drives = scan.drives.iter();
        let readings = drives.flat_map(|drive| drive.readings.iter().zip(&drive.visits));
        for ((reading, visit), expected) in readings.zip(&mut expected) {
            let deviation = scan.scale.deviation(expected.reading);
            scatter += visit.variance * expected.variance_ratio * deviation * deviation;
            scatter += (scan.scatter.slow_share() * reading).powi(2);
            power += reading * reading;
        }
    }
    (scatter / power).sqrt()
}

/// What noise alone leaves, in the same unit.
pub(crate) fn noise_floor(observations: &Observations) -> f64 {
    let (mut noise, mut power) = (0.0, 0.0);
    for scan in &observations.scans {
        let drives = scan.drives.iter();
        for (reading, visit) in drives.flat_map(|drive| drive.readings.iter().zip(&drive.visits)) {
            noise += visit.variance * scan.noise_variance(*reading);
            power += reading * reading;
        }
    }
    (noise / power).sqrt()
}
