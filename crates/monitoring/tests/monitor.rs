//! The monitor as a whole: replay, acknowledgements, what is said, and what is kept on disk.

use fieldgap_monitoring::{
    Acknowledgement, Baseline, ChartKind, Environment, Expect, Judgement, Monitor, Note, Run,
    Scope, Settings, Sides, Slope, Tolerance,
};
use fieldgap_text::Uncertain;
use jiff::Timestamp;
use proptest::prelude::*;

const NOISE: [f64; 11] = [0.3, -0.8, 1.1, -0.4, -1.2, 0.7, 0.2, -0.1, 0.9, -0.6, 0.05];

fn at(number: usize) -> Timestamp {
    Timestamp::from_second(1_795_000_000 + 3600 * number as i64).expect("in range")
}

/// Two cells in turn; the gap of both is larger by `change`.
fn run(number: usize, change: f64) -> Run {
    let value = 0.18 + 0.001 * NOISE[number % NOISE.len()] + change;
    Run {
        cell: ["near", "far"][number % 2].to_owned(),
        at: at(number),
        temperature_c: None,
        figures: [("gap".to_owned(), Uncertain { value, standard_error: 0.001 })].into(),
    }
}

fn runs(numbers: std::ops::Range<usize>, change: f64) -> Vec<Run> {
    numbers.map(|number| run(number, change)).collect()
}

fn baseline() -> Baseline {
    Baseline::of_runs(&runs(0..10, 0.0), Environment::default()).expect("figures")
}

fn replayed(runs: &[Run], acknowledgements: &[Acknowledgement]) -> (Monitor, Vec<Judgement>) {
    Monitor::replay(Settings::default(), &baseline(), runs, acknowledgements)
}

fn alarms(judgements: &[Judgement]) -> usize {
    judgements.iter().filter(|judgement| !judgement.alarms.is_empty()).count()
}

#[test]
fn an_alarm_says_what_changed_since_when_and_by_how_much() {
    let mut all = runs(10..16, 0.0);
    all.extend(runs(16..19, 0.018));
    let (_, judged) = replayed(&all, &[]);
    assert_eq!(alarms(&judged[..6]), 0);
    let alarm = judged[8].alarms.iter().find(|alarm| alarm.scope == Scope::AllCells);
    let alarm = alarm.expect("an alarm");
    assert_eq!((alarm.since, alarm.runs), (at(16), 3));
    assert_eq!(alarm.cells, ["far", "near"]);
    let relative = alarm.relative.expect("well above zero");
    assert!((relative.value - 0.1).abs() < 3.0 * relative.standard_error, "{relative:?}");
    let words = alarm.to_string();
    assert!(words.starts_with("The gap of all cells grew by "), "{words}");
    assert!(words.contains("% of its size since 2026-11-19 03:06 UTC (3 runs)"), "{words}");
    assert!(words.ends_with("at most one false alarm in 1,000 runs"), "{words}");
    assert_eq!(judged[8].notes, [Note::NoTemperature]);
}

#[test]
fn improvements_of_the_gap_raise_no_alarm_unless_asked_for() {
    let better = runs(10..20, -0.02);
    assert_eq!(alarms(&replayed(&better, &[]).1), 0);
    let settings = Settings::default().with_sides("gap", Sides::Both);
    let (_, judged) = Monitor::replay(settings, &baseline(), &better, &[]);
    let alarm = judged.iter().flat_map(|judgement| &judgement.alarms).next().expect("an alarm");
    assert!(alarm.to_string().contains(" shrank by "), "{alarm}");
}

#[test]
fn after_a_repair_figures_are_expected_as_before() {
    let mut all = runs(10..16, 0.0);
    all.extend(runs(16..22, 0.018));
    all.extend(runs(22..30, 0.0));
    let repaired = |expect| Acknowledgement { at: at(22), figure: None, cell: None, expect };
    assert_eq!(alarms(&replayed(&all, &[repaired(Expect::AsBefore)]).1[12..]), 0);
    // Without a repair the new size is the baseline, and the old one would be a fall.
    let mut stays = runs(10..16, 0.0);
    stays.extend(runs(16..40, 0.018));
    assert!(alarms(&replayed(&stays, &[]).1[12..]) > 10);
    assert!(alarms(&replayed(&stays, &[repaired(Expect::AsBefore)]).1[12..]) > 10);
    let (monitor, judged) = replayed(&stays, &[repaired(Expect::Anew)]);
    assert_eq!(alarms(&judged[12..]), 0);
    let mut grows_again = monitor;
    let later: Vec<_> = runs(40..46, 0.036).iter().map(|run| grows_again.judge(run)).collect();
    assert!(alarms(&later) > 0, "the new baseline is watched too");
}

