//! What a run is judged to be: the points of its charts, alarms, and what could not be judged.

use std::fmt;

use fieldgap_text::Uncertain;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::alarm::{Alarm, Scope};

/// The judgement of one run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Judgement {
    /// Charts beyond their limits.
    pub alarms: Vec<Alarm>,
    /// A point for every chart that the run is on.
    pub charts: Vec<ChartPoint>,
    /// What could not be judged or corrected, and why.
    pub notes: Vec<Note>,
}

/// One run on one chart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChartPoint {
    /// The figure.
    pub figure: String,
    /// The cell of the run.
    pub cell: String,
    /// Whose runs the chart takes.
    pub scope: Scope,
    /// Time of the run.
    pub at: Timestamp,
    /// The figure, corrected to the baseline's temperature; its error is that of this run with the correction's and with scatter between
    /// runs.
    pub value: Uncertain,
    /// The baseline as it was before this run, with its error.
    pub baseline: Option<Uncertain>,
    /// Difference of the two in standard errors, as a normal score; `None` while the scatter between runs is unknown.
    pub z: Option<f64>,
    /// The chart's statistic, in the unit of its limit; below zero for a fall.
    pub statistic: Option<f64>,
    /// The limit of the statistic.
    pub limit: f64,
    /// Which sides of the baseline have a limit.
    pub sides: crate::settings::Sides,
    /// Whether the statistic is beyond the limit.
    pub alarm: bool,
}

/// Something that could not be judged or corrected.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Note {
    /// The run has no temperature.
    NoTemperature,
    /// The figure is in no run of the baseline.
    NotInBaseline {
        /// The figure.
        figure: String,
    },
    /// The figure is not a number.
    NotANumber {
        /// The figure.
        figure: String,
    },
    /// The cell's runs do not determine yet what the figure is expected to be.
    Learning {
        /// The figure.
        figure: String,
        /// Runs of the cell so far, this one included.
        runs: u32,
    },
    /// The scatter between runs is not known yet.
    ScatterUnknown {
        /// The figure.
        figure: String,
    },
}

impl fmt::Display for Note {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoTemperature => out.write_str(
                "the run has no reading of the air's temperature, so its figures are not corrected for it: a change of temperature \
                 shows as a change of the figures",
            ),
            Self::NotInBaseline { figure } => {
                write!(out, "{figure} is not charted, because no run of the baseline holds it")
            }
            Self::NotANumber { figure } => write!(out, "{figure} is not a number in this run"),
            Self::Learning { figure, runs } => write!(
                out,
                "{figure} is not judged yet: {runs} run{} of this cell do not determine its mean and its change with temperature",
                if *runs == 1 { "" } else { "s" }
            ),
            Self::ScatterUnknown { figure } => write!(
                out,
                "{figure} is not judged yet: its scatter between runs is unknown until more runs are there"
            ),
        }
    }
}
