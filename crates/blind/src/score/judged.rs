//! One diagnosis with its answer.

use super::super::answer::Answer;
use super::super::assignment::Category;
use super::super::parsed_diagnosis::{ParsedCandidate, ParsedDiagnosis, ParsedVerdict, same};
use super::ordinary;

/// One diagnosis with its answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judged<'a> {
    pub answer: &'a Answer,
    pub diagnosis: &'a ParsedDiagnosis,
}

impl<'a> Judged<'a> {
    pub fn new(answer: &'a Answer, diagnosis: &'a ParsedDiagnosis) -> Self {
        Self { answer, diagnosis }
    }

    /// Whether the truth is a set of effects that the catalogue has; the empty set counts.
    pub fn is_in_catalogue(&self) -> bool {
        self.answer.category != Category::Unmodelled
    }

    /// Whether exactly the true effects were named.
    pub fn is_exact(&self) -> bool {
        self.is_explained() && self.is_true(&self.diagnosis.effects)
    }

    /// Whether the true set is one of at most three alternatives.
    pub fn is_among_alternatives(&self) -> bool {
        self.diagnosis.verdict == ParsedVerdict::Ambiguous
            && self.diagnosis.alternatives.len() <= 3
            && self.diagnosis.alternatives.iter().any(|set| self.is_true(set))
    }

    /// Whether one set was named.
    pub fn is_explained(&self) -> bool {
        matches!(self.diagnosis.verdict, ParsedVerdict::Explained | ParsedVerdict::MostlyExplained)
    }

    /// Whether one set was named and is not the true one. Where nothing is named but what every set-up has, the cause is missed, not
    /// mistaken.
    pub fn is_wrong(&self) -> bool {
        let missed = self.is_ordinary(&self.diagnosis.effects) && !self.answer.effects.is_empty();
        self.is_explained() && !self.is_exact() && !missed
    }

    /// Whether one set was named and all its effects are true.
    pub fn names_only_truth(&self) -> bool {
        let effects = &self.diagnosis.effects;
        let is_true = |effect: &String| self.answer.effects.contains(effect);
        self.is_explained() && self.is_in_catalogue() && self.causes_of(effects).iter().all(is_true)
    }

    /// Whether an effect is in every set that is named: the one, or each of the alternatives.
    pub fn is_named(&self, effect: &str) -> bool {
        let has = |set: &Vec<String>| set.iter().any(|named| named == effect);
        match self.diagnosis.verdict {
            ParsedVerdict::Ambiguous => {
                !self.diagnosis.alternatives.is_empty()
                    && self.diagnosis.alternatives.iter().all(has)
            }
            _ => self.is_explained() && has(&self.diagnosis.effects),
        }
    }

    /// Whether every effect of every set that is named is true.
    pub fn invents_nothing(&self) -> bool {
        let is_true = |set: &Vec<String>| {
            self.causes_of(set).iter().all(|effect| self.answer.effects.contains(effect))
        };
        match self.diagnosis.verdict {
            ParsedVerdict::Ambiguous => self.diagnosis.alternatives.iter().all(is_true),
            _ => is_true(&self.diagnosis.effects),
        }
    }

    /// Of a whole bench: whether the dominant effect is named, nothing else is that is not there, and the share that remains is told.
    pub fn is_whole_bench_right(&self) -> bool {
        let dominant = self.answer.dominant.as_deref();
        dominant.is_some_and(|dominant| self.is_named(dominant))
            && self.invents_nothing()
            && self.tells_remainder()
    }

    /// Whether the diagnosis says how much of the gap it explains.
    pub fn tells_remainder(&self) -> bool {
        self.diagnosis.explained_fraction.is_some()
    }

    /// Whether a cause is reported of a scan without one.
    pub fn is_alarm(&self) -> bool {
        match self.diagnosis.verdict {
            ParsedVerdict::None => false,
            ParsedVerdict::Unexplained => true,
            ParsedVerdict::Ambiguous => {
                let ordinary = |set: &Vec<String>| self.is_ordinary(set);
                !self.diagnosis.alternatives.iter().all(ordinary)
            }
            ParsedVerdict::Explained | ParsedVerdict::MostlyExplained => {
                let effects = &self.diagnosis.effects;
                !self.is_ordinary(effects) || self.is_beyond_the_ordinary(effects)
            }
        }
    }

    /// The most probable candidate, unless the diagnosis rejects all.
    pub fn first(&self) -> Option<&'a ParsedCandidate> {
        let supported = self.diagnosis.verdict != ParsedVerdict::Unexplained;
        self.diagnosis.ranked.first().filter(|_| supported)
    }

    /// Whether a set of effects is the true one.
    pub fn is_true(&self, effects: &[String]) -> bool {
        self.is_in_catalogue() && same(&self.causes_of(effects), &self.answer.effects)
    }

    /// Of these effects those that count as causes: all but what the set-up has anyway.
    fn causes_of(&self, effects: &[String]) -> Vec<String> {
        effects.iter().filter(|effect| !self.has_anyway(effect)).cloned().collect()
    }

    /// Whether these effects are nothing but what the set-up has anyway. The empty set is.
    fn is_ordinary(&self, effects: &[String]) -> bool {
        effects.iter().all(|effect| self.has_anyway(effect))
    }

    fn has_anyway(&self, effect: &str) -> bool {
        self.answer.imperfections.as_ref().is_some_and(|anyway| ordinary::has(anyway, effect))
    }

    /// Whether one of these effects, of which the set-up has a little, is named with much more. Without a stated size it counts as more.
    fn is_beyond_the_ordinary(&self, effects: &[String]) -> bool {
        let Some(anyway) = &self.answer.imperfections else { return false };
        let candidates = &self.diagnosis.ranked;
        let Some(named) = candidates.iter().find(|one| same(&one.effects, effects)) else {
            return !effects.is_empty();
        };
        effects.iter().any(|effect| !ordinary::is_of_its_size(anyway, effect, named))
    }
}