#[test]
fn a_tolerated_change_raises_no_alarm() {
    let all = runs(10..30, 0.0072);
    assert!(alarms(&replayed(&all, &[]).1) > 0);
    let settings =
        Settings::default().with_tolerance("gap", Tolerance::Percent(5.0)).expect("from zero on");
    assert_eq!(alarms(&Monitor::replay(settings, &baseline(), &all, &[]).1), 0);
}

#[test]
fn one_round_as_baseline_is_enough_to_begin() {
    let first = Baseline::of_runs(&runs(0..2, 0.0), Environment::default()).expect("figures");
    assert!(first.scatter_in_words("gap").contains("unknown from this baseline"));
    assert_eq!(first.cells(), ["far", "near"]);
    let mut monitor = Monitor::new(Settings::default(), &first);
    let judged: Vec<_> = runs(2..12, 0.0).iter().map(|run| monitor.judge(run)).collect();
    assert!(judged[0].notes.contains(&Note::ScatterUnknown { figure: "gap".to_owned() }));
    assert!(judged[0].charts.iter().all(|point| point.z.is_none()));
    assert!(judged[9].charts.iter().all(|point| point.z.is_some()));
}

#[test]
fn what_cannot_be_judged_is_said() {
    let mut monitor = Monitor::new(Settings::default(), &baseline());
    let mut odd = run(10, 0.0);
    let nan = Uncertain { value: f64::NAN, standard_error: 0.1 };
    odd.figures.insert("level".to_owned(), nan);
    odd.figures.insert("gap".to_owned(), nan);
    let notes = monitor.judge(&odd).notes;
    assert!(notes.contains(&Note::NotInBaseline { figure: "level".to_owned() }), "{notes:?}");
    assert!(notes.contains(&Note::NotANumber { figure: "gap".to_owned() }), "{notes:?}");
    let mut new_cell = run(11, 0.0);
    new_cell.cell = "beside".to_owned();
    let notes = monitor.judge(&new_cell).notes;
    assert!(notes.contains(&Note::Learning { figure: "gap".to_owned(), runs: 1 }), "{notes:?}");
}

/// A slope that a simulation predicts corrects from the first run on, and its error is added.
#[test]
fn a_predicted_slope_corrects_at_once() {
    let per_k = Uncertain { value: 0.01, standard_error: 0.0005 };
    let environment = Environment::default().with_figure("gap", Slope::Predicted(per_k));
    let warm = |number: usize, temperature_c: f64| {
        let mut warm = run(number, 0.01 * (temperature_c - 22.0));
        warm.temperature_c = Some(Uncertain { value: temperature_c, standard_error: 0.01 });
        warm
    };
    let first: Vec<Run> = (0..10).map(|number| warm(number, 22.0)).collect();
    let baseline = Baseline::of_runs(&first, environment).expect("figures");
    let mut monitor = Monitor::new(Settings::default(), &baseline);
    let judged = monitor.judge(&warm(10, 24.0));
    assert!(judged.alarms.is_empty() && judged.notes.is_empty());
    let point = &judged.charts[0];
    assert!((point.value.value - 0.18).abs() < 0.003, "{:?}", point.value);
    // 2 K at 0.0005 for each kelvin, beside the run's own error.
    assert!(point.value.standard_error > 0.001, "{:?}", point.value);
    assert!(point.z.expect("judged").abs() < 2.0);
}

#[test]
fn baselines_monitors_and_judgements_are_kept_without_loss() {
    let baseline = baseline();
    let text = toml::to_string(&baseline).expect("written");
    assert_eq!(toml::from_str::<Baseline>(&text).expect("read"), baseline);
    let (mut monitor, judged) = replayed(&runs(10..20, 0.01), &[]);
    let text = toml::to_string(&monitor).expect("written");
    let mut read: Monitor = toml::from_str(&text).expect("read");
    assert_eq!(read, monitor);
    assert_eq!(read.judge(&run(20, 0.01)), monitor.judge(&run(20, 0.01)));
    for judgement in judged {
        let text = toml::to_string(&judgement).expect("written");
        assert_eq!(toml::from_str::<Judgement>(&text).expect("read"), judgement);
    }
    // JSON has no number for an error that is not stated.
    let mut unstated = run(0, 0.0);
    unstated.figures.insert("gap".to_owned(), Uncertain { value: 1.0, standard_error: f64::NAN });
    let text = serde_json::to_string(&unstated).expect("written");
    let read: Run = serde_json::from_str(&text).expect("read");
    assert!(text.contains("null") && read.figures["gap"].standard_error.is_nan());
}

