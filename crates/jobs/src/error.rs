//! Errors of batches and of Slurm.

use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};

/// Why a batch was not made, run or collected.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum JobError {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    #[diagnostic(help(
        "check that the path is right, and that the file may be read from this computer"
    ))]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    #[diagnostic(help("check that the disk has room and that the folder may be written"))]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// There is nothing to do.
    #[error("there is nothing to do: the work has no items")]
    NoItems,
    /// `batch.json` is not what it should be.
    #[error("{} is not the file of a batch: {problem}", path.display())]
    #[diagnostic(help("remove this folder of the batch, and run the command again"))]
    NotABatch {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The folder holds a batch of other work.
    #[error("{} holds another batch: its {differs} differs", folder.display())]
    #[diagnostic(help(
        "choose another name or another folder for this one (--name, --batch); or, if that batch is no longer needed, remove its folder"
    ))]
    AnotherWork {
        /// The folder.
        folder: PathBuf,
        /// What differs.
        differs: &'static str,
    },
    /// The batch is another version's.
    #[error("the batch in {} was made by {batch}, and this is {own}", folder.display())]
    #[diagnostic(help(
        "results of two versions are not mixed: let all computers use the same program, or remove the folder of the batch and start again"
    ))]
    OtherSoftware {
        /// The folder.
        folder: PathBuf,
        /// The version that made the batch.
        batch: String,
        /// The version that was to run it.
        own: String,
    },
    /// There is no batch.
    #[error("there is no batch in {}", .0.display())]
    #[diagnostic(help(
        "run the command without --collect first; if the folder is on another computer, it is not shared"
    ))]
    NoBatch(PathBuf),
    /// A shard that the batch does not have.
    #[error("the batch in {} has the shards 0 to {last}, but no shard {number}", folder.display())]
    NoShard {
        /// The folder.
        folder: PathBuf,
        /// The shard.
        number: usize,
        /// The last shard.
        last: usize,
    },
    /// Results are damaged.
    #[error("{}:{line}: {problem}", path.display())]
    #[diagnostic(help(
        "remove this file and run the same command again: only what is missing is computed"
    ))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// Not all shards are done.
    #[error("{missing} of {shards} shards of the batch in {} are not done yet", folder.display())]
    #[diagnostic(help("the same command with --collect looks again; with --wait it waits"))]
    Unfinished {
        /// The folder.
        folder: PathBuf,
        /// Missing shards.
        missing: usize,
        /// All shards.
        shards: usize,
    },
    /// A program of Slurm cannot be started.
    #[error("`{program}` cannot be started: {source}")]
    #[diagnostic(help(
        "Slurm's commands must be on PATH: run this on the cluster's login node, or load its module; without Slurm use --on local"
    ))]
    NoSlurm {
        /// The program.
        program: String,
        /// The reason.
        source: io::Error,
    },
    /// Slurm refused the job.
    #[error("Slurm refused the job: {said}")]
    #[diagnostic(help("{help}"))]
    Refused {
        /// What `sbatch` said.
        said: String,
        /// What to do.
        help: &'static str,
    },
    /// An answer of Slurm that is not understood.
    #[error("the answer of `{program}` is not understood: {said:?}")]
    #[diagnostic(help("call it by hand; a wrapper around it may print something else"))]
    NotUnderstood {
        /// The program.
        program: &'static str,
        /// The beginning of what it said.
        said: String,
    },
    /// The batch was not given to Slurm.
    #[error("the batch in {} was not given to Slurm", .0.display())]
    #[diagnostic(help("run the command without --collect first"))]
    NotSent(PathBuf),
    /// The batch has more shards than an array job may have.
    #[error(
        "the batch has {shards} shards, and an array job of this cluster may have {most} tasks"
    )]
    #[diagnostic(help(
        "remove the folder of the batch, and run the command again with a smaller --array-size"
    ))]
    TooManyShards {
        /// Shards of the batch.
        shards: usize,
        /// Most tasks.
        most: usize,
    },
    /// A folder whose name Slurm would read otherwise.
    #[error("Slurm gives the character {character:?} in {} a meaning of its own", folder.display())]
    #[diagnostic(help("choose a folder without % and \\ in its path (--batch)"))]
    FolderName {
        /// The folder.
        folder: PathBuf,
        /// The character.
        character: char,
    },
    /// Shards failed twice.
    #[error("{}", failed(shards))]
    #[diagnostic(help("{}", what_to_do(shards)))]
    Failed {
        /// The shards.
        shards: Vec<FailedShard>,
    },
}

impl JobError {
    /// An error of reading `path`.
    pub(crate) fn reading(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Read { path, source }
    }

    /// An error of writing `path`.
    pub(crate) fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Write { path, source }
    }
}

/// A shard that Slurm's tasks did not finish.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FailedShard {
    /// Its number.
    pub number: usize,
    /// What Slurm says of its task, such as `TIMEOUT`; `None` where Slurm no longer knows it.
    pub state: Option<String>,
    /// The log of its task.
    pub log: PathBuf,
    /// The last lines of the log; `None` if there is no log.
    pub last_lines: Option<String>,
}

/// Most failed shards that a message describes.
const DESCRIBED: usize = 3;

fn failed(shards: &[FailedShard]) -> String {
    let mut text = match shards.len() {
        1 => "1 shard was sent twice and not finished".to_owned(),
        several => format!("{several} shards were sent twice and not finished"),
    };
    for shard in shards.iter().take(DESCRIBED) {
        let state = shard.state.as_deref().unwrap_or("no longer known to Slurm");
        let _ = write!(text, "\nshard {}: {state}; {}", shard.number, shard.log.display());
        match shard.last_lines.as_deref() {
            None => text += " does not exist",
            Some("") => text += " is empty",
            Some(lines) => {
                text += " ends with";
                for line in lines.lines() {
                    let _ = write!(text, "\n  {line}");
                }
            }
        }
    }
    if shards.len() > DESCRIBED {
        let numbers: Vec<String> =
            shards[DESCRIBED..].iter().map(|shard| shard.number.to_string()).collect();
        let _ = write!(text, "\nalso: {}", numbers.join(", "));
    }
    text
}

fn what_to_do(shards: &[FailedShard]) -> &'static str {
    let state = |wanted: &str| {
        shards
            .iter()
            .any(|shard| shard.state.as_deref().is_some_and(|state| state.contains(wanted)))
    };
    if state("TIMEOUT") || state("DEADLINE") {
        "a task took longer than its limit: run the same command with a longer --time"
    } else if state("OUT_OF_MEMORY") {
        "a task used more memory than it had asked for: run the same command with a larger --mem"
    } else if shards.iter().all(|shard| shard.last_lines.is_none()) {
        "no task wrote a log: the folder of the batch must be on a file system that all nodes share"
    } else {
        "remove the cause that the logs name, and run the same command again: only the missing shards are sent"
    }
}
