//! `fieldgap scan`: run a scan and record it.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};

use clap::Args;
use miette::{IntoDiagnostic, miette};
use serde::Serialize;
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};

use super::ENDED_PARTIAL;
use super::closed_loop::{LoopArgs, Opening, begun};
use super::exposure::Foreseen;
use super::map::{MapRequest, write_map};
use super::output::say;
use super::output::{fresh_folder, print_json};
use super::pause_signals::PauseSignals;
use super::permission::{Act, Permission};
use super::progress::Progress;
use super::sounding::keep_scan;
use super::stop::StopRequests;
use super::trust::{AgreedHooks, Trust, listed, programs};
use super::watch::{Controls, Watching};
use super::watchdog::watchdog;
use crate::rig_file::RigFile;
use crate::terminal::Screen;
use crate::terminal::watch::ScanView;
use fieldgap_acquisition::{
    AcquisitionError, DryRun, Ending, Event, PauseSwitch, PlannedScan, ScanRun,
};

/// Arguments of `scan` and `run`.
#[derive(Debug, Args)]
pub(super) struct ScanArgs {
    /// Plan file (examples are in scans/)
    plan: PathBuf,
    /// Rig file [default: the one named in the plan]
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Folder for the record [default: out/NAME, with the name of the plan]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Only check the plan against the rig file and print its size and duration
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    permission: Permission,
    #[command(flatten)]
    trust: Trust,
    #[command(flatten)]
    showing: Showing,
}

/// How the progress of a scan is shown.
#[derive(Debug, Args)]
pub(super) struct Showing {
    /// Show the scan full screen, with a live map and keys to pause or end it
    #[arg(long, conflicts_with = "json")]
    watch: bool,
    /// Print each event as a line of JSON
    #[arg(long)]
    json: bool,
}

/// A plan that was only checked, for programs.
#[derive(Debug, Serialize)]
struct Checked<'a> {
    #[serde(flatten)]
    check: &'a DryRun,
    #[serde(skip_serializing_if = "Option::is_none")]
    exposure: Option<&'a Foreseen>,
}

/// The `scan` command.
#[derive(Debug, Args)]
pub(super) struct Scan {
    #[command(flatten)]
    args: ScanArgs,
}

/// Result of `scan`.
pub(super) enum Scanned {
    /// The plan was only checked.
    Checked,
    /// The scan ran; its record is in `folder`. `diagnose` is the setting in the plan; `is_map` whether it was for a map, and not for a cause.
    Done { folder: PathBuf, ending: Ending, diagnose: bool, is_map: bool },
}

impl Scan {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        match self.args.scan(&LoopArgs::default())? {
            Scanned::Checked => Ok(ExitCode::SUCCESS),
            Scanned::Done { folder, ending, .. } => Ok(report_ending(&folder, &ending)),
        }
    }
}

impl ScanArgs {
    /// Whether events are printed as JSON.
    pub(super) fn prints_json(&self) -> bool {
        self.showing.prints_json()
    }

    /// Checks the plan, then runs it unless `--dry-run` is given.
    pub(super) fn scan(&self, in_loop: &LoopArgs) -> miette::Result<Scanned> {
        self.showing.is_possible()?;
        let scan = PlannedScan::read(&self.plan, self.rig.as_deref())?;
        RigFile::of(scan.rig_setup().clone())?.check_truth()?;
        let folder = self.out.clone().unwrap_or_else(|| fresh_folder(scan.name()));
        let (scan, opening) = in_loop.opened(scan, &folder)?;
        let check = scan.dry_run()?;
        let foreseen = Foreseen::of_scan(&scan)?;
        if self.dry_run && self.showing.json {
            print_json(&Checked { check: &check, exposure: foreseen.as_ref() })?;
            return Ok(Scanned::Checked);
        }
        if let Some(most) = opening.as_ref().and_then(|o| o.most_readings(scan.plan())) {
            say(format!("the rig chooses its readings, {most} at most; the first round:"));
        }
        say(in_words(&check));
        if self.dry_run {
            if let Some(foreseen) = &foreseen {
                say(format!("\n{}", foreseen.to_text().trim_end()));
                foreseen.concerns().iter().for_each(|concern| say(format!("exposure: {concern}")));
            }
            if let Some(commands) = listed(&programs(&scan.hooks())) {
                say(format!("programs that run at events of the scan:\n{commands}"));
            }
            return Ok(Scanned::Checked);
        }
        let hooks = self.trust.in_hooks_of(&scan)?;
        self.permission.within_limits(foreseen.as_ref(), scan.rig_setup())?;
        self.permission.to(Act::Scan, scan.rig_setup())?;
        let diagnose = scan.plan().diagnose || opening.as_ref().is_some_and(Opening::seeks_a_cause);
        let is_map = scan.plan().adaptive.is_some();
        let scan_run = begun(scan, &folder, opening);
        let ending = run_scan(scan_run, &hooks, &self.showing)?;
        if is_map && ending == Ending::Complete {
            write_map(&folder, MapRequest::default())?;
        }
        Ok(Scanned::Done { folder, ending, diagnose, is_map })
    }
}

