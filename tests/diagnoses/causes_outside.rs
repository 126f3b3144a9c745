//! Faint causes outside the catalogue, or outside a catalogue that lacks them, in scans of vibrating pistons: the verdict is `unexplained`, and the residual
//! tests localise the cause.

use std::f64::consts::TAU;

use fieldgap::acoustics::Vec3;
use fieldgap::diagnosis::{
    Diagnosis, EffectId, FittedParameter, Options, ResidualTest, Verdict, diagnose, diagnose_with,
};

use crate::scanned_pistons::{Truth, scan};

const HEIGHTS_MM: [f64; 4] = [80.0, 120.0, 160.0, 200.0];

/// A diagnosis that must be unexplained, with the residual test of this name.
fn found(name: &str, truth: &Truth) -> (ResidualTest, Diagnosis) {
    found_without(None, name, truth)
}

/// The same with a catalogue that lacks an effect.
fn found_without(
    lacking: Option<EffectId>,
    name: &str,
    truth: &Truth,
) -> (ResidualTest, Diagnosis) {
    let effects = EffectId::ALL.iter().copied().filter(|effect| Some(*effect) != lacking);
    // (That many causes act at once is not in question here.)
    let options =
        Options { effects: Some(effects.collect()), few_causes: true, ..Options::default() };
    let scan = scan(&HEIGHTS_MM, truth);
    let diagnosis = diagnose_with(&[scan], &options).expect("readings enough");
    assert_eq!(diagnosis.verdict, Verdict::Unexplained, "{}", diagnosis.sentence);
    assert!(diagnosis.sentence.contains(name), "{}", diagnosis.sentence);
    let test = diagnosis.residual_tests.iter().find(|test| test.name == name).expect("tested");
    (test.clone(), diagnosis)
}

/// The whole catalogue names an effect as the cause.
fn named(effect: EffectId, truth: &Truth) -> Diagnosis {
    let diagnosis = diagnose(&[scan(&HEIGHTS_MM, truth)], None).expect("readings enough");
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{}", diagnosis.sentence);
    assert_eq!(diagnosis.effects, [effect], "{}", diagnosis.sentence);
    diagnosis
}

fn real(diagnosis: &Diagnosis, name: &str) -> f64 {
    match diagnosis.ranked[0].parameters.get(name) {
        Some(FittedParameter::Real { value, .. }) => *value,
        other => panic!("{name}: {other:?}"),
    }
}

/// The numbers in the indication of a residual test.
fn numbers(test: &ResidualTest) -> Vec<f64> {
    let sign = test.sign_of.as_deref().expect("a sign");
    let parts = sign.split(|c: char| !(c.is_ascii_digit() || matches!(c, '-' | '.' | 'e')));
    parts.filter_map(|part| part.parse().ok()).collect()
}

#[test]
fn a_scattering_object_is_localised() {
    let at_mm = Vec3::new(-12.0, 9.0, 55.0);
    let truth = Truth { scatterer: Some((at_mm, 1.5)), ..Truth::default() };
    let (test, diagnosis) =
        found_without(Some(EffectId::Scatterer), "a wave from elsewhere", &truth);
    let [x, y, z] = numbers(&test)[..] else { panic!("{test:?}") };
    let beside_mm = (Vec3::new(x, y, z) - at_mm).norm();
    assert!(beside_mm < 6.0, "{}: {beside_mm} mm beside", diagnosis.sentence);
    let patterns = ["neighbours alike", "slow patterns across a plane", "planes off as a whole"];
    let others = diagnosis.residual_tests.iter().filter(|test| patterns.contains(&test.name));
    others.for_each(|test| assert!(test.z < 4.0, "not faint: {test:?}"));
    // This object scatters alike to all sides, and a ball does not: its place is right to a wavelength.
    let named = named(EffectId::Scatterer, &truth);
    let [x, y, z] = ["x", "y", "z"].map(|axis| real(&named, &format!("scatterer.{axis}_mm")));
    let beside_mm = (Vec3::new(x, y, z) - at_mm).norm();
    assert!(beside_mm < 10.0, "{}: {beside_mm} mm beside", named.sentence);
}

#[test]
fn an_eccentric_lead_screw_is_identified_by_its_lead() {
    let stands_mm = |_, at_mm: &Vec3| at_mm + Vec3::y() * 0.15 * (TAU * at_mm.y / 8.0).sin();
    let truth = Truth { stands_mm, ..Truth::default() };
    let (test, _) = found_without(Some(EffectId::LeadScrew), "a screw that is out of true", &truth);
    assert!(test.sign_of.as_deref().is_some_and(|sign| sign.starts_with("of y, ")), "{test:?}");
    assert!((numbers(&test)[0] - 8.0).abs() < 0.5, "{test:?}");
    let named = named(EffectId::LeadScrew, &truth);
    let [lead_mm, amplitude_mm] =
        ["lead-screw.lead_mm", "lead-screw.amplitude_mm"].map(|name| real(&named, name));
    assert!((lead_mm - 8.0).abs() < 0.2, "{lead_mm}");
    assert!((amplitude_mm - 0.15).abs() < 0.03, "{amplitude_mm}");
}

/// A linear drift explains three quarters of a step.
#[test]
fn a_gain_step_is_distinguished_from_drift() {
    let received = |reading: f64, progress: f64| reading * if progress > 0.4 { 1.015 } else { 1.0 };
    let (test, diagnosis) =
        found("a set-up that changes on the way", &Truth { received, ..Truth::default() });
    assert!(test.sign_of.as_deref().is_some_and(|sign| sign.contains("gain")), "{test:?}");
    assert_eq!(diagnosis.ranked[0].effects, [EffectId::GainDrift], "{}", diagnosis.sentence);
    let drifting = |reading: f64, progress: f64| reading * (1.0 + 0.015 * progress);
    let drifting = Truth { received: drifting, ..Truth::default() };
    let plain = diagnose(&[scan(&HEIGHTS_MM, &drifting)], None).expect("readings enough");
    assert_eq!(plain.effects, [EffectId::GainDrift], "{}", plain.sentence);
}

/// Phases quadratic in the distance from the centre move the focus almost like a scale error of the axes.
#[test]
fn a_bowed_board_is_distinguished_from_an_axis_scale() {
    let turned_rad = |n: usize| {
        let [x, y] = [n % 6, n / 6].map(|place| place as f64 - 2.5);
        0.008 * (x * x + y * y - 35.0 / 6.0)
    };
    let truth = Truth { turned_rad, ..Truth::default() };
    found_without(Some(EffectId::BowedArray), "elements graded across the array", &truth);
    named(EffectId::BowedArray, &truth);
}

#[test]
fn converter_steps_wider_than_the_noise_are_detected() {
    let steps = |reading: f64, _| (reading / 0.006).round() * 0.006;
    let (test, diagnosis) =
        found("readings in steps", &Truth { received: steps, ..Truth::default() });
    assert!((numbers(&test)[0] / 0.006 - 1.0).abs() < 0.01, "{test:?}");
    assert!(diagnosis.ranked[0].effects.is_empty(), "{}", diagnosis.sentence);
    // Rounding errors of steps finer than the noise are one more part of it.
    let finer = |reading: f64, _| (reading / 0.003).round() * 0.003;
    let finer = Truth { received: finer, ..Truth::default() };
    let finer = diagnose(&[scan(&HEIGHTS_MM, &finer)], None).expect("readings enough");
    assert_eq!(finer.verdict, Verdict::None, "{}", finer.sentence);
}
