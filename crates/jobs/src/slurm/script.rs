//! The script of an array job.

use std::fmt::Write;
use std::path::Path;

use super::numbers::TaskNumbers;
use super::options::SlurmOptions;
use crate::batch::Batch;
use crate::error::JobError;

/// The script that runs these shards of a batch with `program shard FOLDER NUMBER`.
///
/// Its tasks are started in the folder of the batch. A task whose node fails, or that gives way to another job, is started again by Slurm.
///
/// # Errors
/// [`JobError::FolderName`] if Slurm would read the folder's name in another way.
pub fn script(
    batch: &Batch,
    options: &SlurmOptions,
    tasks: &TaskNumbers,
    program: &Path,
) -> Result<String, JobError> {
    let folder = batch.folder();
    let name = folder.to_string_lossy();
    // `%` begins a pattern of the log's name, and a backslash ends all of them (sbatch(1), filename pattern).
    if let Some(character) = name.chars().find(|c| matches!(c, '%' | '\\' | '\n' | '\r' | '\0')) {
        return Err(JobError::FolderName { folder: folder.to_owned(), character });
    }
    let limit = options.at_once.map_or(String::new(), |limit| format!("%{limit}"));
    let mut lines = vec![
        format!("--job-name=fieldgap-{}", batch.kind()),
        format!("--array={tasks}{limit}"),
        "--requeue".to_owned(),
        "--open-mode=append".to_owned(),
        "--output=logs/%a.log".to_owned(),
        "--ntasks=1".to_owned(),
        format!("--cpus-per-task={}", options.cpus),
    ];
    lines.extend(options.partition.as_ref().map(|partition| format!("--partition={partition}")));
    lines.extend(options.time.as_ref().map(|time| format!("--time={time}")));
    lines.extend(options.memory.as_ref().map(|memory| format!("--mem={memory}")));
    let mut script = "#!/bin/bash\n".to_owned();
    for line in lines {
        let _ = writeln!(script, "#SBATCH {line}");
    }
    if !options.set_up.is_empty() {
        let _ = writeln!(script, "{}", options.set_up.trim_end());
    }
    let _ = writeln!(
        script,
        "exec {} shard --threads {} {} \"$SLURM_ARRAY_TASK_ID\"",
        quoted(&program.to_string_lossy()),
        options.cpus,
        quoted(&name)
    );
    Ok(script)
}

/// A word of shell.
fn quoted(word: &str) -> String {
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_quoted_word_is_one_word_of_shell(word in "[ -~äß\n\t]{0,20}") {
            prop_assert_eq!(shlex::split(&quoted(&word)), Some(vec![word]));
        }
    }
}
