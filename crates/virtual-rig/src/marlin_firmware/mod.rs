//! The virtual robot's firmware: Marlin 2.1, with the awkward behaviour of real boards.
//!
//! `ok` means planned, not arrived. With a full planner the `ok` of a move is delayed. Long commands send
//! `echo:busy: processing`. A repeated line number is dropped without a message. Soft endstops clamp without a message. `M114`
//! reports the target, even while the tool head is elsewhere.

mod emergency;
mod gcode;
mod line;
mod motion;
mod settings;

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use emergency::{Emergency, EmergencyParser};
use gcode::Command;
use line::{Accepted, LineIntake, Verdict};
use motion::{EndstopHit, Motion};
pub use settings::MarlinSettings;

use super::firmware::{Firmware, Wake};
use super::trajectory::Trajectory;

/// After a stop the planner discards what is queued for this long, and only then the firmware answers (`cleaning_buffer_counter`;
/// 1.00 to 1.04 s were measured, idle or moving).
const CLEANING_S: f64 = 1.0;

const AXES: [char; 3] = ['X', 'Y', 'Z'];

/// The action when a waiting command can go on.
#[derive(Debug, Clone, PartialEq)]
enum Then {
    /// A move finds its place in the planner.
    Plan([Option<f64>; 3]),
    /// Motion has ended, or a dwell.
    Acknowledge,
    /// The planner is clean after a stop that acted on arrival.
    Clean,
    /// Homing of these axes has ended.
    Homed([bool; 3]),
    /// The position after all motion is reported.
    Report,
    /// The motors are switched off.
    Release,
}

/// A command in execution.
#[derive(Debug, Clone, PartialEq)]
struct Waiting {
    number: Option<i64>,
    until_s: f64,
    next_busy_s: f64,
    then: Then,
}

/// The firmware's whole state.
#[derive(Debug)]
pub struct MarlinFirmware {
    settings: MarlinSettings,
    motion: Motion,
    receive_buffer: VecDeque<u8>,
    intake: LineIntake,
    ring: VecDeque<Accepted>,
    emergency: EmergencyParser,
    stop_requested: bool,
    waiting: Option<Waiting>,
    hits: VecDeque<EndstopHit>,
    busy_interval_s: f64,
    alive: bool,
    kill_requested: bool,
    homing_jam: Arc<AtomicBool>,
}

impl MarlinFirmware {
    /// Firmware that drives the tool head of `trajectory`; silent until [`Firmware::power_up`].
    ///
    /// While `homing_jam` is set every homing fails, as with a broken switch.
    pub fn new(
        settings: MarlinSettings,
        trajectory: Arc<Mutex<Trajectory>>,
        homing_jam: Arc<AtomicBool>,
    ) -> Self {
        Self {
            motion: Motion::new(settings, trajectory),
            receive_buffer: VecDeque::new(),
            intake: LineIntake::new(settings.line_length),
            ring: VecDeque::new(),
            emergency: EmergencyParser::default(),
            stop_requested: false,
            waiting: None,
            hits: VecDeque::new(),
            busy_interval_s: settings.busy_interval_s.get(),
            alive: false,
            kill_requested: false,
            homing_jam,
            settings,
        }
    }

    fn kill(&mut self, now_s: f64, out: &mut Vec<u8>) {
        self.motion.quick_stop(now_s);
        self.motion.release(now_s);
        self.waiting = None;
        self.alive = false;
        say(out, "Error:Printer halted. kill() called!");
    }

    fn quick_stop(&mut self, now_s: f64) {
        self.motion.quick_stop(now_s);
        self.hits.clear();
        let until_s = now_s + CLEANING_S;
        match &mut self.waiting {
            Some(waiting) => {
                waiting.until_s = until_s;
                if !matches!(waiting.then, Then::Report | Then::Clean) {
                    waiting.then = Then::Acknowledge;
                }
            }
            None => self.wait(None, until_s, Then::Clean, now_s),
        }
    }

