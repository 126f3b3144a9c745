//! The virtual robot's firmware: GRBL 1.1 and grblHAL, with the awkward behaviour of real boards.
//!
//! `ok` means planned. A full receive buffer loses bytes without an error. Some bytes act at once. After a limit GRBL answers
//! nothing until `0x18`. A reset in motion loses the position. grblHAL repeats its first error. [`Dialect`] selects between the
//! two. Feed overrides take effect with the next move, not within one.

mod blocks;
mod commands;
mod gcode;
mod intake;
mod machine;
mod report;
mod settings;
mod stored;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use nalgebra::Vector3;

use intake::{Intake, Override, Realtime, Taken};
use machine::Machine;
use report::Reports;
pub use settings::{Dialect, GrblSettings};
use stored::Stored;

use super::firmware::{Firmware, Wake};
use super::trajectory::Trajectory;

const MM_PER_INCH: f64 = 25.4;

/// Time to write a setting, during which received bytes are lost.
const WRITING_S: f64 = 0.02;

/// State of the firmware, apart from its motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Ready,
    Homing,
    Alarm,
    /// After a limit: only a reset helps.
    Critical,
    Check,
    Sleep,
    Door,
}

/// The action when a waiting line can go on.
#[derive(Debug, Clone, PartialEq)]
enum Then {
    /// A move finds its place in the planner.
    Plan { to_mm: Vector3<f64>, feed_mm_s: f64 },
    /// The motion before a dwell has ended: the dwell begins.
    Dwell { dwell_s: f64 },
    /// The dwell has ended, or a setting is written.
    Acknowledge,
    /// Homing of these axes has ended.
    Homed([bool; 3]),
    /// The motion before a move out of the travel was held and has ended.
    SoftLimit,
}

/// A line in execution. `until_s` is infinite where a held machine has to be resumed first.
#[derive(Debug, Clone, PartialEq)]
struct Waiting {
    until_s: f64,
    then: Then,
}

/// The modal state of the parser.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Modal {
    rapid: bool,
    absolute: bool,
    inches: bool,
    feed_mm_min: f64,
}

const POWER_ON: Modal = Modal { rapid: true, absolute: true, inches: false, feed_mm_min: 0.0 };

/// The firmware's whole state.
#[derive(Debug)]
pub struct GrblFirmware {
    settings: GrblSettings,
    dialect: Dialect,
    stored: Stored,
    machine: Machine,
    intake: Intake,
    reports: Reports,
    modal: Modal,
    /// `G92`: the machine's coordinates less this are the work's.
    work_offset_mm: Vector3<f64>,
    feed_override_percent: i32,
    mode: Mode,
    homed: bool,
    waiting: Option<Waiting>,
    /// grblHAL: the error that all G-code is answered with.
    sticky: Option<u32>,
    reset_requested: bool,
    report_requested: bool,
    deaf_until_s: f64,
    alive: bool,
    homing_jam: Arc<AtomicBool>,
}

impl GrblFirmware {
    /// Firmware that drives the tool head of `trajectory`; silent until [`Firmware::power_up`].
    ///
    /// While `homing_jam` is set every homing fails, as with a broken switch.
    pub fn new(
        settings: GrblSettings,
        dialect: Dialect,
        trajectory: Arc<Mutex<Trajectory>>,
        homing_jam: Arc<AtomicBool>,
    ) -> Self {
        let longest = match dialect {
            Dialect::Grbl => 79,
            Dialect::GrblHal => 255,
        };
        Self {
            stored: Stored::new(&settings, dialect),
            machine: Machine::new(settings, trajectory),
            intake: Intake::new(settings.receive_buffer(dialect), longest),
            reports: Reports::default(),
            modal: POWER_ON,
            work_offset_mm: Vector3::zeros(),
            feed_override_percent: 100,
            mode: Mode::Ready,
            homed: false,
            waiting: None,
            sticky: None,
            reset_requested: false,
            report_requested: false,
            deaf_until_s: 0.0,
            alive: false,
            homing_jam,
            settings,
            dialect,
        }
    }

    fn is_hal(&self) -> bool {
        self.dialect == Dialect::GrblHal
    }

    fn wait(&mut self, until_s: Option<f64>, then: Then) {
        self.waiting = Some(Waiting { until_s: until_s.unwrap_or(f64::INFINITY), then });
    }

