//! The surroundings of a campaign: this computer's clock, the rigs of the benches, persons and programs.

use std::path::{Path, PathBuf};

use async_trait::async_trait;
use jiff::Timestamp;
use tokio::sync::{mpsc, watch};

use super::news::Teller;
use super::person;
use super::programs::{READING_LIMIT, SETTING_LIMIT, run};
use crate::cli::closing::{Closing, close};
use crate::cli::compare::ComparisonArgs;
use crate::cli::output::{say, silently};
use crate::cli::sounding::keep_scan;
use crate::cli::watchdog::watchdog;
use crate::rig_file::simulated_devices;
use fieldgap_acquisition::{Ending, Event, PlannedScan, ScanRun, read_air};
use fieldgap_archive::{FIGURES, RecordFigures};
use fieldgap_campaign::{
    After, Bench, Cell, CellFigures, Condition, ConditionValue, ConfirmedBy, Laboratory, Measured,
    News, Overview, Sensor, SetBy, Use,
};
use fieldgap_correction::correct_rig_file;
use fieldgap_diagnosis::{diagnose, diagnose_change};
use fieldgap_monitoring::Run;
use fieldgap_reanalysis::{FOLDER as REANALYSES, ReanalysisName};
use fieldgap_records::{Hooks, Note, NoteKind, RecordedScan, ScanSetup};
use fieldgap_report::write_campaign;

/// The laboratory that the command works in.
pub(super) struct ThisLaboratory {
    pub(super) teller: Teller,
    pub(super) after: After,
    /// The rig file of each bench.
    pub(super) rigs: Vec<PathBuf>,
    /// Hooks of plans and rig files that were agreed to.
    pub(super) agreed: Vec<Hooks>,
    /// Who asked to stop.
    pub(super) stop: watch::Receiver<Option<&'static str>>,
}

#[async_trait(?Send)]
impl Laboratory for ThisLaboratory {
    fn now(&self) -> Timestamp {
        Timestamp::now()
    }

    async fn wait_until(&self, at: Timestamp) {
        // In steps, so that a changed or suspended clock is noticed.
        const STEP: std::time::Duration = std::time::Duration::from_secs(60);
        let left = std::time::Duration::try_from(at.duration_since(self.now())).unwrap_or_default();
        tokio::select! {
            () = tokio::time::sleep(left.min(STEP)) => {}
            _ = self.asked_to_stop() => {}
        }
    }

