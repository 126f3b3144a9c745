//! The index of 10,000 small records, from nothing and when it is current: `cargo bench --bench history`.
//!
//! A query is timed as a whole process, which also looks whether a record has changed. The reference is a look at the times of the same files
//! without anything else, in the same run.

#[path = "../crates/archive/tests/synthetic/mod.rs"]
mod synthetic;

use std::fs;
use std::hint::black_box;
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant, SystemTime};

const RECORDS: u64 = 10_000;
const ROUNDS: usize = 15;

/// Set for the processes that are timed: they are the program itself.
const AS_PROGRAM: &str = "FIELDGAP_BENCH_AS_PROGRAM";

fn main() -> ExitCode {
    if std::env::var_os(AS_PROGRAM).is_some() {
        return fieldgap::cli::main();
    }
    let lab = tempfile::tempdir().expect("a folder");
    synthetic::write_records(lab.path(), RECORDS);
    age(lab.path());
    let start = Instant::now();
    let memory_mb = run(lab.path(), &["--limit", "1"]);
    println!(
        "{RECORDS} records from nothing: {:.1} s, {memory_mb:.0} MB of memory; index {:.1} MB",
        start.elapsed().as_secs_f64(),
        fs::metadata(lab.path().join(".fieldgap-index.sqlite")).expect("there").len() as f64 / 1e6
    );
    let look = best(|| {
        black_box(looked_at(lab.path()));
    });
    println!(
        "a look at the times of their {} files and folders: {:.0} ms",
        looked_at(lab.path()),
        look * 1e3
    );
    let queries: [(&str, &[&str]); 4] = [
        ("rig and gap", &["--rig", "bench A", "--gap-above", "24.5"]),
        ("effect, last 20", &["--effect", "lag", "--limit", "20"]),
        ("text of a note", &["--noted", "preamplifier", "--limit", "50"]),
        ("all, as JSON", &["--format", "json"]),
    ];
    for (name, arguments) in queries {
        let time = best(|| {
            black_box(run(lab.path(), arguments));
        });
        println!("{name}: {:.0} ms", time * 1e3);
    }
    ExitCode::SUCCESS
}

/// Seconds of the fastest of several runs.
fn best(run: impl Fn()) -> f64 {
    let once = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    (0..ROUNDS).map(once).fold(f64::INFINITY, f64::min)
}

/// Runs `fieldgap history`; its largest memory in MB, as far as it can be seen.
fn run(lab: &Path, arguments: &[&str]) -> f64 {
    let program = std::env::current_exe().expect("this program");
    let mut process = Command::new(program)
        .env(AS_PROGRAM, "1")
        .arg("history")
        .arg(lab)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("started");
    let mut largest_kb = 0.0f64;
    loop {
        let status =
            fs::read_to_string(format!("/proc/{}/status", process.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kb = line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse().ok());
        largest_kb = largest_kb.max(kb.unwrap_or(0.0));
        if let Some(status) = process.try_wait().expect("it can be waited for") {
            assert!(status.success(), "{status}");
            return largest_kb / 1e3;
        }
        std::thread::sleep(Duration::from_micros(200));
    }
}

/// Looks at the times of the files that the index looks at; how many there are.
fn looked_at(lab: &Path) -> usize {
    let mut count = 0;
    for week in fs::read_dir(lab).expect("a folder").flatten() {
        let Ok(records) = fs::read_dir(week.path()) else { continue };
        for record in records.flatten() {
            let files =
                ["", "scan.toml", "notes.jsonl", "report/figures.json", "report/why/figures.json"];
            count +=
                files.iter().filter(|file| fs::metadata(record.path().join(file)).is_ok()).count();
        }
    }
    count
}

/// Makes everything a minute old: what was written within two seconds is read again, as coarse clocks could hide a change.
fn age(path: &Path) {
    if path.is_dir() {
        fs::read_dir(path).expect("a folder").flatten().for_each(|entry| age(&entry.path()));
    }
    let old = SystemTime::now() - Duration::from_secs(60);
    fs::File::open(path).and_then(|file| file.set_modified(old)).expect("set");
}
