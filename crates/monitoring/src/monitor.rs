//! The monitor: charts of all figures of all cells, run after run.

use std::collections::{BTreeMap, BTreeSet};

use fieldgap_text::Uncertain;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::alarm::{Alarm, Scope};
use crate::baseline::{Baseline, Expected, Known};
use crate::change_point::change_point;
use crate::chart::Chart;
use crate::environment::Environment;
use crate::history::{Past, known_before, size};
use crate::judgement::{ChartPoint, Judgement, Note};
use crate::normal::score_of_size;
use crate::reference::Reading;
use crate::run::Run;
use crate::settings::{Settings, Sides};

/// A run beyond this many standard errors is charted, but not learned from: either it is changed, or it is an outlier that would hide
/// later changes. Of unchanged runs it leaves out 1 in 2,000.
const MOST_TO_LEARN_FROM: f64 = 3.5;

/// A judged run is learned from only when its cell comes again, and not at all if an alarm came by then: the first runs of a change would otherwise
/// hide the next ones. With few cells, after this many runs.
const SHORTEST_LAG: usize = 3;

/// Follows the figures of repeated runs. Its state follows from settings, baseline, runs and acknowledgements alone, so that
/// [`Monitor::replay`] builds the same one from records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Monitor {
    settings: Settings,
    environment: Environment,
    limits: Limits,
    figures: BTreeMap<String, Followed>,
}

/// Somebody looked at an alarm, or changed the set-up: charts begin anew.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Acknowledgement {
    /// When; runs at this time and later are charted anew.
    pub at: Timestamp,
    /// The figure; all if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub figure: Option<String>,
    /// The cell; all if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cell: Option<String>,
    /// What the figures are expected to be from there on.
    pub expect: Expect,
}

/// What figures are expected to be after an acknowledgement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Expect {
    /// The same: the alarm was false. Its runs are learned from too.
    Unchanged,
    /// What they were before the alarm: its cause is repaired.
    AsBefore,
    /// Something new, which the runs that follow show. The scatter between runs stays known.
    Anew,
}

/// Limits of the charts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Limits {
    one_sided: f64,
    two_sided: f64,
    with_all_cells: bool,
}

/// A figure with its charts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Followed {
    /// What the baseline holds.
    start: Known,
    /// What is known now: that, and what the runs since taught.
    known: Known,
    past: Vec<Past>,
    /// Place in the past up to which runs were learned from.
    learned: usize,
    /// So many runs pass before one is learned from.
    lag: usize,
    all_cells: OneChart,
    cell_by_cell: OneChart,
    cells: BTreeMap<String, OneChart>,
    /// Cells whose reference stays as it was before their alarm.
    held: BTreeSet<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct OneChart {
    chart: Chart,
    /// Place in the past from which on it is charted.
    begin: usize,
    alarmed: bool,
}

impl Monitor {
    /// A monitor that has seen no run.
    ///
    /// A run is on one chart of its cell and on two of all cells for every figure, with and without signs. Each chart gets the limit at which its average run
    /// length is `arl_runs` times the number of these charts (Bonferroni), so that false alarms of all together are at most
    /// one in `arl_runs` runs. Figures that vary together make them rarer.
    pub fn new(settings: Settings, baseline: &Baseline) -> Self {
        let with_all_cells = baseline.cells().len() > 1;
        let charts = baseline.known().len() * if with_all_cells { 3 } else { 1 };
        let runs = settings.arl_runs() * charts as f64;
        let limit = |sides| settings.chart().statistic(sides).limit_for(runs);
        let limits = Limits {
            one_sided: limit(Sides::Rises),
            two_sided: limit(Sides::Both),
            with_all_cells,
        };
        let followed = |known: &Known| Followed {
            start: known.clone(),
            known: known.clone(),
            past: Vec::new(),
            learned: 0,
            lag: known.cells.len().saturating_sub(1).max(SHORTEST_LAG),
            all_cells: OneChart::default(),
            cell_by_cell: OneChart::default(),
            cells: BTreeMap::new(),
            held: BTreeSet::new(),
        };
        Self {
            figures: baseline
                .known()
                .iter()
                .map(|(name, known)| (name.clone(), followed(known)))
                .collect(),
            environment: baseline.environment().clone(),
            settings,
            limits,
        }
    }

