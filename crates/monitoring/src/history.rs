//! The runs of one figure since the monitor began: what charts are reset from, and changes are measured with.

use std::collections::{BTreeMap, BTreeSet};

use fieldgap_text::Uncertain;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::baseline::Known;
use crate::environment::{Environment, Slope};
use crate::reference::Reading;

/// One figure of one judged run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Past {
    pub cell: String,
    pub at: Timestamp,
    pub reading: Reading,
    /// Normal score of the difference from what was expected.
    pub score: Option<f64>,
    /// Whether it is to be learned from later.
    pub may_teach: bool,
    /// Whether the run is one of those whose mean is the reference.
    pub of_the_mean: bool,
    /// Whether the scatter between runs was learned from it.
    pub of_the_scatter: bool,
    /// The difference from what was expected, in stated errors.
    pub difference: Option<f64>,
}

/// A change of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    pub change: Option<Uncertain>,
    pub relative: Option<Uncertain>,
    pub cells: Vec<String>,
    pub runs: usize,
}

/// A relative change is stated if the size is this many standard errors above zero: its error is then below a tenth.
const WELL_ABOVE_ZERO: f64 = 10.0;

/// What was known before a place in the past: the start, and the runs up to there that taught.
pub fn known_before(start: &Known, past: &[Past]) -> Known {
    let mut known = start.clone();
    for one in past {
        if one.of_the_mean {
            known.cells.entry(one.cell.clone()).or_default().add(&one.reading);
        }
        if let Some(difference) = one.difference.filter(|_| one.of_the_scatter) {
            known.add_difference(&one.cell, difference);
        }
    }
    known
}

/// How much the runs `after` differ from what was known before them: the weighted mean of the differences of the cells.
pub fn size(known: &Known, after: &[&Past], figure: &str, environment: &Environment) -> Size {
    let mut by_cell: BTreeMap<&str, Vec<&Past>> = BTreeMap::new();
    for one in after {
        by_cell.entry(&one.cell).or_default().push(one);
    }
    let changes: Vec<CellChange> = by_cell
        .iter()
        .filter_map(|(cell, past)| cell_change(known, cell, past, environment.slope(figure, cell)))
        .collect();
    let well = |cell: &CellChange| cell.mean.abs() > WELL_ABOVE_ZERO * cell.mean_variance.sqrt();
    let cells: BTreeSet<&str> = after.iter().map(|one| one.cell.as_str()).collect();
    Size {
        change: weighted(changes.iter().map(|cell| (cell.change, cell.variance))),
        relative: if changes.iter().all(well) {
            let ratio = |cell: &CellChange| {
                let size = cell.mean.abs();
                (cell.change / size, cell.variance / size.powi(2))
            };
            weighted(changes.iter().map(ratio))
        } else {
            None
        },
        cells: cells.into_iter().map(str::to_owned).collect(),
        runs: after.len(),
    }
}

struct CellChange {
    change: f64,
    variance: f64,
    mean: f64,
    mean_variance: f64,
}

/// The mean difference of a cell's runs from its reference. The error of the reference and that of the slope are common to them.
fn cell_change(known: &Known, cell: &str, past: &[&Past], slope: Slope) -> Option<CellChange> {
    let reference = known.cells.get(cell)?;
    let scatter = known.ratio(cell);
    let (mut sum, mut weight, mut common) = (0.0, 0.0, 0.0);
    for one in past {
        let prediction = reference.predict(&one.reading, slope, scatter)?;
        let own = 1.0 / one.reading.variance;
        sum += own * (one.reading.value - prediction.value);
        common += own * (prediction.variance - one.reading.variance).sqrt();
        weight += own;
    }
    Some(CellChange {
        change: sum / weight,
        variance: scatter.powi(2) * (1.0 / weight + (common / weight).powi(2)),
        mean: reference.mean(),
        mean_variance: scatter.powi(2) * reference.variance(),
    })
}

/// Weighted mean and its error; `None` of nothing.
fn weighted(values: impl Iterator<Item = (f64, f64)>) -> Option<Uncertain> {
    let (sum, weight) = values.fold((0.0, 0.0), |(sum, total), (value, variance)| {
        (sum + value / variance, total + 1.0 / variance)
    });
    (weight > 0.0).then(|| Uncertain { value: sum / weight, standard_error: 1.0 / weight.sqrt() })
}
