//! Envelopes compared with analytic spectra.

use num_complex::Complex64;
use proptest::prelude::*;

use super::*;

fn am(frequency_hz: f64, depth: f64, waveform: Waveform, of: Of) -> Modulation {
    Modulation::Am(Am {
        frequency_hz: Rate::new(frequency_hz).expect("above zero"),
        depth: Fraction::new(depth).expect("in range"),
        waveform,
        of,
    })
}

/// Amplitude of a harmonic of the levels to a power, for a loop of one cycle.
fn harmonic(envelope: &Envelope, power: i32, harmonic: usize) -> f64 {
    let levels = envelope.levels();
    let sum: Complex64 = levels
        .iter()
        .enumerate()
        .map(|(n, &level)| {
            let turns = harmonic as f64 * (n as f64 + 0.5) / levels.len() as f64;
            (f64::from(level) / 255.0).powi(power)
                * Complex64::from_polar(1.0, -std::f64::consts::TAU * turns)
        })
        .sum();
    let scale = if harmonic == 0 { 1.0 } else { 2.0 };
    scale * sum.norm() / levels.len() as f64
}

proptest! {
    #[test]
    fn any_frequency_is_approximated(frequency_hz in prop_oneof![0.2..20.0f64, 20.0..1500.0f64]) {
        let modulation = am(frequency_hz, 1.0, Waveform::Sine, Of::Pressure);
        let achieved = modulation.achieved_hz(40e3, 4096).expect("slow enough");
        prop_assert!((achieved / frequency_hz - 1.0).abs() < 2e-4, "{} for {}", achieved, frequency_hz);
        let envelope = modulation.envelope(40e3, 4096).expect("slow enough");
        prop_assert!(envelope.levels().len() <= 4096);
        // The upward crossings of the mean in a loop give the same frequency.
        let above: Vec<bool> = envelope.levels().iter().map(|&level| level > 127).collect();
        let rises = above.iter().zip(above.iter().cycle().skip(1)).filter(|(a, b)| !**a && **b).count();
        let counted = rises as f64 * 40e3 / envelope.loop_periods() as f64;
        prop_assert!((counted / achieved - 1.0).abs() < 1e-9, "{} {}", counted, achieved);
    }

    #[test]
    fn am_has_the_analytic_spectrum(depth in 0.0..1.0f64) {
        // (1 + m sin)/(1 + m): mean 1/(1 + m) and m/(1 + m) at the frequency: side bands of m/2 of the carrier.
        let envelope = am(200.0, depth, Waveform::Sine, Of::Pressure).envelope(40e3, 4096).expect("slow");
        prop_assert_eq!(envelope.loop_periods(), 200);
        prop_assert!((harmonic(&envelope, 1, 0) - 1.0 / (1.0 + depth)).abs() < 2e-3);
        prop_assert!((harmonic(&envelope, 1, 1) - depth / (1.0 + depth)).abs() < 2e-3);
        prop_assert!(harmonic(&envelope, 1, 2) < 2e-3);
        // The force is proportional to the square: 2 m and m²/2, over (1 + m)².
        let scale = (1.0 + depth).powi(2);
        prop_assert!((harmonic(&envelope, 2, 1) - 2.0 * depth / scale).abs() < 3e-3);
        prop_assert!((harmonic(&envelope, 2, 2) - 0.5 * depth * depth / scale).abs() < 3e-3);
    }

    #[test]
    fn am_of_the_force_has_no_second_harmonic_in_the_force(depth in 0.0..1.0f64) {
        let envelope = am(200.0, depth, Waveform::Sine, Of::Force).envelope(40e3, 4096).expect("slow");
        prop_assert!((harmonic(&envelope, 2, 1) - depth / (1.0 + depth)).abs() < 3e-3);
        prop_assert!(harmonic(&envelope, 2, 2) < 3e-3);
    }

    #[test]
    fn pwm_has_the_analytic_spectrum(percent in 1u32..100) {
        let duty = f64::from(percent) / 100.0;
        let pwm = Modulation::Pwm(Pwm {
            frequency_hz: Rate::new(200.0).expect("above zero"),
            duty_percent: Percent::try_from(f64::from(percent)).expect("in range"),
        });
        let envelope = pwm.envelope(40e3, 4096).expect("slow");
        prop_assert!((harmonic(&envelope, 1, 0) - duty).abs() < 1e-9);
        for n in 1..5usize {
            let expected = 2.0 / (std::f64::consts::PI * n as f64) * (std::f64::consts::PI * n as f64 * duty).sin().abs();
            prop_assert!((harmonic(&envelope, 1, n) - expected).abs() < 1e-3, "{}", n);
        }
    }
}

