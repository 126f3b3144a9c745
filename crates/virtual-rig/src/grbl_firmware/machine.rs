//! The machine behind the firmware: its planner, its counted position, and the true position of the tool head.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};

use nalgebra::Vector3;

use super::settings::GrblSettings;
use super::stored::Stored;
use crate::gantry::Gantry;
use crate::trajectory::Trajectory;

/// How long the jog state lasts after a cancelled jog has come to rest.
const CANCELLED_JOG_S: f64 = 0.4;

/// From the end of a line to the first step of a machine at rest: parsing, planning, and the first segments of steps. On GRBL 1.1h
/// for the ATmega328P 5.0 to 5.4 ms pass to the first step, of which the ramp takes 1.6 ms at the acceleration of that test.
const BEGINS_AFTER_S: f64 = 0.0035;

/// A move in the planner.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Queued {
    to_mm: Vector3<f64>,
    feed_mm_s: f64,
    ends_s: f64,
}

/// The planner's queue and the positions.
///
/// The machine counts its steps in machine coordinates. The true position of the tool head differs by the machine's zero and by
/// every lost step.
#[derive(Debug)]
pub(super) struct Machine {
    settings: GrblSettings,
    gantry: Gantry,
    head_minus_machine_mm: Vector3<f64>,
    planned_mm: Vector3<f64>,
    queue: VecDeque<Queued>,
    /// When a held machine has come to rest.
    held_from_s: Option<f64>,
    jogs_until_s: Option<f64>,
    hit_at_s: Option<f64>,
    released: bool,
    idle_ms: f64,
    hard_limits: bool,
}

impl Machine {
    pub fn new(settings: GrblSettings, trajectory: Arc<Mutex<Trajectory>>) -> Self {
        let gantry = Gantry::new(
            trajectory,
            settings.travel_mm,
            settings.acceleration_mm_s2,
            settings.max_feed_mm_s,
        );
        let mut machine = Self {
            settings,
            gantry,
            head_minus_machine_mm: Vector3::zeros(),
            planned_mm: Vector3::zeros(),
            queue: VecDeque::new(),
            held_from_s: None,
            jogs_until_s: None,
            hit_at_s: None,
            released: true,
            idle_ms: f64::from(settings.idle_ms),
            hard_limits: settings.hard_limits,
        };
        machine.power_up(0.0);
        machine
    }

    /// Resets everything: the tool head stops, and the machine takes its position for zero.
    pub fn power_up(&mut self, now_s: f64) {
        let stopped_mm = self.trajectory().stop(now_s);
        self.head_minus_machine_mm = stopped_mm;
        self.planned_mm = Vector3::zeros();
        self.forget_motion();
        self.released = true;
    }

    /// Applies the stored settings that concern the machine.
    pub fn heed(&mut self, stored: &Stored) {
        self.idle_ms = stored.value(1);
        self.hard_limits = stored.flag(21);
    }

    fn forget_motion(&mut self) {
        self.queue.clear();
        self.held_from_s = None;
        self.jogs_until_s = None;
        self.hit_at_s = None;
    }

    /// The counted position, machine coordinates.
    pub fn at_mm(&self, now_s: f64) -> Vector3<f64> {
        let at_mm = self.trajectory().at(now_s).position_mm - self.head_minus_machine_mm;
        let steps_per_mm = self.settings.steps_per_mm.get();
        at_mm.map(|mm| (mm * steps_per_mm).round() / steps_per_mm)
    }

    /// The end of the last move planned, machine coordinates.
    pub fn planned_mm(&self) -> Vector3<f64> {
        self.planned_mm
    }

    /// Speed at this instant, mm/s.
    pub fn speed_mm_s(&self, now_s: f64) -> f64 {
        self.trajectory().velocity_mm_s(now_s).norm()
    }

    /// Which switches are pressed: each axis has one at either end, on one input.
    pub fn switches(&self, now_s: f64) -> [bool; 3] {
        let at_mm = self.trajectory().at(now_s).position_mm;
        std::array::from_fn(|axis| {
            at_mm[axis] <= 1e-9 || at_mm[axis] >= self.settings.travel_mm[axis].get() - 1e-9
        })
    }

    /// Drops moves that have ended.
    pub fn settle(&mut self, now_s: f64) {
        while self.queue.front().is_some_and(|queued| queued.ends_s <= now_s) {
            self.queue.pop_front();
        }
        if self.jogs_until_s.is_some_and(|until_s| until_s <= now_s) && self.queue.is_empty() {
            self.jogs_until_s = None;
        }
    }

