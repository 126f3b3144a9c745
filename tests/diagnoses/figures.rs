//! The figures of a diagnosis agree with each other, whatever the cause: one number has one value.

use fieldgap::acoustics::Vec3;
use fieldgap::diagnosis::{Diagnosis, EffectId, Verdict, WaterfallPart, diagnose};
use fieldgap_text::percent;

use crate::scanned_pistons::{Truth, scan};

/// What holds of every diagnosis.
fn check(diagnosis: &Diagnosis) {
    let Diagnosis { sentence, waterfall, ranked, .. } = diagnosis;
    assert!(sentence.contains(&format!("gap of {}", percent(diagnosis.gap_before))), "{sentence}");
    assert!(sentence.contains(&percent(diagnosis.noise_floor)), "{sentence}");
    let sum: f64 = waterfall.iter().map(|step| step.share).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{waterfall:?}");
    assert!(waterfall.iter().all(|step| (0.0..=1.0).contains(&step.share)), "{waterfall:?}");
    let left = waterfall.last().filter(|step| step.part == WaterfallPart::Residual);
    let left = left.expect("the residual comes last").share;
    let beyond = |gap: f64| gap.powi(2) - diagnosis.noise_floor.powi(2);
    let expected = (beyond(ranked[0].gap_after) / beyond(diagnosis.gap_before)).max(0.0);
    assert!((left - expected).abs() < 0.02, "{left} {expected} {sentence}");
    let planes = &diagnosis.r#where.planes;
    let least = planes.iter().map(|plane| plane.noise).fold(f64::INFINITY, f64::min);
    let most = planes.iter().map(|plane| plane.noise).fold(0.0, f64::max);
    assert!((least..=most).contains(&diagnosis.noise_floor), "{least} {most}");
    let failed = diagnosis.residual_tests.iter().any(|test| test.is_structure());
    assert_eq!(diagnosis.remainder.is_some(), failed);
    assert!(!(failed && diagnosis.verdict == Verdict::Explained), "{sentence}");
    if diagnosis.verdict.names_a_cause() {
        assert!(sentence.contains(&percent(ranked[0].gap_after)), "{sentence}");
    }
}

/// The free shift of each fit takes up an offset; the share of the gap is the offset's all the same.
#[test]
fn an_offset_has_its_share_of_the_gap() {
    let truth = Truth {
        stands_mm: |_, at_mm| at_mm + Vec3::new(2.0, 0.0, 0.0),
        gain: |n| 1.0 + 0.1 * (2.4 * n as f64 * n as f64).sin(),
        ..Truth::default()
    };
    let diagnosis =
        diagnose(&[scan(&[80.0, 120.0, 160.0], &truth)], None).expect("readings enough");
    check(&diagnosis);
    let mut named = diagnosis.effects.clone();
    named.sort_unstable();
    assert_eq!(named, [EffectId::ElementGain, EffectId::Offset]);
    let share = diagnosis.waterfall.iter().find(|step| step.effect == Some(EffectId::Offset));
    assert!(share.expect("a step of its own").share > 0.8, "{:?}", diagnosis.waterfall);
    let plane = &diagnosis.planes[0];
    let apart = plane.before.iter().zip(&plane.after).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) > 0.1, "the nominal and the corrected map differ");
    let largest = |sigma: &[f64]| sigma.iter().fold(0.0f64, |largest, s| largest.max(s.abs()));
    assert!(largest(&plane.residual_before) > 10.0, "{}", largest(&plane.residual_before));
    assert!(largest(&plane.residual_after) < 5.0, "{}", largest(&plane.residual_after));
}

/// Readings that fluctuate cannot be predicted one by one; the scatter accounts for the gap.
#[test]
fn scatter_accounts_for_a_gap_that_it_does_not_close() {
    let truth = Truth {
        stands_mm: |n, at_mm| {
            let turn = 2.4 * (n as f64) * (n as f64);
            at_mm + 1.2 * Vec3::new(turn.sin(), turn.cos(), 0.0)
        },
        ..Truth::default()
    };
    let diagnosis =
        diagnose(&[scan(&[80.0, 120.0, 160.0], &truth)], None).expect("readings enough");
    assert_eq!(diagnosis.effects, [EffectId::PositionJitter], "{}", diagnosis.sentence);
    let step = &diagnosis.waterfall[diagnosis.waterfall.len() - 2];
    assert!(step.share > 0.5, "{:?}", diagnosis.waterfall);
    assert!(diagnosis.sentence.contains("scatter"), "{}", diagnosis.sentence);
}
