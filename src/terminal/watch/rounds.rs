//! The rounds of a closed loop beside the readings: what is probable, how it moved, what is measured for it, and what is left of the budget.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

use crate::terminal::level::bar;
use fieldgap_closed_loop::{Purpose, Round};
use fieldgap_diagnosis::EffectId;
use fieldgap_records::ClosedLoop;

/// Width of a bar.
const BAR: usize = 12;
/// Width of a probability and of its change, with the blanks before them.
const FIGURES: usize = 11;
/// Sets that are shown by name at most.
const MOST_SETS: usize = 5;

/// The state of a closed loop.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoopView {
    settings: ClosedLoop,
    rounds: Vec<Round>,
    /// Readings so far, and the times of the first and the last, s.
    readings: usize,
    times_s: Option<[f64; 2]>,
    /// Time with the array driven, s, and whether it was at the last reading.
    sounding_s: f64,
    was_driven: bool,
}

/// A part of the probability.
#[derive(Debug, PartialEq)]
struct Part {
    name: String,
    now: f64,
    /// Before the last round; `None` after the first.
    before: Option<f64>,
}

impl LoopView {
    /// A loop that is to begin or to go on after these decisions.
    pub fn new(settings: ClosedLoop, rounds: Vec<Round>) -> Self {
        let (times_s, sounding_s, was_driven) = (None, 0.0, false);
        Self { settings, rounds, readings: 0, times_s, sounding_s, was_driven }
    }

    /// Takes the decisions so far.
    pub fn decided(&mut self, rounds: Vec<Round>) {
        self.rounds = rounds;
    }

    /// Counts a reading.
    pub fn measured(&mut self, time_s: f64, is_driven: bool) {
        self.readings += 1;
        if let Some([_, last_s]) = self.times_s
            && self.was_driven
            && is_driven
        {
            self.sounding_s += time_s - last_s;
        }
        self.was_driven = is_driven;
        self.times_s = Some([self.times_s.map_or(time_s, |[first_s, _]| first_s), time_s]);
    }

    /// Draws it.
    pub fn draw(&self, area: Rect, frame: &mut Frame<'_>) {
        let title = match self.rounds.last() {
            Some(round) if round.purpose == Purpose::End => " the loop has ended ".to_owned(),
            Some(round) => format!(" round {} ", round.round),
            None => " rounds ".to_owned(),
        };
        let width = usize::from(area.width.saturating_sub(2));
        let lines = self.lines(width);
        frame.render_widget(Paragraph::new(lines).block(Block::bordered().title(title)), area);
    }

    fn lines(&self, width: usize) -> Vec<Line<'static>> {
        let mut lines = vec![Line::from(cut(&self.purpose(), width)).bold(), Line::default()];
        lines.extend(self.parts().iter().map(|part| line_of(part, width)));
        lines.push(Line::default());
        let limit = self.settings.most_readings as f64;
        let count = format!("readings {} of {limit}", self.readings);
        lines.push(budget(&count, Some(self.readings as f64 / limit), width));
        let spent_s = self.times_s.map_or(0.0, |[first_s, last_s]| last_s - first_s);
        lines.push(minutes("minutes", spent_s, self.settings.longest_s, width));
        if let Some(longest_s) = self.settings.longest_sounding_s {
            lines.push(minutes("driven", self.sounding_s, Some(longest_s), width));
        }
        lines
    }

    /// What the present round is for.
    fn purpose(&self) -> String {
        let Some(round) = self.rounds.last() else { return "before the first round".to_owned() };
        let named = || round.named.first().map_or_else(String::new, |set| in_words(set));
        match round.purpose {
            Purpose::First => "a first look, spread evenly".to_owned(),
            Purpose::Explore => format!("{} readings to tell the sets apart", round.readings),
            Purpose::Verify => format!("{} fresh readings to test: {}", round.readings, named()),
            Purpose::End => round.reason.clone(),
        }
    }

    /// The most probable sets, then no gap and what is outside of the catalogue.
    fn parts(&self) -> Vec<Part> {
        let mut decided = self.rounds.iter().rev().filter(|round| round.verdict.is_some());
        let Some(now) = decided.next() else { return Vec::new() };
        let before = decided.next();
        let part = |effects: &[EffectId]| Part {
            name: in_words(effects),
            now: probability(now, effects),
            before: before.map(|round| probability(round, effects)),
        };
        let sets = now.probabilities.iter().filter(|likely| !likely.effects.is_empty());
        let mut parts: Vec<Part> =
            sets.take(MOST_SETS).map(|likely| part(&likely.effects)).collect();
        parts.push(part(&[]));
        parts.push(Part {
            name: "outside the catalogue".to_owned(),
            now: now.outside,
            before: before.map(|round| round.outside),
        });
        parts
    }
}

fn probability(round: &Round, effects: &[EffectId]) -> f64 {
    let same =
        |ids: &[EffectId]| ids.len() == effects.len() && ids.iter().all(|id| effects.contains(id));
    let found = round.probabilities.iter().find(|likely| same(&likely.effects));
    found.map_or(0.0, |likely| likely.probability) * (1.0 - round.outside)
}

