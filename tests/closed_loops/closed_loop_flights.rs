//! A rig that chooses its own readings, in motion too: a lag and play are told apart, and a row that was cut short is flown again.

use std::path::Path;

use crate::dead_element_rig::{bench, copy, said};
use crate::program::fieldgap;
use fieldgap::closed_loop::{End, Purpose, Round, read_rounds};
use fieldgap::diagnosis::{EffectId, FittedParameter, diagnose};
use fieldgap::records::{Plan, RecordedScan, VisitPace};

const PLAN: &str = "name = \"loop\"\nrig = \"rig.toml\"\n[simulator]\nmodel = \"piston\"\n\
                    [[focus]]\nx_mm = 10.0\ny_mm = -5.0\nz_mm = 100.0\n\
                    [closed_loop]\nmin_mm = [-30.0, -30.0, 80.0]\nmax_mm = [30.0, 30.0, 140.0]\n\
                    first_readings = 160\nround_readings = 64\nsmallest_gap_sigma = 0.25\n[closed_loop.verify]\nreadings = 32\n";
const FLY: &str = "[fly]\nspeed_mm_s = 180.0\nlag_ms = 0.0\n";
const LAG: &str = "[effects.lag]\ns = 0.025\n";

/// A folder with a rig whose truth has these effects in place of the dead element.
fn bench_with(plan: &str, effects: &str) -> tempfile::TempDir {
    let folder = bench(plan);
    let path = folder.path().join("truth.toml");
    let truth = std::fs::read_to_string(&path).expect("there");
    let (rest, _dead) = truth.split_once("[effects.").expect("it has an effect");
    std::fs::write(path, format!("{rest}{effects}")).expect("written");
    folder
}

/// Runs a plan in a folder; its rounds.
fn run(folder: &Path) -> Vec<Round> {
    let run = fieldgap(folder, &["run", "plan.toml", "--out", "record"]);
    assert!(run.status.success(), "{}", said(&run));
    read_rounds(&folder.join("record")).expect("rounds")
}

/// Speeds of the readings of a record's plan, mm/s; zero at rest.
fn speeds_mm_s(record: &Path) -> Vec<f64> {
    let plan = Plan::read(&record.join("plan.toml")).expect("a plan");
    let speed = |pace| match pace {
        VisitPace::Flown(speed) => speed.get(),
        _ => 0.0,
    };
    plan.visits().iter().map(|visit| speed(visit.pace)).collect()
}