    /// The monitor after these runs and acknowledgements, with the judgement of each run in the order of time.
    pub fn replay(
        settings: Settings,
        baseline: &Baseline,
        runs: &[Run],
        acknowledgements: &[Acknowledgement],
    ) -> (Self, Vec<Judgement>) {
        let mut runs: Vec<&Run> = runs.iter().collect();
        runs.sort_by_key(|run| run.at);
        let mut acknowledgements: Vec<&Acknowledgement> = acknowledgements.iter().collect();
        acknowledgements.sort_by_key(|one| one.at);
        let mut waiting = acknowledgements.into_iter().peekable();
        let mut monitor = Self::new(settings, baseline);
        let mut judgements = Vec::with_capacity(runs.len());
        for run in runs {
            while let Some(one) = waiting.next_if(|one| one.at <= run.at) {
                monitor.acknowledge(one);
            }
            judgements.push(monitor.judge(run));
        }
        waiting.for_each(|one| monitor.acknowledge(one));
        (monitor, judgements)
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The limit of a figure's charts, in standard errors.
    pub fn limit(&self, figure: &str) -> f64 {
        self.limits.of(self.settings.sides(figure))
    }

    /// Judges the next run. Runs come in the order of time.
    pub fn judge(&mut self, run: &Run) -> Judgement {
        let mut judgement = Judgement::default();
        if run.temperature_c.is_none() {
            judgement.notes.push(Note::NoTemperature);
        }
        for (figure, value) in &run.figures {
            let figure = figure.clone();
            let Some(followed) = self.figures.get_mut(&figure) else {
                judgement.notes.push(Note::NotInBaseline { figure });
                continue;
            };
            let Some(reading) = Reading::of(*value, run.temperature_c) else {
                judgement.notes.push(Note::NotANumber { figure });
                continue;
            };
            let context = Context {
                figure: &figure,
                settings: &self.settings,
                environment: &self.environment,
                limits: self.limits,
            };
            followed.judge(run, reading, &context, &mut judgement);
        }
        judgement
    }

    /// Begins charts anew. The chart of all cells begins anew with that of any cell.
    pub fn acknowledge(&mut self, acknowledgement: &Acknowledgement) {
        let concerned =
            |name: &String| acknowledgement.figure.as_ref().is_none_or(|one| one == name);
        for (_, followed) in self.figures.iter_mut().filter(|(name, _)| concerned(name)) {
            followed.reset(acknowledgement.cell.as_deref(), acknowledgement.expect);
        }
    }
}

impl Limits {
    fn of(self, sides: Sides) -> f64 {
        if sides == Sides::Both { self.two_sided } else { self.one_sided }
    }
}

/// What the charts of a figure need besides their own state.
struct Context<'a> {
    figure: &'a str,
    settings: &'a Settings,
    environment: &'a Environment,
    limits: Limits,
}

impl Followed {
    fn judge(&mut self, run: &Run, reading: Reading, context: &Context, judgement: &mut Judgement) {
        let slope = context.environment.slope(context.figure, &run.cell);
        let tolerance = context.settings.tolerance(context.figure);
        let expected = self.known.expect(&run.cell, &reading, slope, tolerance);
        let score = expected.and_then(|expected| expected.score);
        let figure = context.figure.to_owned();
        if expected.is_none() {
            let before = self.known.cells.get(&run.cell).map_or(0, |reference| reference.runs());
            judgement.notes.push(Note::Learning { figure, runs: before + 1 });
        } else if score.is_none() {
            judgement.notes.push(Note::ScatterUnknown { figure });
        }
        let before = self.known.mean(&run.cell);
        let usual = score.is_none_or(|score| score.abs() <= MOST_TO_LEARN_FROM);
        self.past.push(Past {
            cell: run.cell.clone(),
            at: run.at,
            reading,
            score,
            may_teach: usual && !self.held.contains(&run.cell),
            of_the_mean: false,
            of_the_scatter: false,
            difference: expected.map(|expected| expected.difference),
        });
        self.learn();
        let mut scopes = vec![Scope::Cell(run.cell.clone())];
        if context.limits.with_all_cells {
            scopes.extend([Scope::AllCells, Scope::CellByCell]);
        }
        for scope in scopes {
            self.chart(run, scope, (expected, before), context, judgement);
        }
    }

