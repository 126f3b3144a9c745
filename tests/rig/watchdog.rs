//! A scan whose process is killed or suspended, on a rig in another process: the watchdog silences the array and stops the
//! robot within three seconds.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use fieldgap::records::RecordedScan;
use rustix::process::{Pid, Signal, kill_process};
use serialport::TTYPort;

use crate::repository::{here, virtual_rig};

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
        let path = home.join("virtual.toml");
        std::fs::write(&path, virtual_rig("{ times = 6.0 }")).expect("the rig file is written");
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

/// A scan in a process of its own.
struct Scan {
    process: Child,
    output: BufReader<ChildStdout>,
    folder: PathBuf,
}

impl Scan {
    /// Starts the scan of a plan.
    fn begin(home: &Path, rig_file: &Path, plan_text: &str) -> Self {
        let (plan, folder) = (home.join("plan.toml"), home.join("scan"));
        std::fs::write(&plan, plan_text).expect("the plan is written");
        let mut command = fieldgap();
        command.arg("scan").arg(&plan).arg("--rig").arg(rig_file).arg("--out").arg(&folder);
        Self::spawn(&mut command, folder)
    }

    fn spawn(command: &mut Command, folder: PathBuf) -> Self {
        let mut process =
            command.args(["--json", "--yes", "--trust"]).spawn().expect("the scan starts");
        let output = BufReader::new(process.stdout.take().expect("it is piped"));
        Self { process, output, folder }
    }

    /// Reads its events up to the first that contains `words`.
    fn until(&mut self, words: &str) -> String {
        let mut line = String::new();
        while !line.contains(words) {
            line.clear();
            let length = self.output.read_line(&mut line).expect("text");
            assert!(length > 0, "the scan ended without `{words}`");
        }
        line
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.process), signal).expect("the signal is sent");
    }

    /// The process of its watchdog.
    fn watchdog(&self) -> Pid {
        watchdog_of(self.process.id())
    }
}

/// The watchdog of a process.
fn watchdog_of(process: u32) -> Pid {
    let mut children = String::new();
    for thread in std::fs::read_dir(format!("/proc/{process}/task")).expect("it runs") {
        let path = thread.expect("a thread").path().join("children");
        children += &std::fs::read_to_string(path).unwrap_or_default();
    }
    let is_watchdog = |pid: &&str| {
        std::fs::read(format!("/proc/{pid}/cmdline"))
            .is_ok_and(|words| words.ends_with(b"\0watchdog\0"))
    };
    let found = children.split_whitespace().find(is_watchdog).expect("it has a watchdog");
    Pid::from_raw(found.parse().expect("a number")).expect("a process")
}

