//! The state of the view of a running scan, and the effect of keys.

use std::collections::VecDeque;
use std::time::Duration;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::rounds::LoopView;
use super::sheet::Sheets;
use fieldgap_acquisition::Event;
use fieldgap_closed_loop::Round;
use fieldgap_input::visible_line;
use fieldgap_records::{Plan, RecordedSample, Visit, VisitKind};

/// Notes that are kept; all of them are in `events.jsonl`.
const NOTES: usize = 50;

/// Points of this run before the remaining time is shown.
const POINTS_FOR_ESTIMATE: usize = 5;

/// State of a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stage {
    /// Opening the devices and homing.
    Homing,
    /// Measuring points.
    Scanning,
    /// A pause is requested; the current point is finished first.
    Pausing,
    /// Paused; the array is silent.
    Paused,
    /// The end is requested.
    Ending,
    /// Ended, with the reason if it ended early.
    Ended(Option<String>),
}

/// What a key asks of the scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Pause.
    Pause,
    /// Continue after a pause.
    Continue,
    /// End the scan; all readings are kept.
    Abort,
    /// End the program immediately.
    Quit,
}

/// An event as it is shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Note {
    pub(super) at: Duration,
    pub(super) text: String,
    pub(super) alarming: bool,
}

/// The view of a running scan. Instants are counted from its creation.
#[derive(Debug, Clone)]
pub struct ScanView {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) full_scale: f64,
    pub(super) sheets: Sheets,
    references: Vec<bool>,
    pub(super) of: usize,
    pub(super) done: usize,
    pub(super) stage: Stage,
    pub(super) asks_abort: bool,
    pub(super) focus: Option<usize>,
    pub(super) at_mm: Option<[f64; 3]>,
    pub(super) reading: Option<f64>,
    pub(super) drift: Option<Drift>,
    pub(super) notes: VecDeque<Note>,
    pub(super) faults: usize,
    /// Where the scan is a closed loop.
    pub(super) in_rounds: Option<LoopView>,
    current: usize,
    chosen: Option<usize>,
    begun_at: Option<Duration>,
    done_at_begin: usize,
    paused_since: Option<Duration>,
    paused: Duration,
}

/// Drift at the reference point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drift {
    pub(super) first: f64,
    pub(super) now: f64,
    pub(super) at: Duration,
}

impl Drift {
    pub(super) fn percent(&self) -> f64 {
        (self.now / self.first - 1.0) * 100.0
    }
}

impl ScanView {
    /// For a scan that is about to run, of which `kept` is already measured. Readings are in `unit`, up to `full_scale`.
    pub fn new(
        plan: &Plan,
        visits: &[Visit],
        kept: &[RecordedSample],
        unit: impl Into<String>,
        full_scale: f64,
    ) -> Self {
        let mut view = Self {
            name: plan.name.clone(),
            unit: unit.into(),
            full_scale,
            sheets: Sheets::of(plan, visits),
            references: visits.iter().map(|visit| visit.kind == VisitKind::Reference).collect(),
            of: visits.len(),
            done: 0,
            stage: Stage::Homing,
            asks_abort: false,
            focus: None,
            at_mm: None,
            reading: None,
            drift: None,
            notes: VecDeque::new(),
            faults: 0,
            in_rounds: plan.closed_loop.clone().map(|settings| LoopView::new(settings, Vec::new())),
            current: 0,
            chosen: None,
            begun_at: None,
            done_at_begin: kept.len(),
            paused_since: None,
            paused: Duration::ZERO,
        };
        for (row, sample) in kept.iter().enumerate() {
            view.measured(row, sample.reading, Duration::ZERO);
            view.counted(sample.time_s, sample.focus.is_some());
        }
        view
    }

    /// Takes the decisions of a closed loop so far.
    pub fn decided(&mut self, rounds: Vec<Round>) {
        if let Some(in_rounds) = &mut self.in_rounds {
            in_rounds.decided(rounds);
        }
    }

