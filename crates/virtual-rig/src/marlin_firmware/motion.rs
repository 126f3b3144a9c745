//! Coordinates and planning: planned position, counted position, and true position of the tool head.

use std::sync::{Arc, Mutex, MutexGuard};

use nalgebra::Vector3;

use super::settings::MarlinSettings;
use crate::gantry::Gantry;
use crate::trajectory::Trajectory;

/// Distance by which homing backs off the switch before it approaches again, slowly.
const HOMING_BUMP_MM: f64 = 5.0;

/// The planner holds the first move behind an empty queue for this long, so that more can come (`BLOCK_DELAY_FOR_1ST_MOVE`;
/// 109 ms from the line to the first step were measured). The real one lets go as soon as three moves are queued.
const FIRST_MOVE_HOLD_S: f64 = 0.1;

/// A switch reached by a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EndstopHit {
    /// Time, s.
    pub at_s: f64,
    /// The axis, 0 to 2.
    pub axis: usize,
}

/// The firmware's bookkeeping of positions.
///
/// Four positions can differ in a real robot, and a driver must not confuse them: the *logical* one of the commands (shifted by
/// `G92`), the *planned* one, the *counted* one of the motors, and the true one of the *tool head*.
#[derive(Debug)]
pub(super) struct Motion {
    settings: MarlinSettings,
    gantry: Gantry,
    planned_mm: Vector3<f64>,
    head_minus_planned_mm: Vector3<f64>,
    head_minus_counted_mm: Vector3<f64>,
    shift_mm: Vector3<f64>,
    homed: [bool; 3],
    absolute: bool,
    feed_mm_s: f64,
    stepper_timeout_s: f64,
    released: bool,
}

impl Motion {
    pub fn new(settings: MarlinSettings, trajectory: Arc<Mutex<Trajectory>>) -> Self {
        let gantry = Gantry::new(
            trajectory,
            settings.travel_mm,
            settings.acceleration_mm_s2,
            settings.max_feed_mm_s,
        );
        let mut motion = Self {
            settings,
            gantry,
            planned_mm: Vector3::zeros(),
            head_minus_planned_mm: Vector3::zeros(),
            head_minus_counted_mm: Vector3::zeros(),
            shift_mm: Vector3::zeros(),
            homed: [false; 3],
            absolute: true,
            feed_mm_s: 25.0,
            stepper_timeout_s: settings.stepper_timeout_s.get(),
            released: true,
        };
        motion.power_up(0.0);
        motion
    }

    /// Resets everything: the tool head stops, and the firmware takes its position for zero.
    pub fn power_up(&mut self, now_s: f64) {
        let head_mm = self.trajectory().stop(now_s);
        self.planned_mm = Vector3::zeros();
        self.head_minus_planned_mm = head_mm;
        self.head_minus_counted_mm = head_mm;
        self.shift_mm = Vector3::zeros();
        self.homed = [false; 3];
        self.absolute = true;
        self.feed_mm_s = 25.0;
        self.stepper_timeout_s = self.settings.stepper_timeout_s.get();
        self.released = true;
    }

    pub fn set_absolute(&mut self, absolute: bool) {
        self.absolute = absolute;
    }

    pub fn set_feed_mm_min(&mut self, feed_mm_min: f64) {
        if feed_mm_min > 0.0 {
            self.feed_mm_s = feed_mm_min / 60.0;
        }
    }

    pub fn set_stepper_timeout_s(&mut self, timeout_s: f64) {
        self.stepper_timeout_s = timeout_s.max(0.0);
    }

    /// `G92`: gives the present target these coordinates, or zeros if none is given.
    pub fn set_logical(&mut self, coordinates_mm: [Option<f64>; 3]) {
        let all_zero = coordinates_mm == [None; 3];
        for (axis, coordinate_mm) in coordinates_mm.into_iter().enumerate() {
            if let Some(logical_mm) = coordinate_mm.or(all_zero.then_some(0.0)) {
                self.shift_mm[axis] = logical_mm - self.planned_mm[axis];
            }
        }
    }

    /// The target of the last move, in the coordinates of the commands.
    pub fn target_mm(&self) -> Vector3<f64> {
        self.planned_mm + self.shift_mm
    }

    /// The motors' count at `now_s`, in the coordinates of the commands.
    pub fn counted_mm(&self, now_s: f64) -> Vector3<f64> {
        self.trajectory().at(now_s).position_mm - self.head_minus_counted_mm + self.shift_mm
    }

    /// Steps of a position as the firmware's `Count` gives them.
    pub fn steps(&self, logical_mm: Vector3<f64>) -> [i64; 3] {
        let steps_per_mm = self.settings.steps_per_mm.get();
        (logical_mm - self.shift_mm).map(|mm| (mm * steps_per_mm).round() as i64).into()
    }

    /// Which of the minimum switches are pressed.
    pub fn switches(&self, now_s: f64) -> [bool; 3] {
        self.trajectory().at(now_s).position_mm.map(|mm| mm <= 1e-9).into()
    }

    /// When all planned motion has ended.
    pub fn ends_s(&self) -> f64 {
        self.trajectory().ends_s()
    }

    /// Places free in the planner.
    pub fn places(&self, now_s: f64) -> usize {
        self.settings.planner_moves.saturating_sub(self.trajectory().queued(now_s))
    }

    /// When the planner can take a move, if it cannot yet.
    pub fn has_room_at(&self, now_s: f64) -> Option<f64> {
        self.trajectory().has_room_at(self.settings.planner_moves.max(1), now_s)
    }

