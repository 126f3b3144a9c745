//! A batch as an array job: sent, followed, sent again where it failed.

use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::commands::{SlurmCommands, ask, most_tasks, submit};
use super::failed::failed_shard;
use super::numbers::TaskNumbers;
use super::options::SlurmOptions;
use super::script::script;
use super::sent::{Sent, SentJob};
use super::task_state::{TaskReport, TaskState};
use crate::batch::Batch;
use crate::error::JobError;
use crate::whole_file::write_whole;

/// Most times that a shard is sent. Slurm itself starts a task again whose node failed; this is for tasks that ended without results.
const MOST_TIMES: usize = 2;

/// Name of the script in the folder of a batch.
const SCRIPT: &str = "submit.sh";

/// Batches by Slurm.
#[derive(Debug, Clone)]
pub struct Slurm {
    /// The program whose command `shard` runs a shard; all nodes find it at this path.
    pub program: PathBuf,
    /// What the job asks for.
    pub options: SlurmOptions,
    /// Slurm's commands.
    pub commands: SlurmCommands,
    /// Time between two looks at the folder.
    pub look: Duration,
    /// Time between two questions to Slurm, which serves many.
    pub ask: Duration,
}

/// Where a batch is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SlurmProgress {
    /// Shards with results.
    pub done: usize,
    /// All shards.
    pub shards: usize,
    /// Tasks that run.
    pub running: usize,
    /// Tasks that wait.
    pub waiting: usize,
    /// Why tasks wait, in Slurm's words.
    pub reasons: Vec<String>,
    /// A job that was sent just now, and its number of tasks.
    pub sent: Option<(u64, usize)>,
    /// Whether Slurm answers.
    pub answers: bool,
}

impl SlurmProgress {
    /// Whether all shards have results.
    pub fn is_done(&self) -> bool {
        self.done == self.shards
    }
}

impl Slurm {
    /// Slurm, with usual times between questions.
    pub fn new(program: PathBuf, options: SlurmOptions) -> Self {
        Self {
            program,
            options,
            commands: SlurmCommands::default(),
            look: Duration::from_secs(1),
            ask: Duration::from_secs(15),
        }
    }

    /// Most shards of a batch: the tasks of an array job.
    ///
    /// # Errors
    /// [`JobError::NoSlurm`] if there is no Slurm on this computer.
    pub fn most_shards(&self) -> Result<usize, JobError> {
        most_tasks(&self.commands)
    }

    /// Sends what was not sent or failed, once more at most, and tells where the batch is.
    ///
    /// # Errors
    /// [`JobError::Failed`] if shards failed that had been sent twice, and no task is left; otherwise what Slurm or the folder refuses.
    pub fn send(&self, batch: &Batch) -> Result<SlurmProgress, JobError> {
        self.advance(batch, true)
    }

    /// As [`Slurm::send`], for a batch that was sent before.
    ///
    /// # Errors
    /// As [`Slurm::send`]; [`JobError::NotSent`] if nothing was sent.
    pub fn look(&self, batch: &Batch) -> Result<SlurmProgress, JobError> {
        self.advance(batch, false)
    }

    /// Waits until all shards are done. `told` is called at every look at the folder.
    ///
    /// # Errors
    /// As [`Slurm::look`].
    pub fn wait(&self, batch: &Batch, told: &dyn Fn(&SlurmProgress)) -> Result<(), JobError> {
        let mut progress = self.look(batch)?;
        let mut asked = Instant::now();
        loop {
            told(&progress);
            if progress.is_done() {
                return Ok(());
            }
            std::thread::sleep(self.look);
            progress.done = batch.shards() - batch.missing()?.len();
            progress.sent = None;
            if !progress.is_done() && asked.elapsed() >= self.ask {
                progress = self.look(batch)?;
                asked = Instant::now();
            }
        }
    }

