//! Invalid input: one message with place and remedy, exit code 1, and no record.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::small_record::{HEADER, SETUP};

const PLAN: &str = r#"name = "bad"
[simulator]
model = "corrected"
[[focus]]
x_mm = 0.0
y_mm = 0.0
z_mm = 100.0
[[plane]]
z_mm = 100.0
centre_mm = [0.0, 0.0]
size_mm = [10.0, 10.0]
step_mm = 2.0
"#;

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Runs the program; returns its exit code and standard error.
fn fieldgap(arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    (output.status.code(), String::from_utf8(output.stderr).expect("text"))
}

/// Runs `scan` on a plan in a new folder; it must fail without a record.
fn scan_of(plan: &str, rig: &Path) -> String {
    let home = tempfile::tempdir().expect("a folder");
    let (path, out) = (home.path().join("plan.toml"), home.path().join("scan"));
    std::fs::write(&path, plan).expect("the plan is written");
    let rig = rig.to_str().expect("text");
    let (code, message) = fieldgap(&[
        "scan",
        path.to_str().expect("text"),
        "--rig",
        rig,
        "--out",
        out.to_str().expect("text"),
        "--yes",
    ]);
    assert_eq!(code, Some(1), "{message}");
    assert!(!out.join("scan.toml").exists(), "a record was begun: {message}");
    message
}

fn assert_contains(message: &str, wanted: &[&str]) {
    for words in wanted {
        assert!(message.contains(words), "no `{words}` in:\n{message}");
    }
    assert!(!message.contains("panicked"), "{message}");
}

#[test]
fn an_unknown_key_is_shown_at_its_line() {
    let plan = PLAN.replace("size_mm", "sise_mm");
    let message = scan_of(&plan, &here("rigs/virtual.toml"));
    assert_contains(&message, &["plan.toml:11:1", "sise_mm", "help:"]);
}

#[test]
fn a_negative_step_is_shown_at_its_line() {
    let message =
        scan_of(&PLAN.replace("step_mm = 2.0", "step_mm = -2.0"), &here("rigs/virtual.toml"));
    assert_contains(
        &message,
        &["plan.toml:12:11", "-2 is not a length above zero", "step_mm = -2.0"],
    );
}

#[test]
fn a_focus_outside_the_travel_is_shown_with_the_limits() {
    let message = scan_of(
        &PLAN.replace("z_mm = 100.0\n[[plane]]", "z_mm = 900.0\n[[plane]]"),
        &here("rigs/virtual.toml"),
    );
    assert_contains(
        &message,
        &["plan.toml:4:1", "outside the robot's travel", "the robot reaches x -150.0 to 150.0"],
    );
}

#[test]
fn a_point_outside_the_travel_is_shown_at_its_plane() {
    let message = scan_of(
        &PLAN.replace("size_mm = [10.0, 10.0]", "size_mm = [400.0, 10.0]"),
        &here("rigs/virtual.toml"),
    );
    assert_contains(
        &message,
        &["plan.toml:8:1", "the robot cannot move to (-200.00, -5.00, 100.00) mm", "help:"],
    );
}

#[test]
fn a_missing_plan_or_rig_file_is_named() {
    let (code, message) = fieldgap(&["scan", "no-such-plan.toml"]);
    assert_eq!(code, Some(1));
    assert_contains(&message, &["no-such-plan.toml", "cannot be read", "help:"]);
    let plan = PLAN.replace("name = \"bad\"", "name = \"bad\"\nrig = \"no-such-rig.toml\"");
    let home = tempfile::tempdir().expect("a folder");
    let path = home.path().join("plan.toml");
    std::fs::write(&path, plan).expect("the plan is written");
    let (code, message) = fieldgap(&["scan", path.to_str().expect("text")]);
    assert_eq!(code, Some(1));
    assert_contains(&message, &["plan.toml:2:7", "no-such-rig.toml", "--rig"]);
}

#[test]
fn a_missing_port_is_named_with_the_existing_ones() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = std::fs::read_to_string(here("rigs/thesis.toml")).expect("the rig file is there");
    let rig = rig.replace("/dev/tty", "/dev/fieldgap-no-such-tty");
    let path = home.path().join("rig.toml");
    std::fs::write(&path, rig).expect("the rig file is written");
    let message = scan_of(PLAN, &path);
    assert_contains(
        &message,
        &["/dev/fieldgap-no-such-tty", "the port does not exist; ports on this machine", "help:"],
    );
}

