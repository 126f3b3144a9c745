//! The index of many small records: what it finds, and that it follows what happens to the records.

mod synthetic;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use fieldgap_archive::{
    Entry, Filter, Index, Place, Query, RecordFigures, SAME_FOCUS_MM, SeriesName, Sort, Wanted,
    to_text,
};
use fieldgap_diagnosis::{EffectId, Verdict};
use fieldgap_records::{Note, NoteKind};
use jiff::Timestamp;
use proptest::prelude::*;
use synthetic::{write_record, write_records};

fn lab(count: u64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write_records(folder.path(), count);
    age(folder.path());
    folder
}

/// Makes everything a minute old, so that the index need not look again.
fn age(path: &Path) {
    let old = SystemTime::now() - Duration::from_secs(60);
    if path.is_dir() {
        fs::read_dir(path).expect("a folder").for_each(|entry| age(&entry.expect("there").path()));
    }
    let file = fs::File::open(path).expect("there");
    file.set_modified(old).expect("set");
}

fn open(root: &Path) -> Index {
    Index::open(root, None).expect("an index")
}

fn everything() -> Query {
    Query { figures: Wanted::All, ..Query::default() }
}

/// Everything that a new index has of the records, as text: NaN equals NaN there.
fn anew(root: &Path) -> String {
    let place = root.join(".fieldgap-index.sqlite");
    let _ = fs::remove_file(place);
    let mut index = open(root);
    index.update().expect("read");
    contents(&mut index)
}

fn contents(index: &mut Index) -> String {
    let entries = index.query(&everything()).expect("read");
    serde_json::to_string_pretty(&entries).expect("JSON")
}

#[test]
fn what_is_in_the_files_is_found() {
    let lab = lab(30);
    let mut index = open(lab.path());
    let updated = index.update().expect("read");
    assert_eq!((updated.read, updated.records, updated.damaged), (30, 30, 0));
    assert_eq!(index.place(), &Place::Beside(lab.path().join(".fieldgap-index.sqlite")));
    let entries = index.query(&everything()).expect("read");
    assert_eq!(entries.len(), 30);
    for entry in &entries {
        let folder = lab.path().join(&entry.folder);
        let figures = RecordFigures::read(&folder).expect("good");
        assert_eq!(entry.gap, figures.as_ref().map(|f| f.gap));
        assert_eq!(entry.correlation, figures.as_ref().map(|f| f.correlation));
        assert_eq!(entry.verdict, figures.as_ref().and_then(|f| Some(f.cause.as_ref()?.verdict)));
        assert_eq!(entry.notes, Note::all_of(&folder).expect("good"));
        assert_eq!(
            (entry.points, entry.heights_mm.as_slice()),
            (Some(12), &[80.0, 100.0, 120.0][..])
        );
        assert_eq!((entry.foci_mm.len(), entry.foci_mm[1]), (2, None));
        let series = figures.map(|f| f.series()).unwrap_or_default();
        let mut names: Vec<SeriesName> = series.into_iter().map(|(name, _)| name).collect();
        names.sort();
        assert_eq!(entry.figures.keys().cloned().collect::<Vec<_>>(), names);
    }
    // Nothing changed, so that nothing is read again.
    assert_eq!(index.update().expect("read").read, 0);
    assert_eq!(open(lab.path()).update().expect("read").read, 0);
}

#[test]
fn an_index_that_follows_changes_is_that_made_anew() {
    let lab = lab(20);
    let root = lab.path();
    let mut index = open(root);
    index.update().expect("read");
    let record = |number: u64| root.join(format!("week-000/scan-{number:05}"));
    // Changed in place, with the same length.
    let setup = record(3).join("scan.toml");
    let text = fs::read_to_string(&setup).expect("there").replace("daily 3", "DAILY 3");
    fs::write(&setup, text).expect("written");
    let note = Note::new(Timestamp::UNIX_EPOCH, "Bob", "measured again").expect("a note");
    note.of_kind(NoteKind::Repair).add_to(&record(4)).expect("kept");
    fs::remove_dir_all(record(5)).expect("removed");
    fs::rename(record(6), root.join("elsewhere")).expect("moved");
    write_record(&root.join("deep/er/new"), 77);
    fs::remove_file(record(7).join("samples.csv")).expect("removed");
    let figures = record(8).join("report/figures.json");
    fs::write(&figures, fs::read_to_string(record(9).join("report/figures.json")).expect("there"))
        .expect("written");
    let updated = index.update().expect("read");
    assert_eq!(updated.removed, 2);
    let followed = contents(&mut index);
    assert!(followed.contains("DAILY 3") && followed.contains("measured again"));
    drop(index);
    assert_eq!(followed, anew(root));
}

