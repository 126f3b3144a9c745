//! An alarm: what changed, where, since when, and by how much.

use std::fmt;

use fieldgap_text::{Uncertain, fixed, uncertain};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

/// A figure changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alarm {
    /// The figure.
    pub figure: String,
    /// Whose runs are charted.
    pub scope: Scope,
    /// The cells that ran since the change.
    pub cells: Vec<String>,
    /// Time of the run that was judged.
    pub at: Timestamp,
    /// Whether this chart gave no alarm before, since it was last reset.
    pub new: bool,
    /// Time of the first changed run, as estimated from the chart.
    pub since: Timestamp,
    /// Number of runs from that one on.
    pub runs: usize,
    /// Change in the figure's unit, corrected for temperature; `None` if no run was before the change, or the chart is without signs.
    pub change: Option<Uncertain>,
    /// Change as a part of the figure's size; `None` where the size is not well above zero.
    pub relative: Option<Uncertain>,
    /// The chart's statistic; below zero for a fall.
    pub statistic: f64,
    /// Its limit.
    pub limit: f64,
    /// Mean number of runs between two false alarms of all charts together.
    pub arl_runs: f64,
}

/// Whose runs a chart takes.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scope {
    /// Those of one cell.
    Cell(String),
    /// Those of all cells, in the order of time: finds a change that all have in common sooner.
    AllCells,
    /// The same without signs: finds a change that raises a figure in some cells and lowers it in others.
    CellByCell,
}

impl fmt::Display for Scope {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cell(cell) => write!(out, "cell {cell}"),
            Self::AllCells => out.write_str("all cells"),
            Self::CellByCell => out.write_str("single cells"),
        }
    }
}

impl Alarm {
    /// What the figure did.
    pub fn verb(&self) -> &'static str {
        match (&self.scope, self.figure.as_str(), self.statistic > 0.0) {
            (Scope::CellByCell, ..) => "changed",
            (_, "gap", true) => "grew",
            (_, "gap", false) => "shrank",
            (_, _, true) => "rose",
            (_, _, false) => "fell",
        }
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let figure = &self.figure;
        write!(out, "The {figure} of {} {}", self.scope, self.verb())?;
        let sign = self.statistic.signum();
        let part = |ratio: Uncertain| Uncertain {
            value: 100.0 * sign * ratio.value,
            standard_error: 100.0 * ratio.standard_error,
        };
        match (self.relative, self.change) {
            (Some(relative), _) => {
                write!(out, " by {}\u{a0}% of its size", uncertain(part(relative)))?
            }
            (None, Some(change)) => {
                let change = Uncertain { value: sign * change.value, ..change };
                write!(out, " by {}", uncertain(change))?;
            }
            (None, None) if self.scope == Scope::CellByCell => {
                write!(out, ", more in some than in others")?;
            }
            (None, None) => {}
        }
        let runs = if self.runs == 1 { "run" } else { "runs" };
        write!(
            out,
            " since {} ({} {runs}); the chart stands at {}, limit {} standard errors, at most one false alarm in {} runs",
            self.since.strftime("%Y-%m-%d %H:%M UTC"),
            self.runs,
            fixed(self.statistic.abs(), 1),
            fixed(self.limit, 1),
            grouped(self.arl_runs),
        )
    }
}

/// A whole number with commas between thousands.
fn grouped(number: f64) -> String {
    let digits = fixed(number, 0);
    let count = digits.len();
    let comma = |place: usize| place > 0 && (count - place).is_multiple_of(3);
    digits
        .chars()
        .enumerate()
        .flat_map(|(place, digit)| comma(place).then_some(',').into_iter().chain([digit]))
        .collect()
}