    /// Moves that have not ended.
    pub fn queued(&self) -> usize {
        self.queue.len()
    }

    /// When fewer than `depth` moves will be queued; `None`: not before it is resumed.
    pub fn has_room_at(&self, depth: usize, now_s: f64) -> Option<f64> {
        match (self.queue.len() + 1).checked_sub(depth.max(1)).filter(|&waits_for| waits_for > 0) {
            None => Some(now_s),
            Some(waits_for) => Some(self.queue[waits_for - 1].ends_s).filter(|s| s.is_finite()),
        }
    }

    /// When everything planned will have ended; `None`: not before it is resumed.
    pub fn ends_s(&self, now_s: f64) -> Option<f64> {
        self.queue
            .back()
            .map_or(Some(now_s), |queued| Some(queued.ends_s).filter(|s| s.is_finite()))
    }

    /// Whether a move runs or waits for a resume.
    pub fn is_busy(&self) -> bool {
        !self.queue.is_empty()
    }

    /// When the held machine comes to rest.
    pub fn held_from_s(&self) -> Option<f64> {
        self.held_from_s
    }

    /// When a jog has ended, also as a state.
    pub fn jogs_until_s(&self) -> Option<f64> {
        self.jogs_until_s
    }

    /// When the tool head will run into a switch.
    pub fn hit_at_s(&self) -> Option<f64> {
        self.hit_at_s
    }

    /// Whether pulses go to the motors at this instant, so that ending them loses the position.
    pub fn moves_at(&self, now_s: f64) -> bool {
        match self.held_from_s {
            Some(rests_s) => now_s < rests_s,
            None => self.is_busy(),
        }
    }

    /// Plans a move.
    pub fn plan(&mut self, to_mm: Vector3<f64>, feed_mm_s: f64, now_s: f64) {
        let step_mm = 1.0 / self.settings.steps_per_mm.get();
        let to_mm = to_mm.map(|mm| (mm / step_mm).round() * step_mm);
        self.planned_mm = to_mm;
        self.queue.push_back(Queued { to_mm, feed_mm_s, ends_s: f64::INFINITY });
        if self.held_from_s.is_none() {
            self.run_last(now_s);
        }
    }

    /// As [`Machine::plan`], as a jog.
    pub fn jog(&mut self, to_mm: Vector3<f64>, feed_mm_s: f64, now_s: f64) {
        self.plan(to_mm, feed_mm_s, now_s);
        self.jogs_until_s = self.ends_s(now_s);
    }

    /// Schedules the last move of the queue.
    fn run_last(&mut self, now_s: f64) {
        let Some(&Queued { to_mm, feed_mm_s, .. }) = self.queue.back() else { return };
        self.fall_if_released(now_s);
        self.released = false;
        let from_mm = self.trajectory().end_mm();
        let to_mm = to_mm + self.head_minus_machine_mm;
        let at_rest = self.trajectory().ends_s() <= now_s;
        let begins_s = now_s + if at_rest { BEGINS_AFTER_S } else { 0.0 };
        let mut planned = self.gantry.push(from_mm, to_mm, feed_mm_s, begins_s);
        let leaves = (0..3)
            .filter_map(|axis| {
                let wall_mm = if to_mm[axis] < -1e-9 {
                    0.0
                } else if to_mm[axis] > self.settings.travel_mm[axis].get() + 1e-9 {
                    self.settings.travel_mm[axis].get()
                } else {
                    return None;
                };
                let length_mm = to_mm[axis] - from_mm[axis];
                Some(((wall_mm - from_mm[axis]) / length_mm).clamp(0.0, 1.0))
            })
            .min_by(f64::total_cmp);
        if let Some(fraction) = leaves {
            if self.hard_limits {
                let at_s = planned.time_at_fraction_s(fraction);
                planned.cut_at(at_s);
                self.trajectory().replace_last(planned);
                self.hit_at_s = self.hit_at_s.or(Some(at_s));
            } else {
                // The motors lose steps against the frame.
                self.head_minus_machine_mm += self.gantry.within_frame(to_mm) - to_mm;
            }
        }
        if let Some(last) = self.queue.back_mut() {
            last.ends_s = planned.ends_s();
        }
    }

    /// Slows down to rest and keeps the remaining queue.
    pub fn hold(&mut self, now_s: f64) {
        if self.held_from_s.is_some() {
            return;
        }
        self.settle(now_s);
        self.held_from_s = Some(self.slow_down(now_s));
        self.hit_at_s = None;
        for queued in &mut self.queue {
            queued.ends_s = f64::INFINITY;
        }
    }

