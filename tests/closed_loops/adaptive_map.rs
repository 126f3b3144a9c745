//! A rig that measures where its map is least certain: to the end, killed on the way, replayed; and the map of any record.

use std::path::Path;

use crate::dead_element_rig::{bench, copy, said};
use crate::program::fieldgap;
use fieldgap::adaptive_map::{MapEnd, MapRound};
use fieldgap::closed_loop::read_log;
use fieldgap::records::{Plan, RecordedScan};

const PLAN: &str = "name = \"field\"\nrig = \"rig.toml\"\n[simulator]\nmodel = \"piston\"\n\
                    [[focus]]\nx_mm = 10.0\ny_mm = -5.0\nz_mm = 100.0\n\
                    [adaptive]\nz_mm = [90.0, 120.0]\nsize_mm = [40.0, 40.0]\nstep_mm = 4.0\nerror = 0.004\n\
                    readings = 224\nfirst_readings = 96\nround_readings = 64\n";

/// Amplitudes and standard errors of a table.
fn table(path: &Path) -> Vec<[f64; 2]> {
    let text = std::fs::read_to_string(path).expect("a table");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("x_mm,y_mm,z_mm,focus,amplitude,standard_error"));
    let number = |cell: Option<&str>| cell.and_then(|cell| cell.parse().ok()).expect("a number");
    let row = |line: &str| {
        let mut cells = line.split(',').skip(4);
        [number(cells.next()), number(cells.next())]
    };
    lines.map(row).collect()
}

#[test]
fn a_map_is_measured_killed_resumed_and_replayed_alike() {
    let folder = bench(PLAN);
    let run = fieldgap(folder.path(), &["scan", "plan.toml", "--out", "whole"]);
    let words = said(&run);
    assert!(run.status.success(), "{words}");
    assert!(words.contains("map of 242 places from ") && words.contains("standard error: "));
    assert!(words.contains("the stated error of 0.4 % of the peak at 95 % is "), "{words}");
    let whole = folder.path().join("whole");
    let rounds: Vec<MapRound> = read_log(&whole).expect("rounds");
    let last = rounds.last().expect("several");
    let ended = matches!(last.end, Some(MapEnd::Met | MapEnd::Readings | MapEnd::NoGain));
    assert!(ended && last.searched && rounds.len() >= 3, "{last:?}");
    assert!(rounds[1].foretold.len() == rounds[1].readings && rounds[2].checks.is_some());
    let errors = |round: &MapRound| round.rms_error.expect("estimated");
    assert!(errors(last) < errors(&rounds[1]), "{} {}", errors(last), errors(&rounds[1]));
    let map = table(&whole.join("map.csv"));
    assert_eq!(map.len(), 2 * 11 * 11);
    assert!(map.iter().all(|[amplitude, error]| *amplitude >= 0.0 && *error > 0.0));
    for height in ["90", "120"] {
        assert!(whole.join(format!("report/map/map-z{height}mm.png")).exists(), "{height}");
    }

    // The plan of the record names every reading, in the order in which it was taken.
    let visits = Plan::read(&whole.join("plan.toml")).expect("a plan").visits();
    let record = RecordedScan::open(&whole).expect("a record");
    assert_eq!(visits.len(), record.samples.len());
    assert!(visits.iter().zip(&record.samples).all(|(visit, sample)| visit.focus == sample.focus));

    let replayed = fieldgap(folder.path(), &["replay", "whole", "--rounds"]);
    assert!(replayed.status.success(), "{}", said(&replayed));
    assert_eq!(said(&replayed).matches("the same").count(), rounds.len());

    // As if it had been killed after the decision of a round, before the first of its readings: the decision is made again.
    let killed = folder.path().join("killed");
    copy(&whole, &killed);
    let kept = rounds[1].before;
    for file in ["samples.csv", "journal.csv"] {
        let text = std::fs::read_to_string(killed.join(file)).expect("there");
        let lines: String = text.split_inclusive('\n').take(1 + kept).collect();
        std::fs::write(killed.join(file), lines).expect("written");
    }
    let longer = std::fs::read_to_string(killed.join("plan.toml")).expect("there");
    let second = longer.match_indices("[[readings]]").nth(1).expect("several rounds").0;
    let comment = longer[..second].rfind("\n#").expect("its reason") + 1;
    std::fs::write(killed.join("plan.toml"), &longer[..comment]).expect("written");
    std::fs::write(killed.join("state.toml"), "state = \"scanning\"\n").expect("written");
    std::fs::remove_file(killed.join("map.csv")).expect("there");
    let resumed = fieldgap(folder.path(), &["resume", "killed"]);
    assert!(resumed.status.success(), "{}", said(&resumed));
    let after: Vec<MapRound> = read_log(&killed).expect("rounds");
    assert_eq!(after[..2], rounds[..2]);
    let again = Plan::read(&killed.join("plan.toml")).expect("a plan").visits();
    assert_eq!(again[..kept + rounds[1].readings], visits[..kept + rounds[1].readings]);
    assert_eq!(table(&killed.join("map.csv")).len(), map.len());
}