    /// Handles an event.
    pub fn take(&mut self, event: &Event, at: Duration) {
        match event {
            Event::Opened { robot, .. } => self.note(at, format!("{robot} answers"), false),
            Event::Homed => {
                self.stage = Stage::Scanning;
                self.begun_at = Some(at);
                self.note(at, "homed".to_owned(), false);
            }
            Event::ReferenceChecked { row, kept, now, .. } => {
                let change = (now / kept - 1.0) * 100.0;
                self.note(at, format!("row {row} measured again: {change:+.2} %"), false);
            }
            Event::ReferenceRevisited { first, now, .. } => {
                let drift = Drift { first: *first, now: *now, at };
                self.drift = Some(drift);
                self.note(at, format!("reference point: {:+.2} %", drift.percent()), false);
            }
            Event::ImpairedReading { text, .. } => {
                self.faults += 1;
                self.note(at, text.clone(), true);
            }
            Event::Paused => {
                self.stage = Stage::Paused;
                self.paused_since = Some(at);
                self.note(at, "paused, the array is silent".to_owned(), false);
            }
            Event::Continued { waited_s } => {
                self.stage = Stage::Scanning;
                let since = self.paused_since.take();
                self.paused += since.map_or(Duration::ZERO, |since| at.saturating_sub(since));
                self.note(at, format!("continued after {waited_s:.0} s"), false);
            }
            Event::Question { text } | Event::HookFailed { text } => {
                self.faults += 1;
                self.note(at, text.clone(), true);
            }
            Event::LagFound { lag_ms, standard_error_ms } => {
                let text = format!("lag of readings: {lag_ms:.2} ± {standard_error_ms:.2} ms");
                self.note(at, text, false);
            }
            Event::RoundChosen { text } => self.note(at, text.clone(), false),
            Event::DiskFull { reason } => {
                self.faults += 1;
                self.note(at, format!("waiting, the array is silent: {reason}"), true);
            }
            Event::WatchdogLost { reason } => {
                self.faults += 1;
                self.note(at, format!("waiting, the array is silent: the watchdog {reason}"), true);
            }
            Event::Suspended { suspended_s } => {
                self.faults += 1;
                self.note(at, format!("the computer was suspended for {suspended_s:.0} s"), true);
            }
            Event::DiskSpaceFreed { waited_s } | Event::WatchdogRestarted { waited_s } => {
                self.note(at, format!("continued after {waited_s:.0} s"), false);
            }
            Event::Measured { row, of, focus, at_mm, time_s, reading, .. } => {
                // A closed loop has more of them with every round.
                self.of = *of;
                self.counted(*time_s, *focus >= 0);
                self.focus = usize::try_from(*focus).ok();
                self.at_mm = Some(*at_mm);
                self.reading = Some(*reading);
                self.measured(*row, *reading, at);
            }
            Event::Ended { reason, .. } => {
                self.stage = Stage::Ended(reason.clone());
                let text = reason.clone().unwrap_or_else(|| "complete".to_owned());
                self.note(at, text, reason.is_some());
            }
        }
    }

    fn counted(&mut self, time_s: f64, is_driven: bool) {
        if let Some(in_rounds) = &mut self.in_rounds {
            in_rounds.measured(time_s, is_driven);
        }
    }

    fn measured(&mut self, row: usize, reading: f64, at: Duration) {
        self.done = row + 1;
        if let Some(sheet) = self.sheets.set(row, reading) {
            self.current = sheet;
        }
        if self.references.get(row) == Some(&true) {
            let first = self.drift.map_or(reading, |drift| drift.first);
            self.drift = Some(Drift { first, now: reading, at });
        }
    }

    fn note(&mut self, at: Duration, text: String, alarming: bool) {
        if self.notes.len() == NOTES {
            self.notes.pop_front();
        }
        // A device's answer may be in it.
        let text = visible_line(&text).into_owned();
        self.notes.push_back(Note { at, text, alarming });
    }