/// What a command says of a record with these rows; it must refuse them.
fn refused(command: &str, rows: &str) -> String {
    let home = tempfile::tempdir().expect("a folder");
    std::fs::write(home.path().join("scan.toml"), SETUP).expect("written");
    std::fs::write(home.path().join("samples.csv"), format!("{HEADER}\n{rows}")).expect("written");
    let (code, message) = fieldgap(&[command, home.path().to_str().expect("text")]);
    assert_eq!(code, Some(1), "{message}");
    message
}

#[test]
fn a_truncated_record_is_shown_at_its_line() {
    for command in ["replay", "compare"] {
        let message = refused(command, "0,0,0,0,100,1.5\n1,0,2,0,10");
        assert_contains(&message, &["samples.csv:3", "help:"]);
    }
}

#[test]
fn numbers_that_no_scan_can_have_are_shown_at_their_line() {
    let good = "0,0,0,0,100,1.5\n";
    for (row, words) in [
        ("1,0,2,0,1e308,1.5", "within 10 m of the array"),
        ("1,0,2,0,100,1e160", "1e12"),
        ("1,0,2000000,0,100,1.5", "within 10 m of the array (in mm, not in µm)"),
    ] {
        for command in ["compare", "diagnose", "replay"] {
            let message = refused(command, &format!("{good}{row}\n"));
            assert_contains(&message, &["samples.csv:3", words]);
        }
    }
}

#[test]
fn readings_that_show_no_field_are_refused() {
    let rows = |reading: &dyn Fn(usize) -> String, place: &dyn Fn(usize) -> usize| -> String {
        let row = |n: usize| format!("{n},0,{},0,100,{}\n", place(n), reading(n));
        (0..40).map(row).collect()
    };
    let grows = |n: usize| (n + 1).to_string();
    for command in ["compare", "diagnose", "replay"] {
        let stuck = refused(command, &rows(&|_| "1.0".to_owned(), &|n| n));
        assert_contains(&stuck, &["every driven reading", "is 1", "stuck"]);
        let silent = refused(command, &rows(&|n| format!("{n}e-200"), &|n| n));
        assert_contains(&silent, &["zero or below 1e-12"]);
        let one_place = refused(command, &rows(&grows, &|_| 3));
        assert_contains(&one_place, &["1 different pairs of drive and place"]);
    }
}

#[test]
fn a_folder_without_a_scan_is_reported() {
    let home = tempfile::tempdir().expect("a folder");
    for command in ["resume", "replay"] {
        let (code, message) = fieldgap(&[command, home.path().to_str().expect("text")]);
        assert_eq!(code, Some(1), "{message}");
        assert_contains(&message, &["scan.toml"]);
    }
}

#[test]
fn a_wrong_command_line_has_its_own_exit_code() {
    assert_eq!(fieldgap(&["scan"]).0, Some(2));
    assert_eq!(fieldgap(&["no-such-command"]).0, Some(2));
}

#[test]
fn a_port_beside_a_virtual_rig_in_lockstep_is_refused_at_its_line() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = std::fs::read_to_string("rigs/virtual.toml").expect("it is there");
    let rig = rig.replace("[motion.marlin]", "[motion.marlin]\nport = \"/dev/ttyUSB0\"");
    let path = home.path().join("rig.toml");
    std::fs::write(&path, rig).expect("written");
    let (code, message) = fieldgap(&["rig", "where", path.to_str().expect("text")]);
    assert_eq!(code, Some(1), "{message}");
    assert_contains(&message, &["pace = { times = 1.0 }", "rig.toml", "/dev/ttyUSB0"]);
}

