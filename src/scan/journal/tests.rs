use super::*;
use crate::acoustics::Vec3;
use crate::input::TomlSource;
use crate::scan::{RecordedScan, Spread};

fn setup() -> ScanSetup {
    let text = "format = 1\nname = \"n\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
                [array]\nfrequency_hz = 40000.0\nlayout = \"linear\"\ncount = 2\n\
                element_diameter_mm = 10.5\nspacing_mm = 0.0\n\
                [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
                [[focus]]\nphases = \"all-zero\"\n";
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good")
}

fn sample(visit: u32) -> Sample {
    let spread = Some(Spread { std: 0.01, count: 16 });
    let at = Vec3::new(0.001 * f64::from(visit), -0.0225, 0.1);
    Sample::measured(0.25 * f64::from(visit), Some(0), at, 0.5 + f64::from(visit), spread)
}

fn noon() -> Timestamp {
    "2026-11-20T12:00:00Z".parse().expect("an instant")
}

fn create(folder: &Path) -> Result<Journal, JournalError> {
    let copies: [(&str, &[u8]); 2] = [("plan.toml", b"a plan"), ("rig.toml", b"a rig")];
    Journal::create(folder, &setup(), Columns::WithSpread, &copies, noon())
}

/// A scan killed after so many samples.
fn killed_after(folder: &Path, visits: u32) {
    let mut journal = create(folder).expect("an empty folder");
    (0..visits).for_each(|visit| journal.append(&sample(visit)).expect("room on the disk"));
}

fn resume(folder: &Path) -> Resumed {
    Journal::resume(folder, noon()).expect("a scan to be resumed")
}

fn events(folder: &Path) -> Vec<Event> {
    let text = fs::read_to_string(folder.join(EVENTS)).expect("events");
    text.lines().map(|line| serde_json::from_str(line).expect("an event")).collect()
}

#[test]
fn a_scan_kept_to_its_end_is_a_recorded_scan() {
    let folder = tempfile::tempdir().expect("a folder");
    let inside = folder.path().join("a/scan");
    let mut journal = create(&inside).expect("a new folder");
    assert_eq!(ScanState::of(&inside).expect("readable"), Some(ScanState::Scanning));
    for visit in 0..3 {
        assert_eq!(journal.visits_done(), visit as usize);
        journal.append(&sample(visit)).expect("room on the disk");
    }
    journal.record(noon(), EventKind::ReferenceChecked, "within 1 %").expect("room on the disk");
    journal.end(noon(), &ScanState::Complete).expect("room on the disk");

    let scan = RecordedScan::open(&inside).expect("a recorded scan");
    assert_eq!(scan, RecordedScan { setup: setup(), samples: (0..3).map(sample).collect() });
    assert_eq!(fs::read(inside.join("plan.toml")).expect("kept"), b"a plan");
    assert_eq!(ScanState::of(&inside).expect("readable"), Some(ScanState::Complete));
    let kinds: Vec<(EventKind, usize)> =
        events(&inside).iter().map(|event| (event.kind, event.visits_done)).collect();
    use EventKind::{Ended, ReferenceChecked, Started};
    assert_eq!(kinds, [(Started, 0), (ReferenceChecked, 3), (Ended, 3)]);
}

#[test]
fn a_sample_is_in_the_file_before_append_returns() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut journal = create(folder.path()).expect("an empty folder");
    for visit in 0..4 {
        journal.append(&sample(visit)).expect("room on the disk");
        let scan = RecordedScan::open(folder.path()).expect("readable while it grows");
        assert_eq!(scan.samples.last(), Some(&sample(visit)));
    }
}

#[test]
fn cut_at_any_byte_of_the_last_record_only_that_record_is_lost() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 3);
    let path = folder.path().join(SAMPLES);
    let whole = fs::read(&path).expect("samples");
    let last_starts = whole_lines(&whole[..whole.len() - 1]);
    for cut in last_starts..whole.len() {
        fs::write(&path, &whole[..cut]).expect("written");
        let Resumed { mut journal, samples, cut: text, .. } = resume(folder.path());
        assert_eq!(samples, [sample(0), sample(1)]);
        assert_eq!(journal.visits_done(), 2);
        let left = std::str::from_utf8(&whole[last_starts..cut]).expect("text");
        assert_eq!(text.as_deref(), (!left.is_empty()).then_some(left));
        let kept = events(folder.path());
        let kept_cut = kept.iter().rev().find(|event| event.kind == EventKind::LineCut);
        assert_eq!(kept_cut.map(|event| event.text.as_str()).unwrap_or(""), left);

        journal.append(&sample(2)).expect("room on the disk");
        drop(journal);
        assert_eq!(fs::read(&path).expect("samples"), whole);
    }
}

#[test]
fn a_line_written_but_not_acknowledged_counts_if_it_is_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 1);
    let path = folder.path().join(SAMPLES);
    let line = Columns::WithSpread.line(&sample(1)).expect("good");
    let mut text = fs::read_to_string(&path).expect("samples");
    text += &line;
    fs::write(&path, text).expect("written");
    assert_eq!(resume(folder.path()).samples, [sample(0), sample(1)]);
}

#[test]
fn a_tail_of_zeros_left_by_a_power_cut_is_taken_off() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 2);
    let path = folder.path().join(SAMPLES);
    let mut bytes = fs::read(&path).expect("samples");
    bytes.extend([0; 4096]);
    fs::write(&path, bytes).expect("written");
    let resumed = resume(folder.path());
    assert_eq!(resumed.samples.len(), 2);
    assert_eq!(resumed.cut.map(|text| text.len()), Some(KEPT_OF_TORN_LINE));
}

