//! Batches by a Slurm made of small scripts: `sbatch`, `squeue`, `scontrol` and `sacct` in a folder of their own.
//!
//! The scripts keep jobs in files. `sbatch` notes what was submitted; tests then run the tasks or let them fail, and set what the other commands say.

#[path = "../../../tests/script/mod.rs"]
mod script;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use fieldgap_jobs::slurm::{Slurm, SlurmCommands, SlurmOptions, TaskNumbers, script};
use fieldgap_jobs::{Batch, Failure, JobError, MakeBatch, Product, Work, run_shard};
use script::write_script;
use serde_json::Value;

struct Numbers;

impl Work for Numbers {
    fn kind(&self) -> &str {
        "numbers"
    }

    fn description(&self) -> Value {
        Value::Null
    }

    fn items(&self) -> Vec<Value> {
        (0..12).map(Value::from).collect()
    }

    fn run(&self, item: &Value) -> Result<Product, Failure> {
        Product::json(item)
    }
}

/// A Slurm whose answers are files.
struct FakeSlurm {
    folder: tempfile::TempDir,
}

impl FakeSlurm {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("bin")).expect("made");
        let slurm = Self { folder };
        slurm.program("sbatch", "n=$(($(/bin/cat jobs 2>/dev/null || echo 40) + 1)); echo $n >jobs; echo \"$OLDPWD\" >where; echo \"$n;cluster\"");
        slurm.says("squeue", "");
        slurm.program("scontrol", "[ \"$2\" = config ] && echo 'MaxArraySize = 1001' && exit 0\n/bin/cat show_job 2>/dev/null");
        slurm
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A command, run in the folder of this Slurm.
    fn program(&self, name: &str, body: &str) {
        let home = self.folder.path().display();
        write_script(
            &self.path("bin").join(name),
            &format!("#!/bin/sh\ncd {home} || exit 9\n{body}\n"),
        );
    }

    /// Lets a command print a text.
    fn says(&self, name: &str, text: &str) {
        fs::write(self.path(&format!("{name}.txt")), text).expect("written");
        self.program(name, &format!("/bin/cat {name}.txt"));
    }

    fn batch(&self, shards: usize) -> Batch {
        let make = MakeBatch { software: "test 1", made: "now", shards };
        Batch::make_or_open(&self.path("a batch"), &Numbers, &make).expect("made")
    }

    fn slurm(&self) -> Slurm {
        Slurm {
            commands: SlurmCommands { folder: Some(self.path("bin")) },
            look: Duration::from_millis(1),
            ask: Duration::ZERO,
            ..Slurm::new("/opt/field gap".into(), SlurmOptions::default())
        }
    }

    /// Submitted jobs.
    fn jobs(&self) -> usize {
        fs::read_to_string(self.path("jobs"))
            .map_or(0, |text| text.trim().parse::<usize>().expect("a number") - 40)
    }
}

fn run(batch: &Batch, shards: &[usize]) {
    for &shard in shards {
        run_shard(batch, shard, &Numbers, 1, &|_| ()).expect("run");
    }
}

#[test]
fn a_job_is_sent_once_followed_and_collected() {
    let fake = FakeSlurm::new();
    let batch = fake.batch(4);
    assert!(matches!(fake.slurm().look(&batch), Err(JobError::NotSent(_))));
    let sent = fake.slurm().send(&batch).expect("sent");
    assert_eq!((sent.sent, sent.waiting), (Some((41, 4)), 4));
    assert!(batch.folder().join("logs").is_dir());
    let tasks_run_in = fs::read_to_string(fake.path("where")).expect("there");
    assert_eq!(Path::new(tasks_run_in.trim()), batch.folder());

    run(&batch, &[0, 2]);
    fake.says("squeue", "41|0|COMPLETED|None\n41|1|RUNNING|None\n41|3|PENDING|Resources\n");
    let progress = fake.slurm().send(&batch).expect("followed");
    assert_eq!((progress.done, progress.running, progress.waiting, progress.sent), (2, 1, 1, None));
    assert_eq!(progress.reasons, ["Resources"]);
    run(&batch, &[1, 3]);
    assert!(fake.slurm().look(&batch).expect("done").is_done());
    assert_eq!((fake.jobs(), batch.results().expect("merged").count()), (1, 12));
}

