use super::*;
use crate::{RecordedScan, Spread};
use fieldgap_acoustics::Vec3;
use fieldgap_input::TomlSource;

fn setup() -> ScanSetup {
    let text = "format = 1\nname = \"n\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
                [array]\nfrequency_hz = 40000.0\nlayout = \"linear\"\ncount = 2\n\
                element_diameter_mm = 10.5\nspacing_mm = 0.0\n\
                [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
                [[focus]]\nphases = \"all-zero\"\n";
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good")
}

fn sample(visit: u32) -> RecordedSample {
    let spread = Some(Spread { std: 0.01, count: 16 });
    let at = Vec3::new(0.001 * f64::from(visit), -0.0225, 0.1);
    RecordedSample::measured(0.25 * f64::from(visit), Some(0), at, 0.5 + f64::from(visit), spread)
}

fn noon() -> Timestamp {
    "2026-11-20T12:00:00Z".parse().expect("an instant")
}

fn create(folder: &Path) -> Result<Journal, JournalError> {
    let copies: [(&str, &[u8]); 2] = [("plan.toml", b"a plan"), ("rig.toml", b"a rig")];
    Journal::create(folder, &setup(), Columns::WITH_SPREAD, &copies, noon())
}

/// A scan killed after so many samples.
fn killed_after(folder: &Path, visits: u32) {
    let mut journal = create(folder).expect("an empty folder");
    (0..visits).for_each(|visit| append(&mut journal, visit));
}

/// Keeps a sample for which the robot was sent a hundredth of a millimetre higher than it reported to be.
fn append(journal: &mut Journal, visit: u32) {
    keep(journal, &sample(visit)).expect("room on the disk");
}

fn keep(journal: &mut Journal, sample: &RecordedSample) -> Result<(), JournalError> {
    journal.append(sample, sample.position_m() + Vec3::new(0.0, 0.0, 1e-5))
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
        append(&mut journal, visit);
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
        append(&mut journal, visit);
        let scan = RecordedScan::open(folder.path()).expect("readable while it grows");
        assert_eq!(scan.samples.last(), Some(&sample(visit)));
    }
}

/// How many whole lines of a journal stand before a byte, without its header.
fn records_before(bytes: &[u8], end: usize) -> usize {
    bytes[..end].iter().filter(|&&byte| byte == b'\n').count().saturating_sub(1)
}

fn samples_of(resumed: &Resumed) -> Vec<RecordedSample> {
    resumed.records.iter().map(|record| record.sample).collect()
}

#[test]
fn where_the_robot_was_sent_is_kept_beside_where_it_reported_to_be() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 2);
    let text = fs::read_to_string(folder.path().join(record::FILE)).expect("a journal");
    let body = "1,1.0,-22.5,100.01,0.25,0,1.0,-22.5,100.0,1.5,0.01,16";
    let line = format!("{body},{:08x}", crc32fast::hash(body.as_bytes()));
    assert_eq!(text.lines().nth(2), Some(line.as_str()));
    let records = resume(folder.path()).records;
    assert_eq!(records[1].commanded_mm, Some(Vec3::new(1.0, -22.5, 100.01)));
}

#[test]
fn cut_at_any_byte_every_whole_record_before_it_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 4);
    let path = folder.path().join(record::FILE);
    let whole = fs::read(&path).expect("a journal");
    let samples = fs::read(folder.path().join(SAMPLES)).expect("samples");
    let header = record::header(Columns::WITH_SPREAD).len();
    for cut in header..=whole.len() {
        let left = records_before(&whole, cut);
        // The samples are never ahead of the journal; what is whole of them may be any less.
        let ends: Vec<usize> = (0..samples.len()).filter(|&at| samples[at] == b'\n').collect();
        fs::write(&path, &whole[..cut]).expect("written");
        fs::write(folder.path().join(SAMPLES), &samples[..=ends[left]]).expect("written");
        let resumed = resume(folder.path());
        assert_eq!(samples_of(&resumed), (0..left as u32).map(sample).collect::<Vec<_>>());
        let torn = &whole[whole_lines(&whole[..cut])..cut];
        let torn = std::str::from_utf8(torn).expect("text");
        assert_eq!(resumed.cut.as_deref(), (!torn.is_empty()).then_some(torn), "cut at {cut}");

        let mut journal = resumed.journal;
        (left as u32..4).for_each(|visit| append(&mut journal, visit));
        drop(journal);
        assert_eq!(fs::read(&path).expect("a journal"), whole);
        assert_eq!(fs::read(folder.path().join(SAMPLES)).expect("samples"), samples);
    }
}