#[test]
fn a_torn_event_is_taken_off() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 1);
    let path = folder.path().join(EVENTS);
    let mut text = fs::read_to_string(&path).expect("events");
    text += "{\"at\":\"2026";
    fs::write(&path, text).expect("written");
    drop(resume(folder.path()));
    let kinds: Vec<EventKind> = events(folder.path()).iter().map(|event| event.kind).collect();
    assert_eq!(kinds, [EventKind::Started, EventKind::Resumed]);
}

#[test]
fn a_bad_row_in_the_middle_is_a_fault_not_a_loss() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 3);
    let path = folder.path().join(SAMPLES);
    let text = fs::read_to_string(&path).expect("samples").replace("0.25,0,", "0.25,7,");
    fs::write(&path, &text).expect("written");
    let error = Journal::resume(folder.path(), noon()).expect_err("no focus 7");
    assert!(error.to_string().contains("samples.csv:3:6"), "{error}");
    assert_eq!(fs::read_to_string(&path).expect("samples"), text);
}

#[test]
fn killed_at_any_step_of_its_beginning_the_folder_can_be_used_again_or_resumed() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 0);
    // In the reverse order of being written; without scan.toml nothing was measured yet.
    let order = [SETUP, state::FILE, "rig.toml", "plan.toml", SAMPLES, EVENTS];
    for (removed, name) in order.iter().enumerate() {
        let again = tempfile::tempdir().expect("a folder");
        for kept in &order[removed + 1..] {
            fs::copy(folder.path().join(kept), again.path().join(kept)).expect("copied");
        }
        let refused = Journal::resume(again.path(), noon()).expect_err(name);
        assert!(matches!(refused, JournalError::NoScan(_)), "{refused}");
        create(again.path()).expect(name);
    }
    assert!(resume(folder.path()).samples.is_empty());
}

#[test]
fn a_folder_that_holds_a_scan_is_refused_and_the_way_on_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 1);
    let said = create(folder.path()).expect_err("a scan is there").to_string();
    assert!(said.contains("killed") && said.contains("fieldgap resume"), "{said}");

    let reason = "the robot went away".to_owned();
    resume(folder.path()).journal.end(noon(), &ScanState::Partial { reason }).expect("written");
    let said = create(folder.path()).expect_err("a scan is there").to_string();
    assert!(said.contains("the robot went away") && said.contains("fieldgap resume"), "{said}");

    let resumed = resume(folder.path());
    assert_eq!(ScanState::of(folder.path()).expect("readable"), Some(ScanState::Scanning));
    resumed.journal.end(noon(), &ScanState::Complete).expect("written");
    let said = create(folder.path()).expect_err("a scan is there").to_string();
    assert!(said.contains("complete") && said.contains("fieldgap replay"), "{said}");
    let complete = Journal::resume(folder.path(), noon()).expect_err("nothing left to do");
    assert!(matches!(complete, JournalError::AlreadyComplete(_)), "{complete}");
}

#[test]
fn readings_without_a_scan_toml_are_not_written_over() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 1);
    fs::remove_file(folder.path().join(SETUP)).expect("removed");
    assert!(matches!(create(folder.path()), Err(JournalError::Occupied { .. })));
}

#[test]
fn two_at_once_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let running = create(folder.path()).expect("an empty folder");
    let second = Journal::resume(folder.path(), noon()).expect_err("still running");
    assert!(matches!(second, JournalError::Busy(_)), "{second}");
    drop(running);
    assert!(Journal::resume(folder.path(), noon()).is_ok());
}

#[test]
fn a_sample_that_would_spoil_the_record_is_refused_and_the_next_one_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut journal = create(folder.path()).expect("an empty folder");
    let bad = [
        Sample { reading: f64::NAN, ..sample(0) },
        Sample { focus: Some(1), ..sample(0) },
        Sample { spread: None, ..sample(0) },
    ];
    for sample in bad {
        let refused = journal.append(&sample).expect_err("unreadable");
        assert!(matches!(refused, JournalError::Sample { visit: 0, .. }), "{refused}");
    }
    journal.append(&sample(0)).expect("room on the disk");
    assert_eq!(RecordedScan::open(folder.path()).expect("good").samples, [sample(0)]);
}

#[test]
fn a_sample_that_does_not_reach_the_disk_says_what_is_safe() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut journal = create(folder.path()).expect("an empty folder");
    journal.append(&sample(0)).expect("room on the disk");
    // A file that is open for reading alone takes no line, as a full disk would not.
    let unwritable = File::open(folder.path().join(SAMPLES)).expect("there");
    journal.samples = Lines::after(unwritable, 0);
    let error = journal.append(&sample(1)).expect_err("not writable");
    assert!(matches!(error, JournalError::Append { kept: 1, .. }), "{error}");
    assert!(error.to_string().contains("the 1 before it are safe"), "{error}");
    assert_eq!(journal.visits_done(), 1);
    drop(journal);
    assert_eq!(resume(folder.path()).samples, [sample(0)]);
}

#[test]
fn a_full_disk_asks_for_space() {
    let error = JournalError::Append {
        folder: PathBuf::from("scans/today"),
        kept: 812,
        source: io::ErrorKind::StorageFull.into(),
    };
    let said = error.to_string();
    assert!(said.contains("812") && said.contains("Free some space"), "{said}");
    assert!(said.contains("fieldgap resume scans/today"), "{said}");
}
