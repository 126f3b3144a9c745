//! A scan as a page draws it: its heights, its readings beside the simulation, its progress.

use std::path::Path;

use jiff::Timestamp;
use serde::Serialize;
use serde_json::{Value, json};

use fieldgap_acoustics::Simulation;
use fieldgap_acquisition::AirRow;
use fieldgap_records::{Plan, Record, SAME_HEIGHT_MM, ScanSetup, Visit, VisitKind};

/// The state of the process that runs the scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Stage {
    /// It measures.
    Scanning,
    /// It waits, the array silent.
    Paused,
    /// All is measured; the report is being written.
    Reporting,
    /// It has ended.
    Ended,
}

/// A reading: row, drive (-1 with the array silent), place in the array frame (mm), reading, simulated magnitude (no unit; 0 where there
/// is none), time (s), standard deviation of what was averaged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Reading(
    pub usize,
    pub i64,
    pub [f64; 3],
    pub f64,
    pub f64,
    pub f64,
    pub Option<f64>,
);

/// A height of the plan: its rectangle in the array frame, mm.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Height {
    z_mm: f64,
    x_mm: [f64; 2],
    y_mm: [f64; 2],
    points: usize,
}

/// A scan as a page draws it.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ScanView {
    name: String,
    /// Name of the folder below that of the records.
    folder: String,
    unit: String,
    of: usize,
    heights: Vec<Height>,
    stage: Stage,
    recorded: Timestamp,
    /// Why it ended early.
    reason: Option<String>,
    has_report: bool,
    readings: Vec<Reading>,
    /// Rows of the readings at the reference point.
    references: Vec<usize>,
    air: Vec<AirRow>,
}

impl ScanView {
    /// Of a record, whose plan is beside it if fieldgap runs it.
    pub fn new(folder: &Path, name: String, setup: &ScanSetup) -> Self {
        let visits = &planned_visits(folder).unwrap_or_default()[..];
        Self {
            name: setup.name.clone(),
            folder: name,
            unit: setup.unit.clone(),
            of: visits.len(),
            heights: heights(visits),
            stage: Stage::Scanning,
            recorded: setup.recorded,
            reason: None,
            has_report: false,
            readings: Vec::new(),
            references: references(visits),
            air: Vec::new(),
        }
    }

    /// Adds readings.
    pub fn add(&mut self, readings: &[Reading]) {
        self.readings.extend_from_slice(readings);
    }

    /// Sets the readings of the air; whether there are new ones.
    pub fn set_air(&mut self, air: Vec<AirRow>) -> bool {
        let new = air.len() != self.air.len();
        self.air = air;
        new
    }

    /// The readings of the air.
    pub fn air(&self) -> &[AirRow] {
        &self.air
    }

    /// Sets the stage; whether anything has changed.
    pub fn enter(&mut self, stage: Stage, reason: Option<String>, has_report: bool) -> bool {
        let changed = (self.stage, &self.reason, self.has_report) != (stage, &reason, has_report);
        (self.stage, self.reason, self.has_report) = (stage, reason, has_report);
        changed
    }

    /// The folder's name.
    pub fn folder(&self) -> &str {
        &self.folder
    }

    /// The stage.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// All but the readings and heights.
    pub fn progress(&self) -> Value {
        json!({
            "name": self.name, "folder": self.folder, "stage": self.stage, "done": self.readings.len(), "of": self.of,
            "reason": self.reason, "has_report": self.has_report,
        })
    }
}

/// Readings with their simulation, from the records of a journal that begin at row `first`.
pub(crate) fn readings(
    simulations: &[Option<Simulation>],
    first: usize,
    records: &[Record],
) -> Vec<Reading> {
    let reading = |(n, record): (usize, &Record)| {
        let sample = &record.sample;
        let simulation = sample.focus.and_then(|focus| simulations.get(focus)?.as_ref());
        let magnitude = simulation
            .and_then(|simulation| simulation.magnitudes(&[sample.position_m()]).first().copied())
            .filter(|magnitude| magnitude.is_finite());
        Reading(
            first + n,
            sample.focus.and_then(|focus| i64::try_from(focus).ok()).unwrap_or(-1),
            sample.position_mm.into(),
            sample.reading,
            magnitude.unwrap_or(0.0),
            sample.time_s,
            sample.spread.map(|spread| spread.std),
        )
    };
    records.iter().enumerate().map(reading).collect()
}

/// The readings that a record's plan asks for, in their order, if fieldgap runs it or ran it.
pub(crate) fn planned_visits(folder: &Path) -> Option<Vec<Visit>> {
    Plan::read(&folder.join("plan.toml")).ok().map(|plan| plan.visits())
}

/// The rows of the visits to the reference point.
fn references(visits: &[Visit]) -> Vec<usize> {
    let kinds = visits.iter().enumerate();
    kinds.filter(|(_, visit)| visit.kind == VisitKind::Reference).map(|(row, _)| row).collect()
}

/// The heights of a plan's points, in the order of the plan. Dark readings are at no height.
fn heights(visits: &[Visit]) -> Vec<Height> {
    let mut heights: Vec<Height> = Vec::new();
    for visit in visits.iter().filter(|visit| visit.kind == VisitKind::Point) {
        let [x, y, z]: [f64; 3] = (visit.position_m * 1e3).into();
        let same = heights.iter_mut().find(|height| (height.z_mm - z).abs() <= SAME_HEIGHT_MM);
        match same {
            Some(height) => {
                height.x_mm = [height.x_mm[0].min(x), height.x_mm[1].max(x)];
                height.y_mm = [height.y_mm[0].min(y), height.y_mm[1].max(y)];
                height.points += 1;
            }
            None => heights.push(Height { z_mm: z, x_mm: [x, x], y_mm: [y, y], points: 1 }),
        }
    }
    heights
}
