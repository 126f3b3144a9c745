//! One diagnosis with its answer.

use super::super::answer::Answer;
use super::super::assignment::Category;
use super::super::parsed_diagnosis::{ParsedCandidate, ParsedDiagnosis, ParsedVerdict, same};

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

    /// Whether one set was named and is not the true one.
    pub fn is_wrong(&self) -> bool {
        self.is_explained() && !self.is_exact()
    }

    /// Whether one set was named and all its effects are true.
    pub fn names_only_truth(&self) -> bool {
        self.is_explained()
            && self.is_in_catalogue()
            && self.diagnosis.effects.iter().all(|effect| self.answer.effects.contains(effect))
    }

    /// The most probable candidate, unless the diagnosis rejects all.
    pub fn first(&self) -> Option<&'a ParsedCandidate> {
        let supported = self.diagnosis.verdict != ParsedVerdict::Unexplained;
        self.diagnosis.ranked.first().filter(|_| supported)
    }

    /// Whether a set of effects is the true one.
    pub fn is_true(&self, effects: &[String]) -> bool {
        self.is_in_catalogue() && same(effects, &self.answer.effects)
    }
}
