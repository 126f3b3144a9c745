//! Whether the steps of the converter are too coarse for the noise to hide their rounding errors.

use crate::limits::{FEWEST_FOR_STEPS, LAST_DIGIT, MISSED_STEP};
use crate::model::observations::Observations;

/// Readings in steps.
pub(crate) struct ConverterSteps {
    /// The coarsest step, in the readings' unit.
    pub step: f64,
    /// Root mean square of the rounding errors, in standard deviations of the readings they are in.
    pub rounding: f64,
}

impl ConverterSteps {
    /// The step of the readings; `None` if they have none.
    pub fn of(observations: &Observations) -> Option<Self> {
        let (mut sum, mut count, mut coarsest) = (0.0, 0.0, 0.0);
        for scan in &observations.scans {
            let readings = scan.drives.iter().flat_map(|drive| drive.readings.iter().copied());
            let last_digit = LAST_DIGIT * scan.scale.deviation(0.0);
            let step = step(readings.collect(), last_digit).unwrap_or(0.0);
            coarsest = step.max(coarsest);
            for reading in scan.drives.iter().flat_map(|drive| &drive.readings) {
                // Rounding errors spread evenly over one step.
                sum += (step * scan.scale.slope(*reading)).powi(2) / 12.0;
                count += 1.0;
            }
        }
        (coarsest > 0.0).then(|| Self { step: coarsest, rounding: f64::sqrt(sum / count) })
    }
}

/// The step of which all differences between readings are multiples, in their unit; differences below `last_digit` are ignored.
fn step(mut readings: Vec<f64>, last_digit: f64) -> Option<f64> {
    readings.sort_by(f64::total_cmp);
    let first = *readings.first()?;
    let apart = readings.windows(2).map(|pair| pair[1] - pair[0]);
    let mut step = apart.filter(|apart| *apart > last_digit).fold(f64::INFINITY, f64::min);
    if readings.len() < FEWEST_FOR_STEPS || !step.is_finite() {
        return None;
    }
    for beyond in readings.iter().map(|reading| reading - first) {
        let steps = (beyond / step).round();
        if (beyond / step - steps).abs() > MISSED_STEP {
            return None;
        }
        if steps > 0.0 {
            // The relative error of the last digit falls with the distance.
            step = beyond / steps;
        }
    }
    Some(step)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_step_is_found_behind_the_records_last_digit(
            size in 1e-4..1.0f64,
            offset in -1.0..1.0f64,
            counts in prop::collection::vec(0u32..2000, 200..400),
        ) {
            prop_assume!((1..1000).any(|n| counts.contains(&n) && counts.contains(&(n + 1))));
            let digit = 1e-3 * size;
            let rounded = |v: f64| (v / digit).round() * digit;
            let readings = counts.iter().map(|n| rounded(offset + size * f64::from(*n))).collect();
            let found = step(readings, 5.0 * digit).expect("in steps");
            prop_assert!((found / size - 1.0).abs() < 1e-4, "{found} of {size}");
        }

        #[test]
        fn readings_that_are_anywhere_are_in_no_steps(
            readings in prop::collection::vec(0.0..1.0f64, 200..400),
        ) {
            prop_assert_eq!(step(readings, 1e-6), None);
        }
    }
}