#[test]
fn a_list_of_elements_that_is_too_long_is_refused() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = std::fs::read_to_string("rigs/swipe.toml").expect("it is there");
    assert!(rig.contains("left = [17, 15]"));
    let path = home.path().join("rig.toml");
    std::fs::write(&path, rig.replace("left = [17, 15]", "left = [17, 15, 30]")).expect("written");
    let (code, message) = fieldgap(&["sense", path.to_str().expect("text")]);
    assert_eq!(code, Some(1), "{message}");
    assert_contains(&message, &["invalid length 3, expected 2 values"]);
    let truth = home.path().join("truth.toml");
    let text = std::fs::read_to_string("rigs/truth/thesis-lab.toml").expect("it is there");
    let swapped = "\n[effects.swapped-channels]\nelements = [0, 1, 2]\n";
    std::fs::write(&truth, text + swapped).expect("written");
    let rig = std::fs::read_to_string("rigs/virtual.toml").expect("it is there");
    let rig = rig.replace("truth/thesis-lab.toml", truth.to_str().expect("text"));
    std::fs::write(&path, rig).expect("written");
    let (code, message) = fieldgap(&["rig", "where", path.to_str().expect("text")]);
    assert_eq!(code, Some(1), "{message}");
    assert_contains(&message, &["invalid length 3, expected 2 values"]);
}

#[test]
fn a_list_that_is_too_long_is_refused() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = std::fs::read_to_string("rigs/virtual.toml").expect("it is there");
    for (from, to, words) in [
        ("x = [0.0, 300.0]", "x = [0.0, 300.0, 900.0]", "invalid length 3"),
        ("[150.0, 150.0, -20.0]", "[150.0, 150.0, -20.0, 1.0]", "invalid length 4"),
        ("[150.0, 150.0, -20.0]", "[150.0, 150.0, -20e6]", "within 100 m"),
    ] {
        assert!(rig.contains(from), "{from}");
        let path = home.path().join("rig.toml");
        std::fs::write(&path, rig.replace(from, to)).expect("written");
        let (code, message) = fieldgap(&["rig", "where", path.to_str().expect("text")]);
        assert_eq!(code, Some(1), "{message}");
        assert_contains(&message, &[words]);
    }
}

#[test]
fn all_keys_that_a_rig_file_lacks_are_told_at_once() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = home.path().join("rig.toml");
    std::fs::write(&rig, "name = \"a\"\n[array]\nlayout = \"square\"\ncolumns = 6\n[motion]\n[receiver]\nsettle_ms = 5\n")
        .expect("the rig file is written");
    let message = scan_of(PLAN, &rig);
    assert_contains(
        &message,
        &[
            "rig.toml",
            "frequency_hz = 40000.0  # Hz",
            "rows = 6",
            "element_diameter_mm = 10.0  # mm",
            "spacing_mm = 0.5  # mm",
            "[medium]",
            "temperature_c = 20.0",
            "origin_mm = [250.0, 250.0, 40.0]  # mm",
            "a table of one of marlin, grbl, klipper, auto in [motion]",
            "[motion.marlin]  # one of marlin",
            "samples = 16",
            "[focus_array]",
        ],
    );
}

#[test]
fn a_simulation_needs_array_and_medium_alone() {
    let home = tempfile::tempdir().expect("a folder");
    let file = home.path().join("array.toml");
    let array = "[array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 4\nrows = 4\nelement_diameter_mm = 10.0\npitch_mm = 10.5\n";
    std::fs::write(&file, format!("{array}[medium]\nspeed_of_sound_m_s = 343.0\n"))
        .expect("written");
    let path = file.to_str().expect("text");
    let (code, said) = fieldgap(&["simulate", "--rig", path, "--size-mm", "20"]);
    assert_eq!(code, Some(0), "{said}");
    assert_contains(
        &said,
        &["taken by default: focus 0,0,100 mm", "one plane at z = 100 mm", "simulator corrected"],
    );
    let (code, said) =
        fieldgap(&["simulate", "--rig", path, "--size-mm", "20", "--focus-mm", "0,0,-5"]);
    assert_eq!(code, Some(1));
    assert_contains(&said, &["the focus is not above the array"]);
    std::fs::write(&file, format!("{array}[medium]\nspeed_of_sound_m_s = 343000.0\n"))
        .expect("written");
    let (code, said) = fieldgap(&["simulate", "--rig", path]);
    assert_eq!(code, Some(1));
    assert_contains(&said, &["written in mm/s? Then give 343"]);
}
