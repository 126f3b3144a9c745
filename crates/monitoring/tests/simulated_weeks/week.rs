//! A week of runs: a day of baseline, days without a change, and a growth of the gap.

use fieldgap_monitoring::{
    Acknowledgement, Baseline, Environment, Expect, Monitor, Run, Settings, Tolerance,
};

use crate::laboratory::{CELLS, Cause, LEVEL_WITHIN, Laboratory, ROUNDS_A_DAY, Unmodelled};

const A_DAY: usize = CELLS * ROUNDS_A_DAY;
pub const A_WEEK: usize = 7 * A_DAY;

/// Runs after the change that are looked at.
const LOOKED_AT: usize = 3 * CELLS;

/// The growth to be found.
const GROWTH: f64 = 0.05;

/// Before the change, in shares that are scaled to the size of the gap.
const SHARES: Unmodelled = Unmodelled { gain: 0.15, phase_rad: 0.2, reflection: 0.03 };

pub fn settings() -> Settings {
    // The level may drift within ±1 % of where it began: two runs differ by up to twice that.
    let tolerance = Tolerance::Percent(200.0 * LEVEL_WITHIN);
    Settings::default().with_tolerance("level", tolerance).expect("from zero on")
}

/// A laboratory with a mean gap of 15 to 20 %.
fn laboratory(seed: u64, side: usize) -> (Laboratory, Unmodelled) {
    let mut laboratory = Laboratory::new(seed, side);
    let wanted = laboratory.draw_between(0.15, 0.20);
    let by = bisected(0.1, 4.0, 7, |by| laboratory.mean_gap(SHARES.scaled(by)) < wanted);
    (laboratory, SHARES.scaled(by))
}

/// Where `below` ends, by so many halvings of the range.
fn bisected(mut low: f64, mut high: f64, halvings: u32, below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// A monitor after a day of baseline.
fn after_a_day(laboratory: &mut Laboratory, unmodelled: Unmodelled) -> Monitor {
    let day: Vec<Run> = (0..A_DAY).map(|number| laboratory.run(number, unmodelled)).collect();
    let baseline = Baseline::of_runs(&day, Environment::default()).expect("figures");
    Monitor::new(settings(), &baseline)
}

/// What somebody in the laboratory does after a false alarm.
fn acknowledged(monitor: &mut Monitor, run: &Run) {
    monitor.acknowledge(&Acknowledgement {
        at: run.at,
        figure: None,
        cell: None,
        expect: Expect::Unchanged,
    });
}

/// A week without a change: which figures raised alarms, run by run.
pub fn quiet_week(seed: u64, side: usize) -> Vec<Vec<String>> {
    let (mut laboratory, unmodelled) = laboratory(seed, side);
    let mut monitor = after_a_day(&mut laboratory, unmodelled);
    let judged = |number| {
        let run = laboratory.run(number, unmodelled);
        let alarms = monitor.judge(&run).alarms;
        if !alarms.is_empty() {
            acknowledged(&mut monitor, &run);
        }
        alarms.into_iter().map(|alarm| alarm.to_string()).collect()
    };
    (A_DAY..A_WEEK).map(judged).collect()
}

/// A week with a change: number of runs from the change on until the chart of the gap raised an alarm; `None` if it did not in three
/// rounds.
pub fn changed_week(seed: u64, side: usize) -> Option<usize> {
    let (mut laboratory, unmodelled) = laboratory(seed, side);
    let mut monitor = after_a_day(&mut laboratory, unmodelled);
    let change = A_DAY + laboratory.draw_below(2 * A_DAY);
    let cause = [Cause::Gain, Cause::Phase, Cause::Reflection][laboratory.draw_below(3)];
    let grown = (1.0 + GROWTH) * laboratory.mean_gap(unmodelled);
    let by = bisected(1.0, 3.0, 10, |by| laboratory.mean_gap(unmodelled.with(cause, by)) < grown);
    for number in A_DAY..change {
        let run = laboratory.run(number, unmodelled);
        if !monitor.judge(&run).alarms.is_empty() {
            acknowledged(&mut monitor, &run);
        }
    }
    let changed = unmodelled.with(cause, by);
    (1..=LOOKED_AT).find(|delay| {
        let run = laboratory.run(change + delay - 1, changed);
        monitor.judge(&run).alarms.iter().any(|alarm| alarm.figure == "gap")
    })
}
