//! The baseline: what figures were before anything is to be found.

use std::collections::BTreeMap;

use fieldgap_text::{Uncertain, uncertain};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::environment::{Environment, Slope};
use crate::normal::score_of_t;
use crate::reference::{Prediction, Reading, Reference, Scatter};
use crate::run::Run;
use crate::settings::Tolerance;

/// Mean, error and temperature of every figure of every cell, from a round, a record, or an earlier campaign. It can be written to disk:
/// TOML keeps every digit, `serde_json` all but the last.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    from: Timestamp,
    until: Timestamp,
    environment: Environment,
    figures: BTreeMap<String, Known>,
}

/// Why there is no baseline.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BaselineError {
    /// No runs, or none with a figure.
    #[error(
        "no run of the baseline holds a figure that is a number. Give at least one complete round of the cells"
    )]
    NoFigure,
}

/// A figure of one cell in the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaselineFigure {
    /// Mean at the mean temperature, and its standard error, scatter between runs included as far as it is known.
    pub mean: Uncertain,
    /// Number of runs.
    pub runs: u32,
    /// Their mean temperature, °C.
    pub temperature_c: Option<f64>,
    /// The figure's change for each kelvin.
    pub per_k: Option<Uncertain>,
}

/// What is known of one figure: a reference and the scatter between runs for each cell, and the scatter pooled over them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Known {
    pub cells: BTreeMap<String, Reference>,
    scatter: Scatter,
    scatter_of_cells: BTreeMap<String, Scatter>,
}

/// The scatter of a cell against stated errors.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CellScatter {
    ratio: f64,
    degrees_of_freedom: f64,
}

/// The scatter of the other cells counts as much as this many differences of the cell itself. Cells scatter differently: a focus near an edge moves more.
/// With few runs of a cell the others say how much to expect, with many its own decide.
const POOLED_WEIGHT: f64 = 4.0;

/// Scatter is not normal beyond a few standard errors: a peak can jump between two maxima. However many runs there are, differences are
/// therefore judged by a distribution with tails as long as those of t with this many degrees of freedom.
const MOST_DEGREES_OF_FREEDOM: f64 = 10.0;

/// A scatter known from fewer differences is too uncertain to judge by.
const FEWEST_DIFFERENCES: u32 = 2;

/// A reading against what the runs before it let expect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Expected {
    pub prediction: Prediction,
    /// Difference in standard errors as stated.
    pub difference: f64,
    /// The same as a normal score, which takes into account that scatter and baseline have errors of their own; `None` while the scatter
    /// is unknown.
    pub score: Option<f64>,
}

impl Known {
    /// A reading of a cell against the runs before; `None` if these do not determine what is expected.
    ///
    /// The difference, over its standard error with that of the prediction in it, is the recursive residual of Brown, Durbin
    /// and Evans (J. R. Statist. Soc. B 37, 149, 1975). Without a change, these are independent if every run is learned from at once, so that
    /// an error of the baseline does not return in every run; a round of waiting changes this little. Their quotient by the scatter
    /// known before has nearly Student's distribution, and its normal score is charted (self-starting charts: Hawkins, The Statistician 36,
    /// 299, 1987; Quesenberry, J. Quality Technology 23, 213, 1991). What is tolerated is taken off before.
    pub fn expect(
        &self,
        cell: &str,
        reading: &Reading,
        slope: Slope,
        tolerance: Option<Tolerance>,
    ) -> Option<Expected> {
        let scatter = self.cell_scatter(cell);
        let prediction = self.cells.get(cell)?.predict(reading, slope, self.ratio(cell))?;
        let error = prediction.variance.sqrt();
        let difference = (reading.value - prediction.value) / error;
        let tolerated = tolerance.map_or(0.0, |one| one.about(prediction.value)) / error;
        let counted = (difference.abs() - tolerated).max(0.0).copysign(difference);
        let score =
            scatter.map(|scatter| score_of_t(counted / scatter.ratio, scatter.degrees_of_freedom));
        Some(Expected { prediction, difference, score })
    }

    /// Scatter of a cell: its own, and that of the other cells as if it were some differences more (the moderated variance of Smyth,
    /// Statistical Applications in Genetics and Molecular Biology 3, 3, 2004); `None` while there are too few of both.
    fn cell_scatter(&self, cell: &str) -> Option<CellScatter> {
        let own = self.scatter_of_cells.get(cell).copied().unwrap_or_default();
        let others = self.scatter.without(own);
        let weight = POOLED_WEIGHT.min(f64::from(others.degrees_of_freedom()));
        let of_others = others.ratio().map_or(0.0, |ratio| ratio.value.powi(2));
        let freedom = weight + f64::from(own.degrees_of_freedom());
        let variance = (weight * of_others + own.squares()) / freedom;
        (freedom >= f64::from(FEWEST_DIFFERENCES) && variance > 0.0).then(|| CellScatter {
            ratio: variance.sqrt(),
            degrees_of_freedom: freedom.min(MOST_DEGREES_OF_FREEDOM),
        })
    }

