//! A laboratory of the tests: its clock moves when somebody waits, its scans are made at once.

#![allow(dead_code)] // Each test uses a part of it.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use async_trait::async_trait;
use jiff::{SignedDuration, Timestamp};

use fieldgap_acquisition::PlannedScan;
use fieldgap_campaign::{
    Bench, Campaign, CampaignEnd, CampaignFolder, Cell as CampaignCell, CellFigures, Condition,
    ConditionValue, ConfirmedBy, Laboratory, Measured, News, Overview, Runner, Selection, Use,
};
use fieldgap_input::TomlSource;
use fieldgap_monitoring::Run;
use fieldgap_text::Uncertain;

/// How a scan of the fake laboratory ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scan {
    Complete,
    Fails,
    /// The process is killed in the middle of it.
    Killed,
    /// The process is killed while the record is made, before its `scan.toml`.
    KilledBeforeItsSetup,
}

type Answers<T> = RefCell<Box<dyn FnMut(&str) -> T>>;

pub struct FakeLaboratory {
    pub now: Cell<Timestamp>,
    /// What is said of the scan of a cell, by its folder's name.
    pub scans: Answers<Scan>,
    /// The gap of a record.
    pub gaps: Answers<f64>,
    /// The gap of a record by its folder, in place of `gaps`.
    #[allow(clippy::type_complexity)]
    pub gaps_by_folder: RefCell<Option<Box<dyn FnMut(&Path) -> f64>>>,
    /// What a sensor reads.
    pub readings: Answers<Option<f64>>,
    pub measured: RefCell<Vec<(Timestamp, String)>>,
    pub told: RefCell<Vec<String>>,
    pub last: RefCell<Option<Overview>>,
    /// The questions that the page showed while a condition was set.
    pub shown_questions: RefCell<Vec<String>>,
    /// The value of a condition that cannot be set.
    pub refused: RefCell<String>,
    /// Whether the process is killed when it next waits.
    pub killed_waiting: Cell<bool>,
    killed: Cell<bool>,
    pub stop_after: Cell<usize>,
}

/// How long each scan takes.
pub const SCAN: SignedDuration = SignedDuration::from_mins(10);

impl FakeLaboratory {
    pub fn at(now: &str) -> Self {
        Self {
            now: Cell::new(now.parse().expect("a time")),
            scans: RefCell::new(Box::new(|_| Scan::Complete)),
            gaps: RefCell::new(Box::new(|_| 0.18)),
            gaps_by_folder: RefCell::default(),
            readings: RefCell::new(Box::new(|_| None)),
            measured: RefCell::default(),
            told: RefCell::default(),
            last: RefCell::default(),
            shown_questions: RefCell::default(),
            refused: RefCell::default(),
            killed_waiting: Cell::new(false),
            killed: Cell::new(false),
            stop_after: Cell::new(usize::MAX),
        }
    }

    pub fn measured_cells(&self) -> Vec<String> {
        self.measured.borrow().iter().map(|(_, cell)| cell.clone()).collect()
    }

    /// The question that the page shows.
    pub fn shown_question(&self) -> Option<String> {
        self.last.borrow().as_ref().and_then(|overview| overview.question.clone())
    }

    /// The process lives again after a kill.
    pub fn revive(&self) {
        self.killed.set(false);
    }
}

