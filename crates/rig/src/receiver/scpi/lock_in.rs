//! The amplitude of one frequency in a record of samples.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use crate::error::{FEWEST_CYCLES, FEWEST_SAMPLES_A_CYCLE, RecordFault};

/// The peak amplitude at `frequency_hz` in samples `interval_s` apart.
///
/// The samples are multiplied by cosine and sine and summed under a Hann window, so that other frequencies leave little
/// (F. J. Harris, Proc. IEEE 66, 51, 1978). The three sums of a cosine, a sine and a constant are not independent in a record that
/// is no whole number of cycles: they are solved for together, as the least squares of the three under the window, which
/// leaves no error for a carrier on a constant, whatever the length.
pub(super) fn lock_in(
    samples: &[f64],
    interval_s: f64,
    frequency_hz: f64,
) -> Result<f64, RecordFault> {
    let samples_a_cycle = 1.0 / (frequency_hz * interval_s);
    let span_s = interval_s * samples.len() as f64;
    let cycles = span_s * frequency_hz;
    // What is no number is neither enough.
    if !(samples_a_cycle >= FEWEST_SAMPLES_A_CYCLE && samples_a_cycle.is_finite()) {
        return Err(RecordFault::TooCoarse { samples_a_cycle });
    }
    if cycles < FEWEST_CYCLES {
        return Err(RecordFault::TooShort { span_s, cycles });
    }
    let (mut products, mut sums) = (Matrix3::zeros(), Vector3::zeros());
    for (number, sample) in samples.iter().enumerate() {
        let within = (number as f64 + 0.5) / samples.len() as f64;
        let weight = (std::f64::consts::PI * within).sin().powi(2);
        let (sine, cosine) = (TAU * frequency_hz * interval_s * number as f64).sin_cos();
        let basis = Vector3::new(cosine, sine, 1.0);
        products += weight * basis * basis.transpose();
        sums += weight * *sample * basis;
    }
    let solved = products.cholesky().map(|factors| factors.solve(&sums));
    let Some(solved) = solved else {
        return Err(RecordFault::TooShort { span_s, cycles });
    };
    Ok(solved.x.hypot(solved.y))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tone(count: usize, cycles: f64, amplitude: f64, phase: f64, constant: f64) -> Vec<f64> {
        (0..count)
            .map(|n| constant + amplitude * (TAU * cycles * n as f64 / count as f64 + phase).cos())
            .collect()
    }

    proptest! {
        #[test]
        fn a_carrier_on_a_constant_is_found_exactly_in_any_length(
            count in 40usize..600, cycles in 3.0..12.0f64, amplitude in 0.0..5.0f64, phase in 0.0..TAU,
            constant in -3.0..3.0f64,
        ) {
            let interval_s = cycles / 40e3 / count as f64;
            let found = lock_in(&tone(count, cycles, amplitude, phase, constant), interval_s, 40e3);
            prop_assert!((found.expect("long and fine enough") - amplitude).abs() < 1e-9);
        }

        #[test]
        fn no_samples_make_it_panic(
            samples in prop::collection::vec(any::<f64>(), 0..50), interval_s: f64,
        ) {
            let _ = lock_in(&samples, interval_s, 40e3);
        }
    }

    #[test]
    fn what_is_at_other_frequencies_is_left_out() {
        // A mains hum under the window and a harmonic, each as strong as the carrier, in 24.3 cycles.
        let count = 1200;
        let mut samples = tone(count, 24.3, 1.0, 0.4, 0.0);
        for (sample, other) in samples.iter_mut().zip(tone(count, 24.3 * 3.0, 1.0, 1.0, 0.0)) {
            *sample += other;
        }
        for (sample, other) in samples.iter_mut().zip(tone(count, 0.03, 1.0, 1.0, 0.0)) {
            *sample += other;
        }
        let found = lock_in(&samples, 24.3 / 40e3 / count as f64, 40e3).expect("long enough");
        assert!((found - 1.0).abs() < 1e-3, "{found}");
    }

    #[test]
    fn quantisation_to_eight_bits_hardly_matters() {
        let samples: Vec<f64> = tone(1200, 24.0, 1.0, 0.3, 0.0)
            .into_iter()
            .map(|value| (value * 100.0).round() / 100.0)
            .collect();
        let found = lock_in(&samples, 24.0 / 40e3 / 1200.0, 40e3).expect("long enough");
        assert!((found - 1.0).abs() < 1e-3, "{found}");
    }

    #[test]
    fn a_record_that_cannot_show_the_carrier_is_refused() {
        let short = lock_in(&[0.0; 100], 0.5e-6, 40e3).expect_err("two cycles");
        assert_eq!(
            short.to_string(),
            "the record of 50.0 µs holds 2.0 cycles of the carrier; at least 3 are needed"
        );
        let coarse = lock_in(&[0.0; 100], 12.5e-6, 40e3).expect_err("two samples a cycle");
        assert!(matches!(coarse, RecordFault::TooCoarse { .. }));
        assert!(lock_in(&[], 1e-6, 40e3).is_err());
        assert!(lock_in(&[0.0; 100], f64::NAN, 40e3).is_err());
        assert!(lock_in(&[0.0; 100], 0.0, 40e3).is_err());
    }

    #[test]
    fn a_number_that_is_too_small_does_not_read_like_the_one_that_is_needed() {
        let fault = RecordFault::TooShort { span_s: 74e-6, cycles: 2.97 };
        assert!(fault.to_string().contains("holds 2.9 cycles"), "{fault}");
    }
}
