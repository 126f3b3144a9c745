//! `--on`: the same results on this computer, after a kill, and by Slurm's tasks.

mod script;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use fieldgap::jobs::{Batch, Failure, MakeBatch, Product, Work};
use script::write_script;

const PROGRAM: &str = env!("CARGO_BIN_EXE_fieldgap");

/// Many small fields: long enough to be killed in the middle.
const STUDY: &str = r#"
name = "cells"
[array]
frequency_hz = 40000.0
layout = "square"
columns = 4
rows = 4
element_diameter_mm = 10.5
spacing_mm = 0.0
[medium]
speed_of_sound_m_s = 343.0
[simulator]
model = "rayleigh"
[focus]
x_mm = 0.0
y_mm = 0.0
z_mm = 80.0
[map]
size_mm = 40.0
step_mm = 2.0
[[sweep]]
parameter = "map.z_mm"
from = 40.0
to = 119.0
step = 1.0
[[sweep]]
parameter = "medium.speed_of_sound_m_s"
values = [340.0, 343.0, 346.0]
"#;

/// A Slurm that runs all tasks of a job before `sbatch` returns, one after the other; the first job loses the task 2. `squeue` knows no job.
const SBATCH: &str = r#"#!/bin/bash
n=$(($(cat "$FAKE/jobs" 2>/dev/null || echo 0) + 1)); echo $n >"$FAKE/jobs"
[ "$1" = --parsable ] || exit 2
list=$(sed -n 's/^#SBATCH --array=\([-0-9,]*\).*/\1/p' "$2")
for range in ${list//,/ }; do
    for task in $(seq "${range%-*}" "${range#*-}"); do
        [ "$n $task" = "1 2" ] && continue
        SLURM_ARRAY_TASK_ID=$task bash "$2" >>"logs/$task.log" 2>&1
    done
done
echo "$n"
"#;

fn fieldgap(folder: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    command.current_dir(folder).stdin(Stdio::null());
    command
}

fn run(command: &mut Command) -> Output {
    let output = command.output().expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

/// A folder with the programs of a small Slurm; a command that finds them.
fn by_slurm(folder: &Path) -> Command {
    let bin = folder.join("bin");
    fs::create_dir_all(&bin).expect("made");
    let unknown = "#!/bin/sh\necho 'slurm_load_jobs error: Invalid job id specified' >&2\nexit 1\n";
    for (name, text) in [
        ("sbatch", SBATCH),
        ("squeue", unknown),
        ("scontrol", "#!/bin/sh\necho 'MaxArraySize = 50'\n"),
    ] {
        write_script(&bin.join(name), text);
    }
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").expect("a path"));
    let mut command = fieldgap(folder);
    command.env("PATH", path).env("FAKE", folder);
    command
}

fn read(path: PathBuf) -> Vec<u8> {
    fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Two small records, one of which cannot be read.
fn records(folder: &Path) {
    let make = ["blind", "make", "set", "--count", "2", "--seed", "5", "--none", "1"];
    run(fieldgap(folder).args(make).args(["--pairs", "0", "--outside", "0"]));
    let samples = folder.join("set/0001/samples.csv");
    let text = fs::read_to_string(&samples).expect("there");
    fs::write(&samples, text.replacen("0,-35.0", "0,far", 1)).expect("written");
}

#[test]
fn a_study_that_was_killed_and_continued_is_the_same_study() {
    let folder = tempfile::tempdir().expect("a folder");
    let home = folder.path();
    fs::write(home.join("cells.toml"), STUDY).expect("written");
    let study = |batch: &str| {
        let mut command = fieldgap(home);
        command.args(["study", "cells.toml", "--json", "--on", "local", "--batch", batch]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    assert!(study("whole").status().expect("it starts").success());

    let mut killed = study("killed").spawn().expect("it starts");
    let shards = home.join("killed/shards");
    let done = || {
        fs::read_dir(&shards).map_or(0, |entries| {
            let names = entries.flatten().map(|entry| entry.file_name());
            names
                .filter(|name| {
                    name.to_string_lossy().ends_with(".jsonl")
                        && !name.to_string_lossy().starts_with('.')
                })
                .count()
        })
    };
    let begun = Instant::now();
    while done() < 20 {
        assert!(begun.elapsed() < Duration::from_secs(120), "no shard is done");
        std::thread::yield_now();
    }
    // SIGKILL.
    killed.kill().expect("killed");
    killed.wait().expect("it ended");
    assert!(done() < 240, "it was killed in the middle");
    assert!(study("killed").status().expect("it starts").success());
    assert_eq!(read(home.join("killed/merged.jsonl")), read(home.join("whole/merged.jsonl")));

    // The figures are those of the study without shards, and by Slurm they are the same bytes.
    let plain = run(fieldgap(home).args(["study", "cells.toml", "--json"])).stdout;
    let again = run(study("whole").stdout(Stdio::piped())).stdout;
    assert_eq!(String::from_utf8_lossy(&again), String::from_utf8_lossy(&plain));
    let slurm = ["study", "cells.toml", "--json", "--on", "slurm", "--batch", "slurm"];
    let sent = run(by_slurm(home).args(slurm));
    let said = String::from_utf8_lossy(&sent.stderr).into_owned();
    assert!(said.contains("job 1 sent: 50 tasks") && said.contains("--collect"), "{said}");
    let collect = run(by_slurm(home).args(slurm).args(["--collect", "--wait"]));
    assert_eq!(collect.stdout, plain);
    assert_eq!(fs::read_to_string(home.join("jobs")).expect("there"), "2\n");
    assert_eq!(read(home.join("slurm/merged.jsonl")), read(home.join("whole/merged.jsonl")));
}

#[test]
fn a_volume_in_shards_has_the_bytes_of_one_without() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml");
    let volume = |mut command: Command, out: &str| {
        command.args(["simulate", "--simulator", "piston", "--focus-mm", "5,0,80"]);
        command.args(["--volume-mm", "60,100", "--size-mm", "30", "--step-mm", "2", "--out", out]);
        command.arg("--rig").arg(&rig);
        command
    };
    run(&mut volume(fieldgap(folder.path()), "plain"));
    run(volume(fieldgap(folder.path()), "here").args(["--on", "local", "--array-size", "4"]));
    run(volume(by_slurm(folder.path()), "slurm").args([
        "--on",
        "slurm",
        "--array-size",
        "5",
        "--wait",
    ]));
    for file in ["volume.npy", "volume.toml"] {
        let plain = read(folder.path().join("plain").join(file));
        assert!(read(folder.path().join("here").join(file)) == plain, "{file}");
        assert!(read(folder.path().join("slurm").join(file)) == plain, "{file}");
    }
    // Planes alone are not divided.
    let output =
        fieldgap(folder.path()).args(["simulate", "--on", "local", "--rig"]).arg(&rig).output();
    let said = output.expect("it starts").stderr;
    assert!(String::from_utf8_lossy(&said).contains("only a volume"));
}

#[test]
fn records_are_analysed_again_beside_their_first_results() {
    let folder = tempfile::tempdir().expect("a folder");
    let home = folder.path();
    records(home);
    let before = read(home.join("set/0000/scan.toml"));
    let again = |mut command: Command, name: &str, more: &[&str]| {
        command.args(["reanalyse", "set", "--with", "simulator=gaussian", "--name", name]);
        command
            .args(["--with", "effects=sound-speed,pitch"])
            .args(more)
            .output()
            .expect("it starts")
    };
    let here = again(fieldgap(home), "here", &["--csv"]);
    let said = String::from_utf8_lossy(&here.stdout);
    let rows: Vec<&str> = said.lines().collect();
    assert!(rows[0].starts_with("record,simulator_before,gap_before"), "{said}");
    assert!(rows[1].starts_with("0000,piston,0.0") && rows[1].contains(",computed,"), "{said}");
    assert!(rows[2].starts_with("0001,,,,,,,,,,") && rows[2].contains("samples.csv:"), "{said}");
    assert!(!here.status.success(), "a record failed");

    let result = home.join("set/0000/reanalyses/here");
    let json = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&read(result.join(name))).expect("JSON")
    };
    assert_eq!(json("figures.json")["simulator"], "gaussian");
    let diagnosis = json("diagnosis.json");
    assert!(
        diagnosis["undetermined"]
            .to_string()
            .contains("only a part was tried (sound-speed, pitch)")
    );
    for candidate in diagnosis["ranked"].as_array().expect("candidates") {
        for effect in candidate["effects"].as_array().expect("effects") {
            assert!(effect == "sound-speed" || effect == "pitch", "{effect}");
        }
    }
    let provenance = json("provenance.json");
    assert_eq!(provenance["with"]["effects"], "sound-speed,pitch");
    assert_eq!(provenance["sha256"]["scan.toml"].as_str().map(str::len), Some(64));
    assert!(!home.join("set/0001/reanalyses").exists());
    assert_eq!(read(home.join("set/0000/scan.toml")), before);

    // By Slurm, the same bytes.
    let slurm = again(by_slurm(home), "slurm", &["--csv", "--on", "slurm", "--wait"]);
    assert_eq!(String::from_utf8_lossy(&slurm.stdout), said);
    let other = home.join("set/0000/reanalyses/slurm/diagnosis.json");
    assert_eq!(read(other), read(result.join("diagnosis.json")));

    // A record that changes while its batch waits is not mixed with the others.
    let text = fs::read_to_string(home.join("set/0000/samples.csv")).expect("there");
    let first = again(fieldgap(home), "here", &[]);
    assert!(String::from_utf8_lossy(&first.stdout).contains("1 of 2 records failed"));
    fs::write(home.join("set/0000/samples.csv"), text + "\n").expect("written");
    let other = again(fieldgap(home), "here", &[]);
    assert!(String::from_utf8_lossy(&other.stderr).contains("list of items differs"));
}

#[test]
fn a_sealed_set_in_shards_has_the_diagnoses_of_one_without() {
    let folder = tempfile::tempdir().expect("a folder");
    let home = folder.path();
    records(home);
    let set = |out: &str, more: &[&str]| {
        let arguments = ["blind", "run", "set", "--out", out];
        fieldgap(home).args(arguments).args(more).output().expect("it starts")
    };
    assert!(!set("plain", &[]).status.success());
    let here = set("here", &["--on", "local"]);
    assert!(String::from_utf8_lossy(&here.stdout).starts_with("0000  none"));
    assert!(String::from_utf8_lossy(&here.stderr).contains("0001: "));
    assert_eq!(read(home.join("here/0000.json")), read(home.join("plain/0000.json")));
}

#[test]
fn a_task_of_another_version_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let home = folder.path();
    let shard = |batch: &str, number: &str| {
        let output = fieldgap(home).args(["shard", batch, number]).output().expect("it starts");
        assert!(!output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for (batch, software) in
        [("other", "fieldgap 0.0.9"), ("own", concat!("fieldgap ", env!("CARGO_PKG_VERSION")))]
    {
        let make = MakeBatch { software, made: "now", shards: 1 };
        Batch::make_or_open(&home.join(batch), &Unknown, &make).expect("made");
    }
    let said = shard("other", "0");
    assert!(said.contains("was made by fieldgap 0.0.9, and this is fieldgap "), "{said}");
    assert!(shard("own", "0").contains("no work of the kind `unheard-of`"));
    assert!(shard("nowhere", "0").contains("there is no batch"));
}

/// Work of a kind that the program does not know.
struct Unknown;

impl Work for Unknown {
    fn kind(&self) -> &str {
        "unheard-of"
    }

    fn description(&self) -> serde_json::Value {
        serde_json::Value::Null
    }

    fn items(&self) -> Vec<serde_json::Value> {
        vec![serde_json::Value::Null]
    }

    fn run(&self, _: &serde_json::Value) -> Result<Product, Failure> {
        Product::json(&())
    }
}