    fn acknowledge(&self, number: Option<i64>, now_s: f64, out: &mut Vec<u8>) {
        if !self.settings.advanced_ok {
            return say(out, "ok");
        }
        let number = number.map_or(String::new(), |n| format!(" N{n}"));
        let free = self.settings.command_ring.saturating_sub(self.ring.len());
        say(out, &format!("ok{number} P{} B{free}", self.motion.places(now_s)));
    }

    fn wait(&mut self, number: Option<i64>, until_s: f64, then: Then, now_s: f64) {
        let next_busy_s = now_s + self.busy_interval_s;
        self.waiting = Some(Waiting { number, until_s, next_busy_s, then });
    }

    /// Finishes the command in execution if it is due. Returns whether the firmware is free.
    fn continue_waiting(&mut self, now_s: f64, out: &mut Vec<u8>) -> bool {
        let Some(mut waiting) = self.waiting.take() else { return true };
        while waiting.next_busy_s <= now_s && waiting.next_busy_s < waiting.until_s {
            say(out, "echo:busy: processing");
            waiting.next_busy_s += self.busy_interval_s;
        }
        if waiting.until_s > now_s {
            self.waiting = Some(waiting);
            return false;
        }
        match waiting.then {
            Then::Plan(words_mm) => self.hits.extend(self.motion.plan(words_mm, now_s)),
            Then::Acknowledge => {}
            Then::Clean => return true,
            Then::Homed(_) if self.homing_jam.load(Ordering::Relaxed) => {
                say(out, "Error:Homing Failed");
                self.kill(now_s, out);
                return false;
            }
            Then::Homed(axes) => {
                self.motion.homed(axes);
                self.report_position(self.motion.target_mm(), out);
            }
            Then::Report => self.report_position(self.motion.counted_mm(now_s), out),
            Then::Release => self.motion.release(now_s),
        }
        self.acknowledge(waiting.number, now_s, out);
        true
    }

    /// Moves received lines to the command ring while it has room.
    fn fetch(&mut self, now_s: f64, out: &mut Vec<u8>) {
        while self.ring.len() < self.settings.command_ring.max(1) {
            let Some(byte) = self.receive_buffer.pop_front() else { return };
            match self.intake.byte(byte) {
                Some(Verdict::Accepted(accepted)) => {
                    // Obeyed early, and again in its turn.
                    if accepted.text.trim() == "M410" && !self.settings.emergency_parser {
                        self.quick_stop(now_s);
                    }
                    self.ring.push_back(accepted);
                }
                Some(Verdict::Refused(why)) => self.ask_again(why, now_s, out),
                Some(Verdict::Dropped) | None => {}
            }
        }
    }

    /// Reports a transmission error and discards the input after it.
    fn ask_again(&mut self, why: &str, now_s: f64, out: &mut Vec<u8>) {
        let last = self.intake.last_number();
        say(out, &format!("Error:{why}{last}"));
        self.receive_buffer.clear();
        say(out, &format!("Resend: {}", last.wrapping_add(1)));
        if self.settings.resend_ok {
            self.acknowledge(None, now_s, out);
        }
    }

