//! A scan in rounds whose chooser works on while the robot measures.

use std::path::Path;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use fieldgap::acquisition::{
    ChooseRounds, Ending, Event, NextRound, NoNextRound, PlannedScan, ScanRun,
};
use fieldgap::records::{Plan, RecordedScan};
use fieldgap::rig_file::simulated_devices;

const PLAN: &str = "name = \"rounds\"\n[simulator]\nmodel = \"piston\"\n\
                    [[focus]]\nx_mm = 10.0\ny_mm = -5.0\nz_mm = 100.0\n\
                    [[readings]]\nat_mm = [[0, 0, 100], [1, 0, 100]]\nfocus = [0, 0]\n";

const ROUND: &str = "[[readings]]\nat_mm = [[2, 0, 100], [3, 0, 100]]\nfocus = [0, 0]\n";

/// Rows of the second round's readings.
const SECOND: std::ops::Range<usize> = 2..4;

/// Adds one round. While that is measured it waits for a reading of it.
struct Waits {
    measured: Mutex<Receiver<usize>>,
    /// Readings of the record that it worked on, and the row of the reading that arrived meanwhile.
    told: Sender<(usize, Option<usize>)>,
    panics: bool,
}

impl ChooseRounds for Waits {
    fn next(&self, plan: &Plan, record: &RecordedScan) -> Result<NextRound, NoNextRound> {
        let longer = format!("{}\n{ROUND}", plan.text());
        let plan = (record.samples.len() == SECOND.start).then_some(longer);
        Ok(NextRound { decision: "so".to_owned(), plan })
    }

    fn meanwhile(&self, record: &RecordedScan) {
        assert!(!self.panics, "lost its way");
        let measured = self.measured.lock().expect("the only one");
        // Longer than any reading takes.
        let of_round = std::iter::from_fn(|| measured.recv_timeout(Duration::from_secs(60)).ok())
            .find(|row| SECOND.contains(row));
        self.told.send((record.samples.len(), of_round)).expect("it is waited for");
    }
}

fn scanned(home: &Path, panics: bool) -> (Ending, Option<(usize, Option<usize>)>, usize) {
    let plan = home.join("plan.toml");
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml");
    let folder = home.join("record");
    let (measures, measured) = channel();
    let (told, tells) = channel();
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let ending = runtime.block_on(async {
        let scan = PlannedScan::read(&plan, Some(&rig)).expect("a plan");
        let mut scan_run =
            ScanRun::begin(scan, &folder, simulated_devices).await.expect("it begins");
        scan_run.in_rounds(Box::new(Waits { measured: Mutex::new(measured), told, panics }));
        let watch = &mut |event: &Event| {
            if let Event::Measured { row, .. } = event {
                // Nobody listens once it has heard enough.
                let _ = measures.send(*row);
            }
        };
        scan_run.run(watch, std::future::pending()).await.expect("it ends")
    });
    (ending, tells.try_recv().ok(), RecordedScan::open(&folder).expect("a record").samples.len())
}

#[test]
fn what_chooses_works_on_the_earlier_readings_while_a_round_is_measured() {
    let home = tempfile::tempdir().expect("a folder");
    let (ending, told, samples) = scanned(home.path(), false);
    assert_eq!(ending, Ending::Complete);
    assert_eq!((told, samples), (Some((SECOND.start, Some(SECOND.start))), SECOND.end));
}

#[test]
fn a_panic_of_what_chooses_ends_the_scan_and_keeps_the_readings_of_the_round() {
    let home = tempfile::tempdir().expect("a folder");
    let (ending, _, samples) = scanned(home.path(), true);
    let Ending::Partial { reason } = ending else { panic!("{ending:?}") };
    assert!(reason.contains("lost its way"), "{reason}");
    assert_eq!(samples, SECOND.end);
}
