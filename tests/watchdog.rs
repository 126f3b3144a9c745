//! A scan whose process is killed or suspended, on a rig in another process: the watchdog silences the array and stops the
//! robot within three seconds.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use fieldgap::records::RecordedScan;
use rustix::process::{Pid, Signal, kill_process};
use serialport::TTYPort;

/// Longest time until the array is silent.
const SAFE_WITHIN: Duration = Duration::from_secs(3);

/// Two points with a long and slow move between them, so that the robot moves when the process dies.
const PLAN: &str = r#"
name = "killed"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[[points]]
at_mm = [[0.0, 0.0, 100.0], [1.0, 0.0, 100.0], [140.0, 140.0, 220.0], [0.0, 1.0, 100.0]]
"#;

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn fieldgap() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    command
}

/// A virtual rig kept open by another process, which is killed on drop. It runs at six times real time.
struct Rig {
    process: Child,
    ports: Vec<String>,
}

impl Rig {
    fn open(home: &Path) -> Self {
        let text =
            std::fs::read_to_string(here("rigs/virtual.toml")).expect("the rig file is there");
        let truth = format!("truth = \"{}\"", here("rigs/truth/thesis-lab.toml").display());
        let text = text
            .replace("pace = \"lockstep\"", "pace = { times = 6.0 }")
            .replace("truth = \"truth/thesis-lab.toml\"", &truth);
        let path = home.join("virtual.toml");
        std::fs::write(&path, text).expect("the rig file is written");
        let mut process = fieldgap().arg("virtual").arg(path).spawn().expect("it starts");
        let lines = BufReader::new(process.stdout.as_mut().expect("it is piped")).lines();
        let port = |line: std::io::Result<String>| {
            line.expect("text").split_whitespace().last().expect("a port").to_owned()
        };
        let ports = lines.take(3).map(port).collect();
        Self { process, ports }
    }

    /// A rig file with its ports only, and a slow robot.
    fn file(&self, home: &Path) -> PathBuf {
        let text =
            std::fs::read_to_string(here("rigs/virtual.toml")).expect("the rig file is there");
        let (text, _) = text.split_once("[virtual]").expect("it has a virtual part");
        let port = |table: &str, n: usize| {
            (table.to_owned(), format!("{table}\nport = \"{}\"", self.ports[n]))
        };
        let tables = [
            port("[motion.marlin]", 0),
            port("[receiver.stream]", 1),
            port("[focus_array.thesis]", 2),
        ];
        let text = tables.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to));
        let path = home.join("rig.toml");
        std::fs::write(&path, text.replace("feed_mm_s = 80.0", "feed_mm_s = 10.0"))
            .expect("the rig file is written");
        path
    }

    /// The answer of a device to a line, up to a line that begins with `end`.
    fn ask(&self, port: usize, line: &str, end: &str) -> String {
        let builder = serialport::new(&self.ports[port], 115_200);
        let mut port = TTYPort::open(&builder.timeout(Duration::from_secs(5))).expect("it opens");
        port.write_all(line.as_bytes()).expect("it takes the line");
        let mut lines = BufReader::new(port).lines();
        let answer = lines.find(|line| line.as_ref().is_ok_and(|line| line.starts_with(end)));
        answer.expect("an answer").expect("text")
    }

    fn array_state(&self) -> String {
        let sealed = |body: &str| format!("{body}*{:08x}\n", crc32fast::hash(body.as_bytes()));
        self.ask(2, &sealed("77 state"), "77 ok")
    }

    /// Actual position of the robot along x, mm.
    fn robot_x_mm(&self) -> f64 {
        let said = self.ask(0, "M114 R\n", "X:");
        said[2..].split(' ').next().expect("a number").parse().expect("a number")
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Starts a scan and sends it the signal `harm` on the move to its third point; returns the log of the watchdog, the time
/// until it was written, and the scan's folder.
fn harmed(home: &Path, rig: &Rig, harm: Signal) -> (String, Duration, PathBuf) {
    let (plan, folder) = (home.join("plan.toml"), home.join("scan"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let mut scan = fieldgap()
        .arg("scan")
        .arg(&plan)
        .arg("--rig")
        .arg(rig.file(home))
        .arg("--out")
        .arg(&folder)
        .args(["--json", "--yes"])
        .spawn()
        .expect("the scan starts");
    let mut output = BufReader::new(scan.stdout.take().expect("it is piped"));
    let mut line = String::new();
    while !line.contains("\"row\":1,") {
        line.clear();
        assert!(output.read_line(&mut line).expect("text") > 0, "the scan ended early");
    }
    // During the move of 4 s to the third point.
    std::thread::sleep(Duration::from_millis(300));
    kill_process(Pid::from_child(&scan), harm).expect("the signal is sent");
    let harmed = Instant::now();
    let log = folder.join("watchdog.log");
    // The log is written at once, when all is done.
    while std::fs::metadata(&log).map_or(0, |log| log.len()) == 0 {
        assert!(harmed.elapsed() < Duration::from_secs(20), "no watchdog acted");
        std::thread::sleep(Duration::from_millis(5));
    }
    let took = harmed.elapsed();
    let mut rest = String::new();
    output.read_to_string(&mut rest).expect("the scan's process is gone");
    scan.wait().expect("it ends");
    (std::fs::read_to_string(&log).expect("text"), took, folder)
}

fn is_safe(rig: &Rig) {
    assert_eq!(rig.array_state().split('*').next(), Some("77 ok off"));
    let [first, second] = [(), ()].map(|()| rig.robot_x_mm());
    assert_eq!(first, second, "it stands still");
    assert!((151.0..285.0).contains(&first), "stopped on its way, at {first} mm");
}

#[test]
fn after_a_kill_the_rig_is_safe_within_three_seconds() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = Rig::open(home.path());
    let (log, took, folder) = harmed(home.path(), &rig, Signal::KILL);
    assert!(took < SAFE_WITHIN, "{took:?}");
    is_safe(&rig);
    for words in ["ended without closing the rig", "focus array on", "robot on", "it answered"] {
        assert!(log.contains(words), "no `{words}` in {log}");
    }
    assert!(!log.contains("NOT REACHED"), "{log}");
    assert_eq!(RecordedScan::open(&folder).expect("the record is whole").samples.len(), 2);
}

#[test]
fn a_suspended_scan_is_ended_and_the_rig_made_safe() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = Rig::open(home.path());
    let (log, took, _) = harmed(home.path(), &rig, Signal::STOP);
    assert!(took < SAFE_WITHIN + Duration::from_secs(1), "{took:?}");
    is_safe(&rig);
    assert!(
        log.contains("has not responded for 2 s") && log.contains("the program was ended"),
        "{log}"
    );
}

#[test]
fn a_scan_that_ends_normally_has_no_watchdog_log() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = Rig::open(home.path());
    let plan = home.path().join("plan.toml");
    std::fs::write(&plan, PLAN.replace("140.0, 140.0, 220.0", "5.0, 0.0, 100.0"))
        .expect("the plan is written");
    let folder = home.path().join("scan");
    let ended = fieldgap()
        .arg("scan")
        .arg(&plan)
        .arg("--rig")
        .arg(rig.file(home.path()))
        .arg("--out")
        .arg(&folder)
        .arg("--yes")
        .output()
        .expect("the scan runs");
    assert!(ended.status.success());
    assert!(!folder.join("watchdog.log").exists());
    assert_eq!(rig.array_state().split('*').next(), Some("77 ok off"));
}
