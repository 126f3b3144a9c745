//! Scans whose devices or disk fail, on rigs in other processes: they end partial and safely, and can be finished. The same seed
//! and the same record give the same bytes.

use std::io::{BufRead, BufReader, Lines};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};

use fieldgap::acquisition::{Ending, Event, PlannedScan, ScanRun};
use fieldgap::records::RecordedScan;
use fieldgap::rig_file::simulated_devices;
use rustix::process::{Pid, Resource, Rlimit, Signal, kill_process, prlimit};

use crate::repository::{fieldgap, here};

const PLAN: &str = r#"
name = "fails"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[[plane]]
z_mm = 100.0
size_mm = [40.0, 40.0]
step_mm = 2.0
"#;

/// A virtual rig kept open by another process, and a rig file with its ports only.
fn external_rig(home: &Path) -> (Child, PathBuf) {
    let mut rig = fieldgap()
        .arg("virtual")
        .arg(here("rigs/virtual.toml"))
        .spawn()
        .expect("the virtual rig starts");
    let lines = BufReader::new(rig.stdout.as_mut().expect("it is piped")).lines();
    let ports: Vec<String> = lines
        .take(3)
        .map(|line| line.expect("text").split_whitespace().last().expect("a port").to_owned())
        .collect();
    let text = std::fs::read_to_string(here("rigs/virtual.toml")).expect("the rig file is there");
    let (text, _) = text.split_once("[virtual]").expect("it has a virtual part");
    let text = text
        .replace("[motion.marlin]", &format!("[motion.marlin]\nport = \"{}\"", ports[0]))
        .replace("[receiver.stream]", &format!("[receiver.stream]\nport = \"{}\"", ports[1]))
        .replace("[focus_array.thesis]", &format!("[focus_array.thesis]\nport = \"{}\"", ports[2]));
    let path = home.join("rig.toml");
    std::fs::write(&path, text).expect("the rig file is written");
    (rig, path)
}

fn state(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("state.toml")).expect("the state is kept")
}

#[test]
fn a_scan_with_lost_devices_ends_partial() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let (mut rig, rig_file) = external_rig(home.path());
    let mut scan = fieldgap()
        .arg("scan")
        .arg(&plan)
        .arg("--rig")
        .arg(&rig_file)
        .arg("--out")
        .arg(&folder)
        .args(["--json", "--yes"])
        .spawn()
        .expect("the scan starts");
    let mut lines = BufReader::new(scan.stdout.take().expect("it is piped")).lines();
    let measured = |line: &std::io::Result<String>| {
        line.as_ref().is_ok_and(|line| line.contains("\"measured\""))
    };
    assert_eq!(lines.by_ref().filter(measured).take(5).count(), 5);
    rig.kill().expect("the rig can be unplugged");
    rig.wait().expect("it ends");
    let acknowledged = 5 + lines.filter(measured).count();
    assert_eq!(scan.wait().expect("it ends").code(), Some(3));
    let state = state(&folder);
    for words in ["partial", "disconnected", "/dev/pts/", "THE ARRAY MAY STILL EMIT"] {
        assert!(state.contains(words), "no `{words}` in {state}");
    }
    let kept = RecordedScan::open(&folder).expect("the record is whole").samples.len();
    assert_eq!(kept, acknowledged);
    // Without permission nothing is opened, and the record stays as it is.
    let before = files(&folder);
    let refused = fieldgap().arg("resume").arg(&folder).output().expect("the program runs");
    assert_eq!(refused.status.code(), Some(1));
    let words = String::from_utf8_lossy(&refused.stderr);
    assert!(words.contains("nothing was done") && words.contains("--yes"), "{words}");
    assert_eq!(files(&folder), before);
}

#[test]
fn a_scan_on_a_real_rig_needs_permission() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let (mut rig, rig_file) = external_rig(home.path());
    let mut scan = fieldgap();
    scan.arg("scan").arg(&plan).arg("--rig").arg(&rig_file).arg("--out").arg(&folder);
    let refused = scan.output().expect("the program runs");
    assert_eq!(refused.status.code(), Some(1));
    let words = String::from_utf8_lossy(&refused.stderr);
    assert!(words.contains("nothing was done") && words.contains("--yes"), "{words}");
    assert!(!folder.exists(), "no record is begun");
    rig.kill().expect("it can be ended");
    rig.wait().expect("it ends");
}