    /// Learns from the newest run if it could not be judged, and from those that have waited long enough.
    fn learn(&mut self) {
        let newest = self.past.len() - 1;
        if self.past[newest].score.is_none() {
            self.learn_from(newest);
        }
        while self.learned + self.lag <= newest {
            self.learn_from(self.learned);
            self.learned += 1;
        }
    }

    fn learn_from(&mut self, place: usize) {
        let past = &mut self.past[place];
        if past.may_teach {
            past.may_teach = false;
            (past.of_the_mean, past.of_the_scatter) = (true, true);
            self.known.learn(&past.cell, &past.reading, past.difference);
        }
    }

    /// The run on one chart.
    fn chart(
        &mut self,
        run: &Run,
        scope: Scope,
        (expected, baseline): (Option<Expected>, Option<Uncertain>),
        context: &Context,
        judgement: &mut Judgement,
    ) {
        let of_figure = context.settings.sides(context.figure);
        let without_sign = scope == Scope::CellByCell;
        let sides = if without_sign { Sides::Rises } else { of_figure };
        let limit = context.limits.of(sides);
        // A change that all cells have in common has its alarm, with a sign and a size.
        let known_otherwise = without_sign && self.all_cells.alarmed;
        let score = expected.and_then(|expected| expected.score);
        let score = if without_sign { score.map(score_of_size) } else { score };
        let one = self.chart_of(&scope);
        let statistic = score.map(|score| one.chart.step(context.settings.chart(), sides, score));
        let begin = one.begin;
        let beyond = statistic.filter(|statistic| statistic.abs() > limit && !known_otherwise);
        let since = beyond
            .and_then(|statistic| self.changed_since(&scope, begin, statistic))
            .filter(|since| !without_sign || is_to_the_worse(&self.past[*since..], of_figure));
        let beyond = beyond.filter(|_| since.is_some());
        let one = self.chart_of(&scope);
        let new = beyond.is_some() && !one.alarmed;
        one.alarmed |= beyond.is_some();
        judgement.charts.push(ChartPoint {
            figure: context.figure.to_owned(),
            cell: run.cell.clone(),
            scope: scope.clone(),
            at: run.at,
            value: self.corrected(expected),
            baseline,
            z: score,
            statistic,
            limit,
            sides,
            alarm: beyond.is_some(),
        });
        if let (Some(statistic), Some(since)) = (beyond, since) {
            let known = known_before(&self.start, &self.past[..since]);
            let after: Vec<&Past> =
                self.past[since..].iter().filter(|past| scope.takes(&past.cell)).collect();
            let size = size(&known, &after, context.figure, context.environment);
            judgement.alarms.push(Alarm {
                figure: context.figure.to_owned(),
                at: run.at,
                new,
                since: self.past[since].at,
                runs: size.runs,
                // Rises and falls do not add up to a size.
                change: size.change.filter(|_| !without_sign),
                relative: size.relative.filter(|_| !without_sign),
                cells: size.cells,
                scope: scope.clone(),
                statistic,
                limit,
                arl_runs: context.settings.arl_runs(),
            });
            if new {
                self.hold(&scope, since);
            }
        }
    }

