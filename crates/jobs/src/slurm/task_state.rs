//! What Slurm says of a task.

use super::numbers::TaskNumbers;

/// What Slurm says of some tasks of an array job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskReport {
    /// The tasks.
    pub tasks: TaskNumbers,
    /// Their state.
    pub state: TaskState,
    /// Why they wait; empty if nothing is said.
    pub reason: String,
}

/// The state of a task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TaskState {
    /// It waits, also to be started again.
    Waiting,
    /// It runs, or is about to start or end.
    Running,
    /// It ended well.
    Completed,
    /// It ended otherwise; Slurm's word for it.
    Failed(String),
}

impl TaskState {
    /// Reads Slurm's word, also in the forms of `sacct` (`CANCELLED by 1000`, `COMPLETED+`); `None` for a word that it does not have.
    ///
    /// The words are those of the section JOB STATE CODES of `squeue(1)`, up to Slurm 24.11.
    pub fn parse(text: &str) -> Option<Self> {
        let word = text.split_whitespace().next()?.trim_end_matches('+');
        Some(match word {
            "PENDING" | "CONFIGURING" | "REQUEUED" | "REQUEUE_FED" | "REQUEUE_HOLD"
            | "RESV_DEL_HOLD" | "SPECIAL_EXIT" | "STOPPED" | "SUSPENDED" | "POWER_UP_NODE" => {
                Self::Waiting
            }
            "RUNNING" | "COMPLETING" | "STAGE_OUT" | "SIGNALING" | "RESIZING" | "STAGING"
            | "LAUNCH_FAILED" | "UPDATE_DB" => Self::Running,
            "COMPLETED" => Self::Completed,
            "BOOT_FAIL" | "CANCELLED" | "DEADLINE" | "EXPEDITING" | "FAILED" | "NODE_FAIL"
            | "OUT_OF_MEMORY" | "PREEMPTED" | "RECONFIG_FAIL" | "REVOKED" | "TIMEOUT" => {
                Self::Failed(word.to_owned())
            }
            _ => return None,
        })
    }

    /// Whether the task may still finish its shard.
    pub fn is_active(&self) -> bool {
        matches!(self, Self::Waiting | Self::Running)
    }
}
