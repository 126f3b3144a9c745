//! Calls of Slurm's commands.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use super::answers::{
    SQUEUE_FORMAT, parse_config, parse_job_id, parse_sacct, parse_scontrol, parse_squeue,
};
use super::task_state::TaskReport;
use crate::error::JobError;

/// Size of an array job where Slurm does not tell: its default (`slurm.conf(5)`, MaxArraySize).
const USUAL_ARRAY: usize = 1001;

/// Most characters of an answer that is quoted.
const QUOTED: usize = 300;

/// Where Slurm's commands are.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SlurmCommands {
    /// Their folder; without it they are found on PATH.
    pub folder: Option<PathBuf>,
}

impl SlurmCommands {
    fn command(&self, name: &str) -> Command {
        Command::new(self.folder.as_ref().map_or_else(|| name.into(), |folder| folder.join(name)))
    }
}

fn call(command: &mut Command) -> Result<Output, JobError> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.stdin(Stdio::null()).output();
    output.map_err(|source| JobError::NoSlurm { program, source })
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Most tasks of an array job: the largest number of a task is one less than `MaxArraySize`.
pub(super) fn most_tasks(slurm: &SlurmCommands) -> Result<usize, JobError> {
    let answer = call(slurm.command("scontrol").args(["show", "config"]))?;
    let size =
        parse_config(&text(&answer.stdout), "MaxArraySize").and_then(|size| size.parse().ok());
    Ok(size.unwrap_or(USUAL_ARRAY).max(1))
}

/// Submits `script`, a file in `folder`, which is the working folder of its tasks; the number of the job.
pub(super) fn submit(slurm: &SlurmCommands, folder: &Path, script: &str) -> Result<u64, JobError> {
    let answer = call(slurm.command("sbatch").args(["--parsable", script]).current_dir(folder))?;
    let said = text(&answer.stdout);
    if answer.status.success() {
        return parse_job_id(&said).ok_or_else(|| JobError::NotUnderstood {
            program: "sbatch --parsable",
            said: said.chars().take(QUOTED).collect(),
        });
    }
    let said: String = text(&answer.stderr).trim().chars().take(QUOTED).collect();
    let help = remedy(&said);
    Err(JobError::Refused {
        said: if said.is_empty() { answer.status.to_string() } else { said },
        help,
    })
}

/// What to do when Slurm refuses a job. The words are those of Slurm's `slurm_errno.c`.
fn remedy(said: &str) -> &'static str {
    let said = said.to_lowercase();
    let helps = [
        ("partition", "`sinfo` lists the partitions and their limits; name one with --partition"),
        ("account", "add a line `#SBATCH --account=NAME` to the file of --setup"),
        ("qos", "add a line `#SBATCH --qos=NAME` to the file of --setup"),
        ("memory", "no node has so much memory: ask for less with --mem"),
        ("time limit", "the partition has a shorter limit: ask for less with --time"),
        ("array", "ask for fewer tasks with --array-size"),
        ("unable to contact", "Slurm's controller does not answer: try again later"),
        (
            "temporarily",
            "Slurm takes no more jobs at present: try again later, or with a smaller --array-size",
        ),
    ];
    let found = helps.iter().find(|(word, _)| said.contains(word));
    found.map_or("submit.sh in the folder of the batch is the script; `sbatch submit.sh` there tries it by hand", |(_, help)| help)
}

/// What Slurm says of the tasks of a job; `None` if it does not answer, so that nothing is known.
///
/// `squeue` tells of waiting and running tasks, `sacct` of ended ones where the cluster keeps accounts, and `scontrol` of those that ended in the
/// last minutes.
pub(super) fn ask(slurm: &SlurmCommands, job: u64) -> Result<Option<Vec<TaskReport>>, JobError> {
    let id = job.to_string();
    let queue = call(slurm.command("squeue").args([
        "--noheader",
        "--array",
        "--states=all",
        &format!("--jobs={id}"),
        &format!("--format={SQUEUE_FORMAT}"),
    ]))?;
    // It refuses the number of a job that ended some minutes ago. Any other refusal says nothing about the job.
    if !queue.status.success() && !text(&queue.stderr).contains("Invalid job id") {
        return Ok(None);
    }
    let mut reports = parse_squeue(&text(&queue.stdout), job);
    let ended = call(slurm.command("scontrol").args(["show", "job", &id]));
    if let Some(answer) = answered(ended) {
        reports.extend(parse_scontrol(&answer, job));
    }
    let kept = call(slurm.command("sacct").args([
        "--noheader",
        "--parsable2",
        "--allocations",
        "--format=JobID,State",
        &format!("--jobs={id}"),
    ]));
    if let Some(answer) = answered(kept) {
        // Accounts may say for ever that a task runs whose end they missed.
        let ended = |report: &TaskReport| !report.state.is_active();
        reports.extend(parse_sacct(&answer, job).into_iter().filter(ended));
    }
    Ok(Some(reports))
}

/// The answer of a command that need not be there, or know the job.
fn answered(answer: Result<Output, JobError>) -> Option<String> {
    let answer = answer.ok().filter(|answer| answer.status.success())?;
    Some(text(&answer.stdout))
}