    fn execute(&mut self, accepted: Accepted, now_s: f64, out: &mut Vec<u8>) {
        let number = accepted.number;
        let Some(command) = Command::parse(&accepted.text) else {
            return self.unknown(&accepted, now_s, out);
        };
        let coordinates = AXES.map(|axis| command.value(axis));
        match (command.letter, command.code) {
            ('G', 0 | 1) => {
                if let Some(feed_mm_min) = command.value('F') {
                    self.motion.set_feed_mm_min(feed_mm_min);
                }
                let until_s = self.motion.has_room_at(now_s).unwrap_or(now_s);
                return self.wait(number, until_s, Then::Plan(coordinates), now_s);
            }
            ('G', 4) => {
                let dwell_s = command.value('S').or(command.value('P').map(|ms| ms / 1000.0));
                let until_s = self.motion.ends_s().max(now_s) + dwell_s.unwrap_or(0.0).max(0.0);
                return self.wait(number, until_s, Then::Acknowledge, now_s);
            }
            ('G', 28) => {
                let named = AXES.map(|axis| command.has(axis));
                let axes = if named == [false; 3] { [true; 3] } else { named };
                let until_s = self.motion.plan_homing(axes, now_s);
                return self.wait(number, until_s, Then::Homed(axes), now_s);
            }
            ('G', 21) | ('M', 17 | 82 | 83 | 117) => {}
            ('G', 90) => self.motion.set_absolute(true),
            ('G', 91) => self.motion.set_absolute(false),
            ('G', 92) => self.motion.set_logical(coordinates),
            ('M', 18 | 84) => match command.value('S') {
                Some(timeout_s) => self.motion.set_stepper_timeout_s(timeout_s),
                None => {
                    let until_s = self.motion.ends_s().max(now_s);
                    return self.wait(number, until_s, Then::Release, now_s);
                }
            },
            ('M', 110) => {
                if let Some(n) = command.value('N') {
                    self.intake.set_last_number(n as i64);
                }
            }
            ('M', 112) => return self.kill(now_s, out),
            ('M', 113) => match command.value('S') {
                // 0 switches the lines off in the real firmware too.
                Some(0.0) => self.busy_interval_s = f64::INFINITY,
                Some(interval_s) if interval_s > 0.0 => self.busy_interval_s = interval_s.min(60.0),
                _ => say(out, &format!("echo:M113 S{}", self.busy_interval_s)),
            },
            ('M', 114) if self.settings.true_position && command.has('D') => {
                let until_s = self.motion.ends_s().max(now_s);
                return self.wait(number, until_s, Then::Report, now_s);
            }
            ('M', 114) if self.settings.true_position && command.has('R') => {
                self.report_position(self.motion.counted_mm(now_s), out);
            }
            ('M', 114) => self.report_position(self.motion.target_mm(), out),
            ('M', 115) => self.report_firmware(out),
            ('M', 118) => say(out, accepted.text.get(4..).unwrap_or_default().trim_start()),
            ('M', 119) => self.report_switches(now_s, out),
            ('M', 400) => {
                let until_s = self.motion.ends_s().max(now_s);
                return self.wait(number, until_s, Then::Acknowledge, now_s);
            }
            // With the emergency parser it was obeyed on arrival.
            ('M', 410) if self.settings.emergency_parser => {}
            ('M', 410) => {
                self.motion.quick_stop(now_s);
                self.hits.clear();
                return self.wait(number, now_s + CLEANING_S, Then::Acknowledge, now_s);
            }
            _ => return self.unknown(&accepted, now_s, out),
        }
        self.acknowledge(number, now_s, out);
    }

    fn unknown(&self, accepted: &Accepted, now_s: f64, out: &mut Vec<u8>) {
        say(out, &format!("echo:Unknown command: \"{}\"", accepted.text));
        self.acknowledge(accepted.number, now_s, out);
    }

    fn report_position(&self, at_mm: nalgebra::Vector3<f64>, out: &mut Vec<u8>) {
        let [x, y, z] = self.motion.steps(at_mm);
        say(
            out,
            &format!(
                "X:{:.2} Y:{:.2} Z:{:.2} E:0.00 Count X:{x} Y:{y} Z:{z}",
                at_mm.x, at_mm.y, at_mm.z
            ),
        );
    }

    fn report_firmware(&self, out: &mut Vec<u8>) {
        say(
            out,
            "FIRMWARE_NAME:Marlin 2.1.2.1 (fieldgap virtual rig) PROTOCOL_VERSION:1.0 \
             MACHINE_TYPE:Virtual gantry EXTRUDER_COUNT:0",
        );
        let capabilities = [
            ("EEPROM", false),
            ("AUTOREPORT_POS", false),
            ("EMERGENCY_PARSER", self.settings.emergency_parser),
            ("HOST_ACTION_COMMANDS", false),
        ];
        for (name, there) in capabilities {
            say(out, &format!("Cap:{name}:{}", u8::from(there)));
        }
    }

