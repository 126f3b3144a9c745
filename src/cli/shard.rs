//! `fieldgap shard`: one shard of a batch, as Slurm's tasks run it.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{bail, miette};

use super::blind_scans::{self, BlindScans};
use super::on::SOFTWARE;
use super::output::say;
use super::study_cells::{self, StudyCells};
use super::volume_planes::{self, PlanesWork};
use fieldgap_jobs::{Batch, ShardRun, Work, run_shard};
use fieldgap_reanalysis::Reanalysis;

/// The `shard` command.
#[derive(Debug, Args)]
pub(super) struct Shard {
    /// Folder of the batch
    folder: PathBuf,
    /// Number of the shard
    number: usize,
    /// Threads
    #[arg(long, value_name = "N", default_value = "1")]
    threads: NonZeroUsize,
}

impl Shard {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let batch = Batch::open(&self.folder)?;
        batch.is_by(SOFTWARE)?;
        let work = work_of(&batch)?;
        let number = self.number;
        match run_shard(&batch, number, &*work, self.threads.get(), &|_| ())? {
            ShardRun::Known => say(format!("shard {number}: the results are there already")),
            ShardRun::Run { items, failed, working, elapsed } => say(format!(
                "shard {number}: {items} items, {failed} failed; {:.3} s, of these {:.3} s outside of the items",
                elapsed.as_secs_f64(),
                // Several items may run at a time.
                (elapsed.as_secs_f64() - working.as_secs_f64() / self.threads.get() as f64)
                    .max(0.0)
            )),
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// The work of a batch.
fn work_of(batch: &Batch) -> miette::Result<Box<dyn Work>> {
    Ok(match batch.kind() {
        fieldgap_reanalysis::KIND => Box::new(Reanalysis::of_batch(batch)?),
        study_cells::KIND => Box::new(StudyCells::of_batch(batch)?),
        blind_scans::KIND => Box::new(BlindScans::of_batch(batch)?),
        volume_planes::KIND => Box::new(PlanesWork::of_batch(batch)?),
        unknown => bail!("this program knows no work of the kind `{unknown}`"),
    })
}

/// The error of a batch whose description is not understood.
pub(super) fn not_understood(error: serde_json::Error) -> miette::Report {
    miette!(
        help = "remove the folder of the batch, and run the command again",
        "the description of the batch is not understood: {error}"
    )
}