    /// Ends the motion along its path; returns when the tool head rests.
    fn slow_down(&mut self, now_s: f64) -> f64 {
        let velocity_mm_s = self.trajectory().velocity_mm_s(now_s);
        let from_mm = self.trajectory().stop(now_s);
        let speed_mm_s = velocity_mm_s.norm();
        let Some(first) = self.queue.front().filter(|_| speed_mm_s > 0.0) else { return now_s };
        let left_mm = (first.to_mm + self.head_minus_machine_mm - from_mm).norm();
        let needs_mm = speed_mm_s * speed_mm_s / (2.0 * self.settings.acceleration_mm_s2.get());
        let rests_mm = from_mm + velocity_mm_s / speed_mm_s * needs_mm.min(left_mm);
        self.gantry.push(from_mm, rests_mm, speed_mm_s, now_s).ends_s()
    }

    /// Goes on with the queue kept at a hold.
    pub fn resume(&mut self, now_s: f64) {
        if self.held_from_s.take().is_none() {
            return;
        }
        for queued in std::mem::take(&mut self.queue) {
            self.queue.push_back(queued);
            self.run_last(now_s);
        }
    }

    /// Slows a jog down and forgets the rest of it.
    pub fn cancel_jog(&mut self, now_s: f64) {
        let rests_s = self.slow_down(now_s);
        self.queue.clear();
        let rests_mm = self.trajectory().end_mm();
        self.planned_mm = rests_mm - self.head_minus_machine_mm;
        self.jogs_until_s = Some(rests_s + CANCELLED_JOG_S);
    }

    /// Drops the planned moves at rest. The position is kept.
    pub fn flush(&mut self, now_s: f64) {
        self.trajectory().stop(now_s);
        self.forget_motion();
        self.planned_mm = self.at_mm(now_s);
    }

    /// The pulses end at once; the tool head coasts by its momentum, which is not counted.
    pub fn lose_position(&mut self, now_s: f64) {
        let (stopped_mm, coast_mm) = self.gantry.cut_pulses(now_s);
        self.forget_motion();
        self.planned_mm = stopped_mm - self.head_minus_machine_mm;
        self.head_minus_machine_mm += coast_mm;
    }

    /// Plans homing: z, then x and y; to the switch, off it, to it again slowly, off it. Returns when it ends.
    pub fn plan_homing(&mut self, axes: [bool; 3], now_s: f64) -> f64 {
        self.fall_if_released(now_s);
        self.released = false;
        let feed_mm_s = self.settings.homing_feed_mm_s.get();
        let pull_off_mm = self.settings.pull_off_mm.get();
        for axis in [2, 0, 1].into_iter().filter(|&axis| axes[axis]) {
            for (to_mm, feed_mm_s) in [
                (0.0, feed_mm_s),
                (pull_off_mm, feed_mm_s),
                (0.0, 0.25 * feed_mm_s),
                (pull_off_mm, feed_mm_s),
            ] {
                let from_mm = self.trajectory().end_mm();
                let mut target_mm = from_mm;
                target_mm[axis] = to_mm;
                self.gantry.push(from_mm, target_mm, feed_mm_s, now_s);
            }
        }
        self.trajectory().ends_s().max(now_s)
    }

    /// Homing has ended: the switches say where the machine is.
    pub fn homed(&mut self, axes: [bool; 3]) {
        let zero_mm = self.settings.machine_zero_mm();
        let end_mm = self.trajectory().end_mm();
        for axis in (0..3).filter(|&axis| axes[axis]) {
            self.head_minus_machine_mm[axis] = zero_mm[axis];
            self.planned_mm[axis] = end_mm[axis] - zero_mm[axis];
        }
    }

    /// When idle motors are switched off, if they will be.
    pub fn releases_at_s(&self) -> Option<f64> {
        let idles = !self.released && self.idle_ms < 255.0 && self.held_from_s.is_none();
        idles.then(|| self.trajectory().ends_s() + self.idle_ms * 1e-3)
    }

    /// Switches the motors off.
    pub fn release(&mut self, now_s: f64) {
        if !std::mem::replace(&mut self.released, true) {
            self.head_minus_machine_mm += self.gantry.fall(self.settings.sag_mm.get(), now_s);
        }
    }

    fn fall_if_released(&mut self, now_s: f64) {
        if let Some(at_s) = self.releases_at_s().filter(|&at_s| at_s <= now_s) {
            self.release(at_s);
        }
    }

    fn trajectory(&self) -> MutexGuard<'_, Trajectory> {
        self.gantry.trajectory()
    }
}
