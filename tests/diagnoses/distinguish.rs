//! Effects that a scan can distinguish, compared with figures of another program for the same scan.

use fieldgap::diagnosis::{AlikeEffects, EffectId, alike_effects};

fn alike() -> Vec<AlikeEffects> {
    let scan = crate::scanned_pistons::scan(&[50.0, 100.0, 150.0, 200.0], &Default::default());
    alike_effects(&scan, None).expect("enough to compare")
}

/// Residual amplitude of one effect that another cannot reproduce, from a Python prototype for the same planes and array. It had no
/// free near-field term, so that only the order of magnitude must agree. (Its 0.03 for sound speed and drive frequency is excluded:
/// delays kept in seconds preserve the focus at any frequency, but not at another speed of sound.)
#[test]
fn the_least_separable_pairs_agree_with_another_program() {
    let alike = alike();
    for (one, other, published) in [
        (EffectId::ReceiverDirectivity, EffectId::Directivity, 0.02),
        (EffectId::Aperture, EffectId::Directivity, 0.06),
        (EffectId::Aperture, EffectId::ReceiverDirectivity, 0.10),
        (EffectId::Backlash, EffectId::Lag, 0.11),
        (EffectId::Absorption, EffectId::Spreading, 0.19),
        (EffectId::ArrayTilt, EffectId::TemperatureGradient, 0.33),
    ] {
        let pair = alike
            .iter()
            .find(|pair| {
                [pair.effect, pair.imitator] == [one, other]
                    || [pair.effect, pair.imitator] == [other, one]
            })
            .unwrap_or_else(|| panic!("{one} and {other} are compared"));
        let amplitude = pair.residual_share.sqrt();
        assert!((0.2..4.0).contains(&(amplitude / published)), "{one} {other} {amplitude}");
    }
}

/// A gain drift from plane to plane does not resemble backlash, which shifts every other row.
#[test]
fn dissimilar_effects_are_distinguished_far_below_the_noise() {
    let alike = alike();
    let pair = alike
        .iter()
        .find(|pair| {
            [pair.effect, pair.imitator].contains(&EffectId::Backlash)
                && [pair.effect, pair.imitator].contains(&EffectId::GainDrift)
        })
        .expect("both are in the catalogue");
    assert!(pair.residual_share > 0.9, "{pair:?}");
    assert!(pair.separable_gap_sigma < 0.06, "{pair:?}");
}

/// The documented look-alikes of an effect are among those that this scan separates worst from it.
#[test]
fn documented_look_alikes_are_hard_to_separate() {
    /// Largest residual share of a look-alike pair; a random pair has 0.9.
    const MIMICS: f64 = 0.6;
    let alike = alike();
    for &effect in EffectId::ALL {
        for &mimic in effect.mimics() {
            let both = |pair: &&AlikeEffects| {
                [pair.effect, pair.imitator].contains(&effect)
                    && [pair.effect, pair.imitator].contains(&mimic)
            };
            if let Some(pair) = alike.iter().find(both) {
                assert!(pair.residual_share < MIMICS, "{pair:?}");
            }
        }
    }
}
