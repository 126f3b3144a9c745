//! What a monitor is to do: how rare false alarms are to be, and the kind of chart.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Settings of a monitor. Only values that the computation of limits is made for can be held.
///
/// ```
/// use fieldgap_monitoring::{ChartKind, Settings};
///
/// let settings: Settings = toml::from_str(
///     "arl_runs = 2000\nchart = \"cusum\"\nk = 1.0\n[sides]\nefficiency = \"falls\"\n[tolerances]\nlevel = { percent = 2.0 }",
/// )?;
/// assert_eq!(settings.chart(), ChartKind::Cusum { k: 1.0 });
/// assert!(toml::from_str::<Settings>("arl_runs = 2").is_err());
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Table", into = "Table")]
pub struct Settings {
    arl_runs: f64,
    chart: ChartKind,
    sides: BTreeMap<String, Sides>,
    tolerances: BTreeMap<String, Tolerance>,
}

/// A change of a figure that is not to be found, such as a drift of the level that does not matter: only what is beyond it counts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tolerance {
    /// In percent of the baseline.
    Percent(f64),
    /// In the figure's unit.
    Absolute(f64),
}

impl Tolerance {
    /// In the figure's unit, at this baseline.
    pub fn about(self, baseline: f64) -> f64 {
        match self {
            Self::Percent(percent) => 0.01 * percent * baseline.abs(),
            Self::Absolute(absolute) => absolute,
        }
    }
}

/// The statistic of a chart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ChartKind {
    /// Exponentially weighted moving average; a large `lambda` finds large changes sooner, a small one small changes.
    Ewma {
        /// Weight of the newest run, 0.02 to 1.
        lambda: f64,
    },
    /// Cumulative sum.
    Cusum {
        /// Half of the change to be found, in standard errors, 0.1 to 3.
        k: f64,
    },
}

/// Which changes of a figure raise an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sides {
    /// Rises alone.
    Rises,
    /// Falls alone.
    Falls,
    /// Both.
    Both,
}

/// Why settings are refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Runs between false alarms.
    #[error(
        "`arl_runs` is {0}. It is the mean number of runs between two false alarms: set 20 to 1000000 (usual: 1000)"
    )]
    ArlRuns(f64),
    /// Weight of the EWMA.
    #[error(
        "`lambda` is {0}. It is the weight of the newest run in the average: set 0.02 to 1 (usual: 0.25)"
    )]
    Lambda(f64),
    /// Reference value of the CUSUM.
    #[error(
        "`k` is {0}. It is half of the change to be found, in standard errors: set 0.1 to 3 (usual: 0.5)"
    )]
    K(f64),
    /// A tolerance.
    #[error("the tolerance of {figure} is {value}. Set a number from zero on, or leave it out")]
    Tolerance {
        /// The figure.
        figure: String,
        /// The number.
        value: f64,
    },
    /// A parameter of the chart that was not chosen.
    #[error(
        "`{key}` does not belong to a chart of the kind \"{chart}\". Take it out, or set `chart = \"{other}\"`"
    )]
    OtherChart {
        /// The key.
        key: &'static str,
        /// The chart that was chosen.
        chart: &'static str,
        /// The chart that the key belongs to.
        other: &'static str,
    },
}

/// The default: at most one false alarm in 1,000 runs.
const ARL_RUNS: f64 = 1000.0;
/// Finds a change of 3 standard errors of one run within 3 runs; smaller weights are slower for such changes (docs/monitoring.md).
const LAMBDA: f64 = 0.25;
/// The usual value, best for a change of one standard error of a run.
const K: f64 = 0.5;

impl Default for Settings {
    fn default() -> Self {
        Self {
            arl_runs: ARL_RUNS,
            chart: ChartKind::Ewma { lambda: LAMBDA },
            sides: BTreeMap::new(),
            tolerances: BTreeMap::new(),
        }
    }
}

