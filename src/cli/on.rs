//! `--on`: work in shards, on this computer or by Slurm.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use miette::{IntoDiagnostic, WrapErr};

use super::output::say;
use super::progress::counting_bar;
use fieldgap_input::{MOST_TEXT, read_text};
use fieldgap_jobs::slurm::{Memory, Partition, Slurm, SlurmOptions, SlurmProgress, TimeLimit};
use fieldgap_jobs::{Batch, JobError, MakeBatch, USUAL_SHARDS, Work, run_here};

/// The program, as batches name it.
pub(super) const SOFTWARE: &str = concat!("fieldgap ", env!("CARGO_PKG_VERSION"));

/// Where work is done that consists of independent items.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Where it runs")]
pub(super) struct OnArgs {
    /// Divide the work into shards, and run them on this computer or by Slurm; if the command was interrupted, the same command continues it
    #[arg(long, value_enum, value_name = "WHERE")]
    on: Option<On>,
    /// Folder of the batch, which all computers must see [default: beside the results]
    #[arg(long, value_name = "DIR")]
    batch: Option<PathBuf>,
    /// Most shards, which are Slurm's tasks [default: 1000, or what the cluster allows]
    #[arg(long, value_name = "N", requires = "on")]
    array_size: Option<NonZeroU32>,
    /// Slurm: most tasks that run at a time
    #[arg(long, value_name = "N", requires = "on")]
    at_once: Option<NonZeroU32>,
    /// Slurm: partition
    #[arg(long, value_name = "NAME", requires = "on")]
    partition: Option<Partition>,
    /// Slurm: time limit of a task, such as 30 (minutes), 2:00:00 or 1-12:00
    #[arg(long, value_name = "TIME", requires = "on")]
    time: Option<TimeLimit>,
    /// Slurm: memory of a task, such as 500M or 4G
    #[arg(long, value_name = "MEMORY", requires = "on")]
    mem: Option<Memory>,
    /// Slurm: processors of a task
    #[arg(long, value_name = "N", default_value = "1", requires = "on")]
    cpus: NonZeroU32,
    /// Slurm: file with shell lines to run before the command, such as `module load`; it may begin with `#SBATCH` lines
    #[arg(long, value_name = "FILE", requires = "on")]
    setup: Option<PathBuf>,
    /// Slurm: wait until all shards are done
    #[arg(long, requires = "on")]
    wait: bool,
    /// Slurm: collect the results of what was sent before
    #[arg(long, requires = "on")]
    collect: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum On {
    /// This computer
    Local,
    /// A cluster, as an array job
    Slurm,
}

/// The usual folder of a batch whose results go into `out`.
pub(super) fn batch_beside(out: &Path) -> PathBuf {
    let mut beside = out.as_os_str().to_owned();
    beside.push(".batch");
    beside.into()
}

impl OnArgs {
    /// Whether `--on` is given.
    pub(super) fn is_given(&self) -> bool {
        self.on.is_some()
    }

    /// Runs work as a batch in a folder, by default `usual`; `None` if it was given to Slurm and is not done.
    pub(super) fn run(
        &self,
        work: &dyn Work,
        usual: &Path,
        what: &'static str,
    ) -> miette::Result<Option<Batch>> {
        let folder = self.batch.as_deref().unwrap_or(usual);
        match self.on {
            None | Some(On::Local) => self.here(work, folder, what).map(Some),
            Some(On::Slurm) => self.by_slurm(work, folder),
        }
    }

    fn shards(&self) -> usize {
        self.array_size.map_or(USUAL_SHARDS, |size| size.get() as usize)
    }

    fn here(&self, work: &dyn Work, folder: &Path, what: &'static str) -> miette::Result<Batch> {
        let batch = make(work, folder, self.shards())?;
        let left = batch.items_of(&batch.missing()?);
        let bar = counting_bar(batch.items().len(), what);
        bar.set_position((batch.items().len() - left) as u64);
        bar.reset_eta();
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        run_here(&batch, work, threads, &|_| bar.inc(1))?;
        bar.finish_and_clear();
        Ok(batch)
    }

    fn by_slurm(&self, work: &dyn Work, folder: &Path) -> miette::Result<Option<Batch>> {
        let slurm = Slurm::new(std::env::current_exe().into_diagnostic()?, self.options()?);
        let (batch, progress) = if self.collect {
            let batch = Batch::open(folder)?;
            batch.is_by(SOFTWARE)?;
            batch.is_of(work)?;
            let progress = slurm.look(&batch)?;
            (batch, progress)
        } else {
            let shards = self.shards().min(slurm.most_shards()?);
            let batch = make(work, folder, shards)?;
            let progress = slurm.send(&batch)?;
            (batch, progress)
        };
        tell(&progress);
        if self.wait {
            wait(&slurm, &batch, progress.shards)?;
        } else if !progress.is_done() {
            if self.collect {
                let (missing, shards) = (progress.shards - progress.done, progress.shards);
                let folder = batch.folder().to_owned();
                return Err(JobError::Unfinished { folder, missing, shards }.into());
            }
            say(
                "the same command with --collect collects the results, and with --wait waits for them",
            );
            return Ok(None);
        }
        Ok(Some(batch))
    }

    fn options(&self) -> miette::Result<SlurmOptions> {
        let set_up = match &self.setup {
            None => String::new(),
            Some(file) => read_text(file, MOST_TEXT)
                .into_diagnostic()
                .wrap_err_with(|| format!("cannot read {}", file.display()))?,
        };
        Ok(SlurmOptions {
            partition: self.partition.clone(),
            time: self.time.clone(),
            memory: self.mem.clone(),
            cpus: self.cpus,
            at_once: self.at_once,
            set_up,
        })
    }
}

fn make(work: &dyn Work, folder: &Path, shards: usize) -> Result<Batch, JobError> {
    let made = jiff::Timestamp::now().to_string();
    Batch::make_or_open(folder, work, &MakeBatch { software: SOFTWARE, made: &made, shards })
}

fn wait(slurm: &Slurm, batch: &Batch, shards: usize) -> Result<(), JobError> {
    let bar = counting_bar(shards, "shards done");
    let told = |progress: &SlurmProgress| {
        bar.set_position(progress.done as u64);
        if let Some((job, tasks)) = progress.sent {
            bar.suspend(|| say(format!("job {job} sent again: {}", counted(tasks))));
        }
    };
    let waited = slurm.wait(batch, &told);
    bar.finish_and_clear();
    waited
}

/// Says where a batch is.
fn tell(progress: &SlurmProgress) {
    if let Some((job, tasks)) = progress.sent {
        return say(format!("job {job} sent: {}", counted(tasks)));
    }
    let SlurmProgress { done, shards, running, waiting, .. } = progress;
    let reasons = match progress.reasons.is_empty() {
        true => String::new(),
        false => format!(" ({})", progress.reasons.join(", ")),
    };
    let queue = match (progress.is_done(), progress.answers) {
        (true, _) => String::new(),
        (false, false) => "; Slurm does not answer".to_owned(),
        (false, true) => format!(", {running} running, {waiting} waiting{reasons}"),
    };
    say(format!("{done} of {shards} shards done{queue}"));
}

fn counted(tasks: usize) -> String {
    if tasks == 1 { "1 task".to_owned() } else { format!("{tasks} tasks") }
}
