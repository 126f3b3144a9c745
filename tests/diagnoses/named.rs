//! Causes that resemble others, in scans of vibrating pistons.

use std::f64::consts::TAU;

use fieldgap::acoustics::Vec3;
use fieldgap::diagnosis::{Diagnosis, EffectId, FittedParameter, Verdict, diagnose};
use fieldgap::virtual_rig::counter_rng::CounterRng;

use crate::scanned_pistons::{Truth, scan};

/// Distance at which the far-field error of a face is a tenth of the noise.
const HEIGHTS_MM: [f64; 4] = [80.0, 120.0, 160.0, 200.0];

fn diagnosis(truth: &Truth) -> Diagnosis {
    diagnose(&[scan(&HEIGHTS_MM, truth)], None).expect("readings enough")
}

/// Readings clipped at one level do not scatter. This is not low noise, nor an additional saturation.
#[test]
fn heavy_clipping_is_not_taken_for_saturation() {
    let truth = Truth { received: |reading, _| reading.min(0.2), ..Truth::default() };
    let diagnosis = diagnosis(&truth);
    assert_eq!(diagnosis.effects, [EffectId::Clipping], "{}", diagnosis.sentence);
    let share = diagnosis.noise.multiplicative;
    assert!((0.5..1.5).contains(&(share / crate::scanned_pistons::SHARE)), "{share}");
}

/// Sixteen steps per period give phase deviations of the elements, for which they were taken beside gain deviations.
#[test]
fn phase_quantisation_is_found_beside_gain_deviations() {
    let truth = Truth {
        gain: |n| 1.0 + 0.15 * (2.4 * n as f64 * n as f64).sin(),
        driven: |phase_rad| (phase_rad / (TAU / 16.0)).round() * (TAU / 16.0),
        ..Truth::default()
    };
    let mut diagnosis = diagnosis(&truth);
    diagnosis.effects.sort_unstable();
    assert_eq!(
        diagnosis.effects,
        [EffectId::ElementGain, EffectId::PhaseQuantisation],
        "{}",
        diagnosis.sentence
    );
}

/// Gain deviations and a drift; both are named if the gap exceeds half a standard deviation.
#[test]
fn a_faint_gap_is_not_attributed_to_two_causes() {
    fn gain<const PERCENT: u32>(n: usize) -> f64 {
        1.0 + 0.01 * f64::from(PERCENT) * (2.4 * n as f64 * n as f64).sin()
    }
    fn drifting<const PERCENT: u32>(reading: f64, progress: f64) -> f64 {
        reading * (1.0 + 0.01 * f64::from(PERCENT) * progress)
    }
    let plain = diagnosis(&Truth { gain: gain::<6>, received: drifting::<6>, ..Truth::default() });
    assert_eq!(plain.effects, [EffectId::ElementGain, EffectId::GainDrift], "{}", plain.sentence);
    let faint = diagnosis(&Truth { gain: gain::<3>, received: drifting::<3>, ..Truth::default() });
    assert_eq!(
        faint.ranked[0].effects,
        [EffectId::ElementGain, EffectId::GainDrift],
        "{}",
        faint.sentence
    );
    assert_eq!(faint.verdict, Verdict::Unexplained, "{}", faint.sentence);
    assert!(faint.sentence.contains("so faint a gap"), "{}", faint.sentence);
}

/// Random amplitude deviations, and half as large ones along the rows, which need another cause.
#[test]
fn ordered_deviations_are_not_taken_for_random_ones() {
    let random = |n: usize| 1.0 + 0.05 * (2.4 * n as f64 * n as f64).sin();
    let plain = diagnosis(&Truth { gain: random, ..Truth::default() });
    assert_eq!(plain.effects, [EffectId::ElementGain], "{}", plain.sentence);
    let gain = |n: usize| {
        1.0 + 0.05 * (2.4 * n as f64 * n as f64).sin() + 0.0225 * ((n % 6) as f64 - 2.5) / 2.5
    };
    let graded = diagnosis(&Truth { gain, ..Truth::default() });
    assert_eq!(graded.ranked[0].effects, [EffectId::ElementGain], "{}", graded.sentence);
    assert_eq!(graded.verdict, Verdict::Unexplained, "{}", graded.sentence);
}

/// Fringes of half a wavelength, as from a wall beside the field.
#[test]
fn unexplained_ripples_are_not_taken_for_noise() {
    let beside = |at_mm: &Vec3| 1.0 + 0.06 * (TAU * at_mm.x / 4.3).cos();
    let diagnosis = diagnosis(&Truth { beside, ..Truth::default() });
    assert_eq!(diagnosis.verdict, Verdict::Unexplained, "{}", diagnosis.sentence);
    assert!(diagnosis.sentence.contains("ripples across a plane"), "{}", diagnosis.sentence);
}

/// The small shift of every fit absorbs the offset; only its improbable size reveals it.
#[test]
fn an_offset_is_found_beside_another_cause() {
    let truth = Truth {
        stands_mm: |_, at_mm| at_mm + Vec3::new(0.6, -0.5, 0.0),
        received: |reading, progress| reading * (1.0 - 0.1 * progress),
        ..Truth::default()
    };
    let mut diagnosis = diagnosis(&truth);
    diagnosis.effects.sort_unstable();
    assert_eq!(
        diagnosis.effects,
        [EffectId::Offset, EffectId::GainDrift],
        "{}",
        diagnosis.sentence
    );
}

/// A position jitter of 0.15 mm differs from turbulence: it scatters the readings where the field is steep, not where paths are
/// long.
#[test]
fn position_jitter_is_not_taken_for_turbulence() {
    let stands_mm = |number: usize, at_mm: &Vec3| {
        let (rng, first) = (CounterRng::new(11), 3 * number as u64);
        at_mm + 0.15 * Vec3::new(rng.normal(first), rng.normal(first + 1), rng.normal(first + 2))
    };
    let diagnosis = diagnosis(&Truth { stands_mm, ..Truth::default() });
    assert_eq!(diagnosis.effects, [EffectId::PositionJitter], "{}", diagnosis.sentence);
    for axis in ["x_mm", "y_mm"] {
        let found = &diagnosis.ranked[0].parameters[&format!("position-jitter.{axis}")];
        let FittedParameter::Real { value, .. } = found else { panic!("{found:?}") };
        assert!((0.12..0.18).contains(value), "{axis}: {value}");
    }
}
