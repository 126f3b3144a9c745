//! One diagnosis beside its answer.

use super::super::answer::Answer;
use super::super::assignment::Category;
use super::super::said::{Said, SaidCandidate, SaidVerdict, same};

/// One diagnosis beside its answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judged<'a> {
    pub answer: &'a Answer,
    pub said: &'a Said,
}

impl<'a> Judged<'a> {
    pub fn new(answer: &'a Answer, said: &'a Said) -> Self {
        Self { answer, said }
    }

    /// Whether the truth is a set of effects that the catalogue has; the empty set counts.
    pub fn is_in_catalogue(&self) -> bool {
        self.answer.category != Category::Outside
    }

    /// Whether exactly the true effects were named, and no other.
    pub fn is_exact(&self) -> bool {
        self.is_explained() && self.is_true(&self.said.effects)
    }

    /// Whether the true set is one of the rivals, of which there may be three.
    pub fn is_among_rivals(&self) -> bool {
        self.said.verdict == SaidVerdict::Ambiguous
            && self.said.alternatives.len() <= 3
            && self.said.alternatives.iter().any(|set| self.is_true(set))
    }

    /// Whether one set was named.
    pub fn is_explained(&self) -> bool {
        self.said.verdict == SaidVerdict::Explained
    }

    /// Whether one set was named and is not the true one.
    pub fn is_wrong(&self) -> bool {
        self.is_explained() && !self.is_exact()
    }

    /// Whether one set was named and holds nothing that is not true.
    pub fn names_only_truth(&self) -> bool {
        self.is_explained()
            && self.is_in_catalogue()
            && self.said.effects.iter().all(|effect| self.answer.effects.contains(effect))
    }

    /// The most probable candidate, where the diagnosis stands by any.
    pub fn first(&self) -> Option<&'a SaidCandidate> {
        let stands = self.said.verdict != SaidVerdict::Unexplained;
        self.said.ranked.first().filter(|_| stands)
    }

    /// Whether a set of effects is the true one.
    pub fn is_true(&self, effects: &[String]) -> bool {
        self.is_in_catalogue() && same(effects, &self.answer.effects)
    }
}