fn name(folder: &Path) -> String {
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[async_trait(?Send)]
impl Laboratory for FakeLaboratory {
    fn now(&self) -> Timestamp {
        self.now.get()
    }

    async fn wait_until(&self, at: Timestamp) {
        self.now.set(at.max(self.now.get()));
        self.killed.set(self.killed.get() || self.killed_waiting.take());
    }

    fn stop_asked(&self) -> Option<&'static str> {
        let enough = self.measured.borrow().len() >= self.stop_after.get();
        if self.killed.get() {
            return Some("killed");
        }
        enough.then_some("asked to stop")
    }

    async fn set(&self, condition: &Condition, value: &ConditionValue) -> Result<(), String> {
        self.told.borrow_mut().push(format!("set {} {}", condition.name, value.label));
        self.shown_questions.borrow_mut().extend(self.shown_question());
        match *self.refused.borrow() == value.label {
            true => Err("the answer was no".to_owned()),
            false => Ok(()),
        }
    }

    async fn read(
        &self,
        _: &ConfirmedBy,
        value: &ConditionValue,
        _: &[Bench],
    ) -> Result<Option<f64>, String> {
        Ok((self.readings.borrow_mut())(&value.label))
    }

    async fn measure(
        &self,
        _: PlannedScan,
        folder: &Path,
        resume: bool,
    ) -> Result<Measured, String> {
        let name = name(folder);
        let write = |file: &str, text: &str| {
            std::fs::create_dir_all(folder).expect("a folder");
            std::fs::write(folder.join(file), text).expect("written");
        };
        let state = |text: &str| {
            write("state.toml", text);
            write("scan.toml", "");
        };
        assert_eq!(resume, folder.join("scan.toml").exists(), "{name}");
        assert_eq!(resume, folder.exists(), "{name}");
        self.now.set(self.now.get() + SCAN);
        match (self.scans.borrow_mut())(&name) {
            Scan::Complete => {
                state("state = \"complete\"\n");
                self.measured.borrow_mut().push((self.now.get(), name));
                Ok(Measured::Complete(Use { time_s: 600.0, emitting_s: 25.0, way_m: 2.0 }))
            }
            Scan::Fails => {
                state("state = \"partial\"\nreason = \"the receiver is silent\"\n");
                Ok(Measured::Partial("the receiver is silent".to_owned()))
            }
            Scan::Killed => {
                state("state = \"scanning\"\n");
                self.killed.set(true);
                Err("killed".to_owned())
            }
            Scan::KilledBeforeItsSetup => {
                write("state.toml", "state = \"scanning\"\n");
                self.killed.set(true);
                Err("killed".to_owned())
            }
        }
    }

    async fn close(&self, _: &CampaignCell, _: &Path) -> Result<(), String> {
        Ok(())
    }

    fn figures_of(
        &self,
        folder: &Path,
        setting: &str,
        at: Option<Timestamp>,
    ) -> Option<CellFigures> {
        let gap = match self.gaps_by_folder.borrow_mut().as_mut() {
            Some(gap) => gap(folder),
            None => (self.gaps.borrow_mut())(&name(folder)),
        };
        let figures = [("gap".to_owned(), Uncertain { value: gap, standard_error: 0.001 })];
        let run = Run {
            cell: setting.to_owned(),
            at: at.unwrap_or(self.now.get()),
            temperature_c: None,
            figures: BTreeMap::from(figures),
        };
        Some(CellFigures { run, verdict: None })
    }

    async fn explain(
        &self,
        before: (&Path, Timestamp),
        after: (&Path, Timestamp),
    ) -> Option<String> {
        assert!(before.1 < after.1);
        Some(format!("{} against {}", name(after.0), name(before.0)))
    }

    async fn tell(&self, news: News<'_>) {
        let told = match news {
            News::Alarm { alarm, cause, .. } => {
                format!("alarm {} {}", alarm.figure, cause.unwrap_or(""))
            }
            News::RigLeft(rig, reason) => format!("left {rig}: {reason}"),
            News::NotSet(condition, value, reason) => {
                assert_eq!(self.shown_question(), None, "it is answered");
                format!("not set {} {}: {reason}", condition.name, value.label)
            }
            News::Failed(cell, reason) => format!("failed {cell}: {reason}"),
            News::Ended(Some(reason)) => format!("ended: {reason}"),
            _ => return,
        };
        self.told.borrow_mut().push(told);
    }

    async fn draw(&self, overview: Overview) {
        *self.last.borrow_mut() = Some(overview);
    }
}

/// The campaign of a text, beside the plans of the repository.
pub fn campaign(text: &str) -> Campaign {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scans");
    let path = folder.join("campaign-of-a-test.toml");
    let head = "name = \"test\"\nplan = \"quick-look.toml\"\n";
    Campaign::parse(TomlSource::new(&path, format!("{head}{text}"))).expect("a campaign")
}

/// Runs a campaign in a folder, which is made if it is missing.
pub fn run(
    campaign: &Campaign,
    laboratory: &FakeLaboratory,
    folder: &Path,
    selection: Selection,
) -> CampaignEnd {
    let now = laboratory.now();
    let opened = match folder.join("campaign.jsonl").exists() {
        true => {
            let mut opened = CampaignFolder::open(folder).expect("a campaign");
            opened.log(now, fieldgap_campaign::What::Resumed).expect("written");
            opened
        }
        false => CampaignFolder::begin(campaign, folder, 7, now).expect("begun"),
    };
    let runner = Runner::new(campaign, opened, laboratory, selection).expect("a runner");
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_time().build().expect("a runtime");
    runtime.block_on(runner.run()).expect("the log can be written")
}

/// A new folder for a campaign.
pub fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("campaign");
    (folder, path)
}