    /// `0x18`. Ends motion and drops all input. A machine at rest keeps its position.
    fn soft_reset(&mut self, now_s: f64, out: &mut Vec<u8>) {
        let in_execution = self.waiting.take().is_some();
        let critical = self.mode == Mode::Critical;
        let alarm = match self.mode {
            Mode::Homing => Some(6),
            _ if !critical && self.machine.moves_at(now_s) => Some(3),
            _ => None,
        };
        match alarm {
            Some(code) => {
                self.machine.lose_position(now_s);
                self.homed = false;
                say(out, &format!("ALARM:{code}"));
            }
            None => self.machine.flush(now_s),
        }
        // GRBL still answers the line that was being executed.
        if !self.is_hal() && (in_execution || critical) {
            say(out, "ok");
        }
        let locked = alarm.is_some() || critical || matches!(self.mode, Mode::Alarm | Mode::Sleep);
        self.start(locked, now_s, out);
    }

    /// The common part of reset and power-up: greeting and lock.
    fn start(&mut self, locked: bool, now_s: f64, out: &mut Vec<u8>) {
        self.modal = POWER_ON;
        self.work_offset_mm = Vector3::zeros();
        self.feed_override_percent = 100;
        self.reports = Reports::default();
        self.sticky = None;
        self.waiting = None;
        self.reset_requested = false;
        self.report_requested = false;
        self.mode = if locked { Mode::Alarm } else { Mode::Ready };
        say(out, "");
        say(
            out,
            match self.dialect {
                Dialect::Grbl => "Grbl 1.1h ['$' for help]",
                Dialect::GrblHal => "GrblHAL 1.1f ['$' or '$HELP' for help]",
            },
        );
        if self.stored.flag(21) && self.machine.switches(now_s) != [false; 3] {
            say(out, "[MSG:Check Limits]");
        }
        if locked {
            say(out, "[MSG:'$H'|'$X' to unlock]");
        }
    }

    /// A limit was reached: everything stops until a reset.
    fn limit(&mut self, code: u32, out: &mut Vec<u8>) {
        self.mode = Mode::Critical;
        say(out, &format!("ALARM:{code}"));
        say(out, "[MSG:Reset to continue]");
    }

    /// Finishes the line in execution if it is due. Returns whether the firmware is free.
    fn continue_waiting(&mut self, now_s: f64, out: &mut Vec<u8>) -> bool {
        let Some(waiting) = self.waiting.take() else { return true };
        let until_s = self.due_s(&waiting, now_s);
        if until_s > now_s {
            self.waiting = Some(Waiting { until_s, ..waiting });
            return false;
        }
        match waiting.then {
            Then::Plan { to_mm, feed_mm_s } => self.machine.plan(to_mm, feed_mm_s, now_s),
            Then::Dwell { dwell_s } if dwell_s > 0.0 => {
                self.wait(Some(now_s + dwell_s), Then::Acknowledge);
                return false;
            }
            Then::Dwell { .. } | Then::Acknowledge => {}
            Then::Homed(_) if self.homing_jam.load(Ordering::Relaxed) => {
                self.machine.lose_position(now_s);
                self.homed = false;
                // The switch was not found over one and a half times the travel.
                say(out, "ALARM:9");
                if !self.is_hal() {
                    say(out, "ok");
                }
                self.intake.clear();
                self.start(true, now_s, out);
                return true;
            }
            Then::Homed(axes) => {
                self.machine.homed(axes);
                self.homed = true;
                self.mode = Mode::Ready;
                if self.is_hal() {
                    say(out, "[MSG:]");
                }
            }
            Then::SoftLimit => {
                self.machine.flush(now_s);
                self.limit(2, out);
                return false;
            }
        }
        say(out, "ok");
        true
    }

    /// When a waiting line goes on. A hold or a resume can change this time.
    fn due_s(&self, waiting: &Waiting, now_s: f64) -> f64 {
        let due_s = match waiting.then {
            Then::Plan { .. } => {
                self.machine.has_room_at(self.settings.planner_moves(self.dialect), now_s)
            }
            Then::Dwell { .. } if self.machine.held_from_s().is_some() => None,
            Then::Dwell { .. } => self.machine.ends_s(now_s),
            Then::SoftLimit => self.machine.held_from_s(),
            Then::Acknowledge | Then::Homed(_) => Some(waiting.until_s),
        };
        due_s.unwrap_or(f64::INFINITY)
    }

    fn execute(&mut self, taken: Taken, now_s: f64, out: &mut Vec<u8>) {
        let answer = match taken {
            Taken::TooLong => Err(11),
            Taken::Line(line) if line.is_empty() => {
                self.sticky = None;
                Ok(true)
            }
            Taken::Line(line) => match line.strip_prefix('$') {
                Some(command) => {
                    let answer = self.command(command, now_s, out);
                    if answer.is_ok() {
                        self.sticky = None;
                    }
                    answer
                }
                None => self.gcode(&line, now_s),
            },
        };
        match answer {
            Ok(true) => say(out, "ok"),
            Ok(false) => {}
            Err(code) => say(out, &format!("error:{code}")),
        }
    }

