//! Manual operation of a rig by the program: on its own virtual rig, and on one in another process.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::repository::here;

/// The command, with the permission that it needs to move or emit.
fn fieldgap(arguments: &[&str], rig: &Path) -> Command {
    let mut command = unpermitted(arguments, rig);
    if ["home", "go", "find-axis", "focus"].contains(&arguments[0])
        || arguments.contains(&"--focus-mm")
    {
        command.arg("--yes");
    }
    command
}

fn unpermitted(arguments: &[&str], rig: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
    command.arg("rig").arg(arguments[0]).arg(rig).args(&arguments[1..]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn run(arguments: &[&str], rig: &Path) -> Output {
    fieldgap(arguments, rig).output().expect("the program runs")
}

fn said(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    text(&output.stdout) + &text(&output.stderr)
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", said(output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// `rigs/virtual.toml` with additional effects in its truth file.
fn rig_with_truth(home: &Path, effects: &str) -> PathBuf {
    let truth = std::fs::read_to_string(here("rigs/truth/thesis-lab.toml")).expect("it is there");
    std::fs::write(home.join("truth.toml"), truth + effects).expect("it is written");
    let rig = std::fs::read_to_string(here("rigs/virtual.toml")).expect("it is there");
    let path = home.join("rig.toml");
    std::fs::write(&path, rig.replace("truth/thesis-lab.toml", "truth.toml")).expect("written");
    path
}

/// A virtual rig kept open by another process, and a rig file with its ports only.
fn external_rig(home: &Path) -> (Child, PathBuf) {
    let mut rig = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .arg("virtual")
        .arg(here("rigs/virtual.toml"))
        .arg("--json")
        .stdout(Stdio::piped())
        .spawn()
        .expect("the virtual rig starts");
    let lines = BufReader::new(rig.stdout.as_mut().expect("it is piped")).lines();
    let mut text = String::new();
    for line in lines {
        let line = line.expect("text");
        text += &line;
        if line == "}" {
            break;
        }
    }
    let ports: Value = serde_json::from_str(&text).expect("JSON");
    let file = std::fs::read_to_string(here("rigs/virtual.toml")).expect("it is there");
    let (file, _) = file.split_once("[virtual]").expect("it has a virtual part");
    let mut file = file.to_owned();
    for (table, port) in [
        ("[motion.marlin]", "motion"),
        ("[receiver.stream]", "receiver"),
        ("[focus_array.thesis]", "focus_array"),
    ] {
        file = file.replace(table, &format!("{table}\nport = {}", ports[port]));
    }
    let path = home.join("rig.toml");
    std::fs::write(&path, file).expect("the rig file is written");
    (rig, path)
}

fn end(mut child: Child) {
    child.kill().expect("it can be ended");
    child.wait().expect("it ends");
}

#[test]
fn the_beam_axis_is_found_and_the_new_origin_is_correct() {
    let home = tempfile::tempdir().expect("a folder");
    // The receiver is offset by 2 mm, and the array is tilted by 20 and 10 mrad.
    let rig = rig_with_truth(
        home.path(),
        "[effects.offset]\nx_mm = 2.0\ny_mm = -7.0\nz_mm = 0.0\n\
         [effects.array-tilt]\nabout_x_rad = 0.02\nabout_y_rad = 0.01\n",
    );
    let axis = json(&run(&["find-axis", "--json", "--heights-mm", "80,120,160,200"], &rig));
    let figure = |value: &Value| {
        let number = |key: &str| value[key].as_f64().expect("a number");
        (number("value"), number("error"))
    };
    for (found, truth, good) in [
        (&axis["x_m"], -2e-3, 0.2e-3),
        (&axis["y_m"], 7e-3, 0.2e-3),
        // A right-handed rotation about x tilts the normal towards -y, one about y towards x.
        (&axis["slope"]["x"], 0.01f64.tan(), 2e-3),
        (&axis["slope"]["y"], -(0.02f64.tan()), 2e-3),
    ] {
        let (value, error) = figure(found);
        assert!((value - truth).abs() < 4.0 * error, "{value} ± {error}, true is {truth}");
        assert!(error < good, "{error}");
    }
    assert_eq!(axis["change"], true);
    let origin = |number: usize| axis["new_origin_mm"][number].as_f64().expect("a number");
    assert!((origin(0) - 148.0).abs() < 0.5 && (origin(1) - 157.0).abs() < 0.5, "{axis}");
    assert_eq!(origin(2), -20.0);
}

#[test]
fn an_unreachable_or_missing_beam_is_reported() {
    let home = tempfile::tempdir().expect("a folder");
    let high = run(&["find-axis", "--heights-mm", "290"], &here("rigs/virtual.toml"));
    assert_eq!(high.status.code(), Some(1));
    assert!(said(&high).contains("does not fit into the robot's travel"), "{}", said(&high));
    let dead = std::fs::read_to_string(here("rigs/truth/thesis-lab.toml")).expect("it is there");
    let dead = dead.replace("pressure_pa_at_1_m = 4.0", "pressure_pa_at_1_m = 1e-9");
    let rig = rig_with_truth(home.path(), "");
    std::fs::write(home.path().join("truth.toml"), dead).expect("it is written");
    let dead = run(&["find-axis"], &rig);
    assert_eq!(dead.status.code(), Some(1));
    assert!(said(&dead).contains("no beam was found"), "{}", said(&dead));
    assert!(said(&dead).contains("the array is silent, the robot stands still"), "{}", said(&dead));
}

#[test]
fn the_robot_goes_to_targets_within_its_limits_only() {
    let rig = here("rigs/virtual.toml");
    let at = json(&run(&["go", "--to-mm", "-5,10,100", "--json"], &rig));
    assert_eq!(at["robot_mm"], serde_json::json!([145.0, 160.0, 80.0]));
    let at = json(&run(&["go", "--to-mm", "20,30,40", "--robot-axes", "--json"], &rig));
    assert_eq!(at["robot_mm"], serde_json::json!([20.0, 30.0, 40.0]));
    let refused = run(&["go", "--to-mm", "0,0,500"], &rig);
    assert_eq!(refused.status.code(), Some(1));
    assert!(said(&refused).contains("z goes from 0.00 to 250.00 mm"), "{}", said(&refused));
    let at = json(&run(&["home", "--json"], &rig));
    assert_eq!(at["homed"], true);
    let unsure = run(&["where"], &rig);
    assert!(unsure.status.success() && said(&unsure).contains("made homing necessary"));
}

#[test]
fn levels_are_printed_and_rise_with_the_focus() {
    let home = tempfile::tempdir().expect("a folder");
    let (virtual_rig, rig) = external_rig(home.path());
    let level = |arguments: &[&str]| {
        let sampled = run(arguments, &rig);
        assert!(sampled.status.success(), "{}", said(&sampled));
        let text = String::from_utf8_lossy(&sampled.stdout).into_owned();
        let line: Value = serde_json::from_str(text.lines().last().expect("a line")).expect("JSON");
        line["reading"]["mean"].as_f64().expect("a number")
    };
    let gone = run(&["go", "--to-mm", "0,0,100", "--feed-mm-s", "300"], &rig);
    assert!(gone.status.success(), "{}", said(&gone));
    let silent = level(&["sample", "--count", "2", "--json"]);
    let loud = level(&["sample", "--count", "2", "--json", "--focus-mm", "0,0,100"]);
    assert!(loud > 20.0 * silent, "{loud} and {silent}");
    let silent_again = level(&["sample", "--count", "1", "--json"]);
    assert!(loud > 20.0 * silent_again, "the array still emits");
    end(virtual_rig);
}

#[test]
fn after_a_kill_a_focus_is_silenced() {
    let home = tempfile::tempdir().expect("a folder");
    let (virtual_rig, rig) = external_rig(home.path());
    let gone = run(&["go", "--to-mm", "0,0,100", "--feed-mm-s", "300"], &rig);
    assert!(gone.status.success(), "{}", said(&gone));
    let level = || {
        let sampled = run(&["sample", "--count", "1", "--json"], &rig);
        assert!(sampled.status.success(), "{}", said(&sampled));
        let line: Value = serde_json::from_slice(&sampled.stdout).expect("a line of JSON");
        line["reading"]["mean"].as_f64().expect("a number")
    };
    let mut focus =
        fieldgap(&["focus", "--at-mm", "0,0,100", "--continuous"], &rig).spawn().expect("starts");
    let mut lines = BufReader::new(focus.stdout.take().expect("it is piped")).lines();
    assert!(lines.next().is_some_and(|line| line.is_ok()));
    let loud = level();
    assert!(loud > 0.5, "{loud}");
    focus.kill().expect("it can be killed");
    focus.wait().expect("it ends");
    let killed = Instant::now();
    while level() > loud / 20.0 {
        assert!(killed.elapsed() < Duration::from_secs(20), "the array still emits");
    }
    end(virtual_rig);
}

#[test]
fn a_focus_of_another_program_is_stopped_safely() {
    let home = tempfile::tempdir().expect("a folder");
    let (virtual_rig, rig) = external_rig(home.path());
    let mut focus =
        fieldgap(&["focus", "--at-mm", "0,0,100", "--continuous"], &rig).spawn().expect("starts");
    let mut lines = BufReader::new(focus.stdout.take().expect("it is piped")).lines();
    let begun = lines.next().expect("a line").expect("text");
    assert!(begun.contains("focus at (0, 0, 100) mm"), "{begun}");
    let busy = run(&["silence"], &rig);
    assert_eq!(busy.status.code(), Some(1));
    assert!(said(&busy).contains("another program is using the port"), "{}", said(&busy));
    let stopped = run(&["stop"], &rig);
    let words = said(&stopped);
    if words.contains("asking it to end") {
        assert!(stopped.status.success(), "{words}");
        assert!(words.contains("the array is silent") && words.contains("the robot stands still"));
    } else {
        // A system that does not report who uses a port: the user ends the program there.
        assert!(words.contains("THE ARRAY MAY STILL EMIT"), "{words}");
        let pid = Pid::from_raw(i32::try_from(focus.id()).expect("a number")).expect("not zero");
        kill_process(pid, Signal::INT).expect("it is there");
    }
    let ended = focus.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(0), "{}", said(&ended));
    assert!(said(&ended).contains("the array is silent"), "{}", said(&ended));
    end(virtual_rig);
}

#[test]
fn ctrl_c_ends_a_search_with_the_array_silent() {
    let home = tempfile::tempdir().expect("a folder");
    let (virtual_rig, rig) = external_rig(home.path());
    let mut search = fieldgap(&["find-axis"], &rig).spawn().expect("it starts");
    let mut lines = BufReader::new(search.stderr.take().expect("it is piped")).lines();
    let homed = lines.by_ref().find(|line| line.as_ref().is_ok_and(|line| line.contains("homed;")));
    assert!(homed.is_some());
    let pid = Pid::from_raw(i32::try_from(search.id()).expect("a number")).expect("not zero");
    kill_process(pid, Signal::INT).expect("it is there");
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(search.wait().expect("it ends").code(), Some(1));
    let last = rest.last().expect("a final line");
    assert!(last.contains("keyboard: the array is silent, the robot stands still"), "{last}");
    end(virtual_rig);
}

#[test]
fn without_a_terminal_nothing_moves_or_emits_unless_it_is_permitted() {
    let home = tempfile::tempdir().expect("a folder");
    let (virtual_rig, rig) = external_rig(home.path());
    let parked = json(&run(&["where", "--json"], &rig));
    for arguments in [
        &["home"][..],
        &["go", "--to-mm", "0,0,100"],
        &["find-axis"],
        &["focus", "--at-mm", "0,0,100", "--seconds", "0.1"],
        &["sample", "--count", "1", "--focus-mm", "0,0,100"],
    ] {
        let refused = unpermitted(arguments, &rig).output().expect("the program runs");
        assert_eq!(refused.status.code(), Some(1), "{arguments:?}: {}", said(&refused));
        let words = said(&refused);
        assert!(words.contains("nothing was done") && words.contains("--yes"), "{words}");
    }
    assert_eq!(json(&run(&["where", "--json"], &rig)), parked);
    end(virtual_rig);
}

#[test]
fn keys_need_a_terminal() {
    let refused = run(&["jog"], &here("rigs/virtual.toml"));
    assert_eq!(refused.status.code(), Some(1));
    assert!(said(&refused).contains("keys from a terminal"), "{}", said(&refused));
}