#[test]
fn samples_cut_at_any_byte_are_put_back_from_the_journal() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 3);
    let path = folder.path().join(SAMPLES);
    let whole = fs::read(&path).expect("samples");
    for cut in 0..=whole.len() {
        // As a power cut leaves what was never synced: short, or with zeros where something was.
        for zeros in [0, 700] {
            let mut left = whole[..cut].to_vec();
            left.extend(vec![0; zeros]);
            fs::write(&path, &left).expect("written");
            assert_eq!(samples_of(&resume(folder.path())).len(), 3, "cut at {cut}");
            assert_eq!(fs::read(&path).expect("samples"), whole, "cut at {cut}");
        }
    }
}

#[test]
fn a_tail_of_zeros_or_noise_left_by_a_power_cut_is_taken_off() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 2);
    let path = folder.path().join(record::FILE);
    let whole = fs::read(&path).expect("a journal");
    for tail in [vec![0; 4096], b"2,1.0,\n\xff\n\0\0,,\n7\n".repeat(90)] {
        let mut bytes = whole.clone();
        bytes.extend(tail);
        fs::write(&path, bytes).expect("written");
        let resumed = resume(folder.path());
        assert_eq!(resumed.records.len(), 2);
        assert_eq!(resumed.cut.map(|text| text.chars().count()), Some(KEPT_OF_TORN_LINE));
        drop(resumed.journal);
        assert_eq!(fs::read(&path).expect("a journal"), whole);
    }
}

#[test]
fn a_changed_byte_is_a_fault_or_costs_the_last_record_and_never_a_wrong_reading() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 3);
    let path = folder.path().join(record::FILE);
    let whole = fs::read(&path).expect("a journal");
    let samples = fs::read(folder.path().join(SAMPLES)).expect("samples");
    let last = whole_lines(&whole[..whole.len() - 1]);
    for at in record::header(Columns::WITH_SPREAD).len()..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1;
        fs::write(&path, &bytes).expect("written");
        // What is lost of the journal was never acknowledged in the samples.
        let kept =
            if at < last { samples.len() } else { whole_lines(&samples[..samples.len() - 1]) };
        fs::write(folder.path().join(SAMPLES), &samples[..kept]).expect("written");
        match Journal::resume(folder.path(), noon()) {
            Ok(resumed) => {
                assert!(at >= last, "byte {at}");
                assert_eq!(samples_of(&resumed), [sample(0), sample(1)]);
            }
            Err(error) => {
                assert!(at < last, "byte {at}: {error}");
                // A line end that is gone takes the next record with it; samples.csv still has it.
                let said = error.to_string();
                assert!(said.contains("is damaged, but") || said.contains("was changed"), "{said}");
            }
        }
    }
}

#[test]
fn a_scan_that_was_begun_without_a_journal_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 3);
    fs::remove_file(folder.path().join(record::FILE)).expect("removed");
    let path = folder.path().join(SAMPLES);
    let mut text = fs::read_to_string(&path).expect("samples");
    text += "0.75,0,3.0,-22";
    fs::write(&path, text).expect("written");
    let resumed = resume(folder.path());
    assert_eq!(samples_of(&resumed), [sample(0), sample(1), sample(2)]);
    assert!(resumed.records.iter().all(|record| record.commanded_mm.is_none()));
    let mut journal = resumed.journal;
    append(&mut journal, 3);
    drop(journal);
    assert_eq!(samples_of(&resume(folder.path())).len(), 4);
}

#[test]
fn a_record_written_but_not_acknowledged_counts_if_it_is_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 2);
    let path = folder.path().join(SAMPLES);
    let text = fs::read(&path).expect("samples");
    fs::write(&path, &text[..whole_lines(&text[..text.len() - 1])]).expect("written");
    assert_eq!(samples_of(&resume(folder.path())), [sample(0), sample(1)]);
}

#[test]
fn a_row_that_was_written_at_once_is_read_back_whole_or_as_far_as_it_got() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut journal = create(folder.path()).expect("an empty folder");
    let row: Vec<(RecordedSample, Vec3)> =
        (0..5).map(|n| (sample(n), sample(n).position_m())).collect();
    journal.append_row(&row[..2]).expect("written");
    journal.append_row(&row[2..]).expect("written");
    drop(journal);
    let expected: Vec<RecordedSample> = row.iter().map(|(sample, _)| *sample).collect();
    assert_eq!(samples_of(&resume(folder.path())), expected);
    for file in [SAMPLES, record::FILE] {
        let path = folder.path().join(file);
        let text = fs::read_to_string(&path).expect("there");
        let lines: String = text.split_inclusive('\n').take(1 + 4).collect();
        fs::write(&path, lines).expect("written");
    }
    assert_eq!(samples_of(&resume(folder.path())), expected[..4]);
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
fn a_row_that_somebody_changed_is_a_fault_not_a_loss() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 3);
    let path = folder.path().join(SAMPLES);
    let text = fs::read_to_string(&path).expect("samples").replace("0.25,0,", "0.25,7,");
    fs::write(&path, &text).expect("written");
    let error = Journal::resume(folder.path(), noon()).expect_err("changed");
    assert!(error.to_string().contains("samples.csv:3:1"), "{error}");
    assert_eq!(fs::read_to_string(&path).expect("samples"), text);
}