    /// Plans a move to the given coordinates. Returns the switch that it will reach, if any.
    pub fn plan(&mut self, words_mm: [Option<f64>; 3], now_s: f64) -> Option<EndstopHit> {
        let mut target_mm = self.planned_mm;
        for axis in 0..3 {
            if let Some(word_mm) = words_mm[axis] {
                target_mm[axis] = match self.absolute {
                    true => word_mm - self.shift_mm[axis],
                    false => self.planned_mm[axis] + word_mm,
                };
            }
            if self.homed[axis] {
                let travel_mm = self.settings.travel_mm[axis].get();
                target_mm[axis] = target_mm[axis].clamp(0.0, travel_mm);
            }
        }
        self.fall_if_released(now_s);
        self.released = false;
        let step_mm = 1.0 / self.settings.steps_per_mm.get();
        let on_a_step = |mm: f64| (mm / step_mm).round() * step_mm;
        let from_mm = self.trajectory().end_mm();
        let to_mm = target_mm.map(on_a_step) + self.head_minus_planned_mm;
        self.planned_mm = target_mm;
        if (to_mm - from_mm).norm() < 0.5 * step_mm {
            return None;
        }
        self.run(from_mm, to_mm, now_s)
    }

    /// Plans homing of the given axes: to the switch, off it, and to it again, slowly. Returns when it ends.
    pub fn plan_homing(&mut self, axes: [bool; 3], now_s: f64) -> f64 {
        self.fall_if_released(now_s);
        self.released = false;
        let feed_mm_s = self.settings.homing_feed_mm_s.get();
        for axis in (0..3).filter(|&axis| axes[axis]) {
            for (to_mm, feed_mm_s) in
                [(0.0, feed_mm_s), (HOMING_BUMP_MM, feed_mm_s), (0.0, 0.25 * feed_mm_s)]
            {
                let from_mm = self.trajectory().end_mm();
                let mut target_mm = from_mm;
                target_mm[axis] = to_mm;
                self.gantry.push(from_mm, target_mm, feed_mm_s, now_s);
            }
        }
        self.ends_s()
    }

    /// Homing has ended: the switches are zero.
    pub fn homed(&mut self, axes: [bool; 3]) {
        for axis in (0..3).filter(|&axis| axes[axis]) {
            self.planned_mm[axis] = 0.0;
            self.head_minus_planned_mm[axis] = 0.0;
            self.head_minus_counted_mm[axis] = 0.0;
            self.shift_mm[axis] = 0.0;
            self.homed[axis] = true;
        }
    }

    /// `M410`: the pulses end at once; the tool head coasts by its momentum, which is not counted.
    pub fn quick_stop(&mut self, now_s: f64) {
        let (stopped_mm, coast_mm) = self.gantry.cut_pulses(now_s);
        self.planned_mm = stopped_mm - self.head_minus_counted_mm;
        self.head_minus_counted_mm += coast_mm;
        self.head_minus_planned_mm = self.head_minus_counted_mm;
    }

    /// Switches the motors off (`M84`, or the idle time-out).
    pub fn release(&mut self, now_s: f64) {
        if !self.released {
            self.released = true;
            self.fall(now_s.max(self.ends_s()));
        }
    }

    /// When idle motors are switched off, if they will be.
    pub fn releases_at_s(&self) -> Option<f64> {
        (!self.released && self.stepper_timeout_s > 0.0)
            .then(|| self.ends_s() + self.stepper_timeout_s)
    }

    fn fall_if_released(&mut self, now_s: f64) {
        if let Some(at_s) = self.releases_at_s().filter(|&at_s| at_s <= now_s) {
            self.release(at_s);
        }
    }

    fn fall(&mut self, at_s: f64) {
        let fallen_mm = self.gantry.fall(self.settings.sag_mm.get(), at_s);
        self.head_minus_planned_mm += fallen_mm;
        self.head_minus_counted_mm += fallen_mm;
    }

    /// Plans a move and applies the limits of switches and frame.
    fn run(
        &mut self,
        from_mm: Vector3<f64>,
        to_mm: Vector3<f64>,
        now_s: f64,
    ) -> Option<EndstopHit> {
        let hold_s = if self.ends_s() <= now_s { FIRST_MOVE_HOLD_S } else { 0.0 };
        let mut planned = self.gantry.push(from_mm, to_mm, self.feed_mm_s, now_s + hold_s);
        let switch = (0..3)
            .filter(|&axis| to_mm[axis] < -1e-9 && to_mm[axis] < from_mm[axis])
            .map(|axis| (from_mm[axis].max(0.0) / (from_mm[axis] - to_mm[axis]), axis))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((fraction, axis)) = switch {
            let at_s = planned.time_at_fraction_s(fraction);
            planned.cut_at(at_s);
            self.trajectory().replace_last(planned);
            // The rest of the move does not run, but the planner counts it as done.
            self.head_minus_planned_mm += planned.end_mm() - to_mm;
            return Some(EndstopHit { at_s, axis });
        }
        // There is no switch at the far ends: the motors lose steps against the frame.
        let lost_mm = self.gantry.within_frame(to_mm) - to_mm;
        self.head_minus_planned_mm += lost_mm;
        self.head_minus_counted_mm += lost_mm;
        None
    }

    fn trajectory(&self) -> MutexGuard<'_, Trajectory> {
        self.gantry.trajectory()
    }
}
