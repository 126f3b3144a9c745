//! The figures of a campaign's cells on control charts.

use std::collections::BTreeMap;
use std::path::PathBuf;

use fieldgap_monitoring::{
    Acknowledgement, Alarm, Baseline, BaselineError, ChartPoint, Environment, Monitor, Run,
    Settings,
};

/// The figure of the gap.
pub const GAP: &str = "gap";

/// Where the baseline's runs are from.
#[derive(Debug, Clone, PartialEq)]
pub enum BaselineRuns {
    /// The first rounds of the campaign, as many as this.
    FirstRounds(u32),
    /// Runs that were made before.
    Given(Vec<Run>),
}

/// A run of a cell, with its round and its folder.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedRun {
    /// The round, from 1.
    pub round: u32,
    /// The folder of the record.
    pub folder: PathBuf,
    /// Setting, time and figures.
    pub run: Run,
    /// The verdict of its diagnosis, if it was diagnosed.
    pub verdict: Option<String>,
}

/// What the record of a cell says.
#[derive(Debug, Clone, PartialEq)]
pub struct CellFigures {
    /// Setting, time and figures.
    pub run: Run,
    /// The verdict of its diagnosis, if it was diagnosed.
    pub verdict: Option<String>,
}

/// Follows the figures of all cells. The same runs in the same order give the same alarms.
#[derive(Debug, Clone)]
pub struct Follower {
    settings: Settings,
    baseline_runs: BaselineRuns,
    runs: Vec<FollowedRun>,
    acknowledged: Vec<Acknowledgement>,
    monitor: Option<Monitor>,
    baseline: Option<Baseline>,
    /// The charts' points, by figure.
    charts: BTreeMap<String, Vec<ChartPoint>>,
    /// Why there are no charts.
    why_none: Option<String>,
}

impl Follower {
    /// Follows runs from the beginning.
    pub fn new(settings: Settings, baseline_runs: BaselineRuns) -> Self {
        let mut follower = Self {
            settings,
            baseline_runs,
            runs: Vec::new(),
            acknowledged: Vec::new(),
            monitor: None,
            baseline: None,
            charts: BTreeMap::new(),
            why_none: Some("the first round is the baseline, and is not complete".to_owned()),
        };
        if let BaselineRuns::Given(runs) = &follower.baseline_runs {
            let runs = runs.clone();
            follower.begin(&runs);
        }
        follower
    }

    /// Takes the next run; gives its alarms, those that are new first.
    pub fn add(&mut self, followed: FollowedRun) -> Vec<Alarm> {
        if let BaselineRuns::FirstRounds(rounds) = self.baseline_runs
            && self.monitor.is_none()
            && followed.round > rounds
        {
            let first = self.runs.iter().filter(|one| one.round <= rounds);
            let first: Vec<Run> = first.map(|one| one.run.clone()).collect();
            self.begin(&first);
        }
        let alarms = self.judge(&followed.run);
        self.runs.push(followed);
        alarms
    }

    fn begin(&mut self, runs: &[Run]) {
        match Baseline::of_runs(runs, Environment::default()) {
            Ok(baseline) => {
                let mut monitor = Monitor::new(self.settings.clone(), &baseline);
                self.acknowledged.iter().for_each(|one| monitor.acknowledge(one));
                self.monitor = Some(monitor);
                self.baseline = Some(baseline);
                self.why_none = None;
            }
            Err(error) => self.why_none = Some(BaselineError::to_string(&error)),
        }
    }

    fn judge(&mut self, run: &Run) -> Vec<Alarm> {
        let Some(monitor) = &mut self.monitor else { return Vec::new() };
        let judgement = monitor.judge(run);
        for point in judgement.charts {
            self.charts.entry(point.figure.clone()).or_default().push(point);
        }
        judgement.alarms
    }

    /// Begins charts anew after somebody looked at the alarms.
    pub fn acknowledge(&mut self, acknowledgement: &Acknowledgement) {
        self.acknowledged.push(acknowledgement.clone());
        if let Some(monitor) = &mut self.monitor {
            monitor.acknowledge(acknowledgement);
        }
    }

    /// The runs so far.
    pub fn runs(&self) -> &[FollowedRun] {
        &self.runs
    }

    /// The points of each figure's charts.
    pub fn charts(&self) -> &BTreeMap<String, Vec<ChartPoint>> {
        &self.charts
    }

    /// Why there are no charts; `None` where there are.
    pub fn why_no_charts(&self) -> Option<&str> {
        self.why_none.as_deref()
    }

    /// Change of a run's gap against the baseline of its setting, relative to that; `None` without either.
    pub fn gap_change(&self, run: &Run) -> Option<f64> {
        let before = self.baseline.as_ref()?.figure(GAP, &run.cell)?.mean.value;
        Some(run.figures.get(GAP)?.value / before - 1.0)
    }

    /// The last run of an alarm's setting before the change: its record is what the changed one is compared with.
    pub fn before(&self, alarm: &Alarm, setting: &str) -> Option<&FollowedRun> {
        let before = |one: &&FollowedRun| one.run.cell == setting && one.run.at < alarm.since;
        self.runs.iter().rev().find(before)
    }
}