#[test]
fn lost_and_failed_tasks_are_sent_once_more_and_then_named_with_their_logs() {
    let fake = FakeSlurm::new();
    let batch = fake.batch(5);
    fake.slurm().send(&batch).expect("sent");
    run(&batch, &[0]);
    // Task 1 failed, task 2 is known to nobody, task 3 is requeued, task 4 was cancelled; there is no sacct.
    fake.says(
        "squeue",
        "41|1|FAILED|NonZeroExitCode\n41|3|PENDING|BeginTime\n41|4|CANCELLED|None\n",
    );
    let progress = fake.slurm().look(&batch).expect("one task is left");
    assert_eq!((progress.waiting, progress.sent), (1, None));
    run(&batch, &[3]);
    fake.says("squeue", "41|1|FAILED|NonZeroExitCode\n41|4|CANCELLED|None\n");
    let progress = fake.slurm().look(&batch).expect("sent again");
    assert_eq!(progress.sent, Some((42, 3)));
    let again = fs::read_to_string(batch.folder().join("submit.sh")).expect("there");
    assert!(again.contains("#SBATCH --array=1-2,4\n"), "{again}");

    run(&batch, &[2]);
    fs::write(batch.folder().join("logs/1.log"), "one\n\ntwo\nError: no licence\n")
        .expect("written");
    fake.says("squeue", "41|4|CANCELLED|None\n");
    fs::write(
        fake.path("show_job"),
        "JobId=50 ArrayJobId=42 ArrayTaskId=1 JobState=TIMEOUT Reason=TimeLimit\n",
    )
    .expect("written");
    let error = fake.slurm().wait(&batch, &|_| ()).expect_err("given up");
    let said = format!("{error}\n{}", miette::Diagnostic::help(&error).expect("help"));
    let folder = batch.folder().display().to_string();
    assert_eq!(
        said.replace(&folder, "BATCH"),
        "2 shards were sent twice and not finished\nshard 1: TIMEOUT; BATCH/logs/1.log ends with\n  one\n  two\n  Error: no licence\n\
         shard 4: no longer known to Slurm; BATCH/logs/4.log does not exist\n\
         a task took longer than its limit: run the same command with a longer --time"
    );
    // Looking again says the same; asking again sends what is missing.
    assert!(matches!(fake.slurm().look(&batch), Err(JobError::Failed { .. })));
    assert_eq!(fake.jobs(), 2);
    assert_eq!(fake.slurm().send(&batch).expect("sent").sent, Some((43, 2)));
}

#[test]
fn accounts_say_what_became_of_tasks_that_squeue_has_forgotten() {
    let fake = FakeSlurm::new();
    let batch = fake.batch(2);
    fake.slurm().send(&batch).expect("sent");
    fake.program("squeue", "echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1");
    fake.program("scontrol", "[ \"$2\" = config ] && exit 1\necho 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1");
    // A task whose end the accounts have missed must not be waited for.
    fake.says("sacct", "41_0|OUT_OF_MEMORY\n41_1|RUNNING\n");
    assert_eq!(fake.slurm().look(&batch).expect("sent again").sent, Some((42, 2)));
    fake.says("sacct", "42_0|OUT_OF_MEMORY\n42_1|COMPLETED\n");
    let Err(JobError::Failed { shards }) = fake.slurm().look(&batch) else { panic!("given up") };
    let states: Vec<_> = shards.iter().map(|shard| shard.state.as_deref()).collect();
    assert_eq!(states, [Some("OUT_OF_MEMORY"), Some("ended without results")]);
}

