//! Rigs with real and virtual devices. The real ones are those of a virtual rig in another process, behind ports.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};

use fieldgap::records::RecordedScan;

use crate::repository::{fieldgap, virtual_rig};

const PLAN: &str = r#"
name = "mixed"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[dark]
before = 1
after = 1
[[plane]]
z_mm = 100.0
size_mm = [24.0, 16.0]
step_mm = 4.0
"#;

/// Tables of a rig file whose devices may be real, and the line of `fieldgap virtual` with their port.
const ROBOT: (&str, usize) = ("[motion.marlin]", 0);
const RECEIVER: (&str, usize) = ("[receiver.stream]", 1);
const ARRAY: (&str, usize) = ("[focus_array.thesis]", 2);

/// Devices outside: another process with ports, killed on drop.
struct Outside {
    process: Child,
    ports: Vec<String>,
}

impl Outside {
    /// Their time passes 20 times as fast, so that moves take other times than the rig file lets expect.
    fn open(home: &Path) -> Self {
        let path = home.join("outside.toml");
        std::fs::write(&path, virtual_rig("{ times = 20.0 }")).expect("written");
        let mut process = fieldgap().arg("virtual").arg(path).spawn().expect("it starts");
        let lines = BufReader::new(process.stdout.as_mut().expect("it is piped")).lines();
        let port = |line: std::io::Result<String>| {
            line.expect("text").split_whitespace().last().expect("a port").to_owned()
        };
        let ports = lines.take(3).map(port).collect();
        Self { process, ports }
    }

    /// The rig file with the ports of some of these devices; the others are virtual.
    fn beside(&self, home: &Path, pace: &str, real: &[(&str, usize)]) -> PathBuf {
        let path = home.join("mixed.toml");
        let with_port = |text: String, (table, line): &(&str, usize)| {
            text.replace(table, &format!("{table}\nport = \"{}\"", self.ports[*line]))
        };
        std::fs::write(&path, real.iter().fold(virtual_rig(pace), with_port)).expect("written");
        path
    }
}

impl Drop for Outside {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn scan(home: &Path, rig: &Path, name: &str) -> Command {
    let plan = home.join("plan.toml");
    std::fs::write(&plan, PLAN).expect("written");
    let mut command = fieldgap();
    command.arg("scan").arg(&plan).arg("--rig").arg(rig).arg("--out").arg(home.join(name));
    command
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn recorded(home: &Path, name: &str, output: &Output) -> RecordedScan {
    assert!(output.status.success(), "{}", said(output));
    RecordedScan::open(&home.join(name)).expect("the record is whole")
}

#[test]
fn a_virtual_receiver_on_a_real_robot_reads_the_field_of_the_virtual_rig() {
    let home = tempfile::tempdir().expect("a folder");
    let outside = Outside::open(home.path());
    let rig = outside.beside(home.path(), "{ times = 1.0 }", &[ROBOT]);
    let refused = scan(home.path(), &rig, "mixed").output().expect("it runs");
    assert!(said(&refused).contains("nothing was done"), "a real robot moves: {}", said(&refused));
    let mixed = scan(home.path(), &rig, "mixed").arg("--yes").output().expect("it runs");
    let mixed = recorded(home.path(), "mixed", &mixed);
    let whole = home.path().join("whole.toml");
    std::fs::write(&whole, virtual_rig("\"lockstep\"")).expect("written");
    let virtual_only = scan(home.path(), &whole, "whole").output().expect("it runs");
    let virtual_only = recorded(home.path(), "whole", &virtual_only);
    assert_eq!(mixed.samples.len(), 2 + 7 * 5);
    let mut chi_squared = 0.0;
    for (mixed, other) in mixed.samples.iter().zip(&virtual_only.samples) {
        assert_eq!(mixed.focus, other.focus);
        assert!((mixed.position_m() - other.position_m()).norm() < 0.05e-3);
        let variance = |sample: &fieldgap::records::RecordedSample| {
            let spread = sample.spread.expect("it has one");
            spread.std.powi(2) / f64::from(spread.count)
        };
        // And the step of a converter of 14 bits over 5 V.
        let variance = variance(mixed) + variance(other) + (5.0_f64 / 16384.0).powi(2) / 6.0;
        chi_squared += (mixed.reading - other.reading).powi(2) / variance;
    }
    let strongest =
        |scan: &RecordedScan| scan.samples.iter().map(|sample| sample.reading).fold(0.0, f64::max);
    assert!(strongest(&mixed) > 20.0 * mixed.samples[0].reading, "there is a field");
    // 37 differences, each of unit variance: mean 37, standard deviation 8.6.
    assert!(chi_squared < 37.0 + 5.0 * 8.6, "{chi_squared}");
}

#[test]
fn a_real_receiver_is_read_beside_a_virtual_robot_and_array() {
    let home = tempfile::tempdir().expect("a folder");
    let outside = Outside::open(home.path());
    let rig = outside.beside(home.path(), "{ times = 1.0 }", &[RECEIVER]);
    // Nothing real moves or emits: nobody is asked.
    let output = scan(home.path(), &rig, "mixed").output().expect("it runs");
    let mixed = recorded(home.path(), "mixed", &output);
    // The receiver outside stands before a silent array.
    let silent = mixed.samples.iter().all(|sample| sample.reading < 0.1);
    assert!(silent && mixed.samples.len() == 37, "{:?}", mixed.samples);
}

#[test]
fn what_cannot_be_mixed_is_refused() {
    let home = tempfile::tempdir().expect("a folder");
    let outside = Outside::open(home.path());
    for (pace, real, words) in [
        ("\"lockstep\"", ROBOT, "pace = { times = 1.0 }"),
        ("{ times = 20.0 }", RECEIVER, "pace = { times = 1.0 }"),
        (
            "{ times = 1.0 }",
            ARRAY,
            "a virtual receiver measures the field of the virtual array alone",
        ),
    ] {
        let rig = outside.beside(home.path(), pace, &[real]);
        let output = scan(home.path(), &rig, "mixed").arg("--yes").output().expect("it runs");
        assert_eq!(output.status.code(), Some(1), "{words}");
        assert!(said(&output).contains(words), "{}", said(&output));
        assert!(!home.path().join("mixed").exists(), "{words}");
    }
}

#[test]
fn the_watchdog_stops_the_real_robot_of_a_mixed_rig() {
    let home = tempfile::tempdir().expect("a folder");
    let outside = Outside::open(home.path());
    let rig = outside.beside(home.path(), "{ times = 1.0 }", &[ROBOT]);
    let mut scan =
        scan(home.path(), &rig, "mixed").args(["--yes", "--json"]).spawn().expect("it starts");
    let lines = BufReader::new(scan.stdout.take().expect("it is piped")).lines();
    let measured =
        lines.filter(|line| line.as_ref().is_ok_and(|line| line.contains("\"measured\"")));
    assert_eq!(measured.take(3).count(), 3);
    scan.kill().expect("it can be killed");
    scan.wait().expect("it ends");
    let log = home.path().join("mixed/watchdog.log");
    let begun = Instant::now();
    while std::fs::metadata(&log).map_or(0, |log| log.len()) == 0 {
        assert!(begun.elapsed() < Duration::from_secs(10), "no watchdog acted");
        std::thread::sleep(Duration::from_millis(5));
    }
    let log = std::fs::read_to_string(log).expect("text");
    assert!(log.contains("robot on") && !log.contains("focus array"), "{log}");
}