    /// Ratio of the scatter of a cell to stated errors, 1 while it is unknown.
    pub fn ratio(&self, cell: &str) -> f64 {
        self.cell_scatter(cell).map_or(1.0, |scatter| scatter.ratio)
    }

    /// Adds a difference to what is known of the scatter.
    pub fn add_difference(&mut self, cell: &str, difference: f64) {
        self.scatter.add(difference);
        self.scatter_of_cells.entry(cell.to_owned()).or_default().add(difference);
    }

    /// Mean of a cell with its error, scatter between runs included as far as it is known.
    pub fn mean(&self, cell: &str) -> Option<Uncertain> {
        let reference = self.cells.get(cell)?;
        Some(Uncertain {
            value: reference.mean(),
            standard_error: self.ratio(cell) * reference.variance().sqrt(),
        })
    }

    /// Adds a reading to what is known.
    pub fn learn(&mut self, cell: &str, reading: &Reading, difference: Option<f64>) {
        self.cells.entry(cell.to_owned()).or_default().add(reading);
        if let Some(difference) = difference {
            self.add_difference(cell, difference);
        }
    }
}

impl Baseline {
    /// The baseline of these runs, such as one complete round, or one record alone.
    ///
    /// # Errors
    /// [`BaselineError`] if they hold no figure.
    pub fn of_runs(runs: &[Run], environment: Environment) -> Result<Self, BaselineError> {
        let mut ordered: Vec<&Run> = runs.iter().collect();
        ordered.sort_by_key(|run| run.at);
        let mut figures: BTreeMap<String, Known> = BTreeMap::new();
        for run in &ordered {
            for (figure, value) in &run.figures {
                let Some(reading) = Reading::of(*value, run.temperature_c) else { continue };
                let known = figures.entry(figure.clone()).or_default();
                let slope = environment.slope(figure, &run.cell);
                let expected = known.expect(&run.cell, &reading, slope, None);
                let difference = expected.map(|expected| expected.difference);
                known.learn(&run.cell, &reading, difference);
            }
        }
        match (ordered.first(), ordered.last()) {
            (Some(first), Some(last)) if !figures.is_empty() => {
                Ok(Self { from: first.at, until: last.at, environment, figures })
            }
            _ => Err(BaselineError::NoFigure),
        }
    }

    /// Time of its first run.
    pub fn from(&self) -> Timestamp {
        self.from
    }

    /// Time of its last run.
    pub fn until(&self) -> Timestamp {
        self.until
    }

    /// What temperature does to the figures.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Names of the figures.
    pub fn figures(&self) -> impl Iterator<Item = &str> {
        self.figures.keys().map(String::as_str)
    }

    /// Names of the cells, in order.
    pub fn cells(&self) -> Vec<&str> {
        let mut cells: Vec<&str> = self
            .figures
            .values()
            .flat_map(|known| known.cells.keys())
            .map(String::as_str)
            .collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// A figure of a cell.
    pub fn figure(&self, figure: &str, cell: &str) -> Option<BaselineFigure> {
        let known = self.figures.get(figure)?;
        let reference = known.cells.get(cell)?;
        Some(BaselineFigure {
            mean: known.mean(cell)?,
            runs: reference.runs(),
            temperature_c: reference.temperature_c(),
            per_k: reference.per_k(self.environment.slope(figure, cell), known.ratio(cell)),
        })
    }

    /// Scatter of a figure between runs against stated errors, pooled over the cells; `None` if the figure is not in the baseline.
    pub fn scatter(&self, figure: &str) -> Option<Scatter> {
        self.figures.get(figure).map(|known| known.scatter)
    }

    /// What is said about a figure's scatter.
    pub fn scatter_in_words(&self, figure: &str) -> String {
        let scatter = self.scatter(figure).unwrap_or_default();
        match scatter.ratio().filter(|_| scatter.degrees_of_freedom() >= FEWEST_DIFFERENCES) {
            Some(ratio) => format!(
                "between runs it scatters by {} times its stated errors ({} degrees of freedom, all cells together)",
                uncertain(ratio),
                scatter.degrees_of_freedom()
            ),
            None => "its scatter between runs is unknown from this baseline; it is learned from the runs that follow"
                .to_owned(),
        }
    }

    pub(crate) fn known(&self) -> &BTreeMap<String, Known> {
        &self.figures
    }
}
