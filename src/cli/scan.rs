//! `fieldgap scan`: a plan scanned on a rig, the record kept.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::IntoDiagnostic;

use super::ENDED_PARTIAL;
use super::output::{fresh_folder, print_json};
use super::progress::Progress;
use crate::campaign::{Campaign, CampaignError, Ending, Session};

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
    /// It was done; the record is in the folder.
    Done { folder: PathBuf, ending: Ending },
}

impl Scan {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        match self.args.scan()? {
            Scanned::Checked => Ok(ExitCode::SUCCESS),
            Scanned::Done { folder, ending } => {
                eprintln!("record: {}", folder.display());
                Ok(exit_code(&ending))
            }
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
        eprintln!("{check}");
        if self.dry_run {
            return Ok(Scanned::Checked);
        }
        let folder = self.out.clone().unwrap_or_else(|| fresh_folder(campaign.name()));
        let ending = conduct(Session::begin(campaign, &folder), self.json)?;
        Ok(Scanned::Done { folder, ending })
    }
}

/// Runs a session to its end, shown as it goes, ended safe by Ctrl-C or a request to terminate.
pub(super) fn conduct(
    session: impl Future<Output = Result<Session, CampaignError>>,
    json: bool,
) -> miette::Result<Ending> {
    let runtime = tokio::runtime::Runtime::new().into_diagnostic()?;
    runtime.block_on(async {
        let session = session.await?;
        let mut progress = Progress::new(session.visits(), session.done(), json);
        Ok(session.run(&mut |event| progress.show(event), asked_to_stop()).await?)
    })
}

pub(super) fn exit_code(ending: &Ending) -> ExitCode {
    match ending {
        Ending::Complete => ExitCode::SUCCESS,
        Ending::Partial { .. } => ExitCode::from(ENDED_PARTIAL),
    }
}

/// Resolves when a person or the system asks the program to stop, with who asked.
async fn asked_to_stop() -> &'static str {
    use tokio::signal::unix::{SignalKind, signal};
    let mut terminate = match signal(SignalKind::terminate()) {
        Ok(terminate) => terminate,
        Err(_) => {
            let _ = tokio::signal::ctrl_c().await;
            return "interrupted from the keyboard";
        }
    };
    tokio::select! {
        _ = terminate.recv() => "asked to terminate",
        _ = tokio::signal::ctrl_c() => "interrupted from the keyboard",
    }
}