#[test]
fn killed_at_any_step_of_its_beginning_the_folder_can_be_used_again_or_resumed() {
    let folder = tempfile::tempdir().expect("a folder");
    killed_after(folder.path(), 0);
    // In the reverse order of being written; without scan.toml nothing was measured yet.
    let order = [SETUP, state::FILE, "rig.toml", "plan.toml", SAMPLES, record::FILE, EVENTS];
    for (removed, name) in order.iter().enumerate() {
        let again = tempfile::tempdir().expect("a folder");
        for kept in &order[removed + 1..] {
            fs::copy(folder.path().join(kept), again.path().join(kept)).expect("copied");
        }
        let refused = Journal::resume(again.path(), noon()).expect_err(name);
        assert!(matches!(refused, JournalError::NoScan(_)), "{refused}");
        create(again.path()).expect(name);
    }
    assert!(resume(folder.path()).records.is_empty());
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
        RecordedSample { reading: f64::NAN, ..sample(0) },
        RecordedSample { focus: Some(1), ..sample(0) },
        RecordedSample { spread: None, ..sample(0) },
    ];
    for sample in bad {
        let refused = keep(&mut journal, &sample).expect_err("unreadable");
        assert!(matches!(refused, JournalError::Sample { visit: 0, .. }), "{refused}");
    }
    append(&mut journal, 0);
    assert_eq!(RecordedScan::open(folder.path()).expect("good").samples, [sample(0)]);
}

#[test]
fn a_sample_that_does_not_reach_the_disk_says_what_is_safe() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut journal = create(folder.path()).expect("an empty folder");
    append(&mut journal, 0);
    // A file that is open for reading alone takes no line, as a full disk would not.
    let unwritable = File::open(folder.path().join(SAMPLES)).expect("there");
    journal.samples = Lines::after(unwritable, 0);
    let error = keep(&mut journal, &sample(1)).expect_err("not writable");
    assert!(matches!(error, JournalError::Append { kept: 1, .. }), "{error}");
    assert!(error.to_string().contains("the 1 readings before it are safe"), "{error}");
    assert_eq!(journal.visits_done(), 1);
    // Nothing of it is left in the journal either, and it can be tried again.
    journal.samples = Lines::after(
        open_for_append(&folder.path().join(SAMPLES)).expect("there"),
        fs::metadata(folder.path().join(SAMPLES)).expect("there").len(),
    );
    append(&mut journal, 1);
    drop(journal);
    assert_eq!(samples_of(&resume(folder.path())), [sample(0), sample(1)]);
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

#[test]
fn a_record_that_was_deleted_moved_or_replaced_takes_no_further_reading() {
    type Harm = fn(&Path);
    let harms: [(Harm, &str); 5] = [
        (|folder| fs::remove_dir_all(folder).expect("deleted"), "journal.csv"),
        (
            |folder| fs::rename(folder, folder.with_file_name("moved")).expect("moved"),
            "journal.csv",
        ),
        (|folder| fs::remove_file(folder.join(SAMPLES)).expect("deleted"), "samples.csv"),
        (|folder| fs::remove_file(folder.join(SETUP)).expect("deleted"), "scan.toml"),
        (
            |folder| {
                let path = folder.join(record::FILE);
                fs::copy(&path, folder.join("copy")).expect("copied");
                fs::rename(folder.join("copy"), &path).expect("replaced");
            },
            "journal.csv",
        ),
    ];
    for (harm, file) in harms {
        let home = tempfile::tempdir().expect("a folder");
        let folder = home.path().join("scan");
        let mut journal = create(&folder).expect("a new folder");
        append(&mut journal, 0);
        harm(&folder);
        let error = keep(&mut journal, &sample(1)).expect_err("it is gone");
        assert!(matches!(&error, JournalError::Displaced { kept: 1, .. }), "{error}");
        assert!(error.to_string().contains(file), "{error}");
        assert_eq!(journal.visits_done(), 1);
    }
}