#[test]
fn a_map_is_made_of_any_record() {
    let folder = bench(PLAN);
    let plan = PLAN.split("[adaptive]").next().expect("its head").to_owned()
        + "[dark]\nbefore = 16\n[[plane]]\nz_mm = [90.0, 120.0]\nsize_mm = [30.0, 30.0]\nstep_mm = 3.0\n";
    std::fs::write(folder.path().join("planes.toml"), plan).expect("written");
    let scan = fieldgap(folder.path(), &["scan", "planes.toml", "--out", "planes"]);
    assert!(scan.status.success(), "{}", said(&scan));
    let made = fieldgap(folder.path(), &["map", "planes"]);
    let words = said(&made);
    assert!(made.status.success(), "{words}");
    assert!(words.contains("map of 512 places from 258 readings"), "{words}");
    assert!(words.contains("the simulation was corrected by: dead-elements"), "{words}");
    assert!(!words.contains("stated error"), "{words}");
    let of_simulation = table(&folder.path().join("planes/map.csv"));
    let process = [
        "map",
        "planes",
        "--prior",
        "process",
        "--z-mm",
        "100",
        "--step-mm",
        "5",
        "--out",
        "alone",
    ];
    let alone = fieldgap(folder.path(), &process);
    assert!(alone.status.success(), "{}", said(&alone));
    assert!(folder.path().join("alone/map-z100mm.png").exists());
    // Between the two heights a process of the amplitude knows next to nothing.
    let of_process = table(&folder.path().join("alone/map.csv"));
    assert_eq!(of_process.len(), 49);
    let rms = |rows: &[[f64; 2]]| {
        (rows.iter().map(|row| row[1] * row[1]).sum::<f64>() / rows.len() as f64).sqrt()
    };
    assert!(rms(&of_process) > 5.0 * rms(&of_simulation));
    for (arguments, what) in [
        (vec!["map", "planes", "--step-mm", "0.01"], "make --step-mm larger"),
        (vec!["map", "planes", "--step-mm", "-1"], "-1"),
        (vec!["map", "nowhere"], "nowhere"),
    ] {
        let refused = fieldgap(folder.path(), &arguments);
        assert!(!refused.status.success() && said(&refused).contains(what), "{}", said(&refused));
    }
}

#[test]
fn a_map_that_cannot_be_measured_is_refused_before_anything_moves() {
    let folder = bench(PLAN);
    let refused = |plan: String, more: &[&str], what: &str| {
        std::fs::write(folder.path().join("wrong.toml"), plan).expect("written");
        let arguments = [&["run", "wrong.toml", "--dry-run"], more].concat();
        let output = fieldgap(folder.path(), &arguments);
        assert!(!output.status.success() && said(&output).contains(what), "{}", said(&output));
    };
    refused(PLAN.replace("[90.0, 120.0]", "[900.0, 930.0]"), &[], "the robot reaches");
    refused(PLAN.replace("error = 0.004", "error = 4"), &[], "4");
    refused(PLAN.to_owned(), &["--until-explained"], "seeks no cause");
    let dry = fieldgap(folder.path(), &["run", "plan.toml", "--dry-run"]);
    assert!(dry.status.success(), "{}", said(&dry));
    assert!(said(&dry).contains("the rig chooses its readings, 224 at most"), "{}", said(&dry));
}
