//! Wire logs replayed to the drivers give the same behaviour; a changed log is reported with its place.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::repository::{fieldgap, virtual_rig};

const PLAN: &str = r#"
name = "logged"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[dark]
before = 2
[[plane]]
z_mm = 100.0
size_mm = [10.0, 10.0]
step_mm = 2.0
"#;

/// Faults without long time-outs, because this rig runs in real time while nothing is sent.
const FAULTS: &str = "[virtual.faults]\nflip = 0.01\ndouble = 0.01\nwrong_ok = 0.02\n";

/// Scans on a virtual rig with additional lines in its file; returns the scan's folder.
fn scanned(home: &Path, more: &str) -> (PathBuf, Output) {
    let (plan, rig, folder) = (home.join("plan.toml"), home.join("rig.toml"), home.join("scan"));
    std::fs::write(&plan, PLAN).expect("written");
    std::fs::write(&rig, virtual_rig("\"lockstep\"") + more).expect("written");
    let scan = fieldgap()
        .arg("scan")
        .arg(&plan)
        .arg("--rig")
        .arg(&rig)
        .arg("--out")
        .arg(&folder)
        .output()
        .expect("the program runs");
    (folder, scan)
}

fn replayed(folder: &Path) -> (Option<i32>, String) {
    let ended =
        fieldgap().arg("replay").arg(folder).arg("--wire").output().expect("the program runs");
    (ended.status.code(), String::from_utf8_lossy(&ended.stdout).into_owned())
}

#[test]
fn replayed_drivers_behave_as_recorded() {
    let home = tempfile::tempdir().expect("a folder");
    let (folder, scan) = scanned(home.path(), "");
    assert!(scan.status.success());
    let (code, said) = replayed(&folder);
    assert_eq!(code, Some(0), "{said}");
    for words in
        ["robot: 1 sessions, 39 calls", "receiver: 1 sessions, 38 calls", "focus array: 1 sessions"]
    {
        assert!(said.contains(words), "no `{words}` in {said}");
    }
}

#[test]
fn replayed_drivers_on_a_faulty_wire_behave_as_recorded() {
    let home = tempfile::tempdir().expect("a folder");
    let (folder, _) = scanned(home.path(), FAULTS);
    // Resumed wherever it ended, so that the logs have several sessions.
    for _ in 0..2 {
        fieldgap().arg("resume").arg(&folder).output().expect("the program runs");
    }
    let robot = std::fs::read_to_string(folder.join("wire/robot.log")).expect("a log");
    assert!(robot.contains("Resend") || robot.contains("ok\\nok\\n"), "faults occurred");
    let (code, said) = replayed(&folder);
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn a_difference_from_the_log_is_reported_with_its_place() {
    let home = tempfile::tempdir().expect("a folder");
    let (folder, scan) = scanned(home.path(), "");
    assert!(scan.status.success());
    let log = folder.join("wire/robot.log");
    let text = std::fs::read_to_string(&log).expect("a log");
    // As if the recorded driver had sent another feed.
    std::fs::write(&log, text.replacen("F4800.0", "F4700.0", 1)).expect("written");
    let (code, said) = replayed(&folder);
    assert_eq!(code, Some(1), "{said}");
    for words in [
        "session 1 at",
        "{\"move-to\":",
        "then: sent `N",
        "G1 X145.000 Y145.000 Z80.000 F4700.0",
        "now:  sent `N",
        "G1 X145.000 Y145.000 Z80.000 F4800.0",
    ] {
        assert!(said.contains(words), "no `{words}` in {said}");
    }
    // As if it had interpreted the same bytes as another reading.
    std::fs::write(&log, text.replacen(": ok {\"stands\":[0.155", ": ok {\"stands\":[0.156", 1))
        .expect("written");
    let (code, said) = replayed(&folder);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("then: ok {\"stands\":[0.156"), "{said}");
}