#[test]
fn damaged_records_are_listed_with_their_fault() {
    let lab = lab(6);
    let root = lab.path();
    let record = |number: u64| root.join(format!("week-000/scan-{number:05}"));
    fs::write(record(0).join("scan.toml"), "format = 1\nname = 7\n").expect("written");
    fs::write(record(1).join("notes.jsonl"), "{\"at\":1}\n").expect("written");
    fs::create_dir_all(record(2).join("report")).expect("made");
    fs::write(record(2).join("report/figures.json"), "{\"format\":2}").expect("written");
    fs::write(record(3).join("rig.toml"), "name = \"\n").expect("written");
    std::os::unix::fs::symlink("/etc/hostname", record(4).join("a link")).expect("made");
    let mut index = open(root);
    let updated = index.update().expect("read");
    let entries = index.query(&everything()).expect("read");
    assert_eq!((updated.damaged, entries.len()), (5, 6));
    let fault = |number: u64| {
        let found = entries.iter().find(|entry| root.join(&entry.folder) == record(number));
        found.expect("listed").fault.clone().unwrap_or_default()
    };
    let expected = [
        "scan.toml:2",
        "notes.jsonl: line 1 is no note",
        "report/figures.json: has format 2",
        "rig.toml:1",
        "a link",
    ];
    for (number, expected) in expected.iter().enumerate() {
        let fault = fault(number as u64);
        assert!(fault.starts_with(expected), "{number}: {fault}");
    }
    // What else is known of them is kept.
    assert!(entries.iter().filter(|entry| entry.name.is_some()).count() >= 4);
}

#[test]
fn a_damaged_or_foreign_index_is_made_anew() {
    let lab = lab(5);
    let path = lab.path().join(".fieldgap-index.sqlite");
    let fresh = anew(lab.path());
    let good = fs::read(&path).expect("there");
    let mut half = good.clone();
    half[4096..].fill(0x5a);
    let later = |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        // The version of the tables, at byte 60 of the file (SQLite file format, 1.3).
        bytes[60..64].copy_from_slice(&99u32.to_be_bytes());
        bytes
    };
    let cases = [b"no index".repeat(200), half, good[..good.len() / 2].to_vec(), later(&good)];
    for (case, bytes) in cases.iter().enumerate() {
        fs::write(&path, bytes).expect("written");
        let mut index = open(lab.path());
        index.update().expect("made anew");
        assert_eq!(contents(&mut index), fresh, "case {case}");
        assert!(index.renewed().is_some(), "case {case}");
    }
    // An empty file is an index without tables, and no fault.
    fs::write(&path, "").expect("written");
    let mut index = open(lab.path());
    index.update().expect("read");
    assert!(index.renewed().is_none() && contents(&mut index) == fresh);
}

/// Damage in a table that is read only by a query: the pages of the figures.
#[test]
fn damage_that_a_query_finds_is_repaired() {
    let lab = lab(200);
    let path = lab.path().join(".fieldgap-index.sqlite");
    let fresh = anew(lab.path());
    let mut bytes = fs::read(&path).expect("there");
    let end = bytes.len();
    bytes[end / 2..].fill(0xff);
    fs::write(&path, bytes).expect("written");
    let mut index = open(lab.path());
    index.update().expect("read");
    assert_eq!(contents(&mut index), fresh);
    assert!(index.renewed().is_some());
}