    /// The step pulses end: the move stops midway without a message.
    #[cfg(test)]
    fn starve(&mut self, now_s: f64) {
        self.machine.flush(now_s);
    }

    fn change_override(&mut self, change: Override) {
        self.feed_override_percent = match change {
            Override::Normal => 100,
            Override::By(percent) => (self.feed_override_percent + percent).clamp(10, 200),
        };
        self.reports.override_changed();
    }
}

impl Firmware for GrblFirmware {
    fn power_up(&mut self, now_s: f64, out: &mut Vec<u8>) {
        self.alive = true;
        self.intake.clear();
        self.machine.power_up(now_s);
        self.homed = false;
        self.deaf_until_s = now_s;
        // grblHAL has a setting of its own for that, which is off.
        let locked = self.stored.flag(22) && !self.is_hal();
        self.start(locked, now_s, out);
    }

    fn receive(&mut self, byte: u8, now_s: f64) {
        if !self.alive || now_s < self.deaf_until_s {
            return;
        }
        self.machine.settle(now_s);
        let Some(acts) = self.intake.receive(byte) else { return };
        let moves = !matches!(self.mode, Mode::Alarm | Mode::Critical | Mode::Sleep | Mode::Homing);
        match acts {
            // What comes behind it is kept: a line end is then answered behind the greeting.
            Realtime::Reset => {
                self.intake.clear();
                self.reset_requested = true;
            }
            Realtime::Report => self.report_requested = true,
            Realtime::Hold if moves && self.machine.jogs_until_s().is_some() => {
                self.machine.cancel_jog(now_s);
            }
            Realtime::Hold if moves => self.machine.hold(now_s),
            Realtime::Door if moves => {
                self.machine.hold(now_s);
                self.mode = Mode::Door;
            }
            Realtime::Resume => {
                if self.mode == Mode::Door {
                    self.mode = Mode::Ready;
                }
                self.machine.resume(now_s);
            }
            Realtime::CancelJog if self.machine.jogs_until_s().is_some() => {
                self.machine.cancel_jog(now_s);
            }
            Realtime::Override(change) => self.change_override(change),
            Realtime::Hold | Realtime::Door | Realtime::CancelJog | Realtime::Nothing => {}
        }
    }

    fn step(&mut self, now_s: f64, out: &mut Vec<u8>) {
        if !self.alive {
            return;
        }
        loop {
            if std::mem::take(&mut self.reset_requested) {
                self.soft_reset(now_s, out);
            }
            if self.mode == Mode::Critical && !self.is_hal() {
                return;
            }
            if self.machine.hit_at_s().is_some_and(|at_s| at_s <= now_s) {
                self.machine.lose_position(now_s);
                self.homed = false;
                self.waiting = None;
                self.limit(1, out);
                continue;
            }
            self.machine.settle(now_s);
            if let Some(at_s) = self.machine.releases_at_s().filter(|&at_s| at_s <= now_s) {
                self.machine.release(at_s);
            }
            let deaf_to_queries = self.mode == Mode::Homing && !self.is_hal();
            if self.report_requested && !deaf_to_queries {
                self.report_requested = false;
                self.report(now_s, out);
            }
            if !self.continue_waiting(now_s, out) {
                return;
            }
            match self.intake.next_line() {
                Some(taken) => self.execute(taken, now_s, out),
                None if self.report_requested => {}
                None => return,
            }
        }
    }

    fn wake(&self) -> Option<Wake> {
        if !self.alive || (self.mode == Mode::Critical && !self.is_hal()) {
            return None;
        }
        let hit_s = self.machine.hit_at_s();
        if let Some(waiting) = self.waiting.as_ref().filter(|waiting| waiting.until_s.is_finite()) {
            let at_s = hit_s.map_or(waiting.until_s, |hit_s| hit_s.min(waiting.until_s));
            return Some(Wake { at_s, answer_needs_it: true });
        }
        // Whoever holds the machine, or cancels a jog, asks for its rest again and again.
        let rests_s = self.machine.held_from_s().filter(|_| self.reports.is_moving());
        if let Some(at_s) = rests_s.or(self.machine.jogs_until_s()) {
            return Some(Wake { at_s, answer_needs_it: true });
        }
        let at_s = [hit_s, self.machine.releases_at_s()].into_iter().flatten().reduce(f64::min)?;
        Some(Wake { at_s, answer_needs_it: false })
    }
}

fn say(out: &mut Vec<u8>, line: &str) {
    out.extend_from_slice(line.as_bytes());
    out.extend_from_slice(b"\r\n");
}

#[cfg(test)]
mod driver_tests;
#[cfg(test)]
mod tests;