    fn advance(&self, batch: &Batch, may_begin: bool) -> Result<SlurmProgress, JobError> {
        let mut sent = Sent::read(batch)?;
        let mut missing = batch.missing()?;
        let mut progress = SlurmProgress {
            done: batch.shards() - missing.len(),
            shards: batch.shards(),
            running: 0,
            waiting: 0,
            reasons: Vec::new(),
            sent: None,
            answers: true,
        };
        if missing.is_empty() {
            return Ok(progress);
        }
        if may_begin && sent.given_up {
            // Whoever asks again has removed the cause.
            sent = Sent::default();
        }
        if sent.jobs.is_empty() {
            if !may_begin {
                return Err(JobError::NotSent(batch.folder().to_owned()));
            }
            progress.sent = Some(self.submit(batch, &missing, &mut sent)?);
            progress.waiting = missing.len();
            return Ok(progress);
        }
        let mut reports = Vec::new();
        for job in &sent.jobs {
            match ask(&self.commands, job.job)? {
                Some(of_job) => reports.extend(of_job.into_iter().map(|report| (job.job, report))),
                None => progress.answers = false,
            }
        }
        count_active(&missing, &reports, &mut progress);
        // Without an answer nothing is known of the tasks.
        if !progress.answers || progress.running + progress.waiting > 0 {
            return Ok(progress);
        }
        // A task may have finished between the look at the folder and the answer.
        missing = batch.missing_now()?;
        progress.done = batch.shards() - missing.len();
        if missing.is_empty() {
            return Ok(progress);
        }
        let times = |shard: &usize| sent.jobs.iter().filter(|job| job.has(*shard)).count();
        let (again, failed): (Vec<usize>, Vec<usize>) =
            missing.iter().partition(|shard| times(shard) < MOST_TIMES);
        if again.is_empty() {
            let last = sent.jobs.last().map_or(0, |job| job.job);
            let last: Vec<TaskReport> = reports
                .into_iter()
                .filter_map(|(job, report)| (job == last).then_some(report))
                .collect();
            let shards = failed.iter().map(|&shard| failed_shard(batch, shard, &last)).collect();
            sent.given_up = true;
            sent.write(batch)?;
            return Err(JobError::Failed { shards });
        }
        progress.sent = Some(self.submit(batch, &again, &mut sent)?);
        progress.waiting = again.len();
        Ok(progress)
    }

    /// Sends shards as one array job; its number, and that of its tasks.
    fn submit(
        &self,
        batch: &Batch,
        shards: &[usize],
        sent: &mut Sent,
    ) -> Result<(u64, usize), JobError> {
        let most = most_tasks(&self.commands)?;
        if batch.shards() > most {
            return Err(JobError::TooManyShards { shards: batch.shards(), most });
        }
        let numbers = shards.iter().filter_map(|&shard| u32::try_from(shard).ok());
        let tasks = TaskNumbers::new(numbers);
        let text = script(batch, &self.options, &tasks, &self.program)?;
        let logs = batch.folder().join("logs");
        fs::create_dir_all(&logs).map_err(JobError::writing(&logs))?;
        let path = batch.folder().join(SCRIPT);
        write_whole(&path, text.as_bytes()).map_err(JobError::writing(&path))?;
        let job = submit(&self.commands, batch.folder(), SCRIPT)?;
        sent.jobs.push(SentJob { job, tasks: tasks.to_string() });
        sent.write(batch)?;
        Ok((job, shards.len()))
    }
}

/// Counts the missing shards that have a task which runs or waits.
fn count_active(missing: &[usize], reports: &[(u64, TaskReport)], progress: &mut SlurmProgress) {
    let active: Vec<&TaskReport> = reports
        .iter()
        .map(|(_, report)| report)
        .filter(|report| report.state.is_active())
        .collect();
    for &shard in missing {
        let Ok(shard) = u32::try_from(shard) else { continue };
        let mut own = active.iter().filter(|report| report.tasks.contains(shard)).peekable();
        let Some(first) = own.peek() else { continue };
        match first.state == TaskState::Running || own.any(|one| one.state == TaskState::Running) {
            true => progress.running += 1,
            false => progress.waiting += 1,
        }
    }
    for report in active.iter().filter(|report| !report.reason.is_empty()) {
        if report.state == TaskState::Waiting && !progress.reasons.contains(&report.reason) {
            progress.reasons.push(report.reason.clone());
        }
    }
}