#[test]
fn an_index_in_the_cache_serves_a_folder_that_cannot_be_written() {
    let lab = lab(4);
    let cache = tempfile::tempdir().expect("a folder");
    // Also for an administrator, whom no permission stops, there is something in the way.
    fs::create_dir(lab.path().join(".fieldgap-index.sqlite")).expect("made");
    let mut permissions = fs::metadata(lab.path()).expect("there").permissions();
    std::os::unix::fs::PermissionsExt::set_mode(&mut permissions, 0o555);
    fs::set_permissions(lab.path(), permissions.clone()).expect("set");
    for expected in [4, 0] {
        let mut index = Index::open(lab.path(), Some(cache.path())).expect("an index");
        assert!(matches!(index.place(), Place::Cache(path) if path.starts_with(cache.path())));
        assert_eq!(index.update().expect("read").read, expected);
        assert_eq!(index.query(&everything()).expect("read").len(), 4);
    }
    let mut index = open(lab.path());
    assert_eq!(index.place(), &Place::Memory);
    assert_eq!(index.update().expect("read").read, 4);
    std::os::unix::fs::PermissionsExt::set_mode(&mut permissions, 0o755);
    fs::set_permissions(lab.path(), permissions).expect("set");
}

#[test]
fn a_record_alone_has_its_index_in_the_cache() {
    let lab = lab(1);
    let record = lab.path().join("week-000/scan-00000");
    let cache = tempfile::tempdir().expect("a folder");
    let mut index = Index::open(&record, Some(cache.path())).expect("an index");
    index.update().expect("read");
    let entries = index.query(&everything()).expect("read");
    assert_eq!((entries.len(), entries[0].folder.as_path()), (1, Path::new("")));
    assert!(!record.join(".fieldgap-index.sqlite").exists());
}

#[test]
fn records_in_records_hidden_folders_and_links_are_left_out() {
    let lab = lab(1);
    let record = lab.path().join("week-000/scan-00000");
    write_record(&record.join("corrected"), 1);
    write_record(&lab.path().join(".hidden/one"), 2);
    std::os::unix::fs::symlink(&record, lab.path().join("again")).expect("made");
    std::os::unix::fs::symlink(lab.path(), lab.path().join("loop")).expect("made");
    let mut index = open(lab.path());
    index.update().expect("read");
    let folders: Vec<PathBuf> =
        index.query(&everything()).expect("read").into_iter().map(|entry| entry.folder).collect();
    assert_eq!(folders, [PathBuf::from("week-000/scan-00000")]);
}

#[test]
fn a_folder_with_a_name_that_is_no_text_is_found() {
    use std::os::unix::ffi::OsStrExt;
    let lab = tempfile::tempdir().expect("a folder");
    let name = Path::new(std::ffi::OsStr::from_bytes(b"scan-\xff"));
    write_record(&lab.path().join(name), 0);
    age(lab.path());
    let mut index = open(lab.path());
    index.update().expect("read");
    assert_eq!(index.query(&everything()).expect("read")[0].folder, name);
    assert_eq!(index.update().expect("read").read, 0);
}

#[test]
fn figures_of_early_reports_are_taken_without_their_errors() {
    let lab = lab(1);
    let record = lab.path().join("week-000/scan-00000");
    let _ = fs::remove_file(record.join("report/figures.json"));
    let json = "[{\"scan_name\":\"n\",\"reading_unit\":\"V\",\"simulator\":\"corrected\",\"points\":9,\
        \"noise\":{\"additive\":0.3,\"multiplicative\":0.04,\"source\":\"repeats\"},\"registration\":{\"gain\":{\"value\":2.0,\
        \"standard_error\":0.1,\"estimated\":true}},\"planes\":[{\"focus\":0,\"z_m\":0.1,\"map\":{\"scan\":[1,null]},\
        \"discrepancy\":{\"peak_ratio\":{\"value\":1.1,\"standard_error\":null},\"peak_distance_m\":{\"value\":null,\
        \"standard_error\":null},\"focal_radius_m\":null},\"agreement\":{\"correlation\":0.9,\"residual_rms_ratio\":0.2}}],\
        \"overall\":{\"correlation\":0.95,\"residual_rms_ratio\":0.25,\"scan_rms\":10.0}}]";
    fs::create_dir_all(record.join("report")).expect("made");
    fs::write(record.join("report/comparison.json"), json).expect("written");
    let mut index = open(lab.path());
    index.update().expect("read");
    let entry = index.query(&everything()).expect("read").remove(0);
    let gap = entry.gap.expect("compared");
    assert!(gap.value == 0.25 && gap.standard_error.is_nan(), "{gap:?}");
    assert_eq!((entry.points, entry.heights_mm.as_slice()), (Some(9), &[100.0][..]));
    // 0.3/10 and 4 %, added in power.
    assert!((entry.noise_floor.expect("known") - 0.05).abs() < 1e-12);
    assert!(entry.figures.contains_key("z100.focus0.peak_ratio"));
    assert!(!entry.figures.contains_key("z100.focus0.peak_offset_mm"));
}