#[test]
fn waveforms_have_the_harmonics_of_their_fourier_series() {
    let pi = std::f64::consts::PI;
    // At full depth (1 + w)/2 halves the harmonics of w.
    for (waveform, series) in [
        (Waveform::Square, [4.0 / pi, 0.0, 4.0 / (3.0 * pi)]),
        (Waveform::Triangle, [8.0 / (pi * pi), 0.0, 8.0 / (9.0 * pi * pi)]),
        (Waveform::Sawtooth, [2.0 / pi, 1.0 / pi, 2.0 / (3.0 * pi)]),
    ] {
        let envelope = am(100.0, 1.0, waveform, Of::Pressure).envelope(40e3, 4096).expect("slow");
        for (n, value) in series.into_iter().enumerate() {
            let computed = harmonic(&envelope, 1, n + 1);
            assert!((computed - value / 2.0).abs() < 2e-3, "{waveform:?} {}: {computed}", n + 1);
        }
    }
}

#[test]
fn too_fast_modulations_are_refused() {
    let fast = am(10e3, 1.0, Waveform::Sine, Of::Pressure).envelope(40e3, 4096);
    insta::assert_snapshot!(fast.expect_err("four periods"));
}

#[test]
fn movements_have_a_constant_amplitude() {
    let frequency_hz = Rate::new(200.0).expect("above zero");
    let modulation = Modulation::Spatiotemporal(Spatiotemporal { frequency_hz });
    assert_eq!(modulation.envelope(40e3, 4096), Ok(Envelope::continuous()));
}

fn fm(frequency_hz: f64, deviation_hz: f64, sweep_hz: f64) -> Modulation {
    let rate = |value| Rate::new(value).expect("above zero");
    Modulation::Fm(Fm {
        frequency_hz: rate(frequency_hz),
        deviation_hz: rate(deviation_hz),
        sweep_hz: rate(sweep_hz),
        depth: Fraction::new(1.0).expect("in range"),
        waveform: Waveform::Sine,
    })
}

proptest! {
    #[test]
    fn fm_lines_have_bessel_amplitudes(index in 0.1..3.0f64) {
        // (1 + sin)/2 at 200 Hz, 25 sweeps a second: 8 cycles in a loop, lines at 8 + n of J_n(index)/2.
        let envelope = fm(200.0, 25.0 * index, 25.0).envelope(40e3, 4096).expect("slow");
        prop_assert_eq!(envelope.loop_periods(), 1600);
        for n in 0..4i32 {
            let expected = 0.5 * libm::jn(n, index).abs();
            for line in [8 - n, 8 + n] {
                let computed = harmonic(&envelope, 1, line as usize);
                prop_assert!((computed - expected).abs() < 3e-3, "{} of {}: {} {}", line, index, computed, expected);
            }
        }
    }

    #[test]
    fn fm_keeps_the_mean_frequency_and_rounds_the_sweep(
        frequency in 20.0..800.0f64, sweep in 0.5..20.0f64, share in 0.01..0.9f64,
    ) {
        let modulation = fm(frequency, share * frequency, sweep);
        // A slow sweep of a high frequency has too few levels per cycle and is refused.
        if let Ok(achieved) = modulation.achieved_hz(40e3, 4096) {
            prop_assert!((achieved / frequency - 1.0).abs() < 2e-3, "{} for {}", achieved, frequency);
        }
    }
}

#[test]
fn sweeps_to_zero_or_shorter_than_a_cycle_are_refused() {
    for (deviation, sweep) in [(200.0, 5.0), (50.0, 500.0)] {
        let refused = fm(200.0, deviation, sweep).envelope(40e3, 4096).expect_err("no such rate");
        assert!(matches!(refused, DisplayError::Sweep { .. }), "{refused}");
    }
    let refused = fm(700.0, 200.0, 0.5).envelope(40e3, 4096).expect_err("four levels to a cycle");
    assert!(matches!(refused, DisplayError::TooFast { .. }), "{refused}");
}