fn in_words(effects: &[EffectId]) -> String {
    match effects {
        [] => "no gap".to_owned(),
        some => some.iter().map(|id| id.as_cause()).collect::<Vec<_>>().join(" + "),
    }
}

fn line_of(part: &Part, width: usize) -> Line<'static> {
    let room = width.saturating_sub(BAR + FIGURES + 1);
    let change = part.before.map(|before| (100.0 * (part.now - before)).round());
    let (change, colour) = match change {
        Some(more) if more > 0.0 => (format!("+{more}"), Color::Green),
        Some(less) if less < 0.0 => (format!("{less}"), Color::Red),
        _ => (String::new(), Color::Reset),
    };
    Line::from(vec![
        Span::from(format!("{:<room$} ", cut(&part.name, room))),
        Span::from(bar(part.now, BAR)).fg(Color::Cyan),
        Span::from(format!("{:>4.0} %", 100.0 * part.now)),
        Span::from(format!("{change:>5}")).fg(colour),
    ])
}

fn minutes(what: &str, spent_s: f64, longest_s: Option<f64>, width: usize) -> Line<'static> {
    let spent = spent_s / 60.0;
    match longest_s {
        None => budget(&format!("{what} {spent:.1}"), None, width),
        Some(longest_s) => {
            let words = format!("{what} {spent:.1} of {:.1}", longest_s / 60.0);
            budget(&words, Some(spent_s / longest_s), width)
        }
    }
}

/// What is spent of a limit, with a bar where there is one.
fn budget(words: &str, share: Option<f64>, width: usize) -> Line<'static> {
    let room = width.saturating_sub(BAR + FIGURES + 1);
    let bar = share.map_or_else(String::new, |share| bar(share, BAR));
    Line::from(vec![
        Span::from(format!("{:<room$} ", cut(words, room))),
        Span::from(bar).fg(Color::Green),
    ])
}

/// Words that fit a width.
fn cut(words: &str, width: usize) -> String {
    match words.chars().count() <= width {
        true => words.to_owned(),
        false => words.chars().take(width.saturating_sub(1)).chain(['…']).collect(),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use fieldgap_acoustics::Vec3;
    use fieldgap_closed_loop::Likely;
    use fieldgap_diagnosis::Verdict;
    use fieldgap_records::BoxMm;

    fn settings() -> ClosedLoop {
        let within = BoxMm { least: Vec3::zeros(), most: Vec3::repeat(50.0) };
        ClosedLoop {
            longest_s: Some(1200.0),
            longest_sounding_s: Some(600.0),
            ..ClosedLoop::within(within)
        }
    }

    fn round(number: usize, purpose: Purpose, sets: &[(&[EffectId], f64)]) -> Round {
        let likely = |(effects, probability): &(&[EffectId], f64)| Likely {
            effects: effects.to_vec(),
            probability: *probability,
        };
        Round {
            round: number,
            purpose,
            before: 240 + 96 * number,
            readings: 96,
            drives: [1, 11],
            verdict: (number > 0).then_some(Verdict::Ambiguous),
            named: sets.iter().take(1).map(|(set, _)| set.to_vec()).collect(),
            probabilities: sets.iter().map(likely).collect(),
            outside: 0.02,
            expected_bits: None,
            expected_s: 20.0,
            cure: None,
            verification: None,
            end: None,
            reason: String::new(),
        }
    }

    /// In the third round; the array was silent for the first twenty seconds of eighty.
    pub(in super::super) fn loop_view() -> LoopView {
        use EffectId::{Pitch, SoundSpeed, Turbulence};
        let mut view = LoopView::new(settings(), vec![round(0, Purpose::First, &[])]);
        for second in 0..=80 {
            view.measured(f64::from(second), second >= 20);
        }
        view.decided(vec![
            round(0, Purpose::First, &[]),
            round(1, Purpose::Explore, &[(&[Pitch], 0.5), (&[SoundSpeed], 0.4), (&[], 0.1)]),
            round(
                2,
                Purpose::Verify,
                &[(&[Pitch], 0.9), (&[SoundSpeed], 0.09), (&[Turbulence, Pitch], 0.01)],
            ),
        ]);
        view
    }

    #[test]
    fn probabilities_are_those_of_the_last_decision_beside_the_one_before() {
        let view = loop_view();
        let parts: Vec<(String, i32, Option<i32>)> = view
            .parts()
            .into_iter()
            .map(|Part { name, now, before }| {
                let percent = |p: f64| (100.0 * p).round() as i32;
                (name, percent(now), before.map(percent))
            })
            .collect();
        let words = |name: &str| name.to_owned();
        assert_eq!(
            parts,
            [
                (words("another pitch of the array"), 88, Some(49)),
                (words("another speed of sound"), 9, Some(39)),
                (words("turbulent air + another pitch of the array"), 1, Some(0)),
                (words("no gap"), 0, Some(10)),
                (words("outside the catalogue"), 2, Some(2)),
            ]
        );
        assert_eq!(LoopView::new(settings(), vec![round(0, Purpose::First, &[])]).parts(), []);
    }

    #[test]
    fn the_budget_counts_readings_and_time_with_the_array_driven() {
        let view = loop_view();
        assert_eq!((view.readings, view.times_s), (81, Some([0.0, 80.0])));
        assert_eq!(view.sounding_s, 60.0);
    }
}
