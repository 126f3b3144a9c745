//! Batches by Slurm: one array job over the missing shards, each of whose tasks runs one shard.
//!
//! Nothing stays behind: no service, and no process that has to live as long as the job. What was submitted is in the folder of the batch. Each call
//! asks Slurm what became of the tasks, and the folder what is done. What counts is the folder: a shard with results is done, whatever Slurm says.

mod answers;
mod commands;
mod failed;
mod job;
mod numbers;
mod options;
mod script;
mod sent;
mod task_state;

pub use answers::{parse_config, parse_job_id, parse_sacct, parse_scontrol, parse_squeue};
pub use commands::SlurmCommands;
pub use job::{Slurm, SlurmProgress};
pub use numbers::{TaskNumbers, WrongNumbers};
pub use options::{Memory, NotAnOption, Partition, SlurmOptions, TimeLimit};
pub use script::script;
pub use task_state::{TaskReport, TaskState};
