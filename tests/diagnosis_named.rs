//! Causes that are easily taken for others, in scans of vibrating pistons.

use std::f64::consts::TAU;

use fieldgap::acoustics::Vec3;
use fieldgap::diagnosis::{Diagnosis, EffectId, FittedParameter, Verdict, diagnose};
use fieldgap::virtual_rig::counter_rng::CounterRng;

mod scanned_pistons;
use scanned_pistons::{Truth, scan};

/// Far enough that the far field of a face is right to a tenth of the noise.
const HEIGHTS_MM: [f64; 4] = [80.0, 120.0, 160.0, 200.0];

fn diagnosis(truth: &Truth) -> Diagnosis {
    diagnose(&[scan(&HEIGHTS_MM, truth)], None).expect("readings enough")
}

/// Readings that are all cut at one level scatter by nothing: that is no small noise, and no saturation besides.
#[test]
fn a_scan_that_is_heavily_clipped_is_clipped_and_not_saturated() {
    let truth = Truth { received: |reading, _| reading.min(0.2), ..Truth::default() };
    let diagnosis = diagnosis(&truth);
    assert_eq!(diagnosis.effects, [EffectId::Clipping], "{}", diagnosis.sentence);
    let share = diagnosis.noise.multiplicative;
    assert!((0.5..1.5).contains(&(share / scanned_pistons::SHARE)), "{share}");
}

/// Sixteen steps in a period leave phases that differ from element to element, which is what they were taken for beside gains that do.
#[test]
fn a_drivers_steps_are_found_beside_gains_that_differ() {
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

/// Gains that differ and a drift, which are both told where they leave more than half a standard deviation.
#[test]
fn a_faint_gap_is_not_said_to_come_of_two_causes() {
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

/// Amplitudes that differ at random, and by half as much along the rows, for which another cause must be found.
#[test]
fn departures_that_have_an_order_are_not_random() {
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

/// Fringes of half a wavelength, as a wall beside the field makes them.
#[test]
fn ripples_that_no_effect_makes_are_no_noise() {
    let beside = |at_mm: &Vec3| 1.0 + 0.06 * (TAU * at_mm.x / 4.3).cos();
    let diagnosis = diagnosis(&Truth { beside, ..Truth::default() });
    assert_eq!(diagnosis.verdict, Verdict::Unexplained, "{}", diagnosis.sentence);
    assert!(diagnosis.sentence.contains("ripples across a plane"), "{}", diagnosis.sentence);
}

/// The small shift that every fit may make takes up the readings' part of it: what is left to see is that nobody sets up so badly.
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

/// A place that scatters by 0.15 mm from reading to reading is no turbulent air: it scatters readings where the field is steep, and not
/// where paths are long.
#[test]
fn a_position_that_scatters_is_not_taken_for_turbulence() {
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
