//! What a campaign needs from outside: a clock, rigs, persons and programs.

use std::path::Path;

use async_trait::async_trait;
use jiff::Timestamp;

use super::bench::Bench;
use super::budget::Use;
use super::condition::{Condition, ConditionValue, ConfirmedBy};
use super::design::Cell;
use super::follow::CellFigures;
use super::overview::Overview;
use fieldgap_acquisition::PlannedScan;
use fieldgap_monitoring::{Alarm, Run};

/// How the scan of a cell ended. In either case the rig is safe and the record on disk.
#[derive(Debug, Clone, PartialEq)]
pub enum Measured {
    /// Every point was measured.
    Complete(Use),
    /// It ended early, and can be resumed.
    Partial(String),
}

/// What a campaign tells.
#[derive(Debug, Clone, PartialEq)]
pub enum News<'a> {
    /// A round began.
    Round(u32),
    /// It waits until then.
    Waits(Timestamp, &'static str),
    /// A condition was set, and read as this.
    Set(&'a Condition, &'a ConditionValue, Option<f64>),
    /// A condition was not set, for a reason.
    NotSet(&'a Condition, &'a ConditionValue, &'a str),
    /// The scan of a cell begins.
    Begins(&'a str),
    /// A cell is done. Its run is there if it was compared.
    Closed {
        /// The cell's folder.
        folder: &'a Path,
        /// Its figures.
        run: Option<&'a Run>,
        /// Change of the gap against the baseline, relative, if both are known.
        gap_change: Option<f64>,
        /// What could not be done after the scan.
        problem: Option<&'a str>,
    },
    /// A cell failed, for a reason.
    Failed(&'a str, &'a str),
    /// A figure left its limits.
    Alarm {
        /// The cell's folder.
        folder: &'a Path,
        /// The alarm.
        alarm: &'a Alarm,
        /// What a comparison of the records before and after says.
        cause: Option<&'a str>,
        /// Its figures.
        run: &'a Run,
    },
    /// A rig is left alone, for a reason.
    RigLeft(&'a str, &'a str),
    /// The process ends; the reason if not because all is done.
    Ended(Option<&'a str>),
}

/// The surroundings of a campaign.
#[async_trait(?Send)]
pub trait Laboratory {
    /// The time.
    fn now(&self) -> Timestamp;

    /// Waits until a time, or until somebody asks to stop.
    async fn wait_until(&self, at: Timestamp);

    /// Who asked to stop, if anybody.
    fn stop_asked(&self) -> Option<&'static str>;

    /// Sets a condition: runs the program, or asks the person.
    ///
    /// # Errors
    /// Why it is not set.
    async fn set(&self, condition: &Condition, value: &ConditionValue) -> Result<(), String>;

    /// Reads what confirms a condition: a number, or none where a program only says that it holds.
    ///
    /// # Errors
    /// Why there is no reading, or the condition does not hold.
    async fn read(
        &self,
        by: &ConfirmedBy,
        value: &ConditionValue,
        benches: &[Bench],
    ) -> Result<Option<f64>, String>;

    /// Scans a cell into a folder, or resumes the scan in it.
    ///
    /// # Errors
    /// Why there is no scan.
    async fn measure(
        &self,
        scan: PlannedScan,
        folder: &Path,
        resume: bool,
    ) -> Result<Measured, String>;

    /// Does what follows the scan of a cell.
    ///
    /// # Errors
    /// What could not be done.
    async fn close(&self, cell: &Cell, folder: &Path) -> Result<(), String>;

    /// The figures of the record in a folder, as a run of the setting at the time `at`; `None` if it was not compared. Without a time it is
    /// that of the record, which is the same for every scan on a virtual rig.
    fn figures_of(
        &self,
        folder: &Path,
        setting: &str,
        at: Option<Timestamp>,
    ) -> Option<CellFigures>;

    /// What changed from the first of two records to the second, in a sentence; each with the time at which it was complete.
    async fn explain(
        &self,
        before: (&Path, Timestamp),
        after: (&Path, Timestamp),
    ) -> Option<String>;

    /// Tells a person or a program.
    async fn tell(&self, news: News<'_>);

    /// Draws the page of the campaign.
    async fn draw(&self, overview: Overview);
}