#[test]
fn processes_at_once_do_not_disturb_each_other() {
    let lab = lab(300);
    let root = lab.path();
    let path = root.join(".fieldgap-index.sqlite");
    let fresh = anew(root);
    for damage in [false, true] {
        match damage {
            true => fs::write(&path, b"no index".repeat(1000)).expect("written"),
            false => fs::remove_file(&path).expect("removed"),
        }
        std::thread::scope(|threads| {
            let work = || {
                let mut index = open(root);
                index.update().expect("read");
                contents(&mut index)
            };
            let all: Vec<_> = (0..4).map(|_| threads.spawn(work)).collect();
            for thread in all {
                assert_eq!(thread.join().expect("no panic"), fresh);
            }
        });
    }
}

#[test]
fn the_table_is_as_people_see_it() {
    let lab = lab(8);
    let record = |number: u64| lab.path().join(format!("week-000/scan-{number:05}"));
    fs::write(record(2).join("scan.toml"), "format = 1\nname = 7\n").expect("written");
    let mut index = open(lab.path());
    index.update().expect("read");
    let speed: SeriesName = "sound-speed.c_m_s".parse().expect("a name");
    let query = Query { figures: Wanted::Named(vec![speed.clone()]), ..Query::default() };
    let entries = index.query(&query).expect("read");
    for columns in [&[][..], &[speed]] {
        let text = to_text(&entries, columns);
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        insta::assert_snapshot!(format!("table_with_{}_figures", columns.len()), text);
    }
}

/// Whether a record is asked for, without the index.
fn matches(filter: &Filter, entry: &Entry) -> bool {
    let holds = |part: &Option<String>, whole: &str| {
        part.as_ref().is_none_or(|part| whole.to_lowercase().contains(&part.to_lowercase()))
    };
    let near = |[x, y, z]: [f64; 3]| {
        entry.foci_mm.iter().flatten().any(|[a, b, c]| {
            ((a - x).powi(2) + (b - y).powi(2) + (c - z).powi(2)).sqrt() <= SAME_FOCUS_MM
        })
    };
    filter.rig.as_ref().is_none_or(|rig| {
        entry.rig.as_ref().is_some_and(|known| known.to_lowercase() == rig.to_lowercase())
    }) && holds(&filter.name, entry.name.as_deref().unwrap_or(""))
        && filter.since.is_none_or(|since| entry.recorded.is_some_and(|at| at >= since))
        && filter.before.is_none_or(|before| entry.recorded.is_some_and(|at| at < before))
        && filter.focus_mm.is_none_or(near)
        && filter.verdict.is_none_or(|verdict| entry.verdict == Some(verdict))
        && filter.effect.is_none_or(|effect| entry.effects.contains(&effect))
        && filter.gap_above.is_none_or(|above| entry.gap.is_some_and(|gap| gap.value > above))
        && filter.gap_below.is_none_or(|below| entry.gap.is_some_and(|gap| gap.value < below))
        && filter
            .noted
            .as_ref()
            .is_none_or(|_| entry.notes.iter().any(|note| holds(&filter.noted, note.text())))
}