    fn stop_asked(&self) -> Option<&'static str> {
        *self.stop.borrow()
    }

    async fn set(&self, condition: &Condition, value: &ConditionValue) -> Result<(), String> {
        let set = async {
            match &condition.setting {
                SetBy::Program(program) => {
                    let program = program.clone().with_arguments(|text| value.within(text));
                    run(&program, SETTING_LIMIT).await.map(drop)
                }
                SetBy::Person(question) => {
                    let question = value.within(question);
                    self.teller.question(&question).await;
                    match person::asked(&self.teller.folder, &question).await? {
                        true => Ok(()),
                        false => Err("the answer was no".to_owned()),
                    }
                }
            }
        };
        tokio::select! {
            set = set => set,
            who = self.asked_to_stop() => Err(who.to_owned()),
        }
    }

    async fn read(
        &self,
        by: &ConfirmedBy,
        value: &ConditionValue,
        benches: &[Bench],
    ) -> Result<Option<f64>, String> {
        match by {
            ConfirmedBy::Success(program) => {
                let program = program.clone().with_arguments(|text| value.within(text));
                run(&program, READING_LIMIT).await.map(|_| None)
            }
            ConfirmedBy::Number(program, _) => {
                let program = program.clone().with_arguments(|text| value.within(text));
                let printed = run(&program, READING_LIMIT).await?;
                let number = printed.parse::<f64>().ok().filter(|number| number.is_finite());
                number.map(Some).ok_or_else(|| format!("{} printed no number", program.program()))
            }
            ConfirmedBy::Sensor(sensor, _) => {
                for bench in benches {
                    let setup = bench.setup().map_err(|fault| fault.to_string())?;
                    let air = read_air(&setup, simulated_devices).await;
                    let Some(air) = air.map_err(|error| error.to_string())? else { continue };
                    let reading = match sensor {
                        Sensor::TemperatureC => Some(air.temperature_c),
                        Sensor::HumidityPercent => air.humidity_percent,
                    };
                    return reading
                        .map(Some)
                        .ok_or_else(|| format!("the sensor gives no {sensor}"));
                }
                Err("no rig of the campaign has a sensor of the air, [environment]".to_owned())
            }
        }
    }

    async fn measure(
        &self,
        scan: PlannedScan,
        folder: &Path,
        resume: bool,
    ) -> Result<Measured, String> {
        let hooks = scan.hooks();
        let hooks = if self.agreed.contains(&hooks) { hooks } else { Hooks::default() };
        self.scanned(scan, folder, resume, &hooks).await.map_err(|error| in_one_line(&error))
    }

    async fn close(&self, cell: &Cell, folder: &Path) -> Result<(), String> {
        if !self.after.compare {
            return Ok(());
        }
        let closing = if self.after.diagnose { Closing::Cause } else { Closing::Comparison };
        compared(folder, closing).await?;
        if self.after.apply { self.corrected(folder, &self.rigs[cell.bench]).await } else { Ok(()) }
    }

    fn figures_of(
        &self,
        folder: &Path,
        setting: &str,
        at: Option<Timestamp>,
    ) -> Option<CellFigures> {
        figures_of(folder, setting, at)
    }

    async fn explain(
        &self,
        before: (&Path, Timestamp),
        after: (&Path, Timestamp),
    ) -> Option<String> {
        let records = [before, after].map(|(folder, at)| (folder.to_owned(), at));
        let explained = tokio::task::spawn_blocking(move || {
            let [before, after] = records.map(|(folder, at)| {
                let mut scan = RecordedScan::open(&folder).ok()?;
                // Every record of a virtual rig begins at one time; the campaign knows when it was made.
                scan.setup.recorded = at.round(jiff::Unit::Second).unwrap_or(at);
                Some(scan)
            });
            diagnose_change(&before?, &after?, None).ok()
        });
        Some(explained.await.ok()??.sentence.replace('\u{a0}', " "))
    }

    async fn tell(&self, news: News<'_>) {
        if let News::Alarm { folder, alarm, cause, .. } = &news {
            let text = [Some(alarm.to_string()), cause.map(str::to_owned)];
            let text = text.into_iter().flatten().collect::<Vec<_>>().join(". ");
            // The history of records marks it.
            let note = Note::new(self.now(), "fieldgap campaign", &text.replace('\u{a0}', " "));
            let kept = note.and_then(|note| note.of_kind(NoteKind::Alarm).add_to(folder));
            if let Err(error) = kept {
                say(format!("the alarm is not noted in its record: {error}"));
            }
        }
        self.teller.tell(&news).await;
    }

    async fn draw(&self, overview: Overview) {
        let drawn = tokio::task::spawn_blocking(move || write_campaign(&overview));
        if let Ok(Err(error)) = drawn.await {
            say(format!("the page cannot be written: {error}"));
        }
    }
}

impl ThisLaboratory {
    /// Resolves when somebody asks to stop, with who.
    async fn asked_to_stop(&self) -> &'static str {
        let mut stop = self.stop.clone();
        let asked = stop.wait_for(Option::is_some).await.map(|who| *who);
        match asked {
            Ok(Some(who)) => who,
            _ => std::future::pending().await,
        }
    }

    async fn scanned(
        &self,
        scan: PlannedScan,
        folder: &Path,
        resume: bool,
        hooks: &Hooks,
    ) -> miette::Result<Measured> {
        let way_m = scan.dry_run()?.way_m;
        let mut scan_run = match resume {
            true => ScanRun::resume(folder, simulated_devices).await?,
            false => ScanRun::begin(scan, folder, simulated_devices).await?,
        };
        scan_run.guard(watchdog()?, hooks)?;
        let (tell, told) = mpsc::unbounded_channel();
        let monitor = tokio::spawn(scan_run.monitor(hooks.clone()).follow(told, |_: &Event| {}));
        let watch = &mut |event: &Event| {
            let _ = tell.send(event.clone());
        };
        let rig_setup = scan_run.scan().rig_setup().clone();
        let ending = scan_run.run(watch, self.asked_to_stop()).await;
        keep_scan(&rig_setup, folder);
        drop(tell);
        let _ = monitor.await;
        Ok(match ending? {
            Ending::Partial { reason } => Measured::Partial(reason),
            Ending::Complete => Measured::Complete(taken(folder, way_m)?),
        })
    }

    /// Corrects the rig file by the named cause, scans once more with it beside the record, and compares. Nothing is done without a named cause.
    async fn corrected(&self, folder: &Path, original: &Path) -> Result<(), String> {
        let again = folder.join("corrected-rig/scan");
        if again.join("report/index.html").is_file() {
            return Ok(());
        }
        let rig = folder.join("corrected-rig/rig.toml");
        let (record, out, original) = (folder.to_owned(), rig.clone(), original.to_owned());
        let corrected = tokio::task::spawn_blocking(move || -> Result<bool, String> {
            if out.is_file() {
                return Ok(true);
            }
            let scan = RecordedScan::open(&record).map_err(|fault| fault.to_string())?;
            let scans = [scan];
            let diagnosis = diagnose(&scans, None).map_err(|error| error.to_string())?;
            if !diagnosis.verdict.names_a_cause() {
                return Ok(false);
            }
            std::fs::create_dir_all(out.parent().unwrap_or(&record))
                .map_err(|error| error.to_string())?;
            let corrected = correct_rig_file(&diagnosis, &scans[0].setup, &original, &out);
            corrected.map(|_| true).map_err(|error| format!("not corrected: {error}"))
        });
        if !corrected.await.map_err(|error| error.to_string())?? {
            return Ok(());
        }
        let plan = folder.join("plan.toml");
        let scan = PlannedScan::read(&plan, Some(&rig)).map_err(|error| error.to_string())?;
        let resume = again.join("state.toml").is_file();
        let hooks = Hooks::default();
        let measured = self.scanned(scan, &again, resume, &hooks).await;
        match measured.map_err(|error| in_one_line(&error))? {
            Measured::Complete(_) => compared(&again, Closing::Comparison).await,
            Measured::Partial(reason) => {
                Err(format!("the scan with the corrected rig file: {reason}"))
            }
        }
    }
}

