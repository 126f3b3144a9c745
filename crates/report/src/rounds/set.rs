//! The sets of effects that rounds speak of: their names in plain words, and their probabilities round by round.

use fieldgap_closed_loop::{End, Round};
use fieldgap_diagnosis::EffectId;

/// Sets that are shown by name: colours for more do not exist.
const MOST_NAMED: usize = 7;

/// A set is shown by name if it was ever this probable.
const LEAST_SHOWN: f64 = 0.01;

/// A part of the probability, and how it moved.
pub(super) struct Moved {
    pub name: String,
    pub part: Part,
    /// After each search.
    pub probabilities: Vec<f64>,
}

/// What a part of the probability is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Set,
    /// The set-up as believed.
    NoGap,
    /// All sets that are not shown by name.
    Others,
    /// No set of the catalogue.
    Outside,
}

/// The set in plain words.
pub(super) fn in_words(effects: &[EffectId]) -> String {
    match effects {
        [] => "no gap".to_owned(),
        some => some.iter().map(|id| id.as_cause()).collect::<Vec<_>>().join(" + "),
    }
}

/// The decisions that follow a search of all readings before them. The first has none, and a cause that held ends the loop by what was known
/// before the fresh readings.
pub(super) fn searched(rounds: &[Round]) -> impl Iterator<Item = &Round> {
    rounds.iter().filter(|round| round.verdict.is_some() && round.end != Some(End::Verified))
}

/// How the probability moved between sets: by the last round, then by the largest that each had.
pub(super) fn moved(rounds: &[Round]) -> Vec<Moved> {
    let decided: Vec<&Round> = searched(rounds).collect();
    let mut sets: Vec<Vec<EffectId>> = Vec::new();
    for likely in decided.iter().flat_map(|round| &round.probabilities) {
        let mut effects = likely.effects.clone();
        effects.sort_unstable();
        if !effects.is_empty() && !sets.contains(&effects) {
            sets.push(effects);
        }
    }
    let probabilities = |effects: &[EffectId]| -> Vec<f64> {
        let same = |ids: &[EffectId]| {
            ids.len() == effects.len() && ids.iter().all(|id| effects.contains(id))
        };
        let of_round = |round: &&Round| {
            let found = round.probabilities.iter().find(|likely| same(&likely.effects));
            found.map_or(0.0, |likely| likely.probability) * (1.0 - round.outside)
        };
        decided.iter().map(of_round).collect()
    };
    let mut shown: Vec<Moved> = sets
        .iter()
        .map(|effects| Moved {
            name: in_words(effects),
            part: Part::Set,
            probabilities: probabilities(effects),
        })
        .filter(|moved| moved.probabilities.iter().any(|p| *p >= LEAST_SHOWN))
        .collect();
    let rank = |moved: &Moved| {
        let last = moved.probabilities.last().copied().unwrap_or(0.0);
        let largest = moved.probabilities.iter().copied().fold(0.0, f64::max);
        10.0 * last + largest
    };
    shown.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
    shown.truncate(MOST_NAMED);
    let none =
        Moved { name: "no gap".to_owned(), part: Part::NoGap, probabilities: probabilities(&[]) };
    let outside: Vec<f64> = decided.iter().map(|round| round.outside).collect();
    let others = (0..decided.len()).map(|n| {
        let named: f64 = shown.iter().map(|moved| moved.probabilities[n]).sum();
        (1.0 - named - none.probabilities[n] - outside[n]).max(0.0)
    });
    let others = Moved {
        name: "other sets".to_owned(),
        part: Part::Others,
        probabilities: others.collect(),
    };
    let outside = Moved {
        name: "outside the catalogue".to_owned(),
        part: Part::Outside,
        probabilities: outside,
    };
    shown.extend([none, others, outside]);
    shown
}
