//! `fieldgap scan`: a plan scanned on a rig, the record kept.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use miette::IntoDiagnostic;

use super::ENDED_PARTIAL;
use super::output::{fresh_folder, print_json};
use super::progress::Progress;
use super::stop::StopRequests;
use super::watchdog::watchdog;
use crate::campaign::{Campaign, CampaignError, DryRun, Ending, Session};

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
        let campaign = Campaign::read(&self.plan, self.rig.as_deref())?;
        let check = campaign.dry_run()?;
        if self.dry_run && self.json {
            print_json(&check)?;
            return Ok(Scanned::Checked);
        }
        eprintln!("{}", in_words(&check));
        if self.dry_run {
            return Ok(Scanned::Checked);
        }
        let folder = self.out.clone().unwrap_or_else(|| fresh_folder(campaign.name()));
        let diagnose = campaign.plan().diagnose;
        let ending = conduct(Session::begin(campaign, &folder), self.json)?;
        Ok(Scanned::Done { folder, ending, diagnose })
    }
}

/// Runs a session to its end, shown as it goes, ended safe by Ctrl-C, a closed terminal or a request to terminate.
pub(super) fn conduct(
    session: impl Future<Output = Result<Session, CampaignError>>,
    json: bool,
) -> miette::Result<Ending> {
    let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
    let ending = runtime.block_on(async {
        let stop = StopRequests::listen().into_diagnostic()?;
        let mut session = session.await?;
        session.guard(watchdog()?)?;
        let mut progress = Progress::new(session.visits(), session.done(), json);
        let ending = session.run(&mut |event| progress.show(event), stop.first()).await?;
        Ok(ending)
    });
    // Signals stay in the runtime's hands for as long as the program lives: the listener goes on.
    std::mem::forget(runtime);
    ending
}

/// Says where the record is and how to go on with it.
pub(super) fn told(folder: &Path, ending: &Ending) -> ExitCode {
    eprintln!("record: {}", folder.display());
    match ending {
        Ending::Complete => ExitCode::SUCCESS,
        Ending::Partial { .. } => {
            eprintln!("`fieldgap resume {}` finishes it", folder.display());
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