/// Runs a scan to its end and shows its progress. Ctrl-C, a closed terminal or a request to terminate ends it safely.
pub(super) fn run_scan(
    scan_run: impl Future<Output = Result<ScanRun, AcquisitionError>>,
    hooks: &AgreedHooks,
    showing: &Showing,
) -> miette::Result<Ending> {
    let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
    let ending = runtime.block_on(async {
        let stop = StopRequests::listen().into_diagnostic()?;
        let signals = PauseSignals::listen().into_diagnostic()?;
        let mut scan_run = scan_run.await?;
        if !showing.watch {
            scan_run.paused_by(signals.follow());
        }
        scan_run.guard(watchdog()?, hooks.hooks())?;
        let (abort, mut aborted) = unbounded_channel();
        let progress = Arc::new(Mutex::new(showing.begin(&mut scan_run, abort.clone())?));
        let show = {
            let progress = Arc::clone(&progress);
            move |event: &Event| {
                progress.lock().unwrap_or_else(PoisonError::into_inner).show(event);
            }
        };
        let (tell, told) = unbounded_channel();
        let monitor = scan_run.monitor(hooks.hooks().clone());
        let monitor = tokio::spawn(monitor.follow(told, show.clone()));
        let asked = async {
            tokio::select! {
                who = stop.first() => who,
                // Never closed: the sender lives here.
                Some(who) = aborted.recv() => who,
            }
        };
        let watch = &mut |event: &Event| {
            show(event);
            let _ = tell.send(event.clone());
        };
        let rig_setup = scan_run.scan().rig_setup().clone();
        let folder = scan_run.folder().to_owned();
        let ending = scan_run.run(watch, asked).await;
        keep_scan(&rig_setup, &folder);
        drop(tell);
        let _ = monitor.await;
        Ok(ending?)
    });
    // The runtime must live on, because it listens for signals until the program ends.
    std::mem::forget(runtime);
    ending
}

impl Showing {
    /// Checks that there is a terminal if `--watch` needs one.
    pub(super) fn is_possible(&self) -> miette::Result<()> {
        if self.watch && !Screen::is_possible() {
            return Err(miette!(
                help = "leave --watch out, or run the command in a terminal",
                "--watch needs a terminal"
            ));
        }
        Ok(())
    }

    /// Whether events are printed as JSON.
    pub(super) fn prints_json(&self) -> bool {
        self.json
    }

    fn begin(
        &self,
        scan_run: &mut ScanRun,
        abort: UnboundedSender<&'static str>,
    ) -> miette::Result<Progress> {
        if self.json {
            return Ok(Progress::json());
        }
        if !self.watch {
            return Ok(Progress::bar(scan_run.visits(), scan_run.done()));
        }
        let receiver = scan_run.receiver().clone();
        let scan = scan_run.scan();
        let view = ScanView::new(
            scan.plan(),
            scan.visits(),
            scan_run.kept(),
            receiver.unit,
            receiver.full_scale,
        );
        let (switch, pause) = PauseSwitch::new();
        scan_run.paused_by(pause);
        let folder = scan_run.folder().to_owned();
        let watching = Watching::begin(view, Controls { pause: switch, abort }, folder);
        Ok(Progress::Screen(watching.into_diagnostic()?))
    }
}

/// Prints where the record is and how to complete it.
pub(super) fn report_ending(folder: &Path, ending: &Ending) -> ExitCode {
    say(format!("record: {}", folder.display()));
    match ending {
        Ending::Complete => ExitCode::SUCCESS,
        Ending::Partial { .. } => {
            say(format!("`fieldgap resume {}` completes the scan", folder.display()));
            ExitCode::from(ENDED_PARTIAL)
        }
    }
}

fn in_words(check: &DryRun) -> String {
    format!(
        "{} readings ({} with the array silent, {} at the reference point), robot path {:.1} m, duration about {}, {:.1} MiB on disk",
        check.visits,
        check.dark,
        check.references,
        check.way_m,
        indicatif::HumanDuration(check.about()),
        check.bytes as f64 / f64::from(1 << 20)
    )
}
