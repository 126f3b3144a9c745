//! What was said, by what was true.

use std::collections::BTreeMap;

use serde::Serialize;

use super::super::assignment::Category;
use super::super::said::{SaidVerdict, label};
use super::judged::Judged;

/// Verdicts over one category of truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictRow {
    /// What was true.
    pub category: Category,
    /// How often each verdict was given.
    pub verdicts: BTreeMap<SaidVerdict, usize>,
}

impl VerdictRow {
    /// One row a category that there is.
    pub(super) fn of_all(judged: &[Judged<'_>]) -> Vec<Self> {
        let mut rows: BTreeMap<Category, BTreeMap<SaidVerdict, usize>> = BTreeMap::new();
        for one in judged {
            let row = rows.entry(one.answer.category).or_default();
            *row.entry(one.said.verdict).or_default() += 1;
        }
        rows.into_iter().map(|(category, verdicts)| Self { category, verdicts }).collect()
    }
}

/// What was named where one set of causes was true.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConfusionRow {
    /// What kind of truth it is.
    pub category: Category,
    /// The true causes.
    pub truth: String,
    /// How many scans.
    pub of: usize,
    /// How many of them named exactly.
    pub exact: usize,
    /// What was named and how often, the most frequent first.
    pub named: Vec<(String, usize)>,
    /// The scans where something else was named.
    pub missed: Vec<String>,
}

impl ConfusionRow {
    /// One row a set of true causes.
    pub(super) fn of_all(judged: &[Judged<'_>]) -> Vec<Self> {
        let mut by_truth: BTreeMap<(Category, String), Vec<&Judged<'_>>> = BTreeMap::new();
        for one in judged {
            let truth = label(&one.answer.effects);
            by_truth.entry((one.answer.category, truth)).or_default().push(one);
        }
        by_truth
            .into_iter()
            .map(|((category, truth), all)| {
                let mut counts: BTreeMap<String, usize> = BTreeMap::new();
                for one in &all {
                    *counts.entry(one.said.named()).or_default() += 1;
                }
                let mut named: Vec<_> = counts.into_iter().collect();
                named.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
                let right = |one: &Judged<'_>| match category {
                    Category::None => one.said.verdict == SaidVerdict::None,
                    Category::Outside => one.said.verdict == SaidVerdict::Unexplained,
                    Category::One | Category::Two => one.is_exact(),
                };
                let missed: Vec<_> = all.iter().filter(|one| !right(one)).collect();
                Self {
                    category,
                    truth,
                    of: all.len(),
                    exact: all.len() - missed.len(),
                    missed: missed.into_iter().map(|one| one.answer.name.clone()).collect(),
                    named,
                }
            })
            .collect()
    }
}