    fn chart_of(&mut self, scope: &Scope) -> &mut OneChart {
        match scope {
            Scope::Cell(cell) => self.cells.entry(cell.clone()).or_default(),
            Scope::AllCells => &mut self.all_cells,
            Scope::CellByCell => &mut self.cell_by_cell,
        }
    }

    /// The newest run, corrected for temperature.
    fn corrected(&self, expected: Option<Expected>) -> Uncertain {
        let Some(past) = self.past.last() else {
            return Uncertain { value: f64::NAN, standard_error: f64::NAN };
        };
        let (shift, variance) = expected.map_or((0.0, 0.0), |expected| {
            (expected.prediction.of_temperature, expected.prediction.temperature_variance)
        });
        Uncertain {
            value: past.reading.value - shift,
            standard_error: self.known.ratio(&past.cell)
                * (past.reading.variance + variance).sqrt(),
        }
    }

    /// Place in the past of the first changed run.
    fn changed_since(&self, scope: &Scope, begin: usize, direction: f64) -> Option<usize> {
        let (places, scores): (Vec<usize>, Vec<f64>) = (begin..self.past.len())
            .filter(|place| scope.takes(&self.past[*place].cell))
            .filter_map(|place| {
                let score = self.past[place].score?;
                let score = if *scope == Scope::CellByCell { score_of_size(score) } else { score };
                Some((place, score))
            })
            .unzip();
        change_point(&scores, direction).map(|first| places[first])
    }

    /// Takes what changed runs taught out of the references of their cells, and keeps these as they were before the change.
    fn hold(&mut self, scope: &Scope, since: usize) {
        for past in &mut self.past[since..] {
            if scope.takes(&past.cell) {
                past.may_teach = false;
                past.of_the_mean = false;
                past.of_the_scatter = false;
            }
        }
        self.known = known_before(&self.start, &self.past);
        match scope {
            Scope::Cell(cell) => drop(self.held.insert(cell.clone())),
            Scope::AllCells | Scope::CellByCell => {
                self.held.extend(self.known.cells.keys().cloned());
            }
        }
    }

    fn reset(&mut self, cell: Option<&str>, expect: Expect) {
        let concerned = |name: &str| cell.is_none_or(|one| one == name);
        match expect {
            Expect::Unchanged => {
                for (place, past) in self.past.iter_mut().enumerate() {
                    let begin = self.cells.get(&past.cell).map_or(0, |one| one.begin);
                    if concerned(&past.cell) && place >= begin {
                        past.may_teach = false;
                        (past.of_the_mean, past.of_the_scatter) = (true, true);
                    }
                }
                self.known = known_before(&self.start, &self.past);
            }
            Expect::AsBefore => {}
            Expect::Anew => {
                self.start.cells.retain(|name, _| !concerned(name));
                self.known.cells.retain(|name, _| !concerned(name));
                for past in self.past.iter_mut().filter(|past| concerned(&past.cell)) {
                    past.may_teach = false;
                    past.of_the_mean = false;
                }
            }
        }
        let anew = OneChart { begin: self.past.len(), ..OneChart::default() };
        (self.all_cells, self.cell_by_cell) = (anew, anew);
        for (_, one) in self.cells.iter_mut().filter(|(name, _)| concerned(name)) {
            *one = anew;
        }
        self.held.retain(|name| !concerned(name));
    }
}

/// Whether changes to the side that raises alarms outweigh those to the other, in squares of scores.
fn is_to_the_worse(past: &[Past], sides: Sides) -> bool {
    let signed = past.iter().filter_map(|past| past.score).map(|z| z * z.abs()).sum::<f64>();
    match sides {
        Sides::Both => true,
        Sides::Rises => signed > 0.0,
        Sides::Falls => signed < 0.0,
    }
}

impl Scope {
    /// Whether the runs of this cell are on the chart.
    fn takes(&self, cell: &str) -> bool {
        match self {
            Self::Cell(own) => own == cell,
            Self::AllCells | Self::CellByCell => true,
        }
    }
}