#[test]
fn settings_refuse_what_limits_are_not_made_for() {
    for (text, said) in [
        ("arl_runs = 3", "`arl_runs` is 3"),
        ("lambda = 1.5", "`lambda` is 1.5"),
        ("chart = \"cusum\"\nk = 9", "`k` is 9"),
        ("k = 0.5", "does not belong to a chart of the kind \"ewma\""),
        ("chart = \"cusum\"\nlambda = 0.2", "does not belong to a chart of the kind \"cusum\""),
        ("[tolerances]\nlevel = { percent = -1.0 }", "the tolerance of level is -1"),
        ("limit = 3", "unknown field `limit`"),
        ("arl_runs = nan", "`arl_runs` is NaN"),
    ] {
        let error = toml::from_str::<Settings>(text).expect_err(text).to_string();
        assert!(error.contains(said), "{error}");
    }
    let settings: Settings = toml::from_str("").expect("all have defaults");
    assert_eq!(settings, Settings::default());
    let cusum = Settings::new(500.0, ChartKind::Cusum { k: 0.7 }).expect("in range");
    let cusum = cusum.with_sides("level", Sides::Falls);
    let text = toml::to_string(&cusum).expect("written");
    assert_eq!(toml::from_str::<Settings>(&text).expect("read"), cusum);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Judging run after run, or all at once in any order, gives the same.
    #[test]
    fn a_replay_gives_the_same_in_any_order(
        changes in prop::collection::vec(-0.02..0.02f64, 1..40), turn in 0usize..40, expect in 0usize..3,
    ) {
        let all: Vec<Run> = changes.iter().enumerate().map(|(n, change)| run(10 + n, *change)).collect();
        let expect = [Expect::AsBefore, Expect::Unchanged, Expect::Anew][expect];
        let one = Acknowledgement { at: at(10 + changes.len() / 2), figure: None, cell: Some("near".to_owned()), expect };
        let (monitor, judged) = replayed(&all, std::slice::from_ref(&one));
        let mut turned = all.clone();
        turned.rotate_left(turn % all.len());
        let (again, judged_again) = replayed(&turned, std::slice::from_ref(&one));
        prop_assert_eq!(&monitor, &again);
        prop_assert_eq!(&judged, &judged_again);
        let mut step = Monitor::new(Settings::default(), &baseline());
        for (run, judgement) in all.iter().zip(&judged) {
            if run.at == one.at {
                step.acknowledge(&one);
            }
            prop_assert_eq!(&step.judge(run), judgement);
        }
        prop_assert_eq!(step, monitor);
    }
}

/// The gap of one cell rises and that of the other falls, by factors of its scatter.
fn opposed(near: f64, far: f64) -> Vec<Run> {
    let changed = |number: usize| run(number, 0.001 * [near, far][number % 2]);
    runs(10..16, 0.0).into_iter().chain((16..22).map(changed)).collect()
}

#[test]
fn changes_that_differ_in_sign_from_cell_to_cell_raise_an_alarm() {
    let scopes = |runs: &[Run]| -> Vec<Scope> {
        let (_, judged) = replayed(runs, &[]);
        judged.into_iter().flat_map(|one| one.alarms).map(|alarm| alarm.scope).collect()
    };
    // Each by itself is too small for the chart of its cell, and they cancel on the chart of all.
    let found = scopes(&opposed(5.0, -4.5));
    assert!(found.contains(&Scope::CellByCell) && !found.contains(&Scope::AllCells), "{found:?}");
    let (_, judged) = replayed(&opposed(5.0, -4.5), &[]);
    let alarm = judged.iter().flat_map(|one| &one.alarms).next().expect("an alarm");
    let words = alarm.to_string();
    assert!(
        words.starts_with(
            "The gap of single cells changed, more in some than in others since 2026-11-19"
        ),
        "{words}"
    );
    // A gap that falls more than it rises is an improvement.
    assert_eq!(scopes(&opposed(1.0, -6.0)), [], "more fall than rise");
    assert_eq!(scopes(&opposed(-6.0, -6.0)), [], "all fall");
}