/// Waits until a file has contents, which are written at once; the text.
fn awaited(file: &Path, within: Duration) -> String {
    let begun = Instant::now();
    loop {
        match std::fs::read_to_string(file) {
            Ok(text) if !text.is_empty() => return text,
            _ => assert!(begun.elapsed() < within, "no {}", file.display()),
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Starts a scan and sends it the signal `harm` on the move to its third point; returns the log of the watchdog, the time
/// until it was written, and the scan's folder.
fn harmed(home: &Path, rig: &Rig, harm: Signal, plan: &str) -> (String, Duration, PathBuf) {
    let mut scan = Scan::begin(home, &rig.file(home), plan);
    scan.until("\"row\":1,");
    // During the move of 4 s to the third point.
    std::thread::sleep(Duration::from_millis(300));
    scan.signal(harm);
    let harmed = Instant::now();
    let log = awaited(&scan.folder.join("watchdog.log"), Duration::from_secs(20));
    let took = harmed.elapsed();
    let mut rest = String::new();
    scan.output.read_to_string(&mut rest).expect("the scan's process is gone");
    scan.process.wait().expect("it ends");
    (log, took, scan.folder)
}

/// A plan whose failure hook writes event, folder and message to a file.
fn with_hook(plan: &str, told: &Path) -> String {
    let script = r#"printf "%s|%s|%s" "$FIELDGAP_EVENT" "$FIELDGAP_SCAN" "$FIELDGAP_MESSAGE" > "$0.new"; mv "$0.new" "$0""#;
    let command = format!("[\"sh\", \"-c\", '''{script}''', \"{}\"]", told.display());
    format!("{plan}\n[hooks]\non_failure = {command}\n")
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
    let (log, took, folder) = harmed(home.path(), &rig, Signal::KILL, PLAN);
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
    let (log, took, _) = harmed(home.path(), &rig, Signal::STOP, PLAN);
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

#[test]
fn the_failure_hook_is_called_after_a_kill_and_after_a_lasting_stop() {
    for (harm, words) in
        [(Signal::KILL, "ended without closing the rig"), (Signal::STOP, "stopped")]
    {
        let home = tempfile::tempdir().expect("a folder");
        let rig = Rig::open(home.path());
        let told = home.path().join("told");
        let (_, _, folder) = harmed(home.path(), &rig, harm, &with_hook(PLAN, &told));
        let said = awaited(&told, Duration::from_secs(10));
        assert!(said.starts_with(&format!("failure|{}|", folder.display())), "{said}");
        assert!(said.contains(words) && said.contains("focus array on"), "{said}");
    }
}

#[test]
fn the_failure_hook_of_a_scan_on_a_virtual_rig_is_called_too() {
    let home = tempfile::tempdir().expect("a folder");
    let told = home.path().join("told");
    let many = vec!["[0.0, 1.0, 100.0], [1.0, 0.0, 100.0]"; 500].join(", ");
    let plan = with_hook(&PLAN.replace("[0.0, 1.0, 100.0]", &many), &told);
    let mut scan = Scan::begin(home.path(), &here("rigs/virtual.toml"), &plan);
    scan.until("\"row\":1,");
    scan.signal(Signal::KILL);
    scan.process.wait().expect("it ends");
    let said = awaited(&told, Duration::from_secs(10));
    assert!(said.starts_with("failure|") && said.contains("ended without closing"), "{said}");
}

#[test]
fn a_watchdog_that_dies_or_stops_is_started_again_and_the_scan_goes_on() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = Rig::open(home.path());
    for harm in [Signal::KILL, Signal::STOP] {
        let mut scan = Scan::begin(home.path(), &rig.file(home.path()), PLAN);
        scan.until("\"row\":1,");
        let first = scan.watchdog();
        kill_process(first, harm).expect("the signal is sent");
        scan.until("\"watchdog-lost\"");
        scan.until("\"watchdog-restarted\"");
        assert_ne!(scan.watchdog(), first);
        scan.until("\"ended\"");
        assert!(scan.process.wait().expect("it ends").success());
        let events = std::fs::read_to_string(scan.folder.join("events.jsonl")).expect("events");
        assert!(events.contains("\"watchdog\"") && events.contains("started again"), "{events}");
        assert_eq!(RecordedScan::open(&scan.folder).expect("whole").samples.len(), 4);
        assert!(!scan.folder.join("watchdog.log").exists());
        std::fs::remove_dir_all(&scan.folder).expect("removed");
    }
}

#[test]
fn a_watchdog_that_was_started_again_makes_the_rig_safe() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = Rig::open(home.path());
    let mut scan = Scan::begin(home.path(), &rig.file(home.path()), PLAN);
    scan.until("\"homed\"");
    kill_process(scan.watchdog(), Signal::KILL).expect("the signal is sent");
    scan.until("\"watchdog-restarted\"");
    scan.until("\"row\":1,");
    // During the move of 4 s to the third point.
    std::thread::sleep(Duration::from_millis(300));
    scan.signal(Signal::KILL);
    scan.process.wait().expect("it ends");
    awaited(&scan.folder.join("watchdog.log"), SAFE_WITHIN);
    is_safe(&rig);
}

#[test]
fn a_resume_right_after_a_kill_waits_for_the_watchdog_to_let_go() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = Rig::open(home.path());
    let mut scan = Scan::begin(home.path(), &rig.file(home.path()), PLAN);
    scan.until("\"row\":1,");
    let watchdog = scan.watchdog();
    // It holds the ports until it is continued below.
    kill_process(watchdog, Signal::STOP).expect("the signal is sent");
    scan.signal(Signal::KILL);
    scan.process.wait().expect("it ends");
    let errors = home.path().join("errors");
    let mut command = fieldgap();
    command.arg("resume").arg(&scan.folder);
    command.stderr(std::fs::File::create(&errors).expect("created"));
    let mut resumed = Scan::spawn(&mut command, scan.folder);
    let said = || std::fs::read_to_string(&errors).expect("text");
    let begun = Instant::now();
    while !said().contains("waiting for it") {
        assert!(begun.elapsed() < Duration::from_secs(20), "it does not wait: {}", said());
        std::thread::sleep(Duration::from_millis(5));
    }
    kill_process(watchdog, Signal::CONT).expect("the signal is sent");
    let mut events = String::new();
    resumed.output.read_to_string(&mut events).expect("text");
    let ended = resumed.process.wait().expect("it ends");
    assert!(ended.success() && events.contains("\"ended\""), "{}", said());
    assert_eq!(RecordedScan::open(&resumed.folder).expect("whole").samples.len(), 4);
}

#[test]
fn after_a_kill_of_the_server_the_rig_under_hand_is_safe() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = Rig::open(home.path());
    let text = std::fs::read_to_string(rig.file(home.path())).expect("a rig file");
    let mut served = crate::served::Served::with(&text, PLAN);
    let desk = served.log_in();
    desk.post("/api/controls/take", "");
    desk.post("/api/hand/open", "");
    let order = |body: &str| desk.post("/api/hand/order", body);
    order("{\"order\":\"home\"}");
    order("{\"order\":\"go\",\"to_mm\":[1.0,0.0,100.0]}");
    order("{\"order\":\"focus\",\"at_mm\":[0.0,0.0,100.0],\"seconds\":600,\"continuous\":true}");
    let watchdog = format!("/proc/{}", watchdog_of(served.process()).as_raw_nonzero());
    let going = {
        let desk = desk.clone();
        std::thread::spawn(move || {
            desk.ask("POST", "/api/hand/order", "{\"order\":\"go\",\"to_mm\":[140.0,140.0,220.0]}")
        })
    };
    desk.until("moving", |state| state["hand"]["doing"] == "moves");
    // During the move of 4 s.
    std::thread::sleep(Duration::from_millis(300));
    served.kill();
    let killed = Instant::now();
    while Path::new(&watchdog).exists() {
        assert!(killed.elapsed() < SAFE_WITHIN, "the watchdog is not done");
        std::thread::sleep(Duration::from_millis(5));
    }
    is_safe(&rig);
    assert!(going.join().is_err(), "the server answered after it was killed");
}