fn filters() -> impl Strategy<Value = Filter> {
    let start = "2026-01-01T00:00:00Z".parse::<Timestamp>().expect("a time").as_second();
    let time = move || {
        prop::option::weighted(0.3, 0i64..15 * 86_400)
            .prop_map(move |s| s.map(|s| Timestamp::from_second(start + s).expect("a time")))
    };
    let words = |all: &'static [&'static str]| {
        prop::option::weighted(0.3, prop::sample::select(all).prop_map(str::to_owned))
    };
    let conditions = (
        words(&["bench A", "BENCH b", "bench", "none"]),
        words(&["daily", "DAILY 1", "7", "absent", "%"]),
        time(),
        time(),
        prop::option::weighted(
            0.3,
            (-1.0..19.0f64, -1.0..1.0f64, 99.2..101.5f64).prop_map(|(x, y, z)| [x, y, z]),
        ),
    );
    let figures = (
        prop::option::weighted(0.3, prop::sample::select(&Verdict::ALL[..])),
        prop::option::weighted(
            0.3,
            prop::sample::select(&[EffectId::SoundSpeed, EffectId::Lag, EffectId::Pitch][..]),
        ),
        prop::option::weighted(0.3, 0.0..0.3f64),
        prop::option::weighted(0.3, 0.0..0.3f64),
        words(&["preamplifier", "CALIBRATED", "left", "nothing of this"]),
    );
    (conditions, figures).prop_map(
        |((rig, name, since, before, focus_mm), (verdict, effect, gap_above, gap_below, noted))| {
            Filter {
                rig,
                name,
                since,
                before,
                focus_mm,
                verdict,
                effect,
                gap_above,
                gap_below,
                noted,
            }
        },
    )
}

#[test]
fn filters_find_what_a_look_at_each_record_finds() {
    let lab = lab(120);
    let mut index = open(lab.path());
    index.update().expect("read");
    let all = index.query(&everything()).expect("read");
    let index = std::cell::RefCell::new(index);
    let sorts = [Sort::Recorded, Sort::Name, Sort::Rig, Sort::Gap, Sort::Correlation, Sort::Points];
    let cases = (filters(), prop::sample::select(sorts.to_vec()), prop::option::of(0usize..30));
    let mut runner = proptest::test_runner::TestRunner::default();
    let found = std::cell::Cell::new(0);
    runner
        .run(&cases, |(filter, sort, limit)| {
            let query =
                Query { filter: filter.clone(), sort: sort.clone(), limit, figures: Wanted::All };
            let listed = index.borrow_mut().query(&query).expect("read");
            let mut expected: Vec<&Entry> =
                all.iter().filter(|entry| matches(&filter, entry)).collect();
            let gap = |entry: &Entry| entry.gap.map_or(f64::NEG_INFINITY, |gap| gap.value);
            let r = |entry: &Entry| entry.correlation.map_or(f64::NEG_INFINITY, |r| r.value);
            expected.sort_by(|a, b| {
                let by = match sort {
                    Sort::Recorded => a.recorded.cmp(&b.recorded),
                    Sort::Name => a.name.cmp(&b.name),
                    Sort::Rig => a.rig.cmp(&b.rig),
                    Sort::Gap => gap(a).total_cmp(&gap(b)),
                    Sort::Correlation => r(a).total_cmp(&r(b)),
                    _ => a.points.cmp(&b.points),
                };
                by.then_with(|| a.folder.cmp(&b.folder))
            });
            let from = expected.len().saturating_sub(limit.unwrap_or(usize::MAX));
            let expected: Vec<&Entry> = expected.split_off(from);
            let text = |entries: Vec<&Entry>| serde_json::to_string(&entries).expect("JSON");
            found.set(found.get() + usize::from(!expected.is_empty()));
            prop_assert_eq!(text(listed.iter().collect()), text(expected));
            Ok(())
        })
        .expect("the same");
    // Most filters find nothing, as they have several conditions.
    assert!(found.get() > 50, "only {} filters found anything", found.get());
}