#[test]
fn a_controller_that_does_not_answer_is_no_failure() {
    let fake = FakeSlurm::new();
    let batch = fake.batch(2);
    fake.slurm().send(&batch).expect("sent");
    fake.program("squeue", "echo 'slurm_load_jobs error: Unable to contact slurm controller (connect failure)' >&2; exit 1");
    let progress = fake.slurm().look(&batch).expect("wait");
    assert_eq!((progress.answers, progress.sent, fake.jobs()), (false, None, 1));
}

#[test]
fn what_is_refused_is_told_with_what_to_do() {
    let fake = FakeSlurm::new();
    let batch = fake.batch(2);
    fake.program("sbatch", "echo 'sbatch: error: invalid partition specified: fast' >&2; exit 1");
    let error = fake.slurm().send(&batch).expect_err("refused");
    assert!(error.to_string().contains("invalid partition specified: fast"), "{error}");
    assert!(miette::Diagnostic::help(&error).expect("help").to_string().contains("sinfo"));
    fake.program("sbatch", "echo 'Submitted!'");
    assert!(matches!(fake.slurm().send(&batch), Err(JobError::NotUnderstood { .. })));
    fake.program("scontrol", "echo 'MaxArraySize = 1'");
    assert!(matches!(
        fake.slurm().send(&batch),
        Err(JobError::TooManyShards { shards: 2, most: 1 })
    ));
    fs::remove_file(fake.path("bin/scontrol")).expect("removed");
    let error = fake.slurm().send(&batch).expect_err("no Slurm");
    assert!(error.to_string().contains("scontrol` cannot be started"), "{error}");
    assert!(matches!(fake.slurm().most_shards(), Err(JobError::NoSlurm { .. })));
}

#[test]
fn the_size_of_an_array_is_the_clusters() {
    let fake = FakeSlurm::new();
    assert_eq!(fake.slurm().most_shards().expect("told"), 1001);
    fake.program("scontrol", "echo 'MaxArraySize            = 20001'");
    assert_eq!(fake.slurm().most_shards().expect("told"), 20001);
    fake.program("scontrol", "exit 1");
    assert_eq!(fake.slurm().most_shards().expect("its default"), 1001);
}

#[test]
fn the_script_has_what_was_asked_for() {
    let home = tempfile::tempdir().expect("a folder");
    let make = MakeBatch { software: "test 1", made: "now", shards: 12 };
    let batch =
        Batch::make_or_open(&home.path().join("it's a batch"), &Numbers, &make).expect("made");
    let options = SlurmOptions {
        partition: Some("long".parse().expect("good")),
        time: Some("2:00:00".parse().expect("good")),
        memory: Some("4G".parse().expect("good")),
        cpus: "3".parse().expect("good"),
        at_once: Some("8".parse().expect("good")),
        set_up: "#SBATCH --account=lab\nmodule load gcc\n".to_owned(),
    };
    let tasks = TaskNumbers::new([0, 1, 2, 7]);
    let text = script(&batch, &options, &tasks, Path::new("/opt/field gap")).expect("good");
    let folder = batch.folder().display().to_string().replace('\'', r"'\''");
    insta::assert_snapshot!(text.replace(&folder, "BATCH"), @r#"
    #!/bin/bash
    #SBATCH --job-name=fieldgap-numbers
    #SBATCH --array=0-2,7%8
    #SBATCH --requeue
    #SBATCH --open-mode=append
    #SBATCH --output=logs/%a.log
    #SBATCH --ntasks=1
    #SBATCH --cpus-per-task=3
    #SBATCH --partition=long
    #SBATCH --time=2:00:00
    #SBATCH --mem=4G
    #SBATCH --account=lab
    module load gcc
    exec '/opt/field gap' shard --threads 3 'BATCH' "$SLURM_ARRAY_TASK_ID"
    "#);
    let wrong = Batch::make_or_open(&home.path().join("50%"), &Numbers, &make).expect("made");
    let error = script(&wrong, &options, &tasks, Path::new("/opt/x"));
    assert!(matches!(error, Err(JobError::FolderName { character: '%', .. })));
}
