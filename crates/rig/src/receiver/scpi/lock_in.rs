//! The complex amplitude of one frequency in a record of samples.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use num_complex::Complex64;

use crate::error::{FEWEST_CYCLES, FEWEST_SAMPLES_A_CYCLE, RecordFault};

/// Least amplitude of a sync, in steps of its converter: below, rounding alone turns its phase by a tenth of a radian in a short record. Set by
/// judgement.
const LEAST_SYNC_STEPS: f64 = 8.0;

/// Least amplitude of a sync over the rms of the rest of its record. That of a square wave is 2.9, that of pulses a quarter of a cycle long 1.5; noise has
/// less than a half.
const LEAST_SYNC_SHARE: f64 = 1.0;

/// A carrier in a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Carrier {
    /// Its peak amplitude, and its phase at the first sample in the convention exp(-iωt).
    pub amplitude: Complex64,
    /// Rms of what is left beside carrier and constant, under the same window.
    pub rest_rms: f64,
}

impl Carrier {
    /// This carrier against a sync of the same record, whose converter has steps of `step`.
    ///
    /// Both phases are those at the first sample, so that their difference depends neither on when the record began nor, to first order, on the
    /// frequency that was assumed: both are off alike in the middle of the window.
    pub(super) fn against(self, sync: Self, step: f64) -> Result<Complex64, RecordFault> {
        let size = sync.amplitude.norm();
        let (steps, share) = (size / step, size / sync.rest_rms.max(f64::MIN_POSITIVE));
        // What is no number is not enough.
        if !(steps >= LEAST_SYNC_STEPS && share >= LEAST_SYNC_SHARE) {
            return Err(RecordFault::NoSync { steps, share });
        }
        Ok(self.amplitude * sync.amplitude.conj() / size)
    }
}

/// The carrier at `frequency_hz` in samples `interval_s` apart.
///
/// The samples are multiplied by cosine and sine and summed under a Hann window, so that other frequencies leave little
/// (F. J. Harris, Proc. IEEE 66, 51, 1978). The three sums of a cosine, a sine and a constant are not independent in a record that
/// is no whole number of cycles: they are solved for together, as the least squares of the three under the window, which
/// leaves no error for a carrier on a constant, whatever the length.
pub(super) fn lock_in(
    samples: &[f64],
    interval_s: f64,
    frequency_hz: f64,
) -> Result<Carrier, RecordFault> {
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
    let terms = |number: usize| {
        let within = (number as f64 + 0.5) / samples.len() as f64;
        let weight = (std::f64::consts::PI * within).sin().powi(2);
        let (sine, cosine) = (TAU * frequency_hz * interval_s * number as f64).sin_cos();
        (weight, Vector3::new(cosine, sine, 1.0))
    };
    for (number, sample) in samples.iter().enumerate() {
        let (weight, basis) = terms(number);
        products += weight * basis * basis.transpose();
        sums += weight * *sample * basis;
    }
    let solved = products.cholesky().map(|factors| factors.solve(&sums));
    let Some(solved) = solved else {
        return Err(RecordFault::TooShort { span_s, cycles });
    };
    let (mut squares, mut weights) = (0.0, 0.0);
    for (number, sample) in samples.iter().enumerate() {
        let (weight, basis) = terms(number);
        squares += weight * (sample - solved.dot(&basis)).powi(2);
        weights += weight;
    }
    // x cos ωt + y sin ωt is the real part of (x + iy) exp(-iωt).
    let amplitude = Complex64::new(solved.x, solved.y);
    Ok(Carrier { amplitude, rest_rms: (squares / weights).sqrt() })
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
            let found = found.expect("long and fine enough");
            // cos(ωt + φ) is the real part of exp(-iφ) exp(-iωt).
            prop_assert!((found.amplitude - Complex64::from_polar(amplitude, -phase)).norm() < 1e-9);
            prop_assert!(found.rest_rms < 1e-9);
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
        let found = lock_in(&samples, 24.3 / 40e3 / count as f64, 40e3)
            .expect("long enough")
            .amplitude
            .norm();
        assert!((found - 1.0).abs() < 1e-3, "{found}");
    }

    #[test]
    fn quantisation_to_eight_bits_hardly_matters() {
        let samples: Vec<f64> = tone(1200, 24.0, 1.0, 0.3, 0.0)
            .into_iter()
            .map(|value| (value * 100.0).round() / 100.0)
            .collect();
        let found =
            lock_in(&samples, 24.0 / 40e3 / 1200.0, 40e3).expect("long enough").amplitude.norm();
        assert!((found - 1.0).abs() < 1e-3, "{found}");
    }

    /// A square wave whose edges take a twentieth of a cycle: its harmonics are left out, also in a record of 13.3 cycles and with a frequency that is
    /// 0.1 % off.
    #[test]
    fn a_phase_is_told_against_a_square_wave_whatever_the_start_of_the_record() {
        for start in [0.0, 0.3, 0.77] {
            for off in [1.0, 1.001] {
                let cycle = |n: usize| off * 40e3 * 0.2e-6 * n as f64 + start;
                let of = |wave: &dyn Fn(f64) -> f64| {
                    let samples: Vec<f64> = (0..1665).map(|n| wave(cycle(n))).collect();
                    lock_in(&samples, 0.2e-6, 40e3).expect("long enough")
                };
                let square = of(&|cycle| (6.0 * (TAU * cycle).cos()).clamp(-1.0, 1.0) + 0.5);
                let signal = of(&|cycle| 0.3 * (TAU * cycle - 1.2).cos());
                let found = signal.against(square, 0.01).expect("a sync");
                assert!((found - Complex64::from_polar(0.3, 1.2)).norm() < 1e-3, "{start} {found}");
            }
        }
    }

    #[test]
    fn a_sync_that_is_none_is_refused() {
        let carrier = |amplitude: f64, rest_rms: f64| Carrier {
            amplitude: Complex64::new(0.0, amplitude),
            rest_rms,
        };
        let signal = carrier(0.5, 0.0);
        assert!(signal.against(carrier(2.0, 0.7), 0.04).is_ok());
        for (sync, step) in [
            (carrier(0.0, 0.0), 0.04),
            (carrier(0.3, 0.0), 0.04),
            (carrier(2.0, 2.1), 0.04),
            (carrier(f64::NAN, 0.0), 0.04),
        ] {
            let refused = signal.against(sync, step);
            assert!(matches!(refused, Err(RecordFault::NoSync { .. })), "{sync:?}");
        }
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
