//! Figures followed over time: baselines, control charts and alarms.
//!
//! The same cells are run again and again. Each [`Run`] gives named figures with standard errors. A [`Monitor`] compares them
//! with a [`Baseline`] and says when one has changed, by control charts whose limits keep false alarms rare.
//!
//! ```
//! use fieldgap_monitoring::{Baseline, Environment, Monitor, Run, Settings};
//! use fieldgap_text::Uncertain;
//!
//! let gap = |cell: &str, hour: i64, value: f64| Run {
//!     cell: cell.to_owned(),
//!     at: jiff::Timestamp::from_second(1_795_000_000 + 3600 * hour).expect("in range"),
//!     temperature_c: None,
//!     figures: [("gap".to_owned(), Uncertain { value, standard_error: 0.001 })].into(),
//! };
//! // Four rounds of two cells, then the gap of both is a tenth larger.
//! let noise = [0.3, -0.8, 1.1, -0.4, -1.2, 0.7, 0.2, -0.1];
//! let rounds: Vec<Run> = (0..8)
//!     .map(|n| gap(["near", "far"][n % 2], n as i64, 0.18 + 0.001 * noise[n]))
//!     .collect();
//! let baseline = Baseline::of_runs(&rounds, Environment::default())?;
//! let mut monitor = Monitor::new(Settings::default(), &baseline);
//! let first = monitor.judge(&gap("near", 8, 0.198));
//! let second = monitor.judge(&gap("far", 9, 0.199));
//! let alarm = first.alarms.first().or(second.alarms.first()).expect("an alarm");
//! assert!(alarm.to_string().starts_with("The gap of all cells grew by"), "{alarm}");
//! # Ok::<(), fieldgap_monitoring::BaselineError>(())
//! ```
//!
//! | file | what it holds |
//! |---|---|
//! | `run`, `settings`, `environment` | what comes in: runs, how rare false alarms are to be, what temperature does |
//! | `reference`, `baseline` | what a figure is expected to be, and how much it scatters |
//! | `normal`, `run_length` | distributions, average run lengths and limits |
//! | `chart`, `change_point`, `history` | the statistic of a chart, since when a change is there and how large it is |
//! | `monitor`, `judgement`, `alarm` | the charts of all figures together, and what is said of a run |

mod alarm;
mod baseline;
mod change_point;
mod chart;
mod environment;
mod history;
mod judgement;
mod monitor;
mod normal;
mod reference;
mod run;
mod run_length;
mod settings;

pub use alarm::{Alarm, Scope};
pub use baseline::{Baseline, BaselineError, BaselineFigure};
pub use environment::{Environment, Slope};
pub use judgement::{ChartPoint, Judgement, Note};
pub use monitor::{Acknowledgement, Expect, Monitor};
pub use reference::Scatter;
pub use run::Run;
pub use run_length::Statistic;
pub use settings::{ChartKind, Settings, SettingsError, Sides, Tolerance};
