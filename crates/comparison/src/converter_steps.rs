//! Readings in the steps of a converter, counted from zero.
//!
//! A reading that was rounded to a step says only between which limits it lies. Where noise is no larger than a step, a density at the rounded value tells a
//! scatter that is not there.

/// Share of a step by which a reading may miss a whole number of them: records state a step to some digits only.
const MISSED: f64 = 0.1;

/// The step of which all readings are multiples; `None` where they are in no steps.
pub(crate) fn step_from_zero(readings: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = readings.iter().map(|reading| reading.abs()).collect();
    sorted.push(0.0);
    sorted.sort_by(f64::total_cmp);
    let apart = sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|apart| *apart > 0.0);
    let mut step = apart.fold(f64::INFINITY, f64::min);
    for reading in sorted {
        let steps = (reading / step).round();
        // The least distance may be off by the last digit of the record, which the distance from zero divides.
        if (reading / step - steps).abs() > MISSED {
            return None;
        }
        if steps > 0.0 {
            step = reading / steps;
        }
    }
    step.is_finite().then_some(step)
}

/// Squares of the least and the largest level that are rounded to a reading.
pub(crate) fn powers_rounded_to(reading: f64, step: f64) -> [f64; 2] {
    [-0.5, 0.5].map(|beside: f64| (reading + beside * step).max(0.0).powi(2))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_step_is_found_behind_the_last_digit_of_a_record(
            size in 1e-3..1.0f64, counts in prop::collection::vec(0u32..40, 8..40),
        ) {
            prop_assume!((0..40).any(|n| (n == 0 || counts.contains(&n)) && counts.contains(&(n + 1))));
            let rounded = |v: f64| (v * 1e6).round() * 1e-6;
            let readings: Vec<f64> = counts.iter().map(|n| rounded(size * f64::from(*n))).collect();
            let found = step_from_zero(&readings).expect("in steps");
            prop_assert!((found / size - 1.0).abs() < 1e-3, "{found} of {size}");
        }

        #[test]
        fn readings_that_are_anywhere_are_in_no_steps(
            readings in prop::collection::vec(0.5..1.0f64, 12..40),
        ) {
            prop_assert_eq!(step_from_zero(&readings), None);
        }
    }

    #[test]
    fn silence_without_any_reading_above_zero_has_no_step() {
        assert_eq!(step_from_zero(&[0.0; 10]), None);
        assert_eq!(powers_rounded_to(0.5, 0.25), [0.375f64.powi(2), 0.625f64.powi(2)]);
        assert_eq!(powers_rounded_to(0.0, 0.25), [0.0, 0.125f64.powi(2)]);
    }
}
