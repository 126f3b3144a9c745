//! The information about the cause that the readings of a round gave, beside what was expected of them.

use fieldgap_diagnosis::EffectId;

use crate::batch::DEALT_OUT;
use crate::round::Round;

/// Probability left for sets that the search had not found, at least. Set by judgement: one that then explains all is worth ten bits.
const LEAST_OTHERS: f64 = 1e-3;

/// Information that the readings of `round` gave, bits: the Kullback-Leibler divergence of the probabilities after them, in `next`, from those
/// before. Its mean over what may be read is the expected information, as far as the probabilities are right. Before the readings a share is
/// dealt out evenly, as in the choice of the readings; all sets that were not among those count as one. `None` where nothing was expected.
pub fn obtained_bits(round: &Round, next: &Round) -> Option<f64> {
    round.expected_bits?;
    let probability_of = |round: &Round, effects: &[EffectId]| {
        let same = |ids: &[EffectId]| {
            ids.len() == effects.len() && ids.iter().all(|id| effects.contains(id))
        };
        let found = round.probabilities.iter().find(|likely| same(&likely.effects));
        found.map_or(0.0, |likely| likely.probability)
    };
    let sets = &round.probabilities;
    let total: f64 = sets.iter().map(|likely| likely.probability).sum();
    let others_before = (1.0 - total).max(LEAST_OTHERS);
    let (mut bits, mut others_after) = (0.0, 1.0);
    let mut add = |after: f64, before: f64| {
        if after > 0.0 {
            bits += after * (after / before).log2();
        }
    };
    for set in sets {
        let share = (1.0 - DEALT_OUT) * set.probability / total + DEALT_OUT / sets.len() as f64;
        let after = probability_of(next, &set.effects);
        others_after -= after;
        add(after, (1.0 - others_before) * share);
    }
    add(others_after.max(0.0), others_before);
    Some(bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::round::{Likely, Purpose};

    fn round(probabilities: &[(EffectId, f64)]) -> Round {
        let likely = |(id, probability): &(EffectId, f64)| Likely {
            effects: vec![*id],
            probability: *probability,
        };
        Round {
            round: 1,
            purpose: Purpose::Explore,
            before: 240,
            readings: 96,
            drives: [1, 11],
            verdict: None,
            named: Vec::new(),
            probabilities: probabilities.iter().map(likely).collect(),
            outside: 0.02,
            expected_bits: Some(1.0),
            expected_s: 20.0,
            cure: None,
            verification: None,
            end: None,
            reason: String::new(),
        }
    }

    #[test]
    fn two_even_sets_of_which_one_is_left_give_a_bit() {
        let before = round(&[(EffectId::Pitch, 0.5), (EffectId::SoundSpeed, 0.5)]);
        let after = round(&[(EffectId::SoundSpeed, 1.0), (EffectId::Pitch, 0.0)]);
        let bits = obtained_bits(&before, &after).expect("it was expected");
        assert!((bits - 1.0).abs() < 2e-3, "{bits}");
        // Nothing was learnt.
        let nothing = obtained_bits(&before, &before).expect("it was expected");
        assert!(nothing.abs() < 2e-3, "{nothing}");
        let unasked = Round { expected_bits: None, ..before.clone() };
        assert_eq!(obtained_bits(&unasked, &after), None);
    }

    #[test]
    fn a_set_that_nobody_expected_is_a_surprise() {
        let before = round(&[(EffectId::Pitch, 0.5), (EffectId::SoundSpeed, 0.5)]);
        let after = round(&[(EffectId::Skew, 1.0)]);
        let bits = obtained_bits(&before, &after).expect("it was expected");
        assert!((bits - 1e3f64.log2()).abs() < 1e-9, "{bits}");
    }
}
