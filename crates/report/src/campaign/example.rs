//! A campaign for tests: two foci in two rounds, with an alarm, a failed cell and one to come.

use std::collections::BTreeMap;

use jiff::Timestamp;

use fieldgap_campaign::{AlarmOverview, CellOverview, CellStatus, Dimension, GAP, Overview, Use};
use fieldgap_monitoring::{
    Alarm, Baseline, ChartPoint, Environment, Monitor, Run, Scope, Settings,
};
use fieldgap_text::Uncertain;

fn at(hours: i64) -> Timestamp {
    let begin: Timestamp = "2026-11-20T08:00:00Z".parse().expect("a time");
    Timestamp::from_second(begin.as_second() + 3600 * hours).expect("in range")
}

/// A done cell.
pub(crate) fn cell(round: u32, setting: &str) -> CellOverview {
    let exact = |value, standard_error| Uncertain { value, standard_error };
    CellOverview {
        id: format!("r{round:03}-{setting}"),
        round,
        repeat: 1,
        setting: setting.to_owned(),
        values: vec![usize::from(setting.contains("right"))],
        status: CellStatus::Done { problem: None, changed: false },
        run: Some(Run {
            cell: setting.to_owned(),
            at: at(24 * i64::from(round)),
            temperature_c: None,
            figures: [
                (GAP.to_owned(), exact(0.12 + 0.01 * f64::from(round), 0.001)),
                ("correlation".to_owned(), exact(0.991, 0.001)),
                ("level".to_owned(), exact(2.5, 0.01)),
            ]
            .into(),
        }),
        verdict: Some("explained".to_owned()),
        gap_change: Some(0.06),
        alarm: false,
    }
}

/// An alarm of the gap of `focus=left`.
pub(crate) fn alarm(open: bool) -> AlarmOverview {
    let alarm = Alarm {
        figure: GAP.to_owned(),
        scope: Scope::Cell("focus=left".to_owned()),
        cells: vec!["focus=left".to_owned()],
        at: at(48),
        new: true,
        since: at(48),
        runs: 1,
        change: Some(Uncertain { value: 0.0078, standard_error: 0.001 }),
        relative: Some(Uncertain { value: 0.06, standard_error: 0.008 }),
        statistic: 6.2,
        limit: 4.5,
        arl_runs: 1000.0,
    };
    AlarmOverview {
        cell: "r002-focus=left".to_owned(),
        sentence: alarm.to_string(),
        alarm,
        cause: Some("the speed of sound rose by 2 m/s".to_owned()),
        open,
    }
}

/// Charts of the gap that grows.
pub(crate) fn charts() -> BTreeMap<String, Vec<ChartPoint>> {
    let run = |number: i64| Run {
        cell: ["focus=left", "focus=right"][number as usize % 2].to_owned(),
        at: at(2 * number),
        temperature_c: None,
        figures: [GAP, "level", "z100.peak_ratio"]
            .map(|name| {
                let value = if number < 16 { 0.18 } else { 0.19 }
                    + 0.0003 * ((7 * number % 11) as f64 - 5.0);
                (name.to_owned(), Uncertain { value, standard_error: 0.001 })
            })
            .into(),
    };
    let first: Vec<Run> = (0..8).map(run).collect();
    let baseline = Baseline::of_runs(&first, Environment::default()).expect("figures");
    let later: Vec<Run> = (8..24).map(run).collect();
    let (_, judged) = Monitor::replay(Settings::default(), &baseline, &later, &[]);
    let mut charts: BTreeMap<String, Vec<ChartPoint>> = BTreeMap::new();
    for point in judged.into_iter().flat_map(|judgement| judgement.charts) {
        charts.entry(point.figure.clone()).or_default().push(point);
    }
    charts
}

/// The campaign.
pub(crate) fn overview() -> Overview {
    let mut cells = vec![
        cell(1, "focus=left"),
        cell(1, "focus=right"),
        cell(2, "focus=left"),
        cell(2, "focus=right"),
    ];
    cells[2].alarm = true;
    cells[3].status = CellStatus::Failed { reason: "the robot did not answer".to_owned() };
    (cells[3].run, cells[3].verdict, cells[3].gap_change) = (None, None, None);
    Overview {
        name: "two foci".to_owned(),
        folder: "out/two foci".into(),
        began: Some(at(0)),
        rounds: 3,
        rounds_begun: vec![at(24), at(48)],
        starts_left_out: 1,
        dimensions: vec![Dimension {
            name: "focus".to_owned(),
            values: vec!["left".to_owned(), "right".to_owned()],
        }],
        cells,
        alarms: vec![alarm(true)],
        charts: BTreeMap::new(),
        why_no_charts: Some("the first round is the baseline, and is not complete".to_owned()),
        rigs_left: [("bench-b".to_owned(), "3 cells in a row failed".to_owned())].into(),
        not_set: vec!["screen = in: the answer was no".to_owned()],
        question: None,
        used: Use { time_s: 5400.0, emitting_s: 1800.0, way_m: 12.3 },
        ended: true,
        ended_early: Some("the operator asked to stop".to_owned()),
    }
}
