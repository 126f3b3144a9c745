//! `fieldgap scan`: a plan scanned on a rig, the record kept.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};

use clap::Args;
use miette::{IntoDiagnostic, miette};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};

use super::ENDED_PARTIAL;
use super::output::{fresh_folder, print_json};
use super::progress::{Progress, say};
use super::stop::StopRequests;
use super::watch::{Controls, Watching};
use super::watchdog::watchdog;
use crate::rig_file::{RigFile, simulated_devices};
use crate::terminal::Screen;
use crate::terminal::watch::ScanView;
use fieldgap_acquisition::{
    AcquisitionError, DryRun, Ending, Event, PauseSwitch, PlannedScan, ScanRun,
};

/// What a scan is asked for, here and for `run`.
#[derive(Debug, Args)]
pub(super) struct ScanArgs {
    /// The plan (see scans/)
    plan: PathBuf,
    /// The rig file; without it the one that the plan names
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// The folder for the record; without it out/NAME of the plan
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Only check the plan against the rig file, and say what it comes to
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    showing: Showing,
}

/// How a running scan is shown.
#[derive(Debug, Args)]
pub(super) struct Showing {
    /// Show the scan on the whole terminal: its map filling in, and keys to let it wait or end
    #[arg(long, conflicts_with = "json")]
    watch: bool,
    /// Tell every event as a line of JSON
    #[arg(long)]
    json: bool,
}

/// The `scan` command.
#[derive(Debug, Args)]
pub(super) struct Scan {
    #[command(flatten)]
    args: ScanArgs,
}

/// What became of a scan.
pub(super) enum Scanned {
    /// It was only checked.
    Checked,
    /// It was done; the record is in the folder. `diagnose` is what the plan says of it.
    Done { folder: PathBuf, ending: Ending, diagnose: bool },
}

impl Scan {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        match self.args.scan()? {
            Scanned::Checked => Ok(ExitCode::SUCCESS),
            Scanned::Done { folder, ending, .. } => Ok(told(&folder, &ending)),
        }
    }
}

impl ScanArgs {
    /// Checks the plan, then scans it unless only the check was asked for.
    pub(super) fn scan(&self) -> miette::Result<Scanned> {
        self.showing.is_possible()?;
        let scan = PlannedScan::read(&self.plan, self.rig.as_deref())?;
        RigFile::of(scan.rig_setup().clone())?.check_truth()?;
        let check = scan.dry_run()?;
        if self.dry_run && self.showing.json {
            print_json(&check)?;
            return Ok(Scanned::Checked);
        }
        eprintln!("{}", in_words(&check));
        if self.dry_run {
            return Ok(Scanned::Checked);
        }
        let folder = self.out.clone().unwrap_or_else(|| fresh_folder(scan.name()));
        let diagnose = scan.plan().diagnose;
        let ending = conduct(ScanRun::begin(scan, &folder, simulated_devices), &self.showing)?;
        Ok(Scanned::Done { folder, ending, diagnose })
    }
}

/// Runs a session to its end, shown as it goes, ended safe by Ctrl-C, a closed terminal or a request to terminate.
pub(super) fn conduct(
    session: impl Future<Output = Result<ScanRun, AcquisitionError>>,
    showing: &Showing,
) -> miette::Result<Ending> {
    let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
    let ending = runtime.block_on(async {
        let stop = StopRequests::listen().into_diagnostic()?;
        let mut session = session.await?;
        session.guard(watchdog()?)?;
        let (abort, mut aborted) = unbounded_channel();
        let progress = Arc::new(Mutex::new(showing.begin(&mut session, abort.clone())?));
        let show = {
            let progress = Arc::clone(&progress);
            move |event: &Event| {
                progress.lock().unwrap_or_else(PoisonError::into_inner).show(event);
            }
        };
        let (tell, told) = unbounded_channel();
        let monitor = tokio::spawn(session.monitor().follow(told, show.clone()));
        let asked = async {
            tokio::select! {
                who = stop.first() => who,
                // Never closed: this holds an end of it.
                Some(who) = aborted.recv() => who,
            }
        };
        let watch = &mut |event: &Event| {
            show(event);
            let _ = tell.send(event.clone());
        };
        let ending = session.run(watch, asked).await;
        drop(tell);
        let _ = monitor.await;
        Ok(ending?)
    });
    // Signals stay in the runtime's hands for as long as the program lives: the listener goes on.
    std::mem::forget(runtime);
    ending
}

impl Showing {
    /// Makes sure that there is a terminal where one is needed.
    pub(super) fn is_possible(&self) -> miette::Result<()> {
        if self.watch && !Screen::is_possible() {
            return Err(miette!(
                help = "leave --watch out, or start it in a terminal",
                "--watch needs a terminal, and there is none"
            ));
        }
        Ok(())
    }

    fn begin(
        &self,
        session: &mut ScanRun,
        abort: UnboundedSender<&'static str>,
    ) -> miette::Result<Progress> {
        if self.json {
            return Ok(Progress::json());
        }
        if !self.watch {
            return Ok(Progress::bar(session.visits(), session.done()));
        }
        let receiver = session.receiver().clone();
        let scan = session.scan();
        let view = ScanView::new(
            scan.plan(),
            scan.visits(),
            session.kept(),
            receiver.unit,
            receiver.full_scale,
        );
        let (switch, pause) = PauseSwitch::new();
        session.paused_by(pause);
        let watching = Watching::begin(view, Controls { pause: switch, abort });
        Ok(Progress::Screen(watching.into_diagnostic()?))
    }
}

/// Says where the record is and how to go on with it.
pub(super) fn told(folder: &Path, ending: &Ending) -> ExitCode {
    say(&format!("record: {}", folder.display()));
    match ending {
        Ending::Complete => ExitCode::SUCCESS,
        Ending::Partial { .. } => {
            say(&format!("`fieldgap resume {}` finishes it", folder.display()));
            ExitCode::from(ENDED_PARTIAL)
        }
    }
}

fn in_words(check: &DryRun) -> String {
    format!(
        "{} readings ({} in silence, {} at the reference point), {:.1} m of way, about {} on the robot's clock, {:.1} MiB",
        check.visits,
        check.dark,
        check.references,
        check.way_m,
        indicatif::HumanDuration(check.about()),
        check.bytes as f64 / f64::from(1 << 20)
    )
}
