//! `fieldgap blind vary`: how much each limit of the diagnosis decides.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Args;

use super::blind::Sealed;
use super::output::{print, print_json, report_error};
use super::progress::counting_bar;
use fieldgap_blind::{Answers, Moves, Run};
use fieldgap_diagnosis::{DecisiveLimit, decisive_limits, diagnose};

/// Where the diagnoses with varied limits are kept in a set's folder.
const VARIED: &str = "varied";

/// Each limit is multiplied by these.
const FACTORS: [(f64, &str); 2] = [(0.5, "halved"), (2.0, "doubled")];

/// The `blind vary` command.
#[derive(Debug, Args)]
pub(super) struct Vary {
    #[command(flatten)]
    sealed: Sealed,
    /// Only these limits [default: every limit that can change a verdict]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    limits: Vec<String>,
    /// Only the first scans, so many
    #[arg(long, value_name = "N", default_value_t = 100)]
    scans: usize,
    /// Where the diagnoses go; those that are there from a run that was stopped are kept [default: varied in the set's folder]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print everything as JSON
    #[arg(long)]
    json: bool,
}

impl Vary {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let limits = named(&self.limits)?;
        let mut answers = self.sealed.answers()?;
        answers.answers.truncate(self.scans);
        let out = self.out.unwrap_or_else(|| self.sealed.set.join(VARIED));
        let failures = AtomicUsize::new(0);
        let diagnosed = |folder: &str| {
            let folder = out.join(folder);
            diagnose_all(&self.sealed.set, &answers, &folder, &failures);
            folder
        };
        let mut moves = Moves::from(&answers, &diagnosed("as-it-is"))?;
        for limit in limits {
            let usual = limit.get();
            for (factor, word) in FACTORS {
                let varied = limit.vary(factor);
                let folder = diagnosed(&format!("{}-{word}", limit.name()));
                moves.add((limit.name(), usual, limit.get()), &answers, &folder)?;
                drop(varied);
            }
        }
        match self.json {
            true => print_json(&moves)?,
            false => print(&moves.to_text())?,
        }
        let failed = failures.into_inner() > 0;
        Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
    }
}

/// The limits of these names; all without a name.
fn named(names: &[String]) -> miette::Result<Vec<&'static DecisiveLimit>> {
    let all = decisive_limits();
    if names.is_empty() {
        return Ok(all.to_vec());
    }
    let one = |name: &String| {
        all.iter().find(|limit| limit.name() == name).copied().ok_or_else(|| {
            let known: Vec<&str> = all.iter().map(|limit| limit.name()).collect();
            miette::miette!(
                help = format!("the limits are {}", known.join(", ")),
                "no limit of the diagnosis has the name `{name}`"
            )
        })
    };
    names.iter().map(one).collect()
}

/// Diagnoses the scans of a set that have no diagnosis in this folder yet, and counts those that fail.
fn diagnose_all(set: &Path, answers: &Answers, folder: &Path, failures: &AtomicUsize) {
    let run = Run { folder: set.to_owned(), diagnoses: folder.to_owned(), only: Vec::new() };
    let names = answers.answers.iter().map(|answer| answer.name.clone());
    let missing = run.not_diagnosed(names.collect());
    let bar = counting_bar(missing.len(), "scans diagnosed");
    run.each(
        &missing,
        |scans| diagnose(scans, None),
        |done| {
            if let Err(error) = done {
                failures.fetch_add(1, Ordering::Relaxed);
                bar.suspend(|| report_error(&miette::Report::new(error)));
            }
            bar.inc(1);
        },
    );
    bar.finish_and_clear();
}