/// A scan with a file-size limit of 16 KiB (32 blocks of 512 bytes) that has measured some rows and reports that it waits.
fn waiting_for_room(home: &Path) -> (Child, Lines<BufReader<ChildStdout>>, PathBuf) {
    let (plan, folder) = (home.join("plan.toml"), home.join("scan"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let limited = "ulimit -S -f 32; trap '' XFSZ; exec \"$0\" \"$@\"";
    let mut scan = Command::new("sh")
        .args(["-c", limited, env!("CARGO_BIN_EXE_fieldgap"), "scan", "--json"])
        .arg(&plan)
        .arg("--rig")
        .arg(here("rigs/virtual.toml"))
        .arg("--out")
        .arg(&folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the scan runs");
    let mut lines = BufReader::new(scan.stdout.take().expect("it is piped")).lines();
    let waits = |line: &std::io::Result<String>| {
        line.as_ref()
            .is_ok_and(|line| line.contains("\"waiting\"") && line.contains("Free some space"))
    };
    assert!(lines.any(|line| waits(&line)), "it ended without waiting");
    (scan, lines, folder)
}

#[test]
fn a_scan_with_a_full_disk_waits_and_continues() {
    let home = tempfile::tempdir().expect("a folder");
    let (mut scan, lines, folder) = waiting_for_room(home.path());
    let kept = RecordedScan::open(&folder).expect("the record is whole").samples.len();
    assert!((50..441).contains(&kept), "{kept}");
    let unlimited = Rlimit { current: None, maximum: None };
    prlimit(Some(Pid::from_child(&scan)), Resource::Fsize, unlimited).expect("room is made");
    let told: Vec<String> = lines.map(|line| line.expect("text")).collect();
    assert!(scan.wait().expect("it ends").success());
    assert!(told[0].contains("went-on"), "{}", told[0]);
    let rows = told.iter().filter(|line| line.contains("\"measured\"")).count();
    let record = RecordedScan::open(&folder).expect("the record is whole");
    assert_eq!((record.samples.len(), rows), (441, 441 - kept));
    let events = std::fs::read_to_string(folder.join("events.jsonl")).expect("events");
    assert!(events.contains("no room on the disk"), "{events}");
}

#[test]
fn a_waiting_scan_can_be_ended_safely_and_finished_later() {
    let home = tempfile::tempdir().expect("a folder");
    let (mut scan, lines, folder) = waiting_for_room(home.path());
    kill_process(Pid::from_child(&scan), Signal::TERM).expect("the signal is sent");
    drop(lines);
    assert_eq!(scan.wait().expect("it ends").code(), Some(3));
    let state = state(&folder);
    for words in ["partial", "asked to terminate", "the array is silent, the robot stands still"] {
        assert!(state.contains(words), "no `{words}` in {state}");
    }
    let resumed = fieldgap().arg("resume").arg(&folder).output().expect("the program runs");
    assert!(resumed.status.success(), "{}", String::from_utf8_lossy(&resumed.stderr));
    assert_eq!(RecordedScan::open(&folder).expect("whole").samples.len(), 441);
}

#[test]
fn a_changed_rig_is_detected_on_resuming() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    let (rig, truth) = (home.path().join("rig.toml"), home.path().join("truth.toml"));
    std::fs::write(&plan, PLAN).expect("written");
    let rig_then = std::fs::read_to_string(here("rigs/virtual.toml"))
        .expect("the rig file is there")
        .replace("truth/thesis-lab.toml", "truth.toml");
    std::fs::write(&rig, &rig_then).expect("written");
    std::fs::write(&truth, "[noise]\nadditive_v = 0.001\n").expect("written");
    let mut scan = fieldgap()
        .args(["scan", "--json"])
        .arg(&plan)
        .arg("--rig")
        .arg(&rig)
        .arg("--out")
        .arg(&folder)
        .spawn()
        .expect("the scan starts");
    let lines = BufReader::new(scan.stdout.take().expect("it is piped")).lines();
    assert_eq!(lines.take(40).count(), 40);
    scan.kill().expect("it can be killed");
    scan.wait().expect("it ends");

    let resume = || {
        let ended = fieldgap().arg("resume").arg(&folder).output().expect("the program runs");
        (ended.status.code(), String::from_utf8_lossy(&ended.stderr).into_owned())
    };
    std::fs::write(&truth, "[noise]\nadditive_v = 0.002\n").expect("written");
    let (code, said) = resume();
    assert!(code == Some(1) && said.contains("has changed since the scan started"), "{said}");
    std::fs::write(&truth, "[noise]\nadditive_v = 0.001\n").expect("written");
    std::fs::write(&rig, rig_then.replace("feed_mm_s = 80.0", "feed_mm_s = 60.0"))
        .expect("written");
    let (code, said) = resume();
    assert!(code == Some(1) && said.contains("`motion.feed_mm_s` was 80.0 and is 60.0"), "{said}");
    std::fs::write(&rig, rig_then).expect("written");
    assert_eq!(resume().0, Some(0));
}

#[tokio::test]
async fn a_scan_with_a_panic_ends_safely_and_can_be_finished() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let campaign =
        PlannedScan::read(&plan, Some(&here("rigs/virtual.toml"))).expect("a plan and a rig");
    let session = ScanRun::begin(campaign, &folder, simulated_devices).await.expect("it begins");
    let mut panics = |event: &Event| {
        assert!(!matches!(event, Event::Measured { row: 7, .. }), "a defect of the display");
    };
    let ended = session.run(&mut panics, std::future::pending()).await.expect("it ends");
    let Ending::Partial { reason } = ended else { panic!("it is not complete") };
    for words in [
        "the program itself failed: a defect of the display",
        "the array is silent, the robot stands still",
    ] {
        assert!(reason.contains(words), "no `{words}` in {reason}");
    }
    assert_eq!(RecordedScan::open(&folder).expect("whole").samples.len(), 8);
    let resumed = ScanRun::resume(&folder, simulated_devices).await.expect("it can be taken up");
    let ended = resumed.run(&mut |_| (), std::future::pending()).await.expect("it ends");
    assert_eq!(ended, Ending::Complete);
}

/// Every file of a folder, by name.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.is_file())
        .map(|path| {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, std::fs::read(&path).expect("readable"))
        })
        .collect();
    files.sort();
    files
}