/// A parameter of the named cause, with its standard error.
fn found(record: &Path, cause: EffectId, parameter: &str) -> [f64; 2] {
    let record = RecordedScan::open(record).expect("a record");
    let diagnosis = diagnose(&[record], None).expect("comparable");
    let named = diagnosis.ranked.iter().find(|candidate| candidate.effects == [cause]);
    match named.expect("it is ranked").parameters[parameter] {
        FittedParameter::Real { value, standard_error } => [value, standard_error],
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn a_lag_is_found_in_flight_and_proved_there_and_a_row_that_was_cut_short_is_flown_again() {
    let folder = bench_with(&format!("{PLAN}{FLY}"), LAG);
    let rounds = run(folder.path());
    let record = folder.path().join("record");
    let last = rounds.last().expect("several");
    assert_eq!(last.end, Some(End::Verified), "{}", last.reason);
    assert_eq!(last.named, [[EffectId::Lag]]);
    let [lag_s, error_s] = found(&record, EffectId::Lag, "lag.s");
    assert!(error_s < 2e-4 && (lag_s - 0.025).abs() < 4.0 * error_s, "{lag_s} ± {error_s}");
    // Each round is flown at both speeds or at the one that tells more, and fresh readings at both.
    let speeds = speeds_mm_s(&record);
    for round in rounds.iter().filter(|round| round.readings > 0) {
        let of_round = &speeds[round.before..round.before + round.readings];
        let flown = of_round.iter().filter(|mm_s| **mm_s > 0.0).count();
        assert!((round.readings / 8..=round.readings * 2 / 3).contains(&flown), "{flown}");
        let at = |speed: f64| of_round.contains(&speed);
        assert!(round.purpose == Purpose::Explore || (at(180.0) && at(60.0)));
    }
    let page = std::fs::read_to_string(record.join("report/rounds/index.html")).expect("a page");
    assert!(page.contains(">flown</th>") && page.contains("Diamonds: read in motion."));
    let replayed = fieldgap(folder.path(), &["replay", "record", "--rounds"]);
    assert!(replayed.status.success(), "{}", said(&replayed));
    assert_eq!(said(&replayed).matches("the same").count(), rounds.len());

    // As if it had been killed within a row of the second round.
    let killed = folder.path().join("killed");
    copy(&record, &killed);
    let row = (rounds[1].before..speeds.len()).find(|&n| speeds[n] > 0.0).expect("a row");
    let kept = row + 6;
    for file in ["samples.csv", "journal.csv"] {
        let text = std::fs::read_to_string(killed.join(file)).expect("there");
        let lines: String = text.split_inclusive('\n').take(1 + kept).collect();
        std::fs::write(killed.join(file), lines).expect("written");
    }
    std::fs::write(killed.join("state.toml"), "state = \"scanning\"\n").expect("written");
    let resumed = fieldgap(folder.path(), &["resume", "killed"]);
    assert!(resumed.status.success(), "{}", said(&resumed));
    let after = read_rounds(&killed).expect("rounds");
    assert_eq!(after[..2], rounds[..2]);
    assert_eq!(after.last().and_then(|round| round.end), Some(End::Verified));
    let samples = RecordedScan::open(&killed).expect("a record").samples;
    let before = RecordedScan::open(&record).expect("a record").samples;
    assert_eq!(samples[..kept], before[..kept]);
    let step_s = |n: usize| samples[n + 1].time_s - samples[n].time_s;
    assert!((step_s(row + 6) - step_s(row)).abs() < 1e-3, "{} {}", step_s(row + 6), step_s(row));
}

#[test]
fn without_flights_a_lag_does_not_show() {
    let plan = PLAN.replace("first_readings", "readings = 230\nfirst_readings");
    let folder = bench_with(&plan, LAG);
    let rounds = run(folder.path());
    assert!(rounds.iter().all(|round| round.named.iter().all(Vec::is_empty)));
    let plan = std::fs::read_to_string(folder.path().join("record/plan.toml")).expect("there");
    assert!(!plan.contains("speed_mm_s"));
}

#[test]
fn play_is_told_from_a_lag() {
    let folder = bench_with(&format!("{PLAN}{FLY}"), "[effects.backlash]\nmm = 0.6\n");
    let rounds = run(folder.path());
    let last = rounds.last().expect("several");
    assert_eq!(last.end, Some(End::Verified), "{}", last.reason);
    assert_eq!(last.named, [[EffectId::Backlash]]);
    let record = folder.path().join("record");
    let [play_mm, error_mm] = found(&record, EffectId::Backlash, "backlash.mm");
    assert!(error_mm < 0.03 && (play_mm - 0.6).abs() < 4.0 * error_mm, "{play_mm} ± {error_mm}");
}

#[test]
fn a_speed_that_the_receiver_is_too_slow_for_is_refused_before_anything_moves() {
    let folder = bench_with(&format!("{PLAN}{FLY}"), LAG);
    let path = folder.path().join("rig.toml");
    let rig = std::fs::read_to_string(&path).expect("there");
    assert!(rig.contains("rate_hz = 1000.0"));
    std::fs::write(path, rig.replace("rate_hz = 1000.0", "rate_hz = 200.0")).expect("written");
    let run = fieldgap(folder.path(), &["run", "plan.toml", "--out", "record"]);
    assert!(!run.status.success());
    assert!(said(&run).contains("180 mm/s"), "{}", said(&run));
    let record = RecordedScan::open(&folder.path().join("record"));
    assert!(record.is_err() || record.is_ok_and(|record| record.samples.is_empty()));
}
