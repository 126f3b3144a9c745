//! Verdicts and named causes against the true ones.

use std::collections::BTreeMap;

use serde::Serialize;

use super::super::assignment::Category;
use super::super::parsed_diagnosis::{ParsedVerdict, label};
use super::judged::Judged;

/// Verdicts for one category of truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictRow {
    /// The true category.
    pub category: Category,
    /// Number of each verdict.
    pub verdicts: BTreeMap<ParsedVerdict, usize>,
}

impl VerdictRow {
    /// One row for each category present.
    pub(super) fn of_all(judged: &[Judged<'_>]) -> Vec<Self> {
        let mut rows: BTreeMap<Category, BTreeMap<ParsedVerdict, usize>> = BTreeMap::new();
        for one in judged {
            let row = rows.entry(one.answer.category).or_default();
            *row.entry(one.diagnosis.verdict).or_default() += 1;
        }
        rows.into_iter().map(|(category, verdicts)| Self { category, verdicts }).collect()
    }
}

/// What was named for one set of true causes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConfusionRow {
    /// The category.
    pub category: Category,
    /// The true causes.
    pub truth: String,
    /// Number of scans.
    pub of: usize,
    /// Number of scans that were named exactly.
    pub exact: usize,
    /// What was named with its count, the most frequent first.
    pub named: Vec<(String, usize)>,
    /// The scans that were not named exactly.
    pub missed: Vec<String>,
}

impl ConfusionRow {
    /// One row for each set of true causes.
    pub(super) fn of_all(judged: &[Judged<'_>]) -> Vec<Self> {
        let mut by_truth: BTreeMap<(Category, String), Vec<&Judged<'_>>> = BTreeMap::new();
        for one in judged {
            let truth = match &one.answer.dominant {
                Some(dominant) => format!("whole bench, {dominant}"),
                None => label(&one.answer.effects),
            };
            by_truth.entry((one.answer.category, truth)).or_default().push(one);
        }
        by_truth
            .into_iter()
            .map(|((category, truth), all)| {
                let mut counts: BTreeMap<String, usize> = BTreeMap::new();
                for one in &all {
                    *counts.entry(one.diagnosis.named()).or_default() += 1;
                }
                let mut named: Vec<_> = counts.into_iter().collect();
                named.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
                let right = |one: &Judged<'_>| match category {
                    Category::None => !one.is_alarm(),
                    Category::WholeBench => one.is_whole_bench_right(),
                    Category::Unmodelled => one.diagnosis.verdict == ParsedVerdict::Unexplained,
                    _ => one.is_exact(),
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