impl Settings {
    /// Settings of a chart and of the mean number of runs between false alarms.
    ///
    /// # Errors
    /// [`SettingsError`] if a value is out of range.
    pub fn new(arl_runs: f64, chart: ChartKind) -> Result<Self, SettingsError> {
        if !(20.0..=1e6).contains(&arl_runs) {
            return Err(SettingsError::ArlRuns(arl_runs));
        }
        match chart {
            ChartKind::Ewma { lambda } if !(0.02..=1.0).contains(&lambda) => {
                Err(SettingsError::Lambda(lambda))
            }
            ChartKind::Cusum { k } if !(0.1..=3.0).contains(&k) => Err(SettingsError::K(k)),
            _ => Ok(Self { arl_runs, chart, ..Self::default() }),
        }
    }

    /// As before, with the changes of one figure that raise an alarm.
    pub fn with_sides(mut self, figure: &str, sides: Sides) -> Self {
        self.sides.insert(figure.to_owned(), sides);
        self
    }

    /// As before, with a tolerance of one figure.
    ///
    /// # Errors
    /// [`SettingsError::Tolerance`] if it is below zero or not finite.
    pub fn with_tolerance(
        mut self,
        figure: &str,
        tolerance: Tolerance,
    ) -> Result<Self, SettingsError> {
        let (Tolerance::Percent(value) | Tolerance::Absolute(value)) = tolerance;
        if !(0.0..f64::INFINITY).contains(&value) {
            return Err(SettingsError::Tolerance { figure: figure.to_owned(), value });
        }
        self.tolerances.insert(figure.to_owned(), tolerance);
        Ok(self)
    }

    /// The tolerance of a figure.
    pub fn tolerance(&self, figure: &str) -> Option<Tolerance> {
        self.tolerances.get(figure).copied()
    }

    /// Mean number of runs between two false alarms, all charts of a run together.
    pub fn arl_runs(&self) -> f64 {
        self.arl_runs
    }

    /// The kind of chart.
    pub fn chart(&self) -> ChartKind {
        self.chart
    }

    /// Which changes of a figure raise an alarm. Unless set, rises of a gap and falls of a correlation, because their opposites
    /// are improvements; both of all other figures. The last part of a name with dots decides.
    pub fn sides(&self, figure: &str) -> Sides {
        self.sides.get(figure).copied().unwrap_or_else(|| {
            match figure.rsplit('.').next().unwrap_or(figure) {
                "gap" => Sides::Rises,
                "correlation" => Sides::Falls,
                _ => Sides::Both,
            }
        })
    }
}

/// The settings as they are written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    #[serde(default = "default_arl_runs")]
    arl_runs: f64,
    #[serde(default)]
    chart: ChartName,
    #[serde(skip_serializing_if = "Option::is_none")]
    lambda: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    k: Option<f64>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    sides: BTreeMap<String, Sides>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    tolerances: BTreeMap<String, Tolerance>,
}

fn default_arl_runs() -> f64 {
    ARL_RUNS
}

#[derive(Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ChartName {
    #[default]
    Ewma,
    Cusum,
}

impl TryFrom<Table> for Settings {
    type Error = SettingsError;

    fn try_from(table: Table) -> Result<Self, SettingsError> {
        let other = |key, chart, other| Err(SettingsError::OtherChart { key, chart, other });
        let chart = match (table.chart, table.lambda, table.k) {
            (ChartName::Ewma, _, Some(_)) => return other("k", "ewma", "cusum"),
            (ChartName::Cusum, Some(_), _) => return other("lambda", "cusum", "ewma"),
            (ChartName::Ewma, lambda, None) => ChartKind::Ewma { lambda: lambda.unwrap_or(LAMBDA) },
            (ChartName::Cusum, None, k) => ChartKind::Cusum { k: k.unwrap_or(K) },
        };
        let settings = Self { sides: table.sides, ..Self::new(table.arl_runs, chart)? };
        let mut tolerances = table.tolerances.into_iter();
        tolerances.try_fold(settings, |settings, (figure, tolerance)| {
            settings.with_tolerance(&figure, tolerance)
        })
    }
}

impl From<Settings> for Table {
    fn from(settings: Settings) -> Self {
        let (chart, lambda, k) = match settings.chart {
            ChartKind::Ewma { lambda } => (ChartName::Ewma, Some(lambda), None),
            ChartKind::Cusum { k } => (ChartName::Cusum, None, Some(k)),
        };
        Self {
            arl_runs: settings.arl_runs,
            chart,
            lambda,
            k,
            sides: settings.sides,
            tolerances: settings.tolerances,
        }
    }
}
