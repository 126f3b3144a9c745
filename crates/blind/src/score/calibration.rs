//! Calibration of the stated probabilities: of candidates stated with 0.9, nine in ten should be right.

use serde::Serialize;

use super::super::assignment::Category;
use super::judged::Judged;
use super::rate::{Figure, Target};

/// Bins of equal width from 0 to 1.
const BINS: usize = 10;

/// Calibration of the stated probabilities.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// The bins that are not empty.
    pub bins: Vec<CalibrationBin>,
    /// Mean absolute difference of stated probability and right share over the bins, weighted by their counts.
    pub error: Option<f64>,
    /// Number of scans: those whose diagnosis supports a candidate.
    pub of: usize,
}

/// Diagnoses with about the same stated probability.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrationBin {
    /// Number of diagnoses.
    pub of: usize,
    /// Mean stated probability of the first candidate.
    pub stated: f64,
    /// Share of first candidates that are the truth.
    pub right: f64,
}

impl Calibration {
    /// From all diagnoses except `unexplained` ones, which reject all candidates, and those of whole benches, of which no scan shows every
    /// small effect.
    pub(super) fn of(judged: &[Judged<'_>]) -> Self {
        let mut sums = [(0usize, 0.0, 0usize); BINS];
        for one in judged.iter().filter(|one| one.answer.category != Category::WholeBench) {
            let Some(first) = one.first() else { continue };
            let bin = ((first.probability * BINS as f64) as usize).min(BINS - 1);
            sums[bin].0 += 1;
            sums[bin].1 += first.probability;
            sums[bin].2 += usize::from(one.is_true(&first.effects));
        }
        let bins: Vec<CalibrationBin> = sums
            .into_iter()
            .filter(|(of, ..)| *of > 0)
            .map(|(of, stated, right)| CalibrationBin {
                of,
                stated: stated / of as f64,
                right: right as f64 / of as f64,
            })
            .collect();
        let of = bins.iter().map(|bin| bin.of).sum::<usize>();
        let difference: f64 =
            bins.iter().map(|bin| bin.of as f64 * (bin.stated - bin.right).abs()).sum();
        Self { bins, error: (of > 0).then(|| difference / of as f64), of }
    }

    /// The error as a figure.
    pub(super) fn figure(&self, target: Target) -> Figure {
        let what = "calibration error of the first candidate's probability";
        Figure::new(what, self.error, self.of, target)
    }
}
