//! A scan whose computer is suspended: the suspension is recorded, the robot's place confirmed, and the interrupted point
//! measured again. The clock that tells suspensions is the test's.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use fieldgap::acquisition::{Ending, Event, PlannedScan, ScanRun};
use fieldgap::records::{EventKind, RecordedScan, read_events};
use fieldgap::rig_file::simulated_devices;

const PLAN: &str = r#"
name = "suspended"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[[plane]]
z_mm = 100.0
size_mm = [10.0, 4.0]
step_mm = 2.0
"#;

/// Scans, with a suspension of a minute after the third point; the folder's events and the number of times that a point
/// was read.
fn scanned(home: &Path, name: &str, suspended: bool) -> (Vec<String>, usize) {
    let plan = home.join("plan.toml");
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml");
    let folder = home.join(name);
    let suspended_s = Arc::new(AtomicU64::new(0));
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let told = runtime.block_on(async {
        let scan = PlannedScan::read(&plan, Some(&rig)).expect("a plan");
        let mut scan_run =
            ScanRun::begin(scan, &folder, simulated_devices).await.expect("it begins");
        let clock = Arc::clone(&suspended_s);
        scan_run.suspended_by(Box::new(move || Duration::from_secs(clock.load(Ordering::Relaxed))));
        let mut told = Vec::new();
        let watch = &mut |event: &Event| {
            if suspended && matches!(event, Event::Measured { row: 2, .. }) {
                suspended_s.store(60, Ordering::Relaxed);
            }
            told.push(serde_json::to_string(event).expect("plain data"));
        };
        let ending = scan_run.run(watch, std::future::pending()).await.expect("it ends");
        assert_eq!(ending, Ending::Complete);
        told
    });
    let log = std::fs::read_dir(folder.join("wire")).expect("wire logs");
    let read = log
        .map(|file| std::fs::read_to_string(file.expect("a file").path()).expect("text"))
        .map(|text| text.matches("read-point").count())
        .sum();
    (told, read)
}

#[test]
fn a_suspension_is_recorded_and_the_interrupted_point_measured_again() {
    let home = tempfile::tempdir().expect("a folder");
    let (told, read) = scanned(home.path(), "suspended", true);
    let place = |words: &str| told.iter().position(|event| event.contains(words)).expect(words);
    let suspended = place("\"suspended\"");
    assert!(told[suspended].contains("60.0"), "{}", told[suspended]);
    assert!(place("\"row\":2,") < suspended && suspended < place("\"row\":3,"));
    let folder = home.path().join("suspended");
    let events = read_events(&folder).expect("events");
    let texts: Vec<&str> = events
        .iter()
        .filter(|event| event.kind == EventKind::Suspended)
        .map(|event| event.text.as_str())
        .collect();
    assert_eq!(texts.len(), 2, "{texts:?}");
    assert!(texts[0].contains("60.0 s") && texts[1].contains("same place"), "{texts:?}");

    let (_, read_without) = scanned(home.path(), "whole", false);
    assert_eq!(read, read_without + 1);
    let samples = |name| RecordedScan::open(&home.path().join(name)).expect("whole").samples.len();
    assert_eq!((samples("suspended"), read_without), (samples("whole"), samples("whole")));
}
