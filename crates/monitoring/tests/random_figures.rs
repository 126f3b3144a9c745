//! Monitors on figures drawn at random: what limits promise, whatever the scatter beyond stated errors.

use fieldgap_monitoring::{
    Acknowledgement, Baseline, Environment, Expect, Monitor, Run, Scope, Settings, Slope,
};
use fieldgap_text::Uncertain;
use jiff::Timestamp;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const CELLS: usize = 12;
const FIGURES: [&str; 6] = ["gap", "correlation", "level", "x_mm", "y_mm", "radius_mm"];
const STATED: f64 = 0.001;

/// Runs of 12 cells. Scatter is `scatter` times the stated errors, and differs by as much as `between_cells` from cell to cell.
struct Draws {
    random: ChaCha8Rng,
    scatter: f64,
    between_cells: f64,
    swing_c: f64,
}

impl Draws {
    fn new(seed: u64) -> Self {
        let random = ChaCha8Rng::seed_from_u64(seed);
        Self { random, scatter: 2.0, between_cells: 0.0, swing_c: 0.0 }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    /// Figures share a part of their scatter; each has its own slope in temperature in each cell.
    fn run(&mut self, number: usize, change: f64) -> Run {
        let cell = number % CELLS;
        let common = self.normal();
        let warmer_k = self.swing_c * (number as f64 / 50.0).sin() + 0.1 * self.normal();
        let of_cell = 1.0 + self.between_cells * ((cell as f64 * 2.4).sin());
        let figure = |place: usize, own: f64| {
            let scatter = STATED * self.scatter * of_cell * (0.6 * common + 0.8 * own);
            let per_k = 0.003 * ((cell + place) as f64).cos();
            let value = 0.18 + 0.01 * cell as f64 + per_k * warmer_k + scatter + change;
            Uncertain { value, standard_error: STATED }
        };
        let owns: Vec<f64> =
            FIGURES.iter().map(|_| StandardNormal.sample(&mut self.random)).collect();
        let figures = FIGURES
            .iter()
            .enumerate()
            .map(|(place, name)| (name.to_string(), figure(place, owns[place])));
        Run {
            cell: format!("cell-{cell}"),
            at: Timestamp::from_second(1_795_000_000 + 1800 * number as i64).expect("in range"),
            temperature_c: (self.swing_c > 0.0)
                .then_some(Uncertain { value: 22.0 + warmer_k, standard_error: 0.01 }),
            figures: figures.collect(),
        }
    }
}

/// False alarms in weeks of runs without a change, and the number of judged runs.
fn false_alarms(
    weeks: u64,
    baseline_rounds: usize,
    draws: impl Fn(u64) -> Draws,
) -> (usize, usize) {
    let (mut alarms, mut runs) = (0, 0);
    for seed in 0..weeks {
        let mut draws = draws(seed);
        let first: Vec<Run> = (0..baseline_rounds * CELLS).map(|n| draws.run(n, 0.0)).collect();
        let baseline = Baseline::of_runs(&first, Environment::default()).expect("figures");
        let mut monitor = Monitor::new(Settings::default(), &baseline);
        for number in first.len()..first.len() + 24 * CELLS {
            let run = draws.run(number, 0.0);
            runs += 1;
            if !monitor.judge(&run).alarms.is_empty() {
                alarms += 1;
                monitor.acknowledge(&Acknowledgement {
                    at: run.at,
                    figure: None,
                    cell: None,
                    expect: Expect::Unchanged,
                });
            }
        }
    }
    (alarms, runs)
}

/// Stated errors half of the scatter, one run for each cell in the baseline: more than 10,000 runs, at most one alarm in 1,000.
#[test]
fn scatter_beyond_stated_errors_does_not_raise_alarms() {
    let (alarms, runs) = false_alarms(36, 1, Draws::new);
    assert!(runs > 10_000 && alarms * 1000 <= runs, "{alarms} in {runs}");
}

#[test]
fn cells_that_scatter_differently_do_not_raise_alarms() {
    let uneven = |seed| Draws { between_cells: 0.5, ..Draws::new(1000 + seed) };
    let (alarms, runs) = false_alarms(36, 4, uneven);
    assert!(runs > 10_000 && alarms * 1000 <= runs, "{alarms} in {runs}");
}

/// Slopes of up to three stated errors for each kelvin, and a swing of 2 °C either way.
#[test]
fn temperature_does_not_raise_alarms() {
    let swinging = |seed| Draws { swing_c: 2.0, ..Draws::new(2000 + seed) };
    let (alarms, runs) = false_alarms(36, 4, swinging);
    assert!(runs > 10_000 && alarms * 1000 <= runs, "{alarms} in {runs}");
}

/// The same without correction, so that the test above can fail: the slopes raise alarms.
#[test]
fn uncorrected_temperature_does_raise_alarms() {
    let mut draws = Draws { swing_c: 2.0, scatter: 0.3, ..Draws::new(7) };
    let first: Vec<Run> = (0..4 * CELLS).map(|n| draws.run(n, 0.0)).collect();
    let later: Vec<Run> = (4 * CELLS..20 * CELLS).map(|n| draws.run(n, 0.0)).collect();
    let alarms = |slope| {
        let baseline = Baseline::of_runs(&first, Environment::all(slope)).expect("figures");
        let (_, judged) = Monitor::replay(Settings::default(), &baseline, &later, &[]);
        judged.iter().filter(|judgement| !judgement.alarms.is_empty()).count()
    };
    assert!(alarms(Slope::Uncorrected) > 0);
    assert_eq!(alarms(Slope::Fitted), 0);
}

/// A rise of five standard deviations of all figures: found at once, at its time and with its size.
#[test]
fn a_change_is_found_with_its_time_and_size() {
    let (mut found, mut in_time, mut within) = (0, 0, 0);
    for seed in 0..40 {
        let mut draws = Draws::new(3000 + seed);
        let first: Vec<Run> = (0..4 * CELLS).map(|n| draws.run(n, 0.0)).collect();
        let change = 6 * CELLS + 5;
        let later: Vec<Run> = (4 * CELLS..change + 3)
            .map(|n| draws.run(n, if n < change { 0.0 } else { 0.01 }))
            .collect();
        let baseline = Baseline::of_runs(&first, Environment::default()).expect("figures");
        let (_, judged) = Monitor::replay(Settings::default(), &baseline, &later, &[]);
        let last = judged.last().expect("runs");
        let of_gap = |alarm: &&fieldgap_monitoring::Alarm| {
            alarm.figure == "gap" && alarm.scope == Scope::AllCells
        };
        if let Some(alarm) = last.alarms.iter().find(of_gap) {
            found += 1;
            in_time += usize::from(alarm.since == later[later.len() - 3].at);
            let change = alarm.change.expect("runs before");
            within += usize::from((change.value - 0.01).abs() < 2.0 * change.standard_error);
        }
    }
    assert!(found >= 38, "{found} of 40");
    // A run before the change that is high by chance is taken for changed too.
    assert!(in_time >= 30, "{in_time} of {found}");
    // Of 40, 38 are expected within two errors; fewer than 33 have a chance of 1 in 300.
    assert!(within >= 33, "{within} of {found}");
}

/// How often a change of all cells is found within three runs, and within a round of 12, against its size and the length of the baseline.
#[test]
#[ignore = "prints a table"]
fn longer_baselines_find_smaller_changes() {
    const WEEKS: u64 = 120;
    const SIZES: [f64; 6] = [3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    let mut in_three = Vec::new();
    for rounds in [4, 8, 16] {
        let mut found = [[0; 2]; SIZES.len()];
        for seed in 0..WEEKS {
            let mut draws = Draws { swing_c: 1.0, ..Draws::new(4000 + seed) };
            let first: Vec<Run> = (0..rounds * CELLS).map(|n| draws.run(n, 0.0)).collect();
            let baseline = Baseline::of_runs(&first, Environment::default()).expect("figures");
            let mut quiet = Monitor::new(Settings::default(), &baseline);
            let change = (rounds + 1) * CELLS + 5;
            for number in rounds * CELLS..change {
                quiet.judge(&draws.run(number, 0.0));
            }
            for (size, found) in SIZES.iter().zip(&mut found) {
                let mut monitor = quiet.clone();
                let grown = size * draws.scatter * STATED;
                let delay = (1..=CELLS).find(|delay| {
                    let run = draws.run(change + delay - 1, grown);
                    monitor.judge(&run).alarms.iter().any(|alarm| alarm.figure == "gap")
                });
                found[0] += usize::from(delay.is_some_and(|delay| delay <= 3));
                found[1] += usize::from(delay.is_some());
            }
        }
        println!("{rounds} rounds, changes of {SIZES:?} deviations: {found:?} of {WEEKS}");
        in_three.push(found.iter().map(|found| found[0]).sum::<usize>());
    }
    assert!(in_three[1..].iter().all(|found| *found > in_three[0]), "{in_three:?}");
}
