//! Files of an unusual kind or size, and numbers at the ends of their range: one message within seconds and 4 GiB, never a crash.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use rustix::fs::{CWD, FileType, Mode, mknodat};

use crate::small_record::{HEADER, SETUP};

/// Most memory of one command, KiB, and longest time, s.
const MEMORY_KIB: u32 = 4 << 20;
const SECONDS: u32 = 20;

/// Runs the program with bounded memory and time; returns its exit code and standard error.
fn fieldgap(arguments: &[&str]) -> (Option<i32>, String) {
    let bounded = format!("ulimit -v {MEMORY_KIB}; exec timeout {SECONDS} \"$0\" \"$@\"");
    let output = Command::new("sh")
        .args(["-c", &bounded, env!("CARGO_BIN_EXE_fieldgap")])
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    (output.status.code(), String::from_utf8(output.stderr).expect("text"))
}

/// The message of a command that must refuse its files.
fn refused(arguments: &[&str]) -> String {
    let (code, message) = fieldgap(arguments);
    assert_eq!(code, Some(1), "{arguments:?}: {message}");
    message
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// A grid of readings of a focus, with places times `scale`, at a height.
fn grid(scale: f64, z_mm: f64) -> String {
    let place = |n: usize| (n as f64 * 4.0 - 20.0, n);
    let rows = (0..11).flat_map(|row| (0..11).map(move |column| (place(column), place(row))));
    rows.map(|((x, column), (y, row))| {
        let reading = 1.0 / (1.0 + (x * x + y * y) / 100.0);
        format!("{},0,{},{},{z_mm},{reading}\n", row * 11 + column, x * scale, y * scale)
    })
    .collect()
}

/// A folder with a record.
fn record(setup: &str, rows: &str) -> tempfile::TempDir {
    let home = tempfile::tempdir().expect("a folder");
    std::fs::write(home.path().join("scan.toml"), setup).expect("written");
    std::fs::write(home.path().join("samples.csv"), format!("{HEADER}\n{rows}")).expect("written");
    home
}

/// A pipe that nobody writes to, and a device without end.
fn endless(home: &Path) -> [PathBuf; 2] {
    let pipe = home.join("pipe");
    mknodat(CWD, &pipe, FileType::Fifo, Mode::from_raw_mode(0o600), 0).expect("a pipe");
    [pipe, PathBuf::from("/dev/zero")]
}

#[test]
fn pipes_and_devices_are_refused_by_every_command_that_reads_a_file() {
    let home = tempfile::tempdir().expect("a folder");
    let out = home.path().join("out.sealed");
    for path in endless(home.path()) {
        let (path, out) = (text(&path), text(&out));
        for arguments in [
            &["scan", path][..],
            &["rig", "where", path],
            &["simulate", "--display", path],
            &["focus", path],
            &["study", path],
            &["sense", path],
            &["virtual", path],
            &["characterize", path],
            &["blind", "seal-truth", path, "--out", out],
            &["import", "thesis-log", path, "--out", out],
            &["import", "points", path, "--setup", path, "--out", out],
            &["simulate", "--rig", path, "--focus-mm", "0,0,100", "--z-mm", "100"],
        ] {
            let message = refused(arguments);
            assert!(message.contains("not a regular file"), "{arguments:?}: {message}");
        }
    }
}

#[test]
fn pipes_and_devices_in_a_record_are_refused() {
    for name in ["scan.toml", "samples.csv", "state.toml", "wire/robot.log"] {
        let home = record(SETUP, &grid(1.0, 100.0));
        std::fs::copy("rigs/virtual.toml", home.path().join("rig.toml")).expect("copied");
        std::fs::create_dir(home.path().join("wire")).expect("a folder");
        for endless in endless(home.path()) {
            let path = home.path().join(name);
            let _ = std::fs::remove_file(&path);
            std::os::unix::fs::symlink(&endless, &path).expect("a link");
            let folder = text(home.path());
            let command: &[&str] = match name {
                "wire/robot.log" => &["replay", "--wire", folder],
                "state.toml" => &["resume", folder],
                _ => &["replay", folder],
            };
            let message = refused(command);
            let of_pipe = message.contains("not a regular file");
            let of_link = message.contains("a link that leads out of the record");
            assert!(of_pipe || of_link, "{name}: {message}");
        }
    }
}

#[test]
fn pipes_beside_the_readings_do_not_stall_a_replay() {
    for name in ["events.jsonl", "plan.toml", "rig.toml"] {
        let home = record(SETUP, &grid(1.0, 100.0));
        for endless in endless(home.path()) {
            let path = home.path().join(name);
            let _ = std::fs::remove_file(&path);
            std::os::unix::fs::symlink(&endless, &path).expect("a link");
            let (code, message) = fieldgap(&["replay", text(home.path())]);
            assert!(matches!(code, Some(0 | 1)), "{name}: {code:?} {message}");
        }
    }
}

#[test]
fn a_file_beyond_its_limit_is_refused_with_the_limit() {
    let home = record(SETUP, &grid(1.0, 100.0));
    let folder = text(home.path());
    let grow = |name: &str| {
        let file = std::fs::OpenOptions::new().append(true).open(home.path().join(name));
        file.expect("there").set_len(100 << 30).expect("a file with a hole");
    };
    grow("samples.csv");
    let message = refused(&["replay", folder]);
    assert!(message.contains("at most") && message.contains("MiB"), "{message}");
    grow("scan.toml");
    let message = refused(&["compare", folder]);
    assert!(message.contains("at most") && message.contains("MiB"), "{message}");
}

#[test]
fn a_line_of_any_length_is_shown_in_part() {
    let long = "x".repeat(70_000);
    for line in [format!("{long}\n"), format!("{}a\n", "\t".repeat(70_000))] {
        let home = record(&format!("{SETUP}{line}"), "");
        let message = refused(&["compare", text(home.path())]);
        assert!(message.contains("scan.toml:20:70"), "{message}");
        assert!(message.len() < 4000, "{} bytes", message.len());
    }
    let home = record(SETUP, &format!("{long}\n"));
    let message = refused(&["compare", text(home.path())]);
    assert!(message.contains("samples.csv:2") && message.len() < 4000, "{message}");
}

#[test]
fn places_in_micrometres_are_refused_with_the_unit() {
    for (scale, z_mm) in [(1e3, 1e5), (1e3, 100.0), (1.0, 1e5)] {
        let home = record(SETUP, &grid(scale, z_mm));
        for command in ["compare", "diagnose", "distinguish", "replay"] {
            let message = refused(&[command, text(home.path())]);
            assert!(message.contains("µm"), "{command}: {message}");
        }
    }
    let far = grid(1.0, 100.0) + "500,0,0,0,100000,0.5\n";
    let home = record(SETUP, &far);
    let message = refused(&["diagnose", text(home.path())]);
    assert!(message.contains("samples.csv:123") && message.contains("µm"), "{message}");
}

#[test]
fn a_field_too_fine_for_its_extent_is_refused() {
    let home = record(&SETUP.replace("40000.0", "1e7"), &grid(1.0, 100.0));
    for command in ["compare", "diagnose", "distinguish", "replay"] {
        let message = refused(&[command, text(home.path())]);
        assert!(message.contains("wavelengths"), "{command}: {message}");
    }
}

#[test]
fn a_display_in_steps_of_nanometres_is_refused() {
    let home = tempfile::tempdir().expect("a folder");
    let circle = std::fs::read_to_string("scans/display-circle.toml").expect("there");
    let step = circle.lines().find(|line| line.starts_with("step_mm")).expect("a step");
    let path = home.path().join("display.toml");
    for (with, words) in [("step_mm = 1e-9", "1e-6 mm"), ("step_mm = 1e-6", "steps in a loop")] {
        std::fs::write(&path, circle.replace(step, with)).expect("written");
        let message =
            refused(&["simulate", "--display", text(&path), "--rig", "rigs/virtual.toml"]);
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn a_wire_log_of_impossible_times_is_refused_at_its_line() {
    let home = record(SETUP, &grid(1.0, 100.0));
    std::fs::copy("rigs/virtual.toml", home.path().join("rig.toml")).expect("copied");
    std::fs::create_dir(home.path().join("wire")).expect("a folder");
    let log = "0 @ m 2026-01-01T00:00:00Z 1\n1e308 < start\\n\n";
    std::fs::write(home.path().join("wire/robot.log"), log).expect("written");
    let message = refused(&["replay", "--wire", text(home.path())]);
    assert!(message.contains("line 2"), "{message}");
}
