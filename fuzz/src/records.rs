//! Files that programs write: records, journals, events, imports, single elements.

use std::path::Path;

use fieldgap::acoustics::Vec3;
use fieldgap::archive::{Index, Query, RecordFigures, Wanted, to_csv, to_text};
use fieldgap::campaign::{CampaignError, CampaignFolder};
use fieldgap::comparison::{Registering, compare};
use fieldgap::exposure::SoundingLog;
use fieldgap::input::{Fault, Positive};
use fieldgap::records::import::{
    Anchor, FirstRow, GridCsv, GridPlacement, ThesisLog, ThesisLogSetup,
};
use fieldgap::records::{
    AirRow, Journal, JournalError, Note, RecordedScan, ScanState, read_events,
};

use super::files::shown;

/// Between the files of one case.
const NEXT_FILE: &[u8] = b"\n=====\n";

/// Most readings of a record that are also compared.
const COMPARED: usize = 200;

/// The set-up of records whose other files are under test.
const SETUP: &str = include_str!("../corpus/setup.toml");

fn with_folder(files: &[(&str, &[u8])], read: impl FnOnce(&Path)) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    read(folder.path());
}

fn check<T>(result: Result<T, Fault>) {
    if let Err(fault) = result {
        shown(&fault);
    }
}

/// `scan.toml` and `samples.csv`; a small record is also compared with its simulation.
pub fn record(case: &[u8]) {
    let at = case.windows(NEXT_FILE.len()).position(|window| window == NEXT_FILE);
    let (setup, samples) =
        at.map_or((case, &b""[..]), |at| (&case[..at], &case[at + NEXT_FILE.len()..]));
    with_folder(&[("scan.toml", setup), ("samples.csv", samples)], |folder| {
        let scan = match RecordedScan::open(folder) {
            Ok(scan) => scan,
            Err(fault) => return shown(&fault),
        };
        assert!(scan.samples.iter().all(|sample| sample.phase_rad.is_none_or(f64::is_finite)));
        if scan.samples.len() * scan.setup.array.array().len() <= COMPARED * 36
            && let Ok(comparison) = compare(&scan, scan.setup.simulator, Registering::GainOnly)
        {
            let text = comparison.to_text();
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
    });
}

/// A file of single elements.
pub fn elements(case: &[u8]) {
    let regular =
        "layout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0";
    let setup = SETUP.replace(regular, "layout = \"elements\"\nfile = \"elements.csv\"");
    assert_ne!(setup, SETUP);
    let files = [("scan.toml", setup.as_bytes()), ("elements.csv", case), ("samples.csv", b"")];
    with_folder(&files, |folder| check(RecordedScan::open(folder)));
}

/// The journal of a scan that is resumed.
pub fn journal(case: &[u8]) {
    let files = [("scan.toml", SETUP.as_bytes()), ("journal.csv", case), ("samples.csv", b"")];
    with_folder(&files, |folder| match Journal::resume(folder, jiff::Timestamp::UNIX_EPOCH) {
        Ok(resumed) => {
            let finite = |at: Vec3| at.iter().all(|mm| mm.is_finite());
            let kept = |record: &fieldgap::records::Record| record.commanded_mm.is_none_or(finite);
            assert!(resumed.records.iter().all(kept));
        }
        Err(JournalError::Fault(fault)) => shown(&fault),
        Err(_) => {}
    });
}

/// The events, the state, the notes and the air of a scan.
pub fn events(case: &[u8]) {
    let files = ["events.jsonl", "state.toml", "notes.jsonl", "environment.csv"];
    with_folder(&files.map(|name| (name, case)), |folder| {
        let _ = read_events(folder);
        check(Note::all_of(folder));
        assert!(AirRow::all_of(folder).iter().all(|row| row.temperature_c.is_finite()));
        check(ScanState::of(folder));
    });
}

/// The log of times with the array driven: minutes of zero or more, or an error that names the line.
pub fn sounding(case: &[u8]) {
    with_folder(&[("sounding.jsonl", case)], |folder| {
        let log = SoundingLog::at(folder.join("sounding.jsonl"));
        let day = jiff::civil::date(2026, 11, 24);
        match log.minutes_on(day, &jiff::tz::TimeZone::UTC, "bench") {
            Ok(minutes) => assert!(minutes >= 0.0 && minutes.is_finite()),
            Err(fault) => shown(&fault),
        }
    });
}

/// `rounds.jsonl` of a closed loop: rounds in order, or an error that names the line.
pub fn rounds(case: &[u8]) {
    let text = String::from_utf8_lossy(case);
    match fieldgap::closed_loop::parse_rounds(Path::new("rounds.jsonl"), &text) {
        Ok(rounds) => assert!(rounds.iter().enumerate().all(|(n, round)| round.round == n)),
        Err(error) => assert!(error.to_string().starts_with("rounds.jsonl, line ")),
    }
}

/// `map-rounds.jsonl` of an adaptive map: the same.
pub fn map_rounds(case: &[u8]) {
    use fieldgap::adaptive_map::MapRound;
    let text = String::from_utf8_lossy(case);
    let rounds = fieldgap::closed_loop::parse_log(Path::new("map-rounds.jsonl"), &text);
    match rounds {
        Ok(rounds) => {
            let rounds: Vec<MapRound> = rounds;
            assert!(rounds.iter().enumerate().all(|(n, round)| round.round == n));
        }
        Err(error) => assert!(error.to_string().starts_with("map-rounds.jsonl, line ")),
    }
}

/// The log of a campaign.
pub fn campaign_log(case: &[u8]) {
    with_folder(&[("campaign.jsonl", case)], |folder| match CampaignFolder::read(folder) {
        Ok(state) => assert!(state.open_alarms().count() <= state.alarms.len()),
        Err(CampaignError::File(fault)) => shown(&fault),
        Err(_) => {}
    });
}

/// The figures of a record, in both forms, and the index that reads them.
pub fn figures(case: &[u8]) {
    for name in ["figures.json", "comparison.json"] {
        let files = [("scan.toml", SETUP.as_bytes()), ("samples.csv", b"")];
        with_folder(&files, |folder| {
            let report = folder.join("report");
            std::fs::create_dir(&report).expect("made");
            std::fs::write(report.join(name), case).expect("written");
            match RecordFigures::read(folder) {
                Ok(Some(figures)) => {
                    assert!(figures.series().iter().all(|(_, f)| f.value.is_finite()))
                }
                Ok(None) => {}
                Err(fault) => shown(&fault),
            }
            let mut index = Index::open(folder, None).expect("in memory");
            index.update().expect("read");
            let query = Query { figures: Wanted::All, ..Query::default() };
            let entries = index.query(&query).expect("read");
            assert_eq!(entries.len(), 1);
            let text = to_text(&entries, &[]);
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
            to_csv(&entries, &[]).expect("text");
        });
    }
}

/// A log of the thesis's robot.
pub fn thesis_log(case: &[u8]) {
    with_folder(&[("log.csv", case)], |folder| match ThesisLog::read(&folder.join("log.csv")) {
        Ok(log) => {
            let setup = ThesisLogSetup::of_thesis("log", jiff::Timestamp::UNIX_EPOCH);
            let _ = log.into_scan(setup).write(&folder.join("scan"));
        }
        Err(fault) => shown(&fault),
    });
}

/// A grid of numbers.
pub fn grid(case: &[u8]) {
    with_folder(&[("grid.csv", case)], |folder| match GridCsv::read(&folder.join("grid.csv")) {
        Ok(grid) => {
            let step_mm = [1.0, 2.0].map(|mm| Positive::new(mm).expect("above zero")).into();
            let anchor = Anchor::Centre([0.0, 0.0]);
            let placement =
                GridPlacement { z_mm: 100.0, step_mm, anchor, first_row: FirstRow::Top };
            assert!(grid.samples(&placement, 0, 0.0).len() <= grid.rows() * grid.columns());
        }
        Err(fault) => shown(&fault),
    });
}

/// A file of points in any of the formats of other programs, with columns that its seeds have.
pub fn points(case: &[u8]) {
    use fieldgap::exchange::import::{Columns, Negative, PointsRequest, Units, points_of_bytes};
    let path = Path::new("points");
    let units: Units = "mm,mm,mm,V".parse().expect("units");
    for columns in
        ["x,y,z,p", "1,2,3,4", "scan/x,scan/y,scan/z,scan/p", "data:1,data:2,data:3,data:4"]
    {
        let columns: Columns = columns.parse().expect("columns");
        let request = PointsRequest {
            columns: Some(columns),
            units: Some(units.clone()),
            negative: Negative::Rectify,
            ..PointsRequest::default()
        };
        match points_of_bytes(path, case.to_vec(), &request) {
            Ok(points) => {
                assert!(
                    points
                        .samples
                        .iter()
                        .all(|sample| sample.reading.is_finite() && sample.reading >= 0.0)
                );
                points.summary();
            }
            Err(fault) => shown(&fault),
        }
    }
}
