//! `init`, and `virtual --write-rig`: their files are accepted by the commands that they are for.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn fieldgap(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn succeeds(arguments: &[&str], folder: &Path) -> String {
    let done = fieldgap(arguments, folder);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{arguments:?}: {said}");
    said + &String::from_utf8_lossy(&done.stdout)
}

#[test]
fn a_virtual_rig_from_defaults_is_scanned_and_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let said = succeeds(&["init", "bench", "--yes"], folder.path());
    assert!(said.contains("fieldgap run bench/first-scan.toml"), "{said}");
    succeeds(&["rig", "check", "bench/my-rig.toml"], folder.path());
    let said = succeeds(&["run", "bench/first-scan.toml", "--out", "record"], folder.path());
    assert!(said.contains("Scan and simulation agree"), "{said}");
}

#[test]
fn every_combination_of_devices_passes_a_dry_run() {
    let folder = tempfile::tempdir().expect("a folder");
    for robot in ["virtual", "marlin", "grbl", "klipper", "auto"] {
        for receiver in ["virtual", "stream", "free-running", "scpi"] {
            for driver in ["virtual", "thesis", "sonic-surface", "ultraino"] {
                // A virtual receiver measures the field of a virtual array alone.
                if receiver == "virtual" && driver != "virtual" {
                    continue;
                }
                let name = format!("{robot}-{receiver}-{driver}");
                let devices = ["--robot", robot, "--receiver", receiver, "--driver", driver];
                let init = [&["init", &name, "--yes"][..], &devices].concat();
                succeeds(&init, folder.path());
                let plan = format!("{name}/first-scan.toml");
                succeeds(&["scan", &plan, "--dry-run"], folder.path());
            }
        }
    }
}

#[test]
fn an_own_array_on_a_robot_with_negative_axes_passes_a_dry_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let init = [
        "init",
        ".",
        "--yes",
        "--name",
        "lab 3",
        "--array",
        "10,10",
        "--pitch-mm",
        "10",
        "--travel-mm",
        "-400,0,-300,0,-200,0",
        "--centre-mm",
        "-200,-150,-230",
        "--robot",
        "grbl",
        "--robot-port",
        "/dev/ttyACM0",
        "--receiver",
        "free-running",
        "--temperature-c",
        "-3.5",
    ];
    succeeds(&init, folder.path());
    let rig = std::fs::read_to_string(folder.path().join("lab-3.toml")).expect("a rig file");
    for line in ["columns = 10", "port = \"/dev/ttyACM0\"", "temperature_c = -3.5"] {
        assert!(rig.contains(line), "{line} in\n{rig}");
    }
    let said = succeeds(&["scan", "first-scan.toml", "--dry-run"], folder.path());
    assert!(said.contains("readings"), "{said}");
}

#[test]
fn files_are_not_overwritten_and_nothing_is_guessed_without_a_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |arguments: &[&str], reason: &str| {
        let done = fieldgap(arguments, folder.path());
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(!done.status.success() && said.contains(reason), "{arguments:?}: {said}");
    };
    refused(&["init", "bench"], "--yes");
    assert!(!folder.path().join("bench").exists());
    succeeds(&["init", "bench", "--yes"], folder.path());
    let rig = folder.path().join("bench/my-rig.toml");
    let before = std::fs::read(&rig).expect("a rig file");
    refused(&["init", "bench", "--yes", "--pitch-mm", "9"], "exists already");
    assert_eq!(std::fs::read(&rig).expect("a rig file"), before);
    let low =
        ["init", "other", "--yes", "--travel-mm", "0,100,0,100,0,25", "--centre-mm", "50,50,20"];
    refused(&low, "no room");
    refused(&["init", "other", "--yes", "--driver", "thesis"], "virtual receiver");
    refused(&["init", "other", "--yes", "--travel-mm", "0,100,0"], "6 numbers");
    refused(&["init", "other", "--yes", "--pitch-mm", "1e9"], "not");
    assert!(!folder.path().join("other").exists());
}

#[test]
fn the_ports_of_a_virtual_rig_are_driven_by_the_rig_file_that_it_writes() {
    let folder = tempfile::tempdir().expect("a folder");
    succeeds(&["init", "bench", "--yes"], folder.path());
    let serve = ["virtual", "bench/my-rig.toml", "--links", "ports", "--write-rig"];
    let mut rig = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .args(serve)
        .arg("bench/driving.toml")
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let lines = BufReader::new(rig.stdout.take().expect("piped")).lines();
    let told: Vec<String> = lines
        .map(|line| line.expect("text"))
        .take_while(|line| !line.starts_with("Ctrl-C"))
        .collect();
    assert!(told.iter().any(|line| line.ends_with("ports/robot")), "{told:?}");
    let driving = std::fs::read_to_string(folder.path().join("bench/driving.toml")).expect("text");
    assert!(driving.contains("ports/receiver") && !driving.contains("[virtual"), "{driving}");
    let said = succeeds(&["rig", "check", "bench/driving.toml"], folder.path());
    assert!(said.contains("ports/robot"), "{said}");
    let elsewhere = ["virtual", "bench/my-rig.toml", "--write-rig", "driving.toml"];
    assert!(!fieldgap(&elsewhere, folder.path()).status.success());
    let id = rustix::process::Pid::from_child(&rig);
    rustix::process::kill_process(id, rustix::process::Signal::INT).expect("it runs");
    assert!(rig.wait().expect("it ends").success());
    assert!(!folder.path().join("ports/robot").is_symlink());
}

#[test]
fn the_report_proposes_to_correct_the_rig_file_that_was_used() {
    let folder = tempfile::tempdir().expect("a folder");
    succeeds(&["init", "bench", "--yes"], folder.path());
    let truth = folder.path().join("bench/virtual-laboratory.toml");
    let text = std::fs::read_to_string(&truth).expect("text");
    std::fs::write(&truth, text + "\n[effects.sound-speed]\nc_m_s = 349.0\n").expect("written");
    succeeds(&["run", "bench/first-scan.toml", "--out", "warm"], folder.path());
    let page = std::fs::read_to_string(folder.path().join("warm/report/index.html")).expect("page");
    let command = "fieldgap diagnose warm --apply bench/my-rig.toml --out bench/corrected-rig.toml";
    assert!(page.contains(command) && page.contains("medium.speed_of_sound_m_s"));
    let arguments: Vec<&str> = command.split(' ').skip(1).collect();
    succeeds(&arguments, folder.path());
    let corrected = ["run", "bench/first-scan.toml", "--rig", "bench/corrected-rig.toml"];
    let said = succeeds(&[&corrected[..], &["--out", "corrected"]].concat(), folder.path());
    assert!(!said.contains("another speed of sound"), "{said}");
    // A rig file that was changed since is not taken for the one that was used.
    let rig = folder.path().join("bench/my-rig.toml");
    let changed = std::fs::read_to_string(&rig).expect("text").replace("= 20.0", "= 21.0");
    std::fs::write(&rig, changed).expect("written");
    assert!(fieldgap::acquisition::original_rig(&folder.path().join("warm")).is_none());
}