    fn report_switches(&self, now_s: f64, out: &mut Vec<u8>) {
        say(out, "Reporting endstop status");
        for (axis, pressed) in ["x_min", "y_min", "z_min"].iter().zip(self.motion.switches(now_s)) {
            say(out, &format!("{axis}: {}", if pressed { "TRIGGERED" } else { "open" }));
        }
    }

    fn report_hits(&mut self, now_s: f64, out: &mut Vec<u8>) {
        while self.hits.front().is_some_and(|hit| hit.at_s <= now_s) {
            if let Some(EndstopHit { axis, .. }) = self.hits.pop_front() {
                say(out, &format!("echo:endstops hit:  {}:0.00", AXES[axis]));
            }
        }
    }
}

impl Firmware for MarlinFirmware {
    fn power_up(&mut self, now_s: f64, out: &mut Vec<u8>) {
        self.motion.power_up(now_s);
        self.receive_buffer.clear();
        self.intake = LineIntake::new(self.settings.line_length);
        self.ring.clear();
        self.emergency = EmergencyParser::default();
        self.stop_requested = false;
        self.kill_requested = false;
        self.waiting = None;
        self.hits.clear();
        self.busy_interval_s = self.settings.busy_interval_s.get();
        self.alive = true;
        for line in [
            "start",
            "PowerUp",
            "Marlin 2.1.2.1",
            "echo: Last Updated: 2022-12-18 | Author: (fieldgap virtual rig)",
            "echo: Free Memory: 4096  PlannerBufferBytes: 1232",
        ] {
            say(out, line);
        }
    }

    fn receive(&mut self, byte: u8, _now_s: f64) {
        if !self.alive {
            return;
        }
        if self.settings.emergency_parser {
            match self.emergency.byte(byte) {
                Some(Emergency::Kill) => self.kill_requested = true,
                Some(Emergency::QuickStop) => self.stop_requested = true,
                None => {}
            }
        }
        if self.receive_buffer.len() < self.settings.receive_buffer {
            self.receive_buffer.push_back(byte);
        }
    }

    fn step(&mut self, now_s: f64, out: &mut Vec<u8>) {
        if !self.alive {
            return;
        }
        if self.motion.releases_at_s().is_some_and(|at_s| at_s <= now_s) {
            self.motion.release(self.motion.releases_at_s().unwrap_or(now_s));
        }
        if std::mem::take(&mut self.kill_requested) {
            return self.kill(now_s, out);
        }
        if std::mem::take(&mut self.stop_requested) {
            self.quick_stop(now_s);
        }
        loop {
            self.report_hits(now_s, out);
            if !self.continue_waiting(now_s, out) {
                // Lines are read meanwhile, as far as the ring has room.
                self.fetch(now_s, out);
                return;
            }
            self.fetch(now_s, out);
            match self.ring.pop_front() {
                Some(accepted) => self.execute(accepted, now_s, out),
                None => return,
            }
            if !self.alive {
                return;
            }
        }
    }

    fn wake(&self) -> Option<Wake> {
        if !self.alive {
            return None;
        }
        if let Some(waiting) = &self.waiting {
            let at_s = waiting.until_s.min(waiting.next_busy_s);
            return Some(Wake { at_s, answer_needs_it: true });
        }
        let hit_s = self.hits.front().map(|hit| hit.at_s);
        let at_s = [hit_s, self.motion.releases_at_s()].into_iter().flatten().reduce(f64::min)?;
        Some(Wake { at_s, answer_needs_it: false })
    }
}

fn say(out: &mut Vec<u8>, line: &str) {
    out.extend_from_slice(line.as_bytes());
    out.push(b'\n');
}

#[cfg(test)]
mod tests;
