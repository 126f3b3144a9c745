//! A scan that is killed at random instants and resumed each time: no acknowledged reading is lost, changed or duplicated,
//! and the final record is complete.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use fieldgap::records::{Plan, RecordedScan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::{Pid, Signal, kill_process};

/// A plane of 45 x 45 points, enough for all kills.
const PLAN: &str = r#"
name = "killed"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[dark]
before = 2
after = 2
[[plane]]
z_mm = 100.0
size_mm = [44.0, 44.0]
step_mm = 1.0
"#;

/// A reading that the program acknowledged.
struct Acknowledged {
    row: usize,
    reading: f64,
}

fn fieldgap() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    command
}

fn begin_or_resume(plan: &Path, folder: &Path) -> Command {
    let mut command = fieldgap();
    if folder.join("scan.toml").exists() {
        command.arg("resume").arg(folder).arg("--json");
    } else {
        let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml");
        command.arg("scan").arg(plan).arg("--rig").arg(rig).arg("--out").arg(folder).arg("--json");
    }
    command
}

fn measured(line: &str) -> Option<Acknowledged> {
    let event: serde_json::Value = serde_json::from_str(line).ok()?;
    (event["event"] == "measured").then(|| Acknowledged {
        row: event["row"].as_u64().expect("a row") as usize,
        reading: event["reading"].as_f64().expect("a reading"),
    })
}

/// Runs the program until it has acknowledged some readings and a random time has passed, and kills it; returns the
/// acknowledged readings.
fn run_and_kill(command: &mut Command, draws: &mut ChaCha8Rng) -> Vec<Acknowledged> {
    let mut child = command.spawn().expect("the program starts");
    let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
    let enough = draws.random_range(0..12);
    let mut acknowledged = Vec::new();
    while acknowledged.len() < enough {
        match lines.next() {
            Some(line) => acknowledged.extend(measured(&line.expect("text"))),
            None => break,
        }
    }
    // During another point or, without acknowledged readings, during the start.
    let window = if enough == 0 { 40_000 } else { 2_000 };
    let until = Instant::now() + Duration::from_micros(draws.random_range(0..window));
    while Instant::now() < until {
        std::hint::spin_loop();
    }
    child.kill().expect("it can be killed");
    acknowledged.extend(lines.filter_map(|line| measured(&line.ok()?)));
    child.wait().expect("it ends");
    acknowledged
}

#[test]
fn forty_kills_lose_no_acknowledged_reading() {
    kill_and_resume(PLAN, 40);
}

/// A plane of 100 x 100 points.
#[test]
#[ignore = "takes minutes; run: cargo test --release --test rig kill_and_resume -- --ignored"]
fn a_thousand_kills_over_ten_thousand_points_lose_no_acknowledged_reading() {
    kill_and_resume(&PLAN.replace("[44.0, 44.0]", "[99.0, 99.0]"), 1000);
}

fn kill_and_resume(plan_text: &str, kills: usize) {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    std::fs::write(&plan, plan_text).expect("the plan is written");
    let mut draws = ChaCha8Rng::seed_from_u64(200);
    let mut safe: Vec<f64> = Vec::new();
    for kill in 0..kills {
        for acknowledged in run_and_kill(&mut begin_or_resume(&plan, &folder), &mut draws) {
            assert!(acknowledged.row >= safe.len(), "kill {kill}: row {} again", acknowledged.row);
            // Rows on disk whose acknowledgement was lost with the process are unknown here.
            safe.resize(acknowledged.row, f64::NAN);
            safe.push(acknowledged.reading);
        }
        for file in ["samples.csv", "journal.csv"] {
            let rows = std::fs::read_to_string(folder.join(file))
                .map_or(0, |text| text.matches('\n').count().saturating_sub(1));
            let safe = safe.len();
            assert!(rows >= safe, "kill {kill}: {rows} rows in {file} of {safe} acknowledged");
        }
    }
    assert!(safe.len() > kills, "only {} readings were acknowledged", safe.len());

    let ended = begin_or_resume(&plan, &folder).output().expect("the program runs");
    assert!(ended.status.success(), "the last resume ended with {}", ended.status);
    let record = RecordedScan::open(&folder).expect("the record is whole");
    let visits = Plan::read(&plan).expect("the plan is read").visits();
    assert_eq!(record.samples.len(), visits.len());
    let journal = std::fs::read_to_string(folder.join("journal.csv")).expect("the journal is kept");
    assert_eq!(journal.lines().count(), 1 + visits.len());
    for (row, ((sample, visit), line)) in
        record.samples.iter().zip(&visits).zip(journal.lines().skip(1)).enumerate()
    {
        let to = visit.position_m.map(|m| (m * 1e9).round() / 1e6);
        let sent = format!("{row},{:?},{:?},{:?},", to.x, to.y, to.z);
        assert!(line.starts_with(&sent), "row {row}: {line}");
        assert_eq!(sample.focus, visit.focus, "row {row}");
        assert!((sample.position_m() - visit.position_m).norm() < 0.05e-3, "row {row}");
        if let Some(reading) = safe.get(row).filter(|reading| !reading.is_nan()) {
            // JSON may differ in the last bit.
            assert!((sample.reading / reading - 1.0).abs() < 1e-15, "row {row}");
        }
    }
}

#[test]
fn an_interrupted_scan_ends_safely_and_can_be_finished() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    for (signal, who) in
        [(Signal::INT, "interrupted from the keyboard"), (Signal::TERM, "asked to terminate")]
    {
        let mut child = begin_or_resume(&plan, &folder).spawn().expect("the program starts");
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        let begun = lines.by_ref().filter_map(|line| measured(&line.ok()?)).take(20).count();
        assert_eq!(begun, 20);
        kill_process(Pid::from_child(&child), signal).expect("the signal is sent");
        let rows = 1 + lines.filter_map(|line| measured(&line.ok()?)).last().map_or(19, |m| m.row);
        assert_eq!(child.wait().expect("it ends").code(), Some(3));
        let state = std::fs::read_to_string(folder.join("state.toml")).expect("the state is kept");
        for words in ["partial", who, "the array is silent, the robot stands still"] {
            assert!(state.contains(words), "no `{words}` in {state}");
        }
        let kept = RecordedScan::open(&folder).expect("the record is whole").samples.len();
        assert!(kept >= rows, "{kept} rows of {rows} acknowledged");
    }
    let ended = begin_or_resume(&plan, &folder).output().expect("the program runs");
    assert!(ended.status.success());
    let record = RecordedScan::open(&folder).expect("the record is whole");
    assert_eq!(record.samples.len(), Plan::read(&plan).expect("a plan").visits().len());
}
