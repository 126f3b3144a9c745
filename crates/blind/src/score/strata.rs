//! The rates by the classes of laboratories, one axis after the other.

use std::collections::BTreeMap;

use serde::Serialize;

use super::super::assignment::Category;
use super::calibration::Calibration;
use super::judged::Judged;
use super::rate::{Figure, Rate, Target};
use super::rates::CLEAR;

/// Scans from which a class's calibration error is held against its target: fewer have a scatter of that size.
const ENOUGH: usize = 100;

/// The scans of one class on one axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StratumScore {
    /// The axis, such as the radiator.
    pub axis: String,
    /// The class on it.
    pub class: String,
    /// Number of scans.
    pub of: usize,
    /// Its rates, in the order of [`StratumScore::COLUMNS`].
    pub rates: Vec<Rate>,
    /// Calibration of the stated probabilities.
    pub calibration: Calibration,
}

impl StratumScore {
    /// What is counted in each class.
    pub const COLUMNS: [&'static str; 8] =
        ["one", "or rivals", "wrong", "two", "three true", "whole", "alarms", "outside"];

    /// One for each class of each axis, by their names; none for the bench.
    pub(super) fn of_all(judged: &[Judged<'_>]) -> Vec<Self> {
        let mut classes: BTreeMap<(&str, &str), Vec<Judged<'_>>> = BTreeMap::new();
        for one in judged {
            for (axis, class) in &one.answer.strata {
                classes.entry((axis, class)).or_default().push(*one);
            }
            if !one.answer.strata.is_empty() {
                let ideal = one.answer.imperfections.is_none();
                let class = if ideal { "none" } else { "ordinary" };
                classes.entry(("imperfections", class)).or_default().push(*one);
            }
        }
        let of_class = |((axis, class), judged): ((&str, &str), Vec<Judged<'_>>)| Self {
            axis: axis.to_owned(),
            class: class.to_owned(),
            of: judged.len(),
            rates: rates(&judged),
            calibration: Calibration::of(&judged),
        };
        classes.into_iter().map(of_class).collect()
    }

    /// The largest calibration error of a class with enough scans, as a figure; nothing where no class has.
    pub(super) fn worst_calibration(all: &[Self], target: Target) -> Option<Figure> {
        let enough = all.iter().filter(|stratum| stratum.calibration.of >= ENOUGH);
        let error = |stratum: &&Self| stratum.calibration.error.unwrap_or(0.0);
        let worst = enough.max_by(|a, b| error(a).total_cmp(&error(b)))?;
        let what =
            format!("largest calibration error of a class ({}: {})", worst.axis, worst.class);
        Some(Figure::new(&what, worst.calibration.error, worst.calibration.of, target))
    }
}

fn rates(judged: &[Judged<'_>]) -> Vec<Rate> {
    let of = |category: Category| judged.iter().filter(move |one| one.answer.category == category);
    let clear = |category: Category| of(category).filter(|one| one.answer.gap_sigma >= CLEAR);
    let [one, or_rivals, wrong, two, three, whole, alarms, outside] = StratumScore::COLUMNS;
    vec![
        Rate::of(one, clear(Category::One), |one| one.is_exact()),
        Rate::of(or_rivals, clear(Category::One), |one| {
            one.is_exact() || one.is_among_alternatives()
        }),
        Rate::of(wrong, of(Category::One), |one| one.is_wrong()),
        Rate::of(two, of(Category::Two), |one| one.is_exact()),
        Rate::of(three, of(Category::Three).filter(|one| one.is_explained()), |one| {
            one.names_only_truth()
        }),
        Rate::of(whole, of(Category::WholeBench), |one| one.is_whole_bench_right()),
        Rate::of(alarms, of(Category::None), |one| one.is_alarm()),
        Rate::of(outside, clear(Category::Unmodelled), |one| !one.is_explained()),
    ]
}