/// The figures of the record in a folder, as those of a setting.
pub(super) fn figures_of(
    folder: &Path,
    setting: &str,
    at: Option<Timestamp>,
) -> Option<CellFigures> {
    as_of_cell(RecordFigures::read(folder).ok()??, folder, setting, at)
}

/// The same, from a reanalysis of the record.
pub(super) fn reanalysed_figures_of(
    folder: &Path,
    name: &ReanalysisName,
    setting: &str,
    at: Option<Timestamp>,
) -> Option<CellFigures> {
    let file = folder.join(REANALYSES).join(name.to_string()).join(FIGURES);
    as_of_cell(RecordFigures::read_file(&file).ok()??, folder, setting, at)
}

fn as_of_cell(
    figures: RecordFigures,
    folder: &Path,
    setting: &str,
    at: Option<Timestamp>,
) -> Option<CellFigures> {
    let recorded = || Some(ScanSetup::read(&folder.join("scan.toml")).ok()?.recorded);
    let series = figures.series().into_iter().map(|(name, figure)| (name.into(), figure));
    let run = Run {
        cell: setting.to_owned(),
        at: at.or_else(recorded)?,
        temperature_c: figures.air.map(|air| air.temperature_c),
        figures: series.collect(),
    };
    Some(CellFigures { run, verdict: figures.cause.map(|cause| cause.verdict.name().to_owned()) })
}

/// Compares a record and writes its report.
async fn compared(folder: &Path, closing: Closing) -> Result<(), String> {
    let folder = folder.to_owned();
    let compared = tokio::task::spawn_blocking(move || {
        let report = folder.join("report");
        silently(|| close(&folder, &ComparisonArgs::default(), &report, closing)).map(drop)
    });
    compared.await.map_err(|error| error.to_string())?.map_err(|error| in_one_line(&error))
}

/// What a complete scan took: its time, and that between its first and last reading with the array driven.
fn taken(folder: &Path, way_m: f64) -> miette::Result<Use> {
    let scan = RecordedScan::open(folder)?;
    let times = |driven_only: bool| {
        let of = scan.samples.iter().filter(move |sample| !driven_only || sample.focus.is_some());
        let times = of.map(|sample| sample.time_s);
        times.clone().fold(0.0, f64::max) - times.fold(f64::INFINITY, f64::min)
    };
    let positive = |seconds: f64| if seconds.is_finite() { seconds.max(0.0) } else { 0.0 };
    Ok(Use { time_s: positive(times(false)), emitting_s: positive(times(true)), way_m })
}

/// An error and its causes, on one line.
fn in_one_line(error: &miette::Report) -> String {
    let causes: Vec<String> = error.chain().map(ToString::to_string).collect();
    causes.join(": ").split_whitespace().collect::<Vec<_>>().join(" ")
}
