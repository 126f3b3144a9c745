//! What the air's temperature does to the figures of itself.

use std::collections::BTreeMap;

use fieldgap_text::Uncertain;
use serde::{Deserialize, Serialize};

/// How a figure changes with the air's temperature, and from where that is known.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Slope {
    /// Fitted to the runs of each cell, from the baseline on. A cell then needs two runs at different temperatures before a
    /// third is judged.
    #[default]
    Fitted,
    /// Known beforehand, such as from a simulation: the figure's change for each kelvin. Runs sharpen it. A slope that is only
    /// known to be small is a `Predicted` one too: zero, with an error as large as the slope may be.
    Predicted(Uncertain),
    /// Not corrected for.
    Uncorrected,
}

/// The slopes of all figures; without entries, each is [`Slope::Fitted`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Environment {
    #[serde(default)]
    others: Slope,
    /// By figure.
    #[serde(default)]
    figures: BTreeMap<String, Slope>,
    /// By figure, then by cell.
    #[serde(default)]
    cells: BTreeMap<String, BTreeMap<String, Slope>>,
}

impl Environment {
    /// The same for all figures that get nothing of their own.
    pub fn all(slope: Slope) -> Self {
        Self { others: slope, ..Self::default() }
    }

    /// As before, with the slope of one figure in all cells.
    pub fn with_figure(mut self, figure: &str, slope: Slope) -> Self {
        self.figures.insert(figure.to_owned(), slope);
        self
    }

    /// As before, with the slope of one figure in one cell.
    pub fn with_cell(mut self, figure: &str, cell: &str, slope: Slope) -> Self {
        self.cells.entry(figure.to_owned()).or_default().insert(cell.to_owned(), slope);
        self
    }

    /// The slope of a figure in a cell.
    pub fn slope(&self, figure: &str, cell: &str) -> Slope {
        let of_cell = self.cells.get(figure).and_then(|cells| cells.get(cell));
        *of_cell.or_else(|| self.figures.get(figure)).unwrap_or(&self.others)
    }
}