    /// State of the scan.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Handles a key.
    pub fn key(&mut self, key: KeyEvent) -> Option<Request> {
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return match (key.code, &self.stage) {
                (KeyCode::Char('c'), Stage::Ending) => Some(Request::Quit),
                (KeyCode::Char('c'), _) => self.end(),
                _ => None,
            };
        }
        if self.asks_abort {
            self.asks_abort = false;
            return match key.code {
                KeyCode::Char('y' | 'Y') => self.end(),
                _ => None,
            };
        }
        match key.code {
            KeyCode::Char('p') if self.stage == Stage::Scanning => self.pause(),
            KeyCode::Char('r') if self.waits() => self.resume(),
            KeyCode::Char(' ') if self.stage == Stage::Scanning => self.pause(),
            KeyCode::Char(' ') if self.waits() => self.resume(),
            KeyCode::Char('a' | 'q') | KeyCode::Esc => {
                self.asks_abort = !matches!(self.stage, Stage::Ending | Stage::Ended(_));
                None
            }
            KeyCode::Left => self.look(|shown, _| shown.saturating_sub(1)),
            KeyCode::Right => self.look(|shown, last| (shown + 1).min(last)),
            KeyCode::End | KeyCode::Char('f') => {
                self.chosen = None;
                None
            }
            _ => None,
        }
    }

    fn waits(&self) -> bool {
        matches!(self.stage, Stage::Pausing | Stage::Paused)
    }

    fn pause(&mut self) -> Option<Request> {
        self.stage = Stage::Pausing;
        Some(Request::Pause)
    }

    fn resume(&mut self) -> Option<Request> {
        // If the pause had not begun yet, no event will follow.
        if self.stage == Stage::Pausing {
            self.stage = Stage::Scanning;
        }
        Some(Request::Continue)
    }

    fn end(&mut self) -> Option<Request> {
        if matches!(self.stage, Stage::Ending | Stage::Ended(_)) {
            return None;
        }
        self.stage = Stage::Ending;
        self.asks_abort = false;
        Some(Request::Abort)
    }

    fn look(&mut self, step: impl Fn(usize, usize) -> usize) -> Option<Request> {
        let last = self.sheets.all().len().saturating_sub(1);
        self.chosen = Some(step(self.shown(), last));
        None
    }

    /// The sheet that is shown: the chosen one, or else the one being measured.
    pub(super) fn shown(&self) -> usize {
        self.chosen.unwrap_or(self.current)
    }

    /// Estimated remaining time, from the speed of this run without its pauses.
    pub fn time_left(&self, now: Duration) -> Option<Duration> {
        let begun = self.begun_at?;
        let points = self.done.checked_sub(self.done_at_begin)?;
        if points < POINTS_FOR_ESTIMATE {
            return None;
        }
        let waiting = self.paused_since.map_or(Duration::ZERO, |since| now.saturating_sub(since));
        let busy = now.saturating_sub(begun).saturating_sub(self.paused).saturating_sub(waiting);
        let left = busy.as_secs_f64() / points as f64 * (self.of - self.done) as f64;
        Duration::try_from_secs_f64(left).ok()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::path::Path;

    use super::*;
    use fieldgap_input::TomlSource;

    pub(in super::super) fn view() -> ScanView {
        let text = "name = \"quick-look\"\n[simulator]\nmodel = \"corrected\"\n\
            [[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 100.0\n\
            [reference]\nat_mm = [0, 0, 100]\nevery_points = 30\n\
            [[plane]]\nz_mm = [100, 150]\nsize_mm = [20, 20]\nstep_mm = 2\n";
        let plan = Plan::parse(TomlSource::new(Path::new("p.toml"), text)).expect("good");
        ScanView::new(&plan, &plan.visits(), &[], "V", 5.0)
    }

    pub(in super::super) fn measured(view: &mut ScanView, row: usize, reading: f64, at_s: u64) {
        let event = Event::Measured {
            row,
            of: view.of,
            focus: 0,
            at_mm: [1.0, -2.0, 100.0],
            time_s: at_s as f64,
            reading,
            clipped: false,
        };
        view.take(&event, Duration::from_secs(at_s));
    }

    fn press(code: KeyCode) -> KeyEvent {
        KeyEvent::new(code, KeyModifiers::NONE)
    }

    fn scanning() -> ScanView {
        let mut view = view();
        view.take(&Event::Homed, Duration::from_secs(10));
        view
    }

    #[test]
    fn it_pauses_and_continues_on_request() {
        let mut view = view();
        assert_eq!(view.key(press(KeyCode::Char('p'))), None, "there is nothing to wait with");
        let mut view_2 = scanning();
        assert_eq!(view_2.key(press(KeyCode::Char('r'))), None);
        assert_eq!(view_2.key(press(KeyCode::Char('p'))), Some(Request::Pause));
        assert_eq!(view_2.stage, Stage::Pausing);
        assert_eq!(view_2.key(press(KeyCode::Char('p'))), None);
        view_2.take(&Event::Paused, Duration::from_secs(11));
        assert_eq!(view_2.key(press(KeyCode::Char(' '))), Some(Request::Continue));
        assert_eq!(view_2.stage, Stage::Paused, "until it says that it goes on");
        view_2.take(&Event::Continued { waited_s: 4.0 }, Duration::from_secs(15));
        assert_eq!(view_2.stage, Stage::Scanning);
    }

    #[test]
    fn ending_takes_two_keys_or_ctrl_c() {
        let mut view = scanning();
        assert_eq!(view.key(press(KeyCode::Char('a'))), None);
        assert!(view.asks_abort);
        assert_eq!(view.key(press(KeyCode::Char('n'))), None);
        assert_eq!(view.key(press(KeyCode::Char('y'))), None, "it was answered already");
        view.key(press(KeyCode::Esc));
        assert_eq!(view.key(press(KeyCode::Char('y'))), Some(Request::Abort));
        assert_eq!(view.key(press(KeyCode::Char('a'))), None);
        assert!(!view.asks_abort);
        let interrupt = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(view.key(interrupt), Some(Request::Quit), "the second time it is meant");
        assert_eq!(scanning().key(interrupt), Some(Request::Abort));
    }

    #[test]
    fn pauses_do_not_count_in_the_remaining_time() {
        let mut view = scanning();
        for row in 0..10 {
            measured(&mut view, row, 1.0, 10 + row as u64 + 1);
        }
        let left_s = (view.of - 10) as u64;
        assert_eq!(view.time_left(Duration::from_secs(20)), Some(Duration::from_secs(left_s)));
        view.take(&Event::Paused, Duration::from_secs(20));
        assert_eq!(view.time_left(Duration::from_secs(500)), Some(Duration::from_secs(left_s)));
        view.take(&Event::Continued { waited_s: 480.0 }, Duration::from_secs(500));
        assert_eq!(view.time_left(Duration::from_secs(500)), Some(Duration::from_secs(left_s)));
    }

    #[test]
    fn the_map_follows_the_scan_until_another_is_chosen() {
        let mut view = scanning();
        measured(&mut view, 1, 1.0, 11);
        assert_eq!(view.shown(), 0);
        measured(&mut view, 130, 1.0, 12);
        assert_eq!(view.shown(), 1);
        view.key(press(KeyCode::Left));
        view.key(press(KeyCode::Left));
        assert_eq!(view.shown(), 0);
        view.key(press(KeyCode::Right));
        view.key(press(KeyCode::Right));
        assert_eq!(view.shown(), 1);
        view.key(press(KeyCode::Left));
        view.key(press(KeyCode::Char('f')));
        assert_eq!(view.shown(), 1);
    }

    #[test]
    fn the_drift_is_since_the_first_visit_to_the_reference() {
        let mut view = scanning();
        measured(&mut view, 0, 2.0, 11);
        measured(&mut view, 31, 1.9, 50);
        let drift = view.drift.expect("both were the reference point's");
        assert!((drift.percent() + 5.0).abs() < 1e-9);
    }

    #[test]
    fn notes_are_bounded() {
        let mut view = scanning();
        for row in 0..1000 {
            let text = format!("row {row}, 1 sample was lost on its way");
            view.take(&Event::ImpairedReading { row, text }, Duration::from_secs(11));
        }
        assert_eq!((view.notes.len(), view.faults), (NOTES, 1000));
    }
}