#[test]
fn records_and_reports_are_reproducible() {
    let home = tempfile::tempdir().expect("a folder");
    let scan = |name: &str| {
        let folder = home.path().join(name);
        let plan = here("scans/quick-look.toml");
        let ended = fieldgap().arg("scan").arg(plan).arg("--out").arg(&folder).output();
        assert!(ended.expect("the program runs").status.success());
        folder
    };
    let (first, second) = (scan("first"), scan("second"));
    for file in ["scan.toml", "samples.csv"] {
        let [one, other] = [&first, &second].map(|folder| std::fs::read(folder.join(file)).ok());
        assert!(one.is_some() && one == other, "{file} differs");
    }
    let report = |name: &str, threads: &str| {
        let out = home.path().join(name);
        let ended = fieldgap()
            .env("RAYON_NUM_THREADS", threads)
            .arg("replay")
            .arg(&first)
            .arg("--out")
            .arg(&out)
            .output()
            .expect("the program runs");
        assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
        files(&out)
    };
    let (one, other) = (report("one", "1"), report("other", "3"));
    assert!(one.iter().any(|(name, _)| name == "index.html"));
    assert_eq!(one, other);
}

#[test]
fn a_scan_whose_folder_is_deleted_ends_at_the_next_point() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    std::fs::write(&plan, PLAN.replace("step_mm = 2.0", "step_mm = 0.5")).expect("written");
    let mut scan = fieldgap();
    scan.arg("scan").arg(&plan).arg("--rig").arg(here("rigs/virtual.toml"));
    let mut scan = scan.arg("--out").arg(&folder).arg("--json").spawn().expect("the scan starts");
    let mut lines = BufReader::new(scan.stdout.take().expect("it is piped")).lines();
    let measured = |line: &std::io::Result<String>| {
        line.as_ref().is_ok_and(|line| line.contains("\"measured\""))
    };
    assert_eq!(lines.by_ref().filter(measured).take(5).count(), 5);
    // The scan may write a file between the last one that is deleted and the folder itself.
    while let Err(error) = std::fs::remove_dir_all(&folder) {
        assert_eq!(error.kind(), std::io::ErrorKind::DirectoryNotEmpty, "{error}");
    }
    let further = lines.filter(measured).count();
    let ended = scan.wait_with_output().expect("it ends");
    assert_eq!(ended.status.code(), Some(1));
    let words = String::from_utf8_lossy(&ended.stderr);
    assert!(words.contains("was deleted, moved or replaced"), "{words}");
    assert!(!words.contains("record: "), "{words}");
    // Points that were measured before the deletion and reported after it; 6,400 were to come.
    assert!(further < 200, "{further} further readings");
}
