//! The robot's true motion at any instant: its planned moves, past and queued.

use std::collections::VecDeque;

use nalgebra::Vector3;

use super::planner::PlannedMove;

/// Ended moves that are kept, for a receiver that lags or streams while the clock jumps.
const REMEMBERED_MOVES: usize = 4096;

/// Position and direction of travel at one instant, in the robot's own axes (its switches at zero).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinematics {
    /// Position, millimetres.
    pub position_mm: Vector3<f64>,
    /// The last direction of travel along x: +1, -1, or 0 if it has not moved along x yet.
    pub x_direction: f64,
    /// Distance travelled along x since that direction was last reversed, millimetres.
    pub x_since_reversal_mm: f64,
    /// Length of the path since power-up, millimetres.
    pub travelled_mm: f64,
}

#[derive(Debug, Clone, Copy)]
struct Leg {
    planned: PlannedMove,
    x_direction_before: f64,
    x_since_reversal_before_mm: f64,
    travelled_before_mm: f64,
}

impl Leg {
    fn at(&self, time_s: f64) -> Kinematics {
        let position_mm = self.planned.position_mm(time_s);
        let way_mm = position_mm - self.planned.start_mm();
        let dx_mm = way_mm.x;
        let (x_direction, x_since_reversal_mm) = if dx_mm == 0.0 {
            (self.x_direction_before, self.x_since_reversal_before_mm)
        } else if dx_mm.signum() == self.x_direction_before {
            (self.x_direction_before, self.x_since_reversal_before_mm + dx_mm.abs())
        } else {
            (dx_mm.signum(), dx_mm.abs())
        };
        let travelled_mm = self.travelled_before_mm + way_mm.norm();
        Kinematics { position_mm, x_direction, x_since_reversal_mm, travelled_mm }
    }
}

/// The whole motion of the tool head.
#[derive(Debug)]
pub struct Trajectory {
    parked_mm: Vector3<f64>,
    legs: VecDeque<Leg>,
    travel_mm: Vector3<f64>,
}

impl Trajectory {
    /// A tool head at rest at `parked_mm`, with a physical travel from 0 to `travel_mm` on each axis.
    pub fn new(parked_mm: Vector3<f64>, travel_mm: Vector3<f64>) -> Self {
        Self { parked_mm, legs: VecDeque::new(), travel_mm }
    }

    /// The tool head at `time_s`.
    pub fn at(&self, time_s: f64) -> Kinematics {
        let after = self.legs.partition_point(|leg| leg.planned.starts_s() <= time_s);
        let mut kinematics = match after.checked_sub(1) {
            Some(last) => self.legs[last].at(time_s),
            None => {
                let position_mm =
                    self.legs.front().map_or(self.parked_mm, |leg| leg.planned.start_mm());
                Kinematics {
                    position_mm,
                    x_direction: 0.0,
                    x_since_reversal_mm: 0.0,
                    travelled_mm: 0.0,
                }
            }
        };
        kinematics.position_mm = self.within_frame(kinematics.position_mm);
        kinematics
    }

    /// Past its end of travel the tool head presses against the frame and its motors lose steps.
    fn within_frame(&self, position_mm: Vector3<f64>) -> Vector3<f64> {
        position_mm.sup(&Vector3::zeros()).inf(&self.travel_mm)
    }

    /// The position at the end of all planned motion.
    pub fn end_mm(&self) -> Vector3<f64> {
        let end_mm = self.legs.back().map_or(self.parked_mm, |leg| leg.planned.end_mm());
        self.within_frame(end_mm)
    }

    /// When all planned motion has ended (0 if there never was any).
    pub fn ends_s(&self) -> f64 {
        self.legs.back().map_or(0.0, |leg| leg.planned.ends_s())
    }

    /// The number of moves that have not ended at `now_s`.
    pub fn queued(&self, now_s: f64) -> usize {
        self.legs.len() - self.legs.partition_point(|leg| leg.planned.ends_s() <= now_s)
    }

    /// When fewer than `depth` moves will be queued, if that is after `now_s`.
    pub fn has_room_at(&self, depth: usize, now_s: f64) -> Option<f64> {
        let queued = self.queued(now_s);
        let waits_for = (queued + 1).checked_sub(depth).filter(|&waits_for| waits_for > 0)?;
        let first = self.legs.len() - queued;
        Some(self.legs[first + waits_for - 1].planned.ends_s())
    }

    /// Appends a move; it must start at or after the end of the last one.
    pub fn push(&mut self, planned: PlannedMove) {
        let before = match self.legs.back() {
            Some(leg) => leg.at(leg.planned.ends_s()),
            None => self.at(0.0),
        };
        self.legs.push_back(Leg {
            planned,
            x_direction_before: before.x_direction,
            x_since_reversal_before_mm: before.x_since_reversal_mm,
            travelled_before_mm: before.travelled_mm,
        });
        if self.legs.len() > REMEMBERED_MOVES {
            self.legs.pop_front();
        }
    }

    /// Puts a move in place of the one pushed last.
    pub fn replace_last(&mut self, planned: PlannedMove) {
        if let Some(leg) = self.legs.back_mut() {
            leg.planned = planned;
        }
    }

    /// The velocity at `time_s`, millimetres a second; zero at rest.
    pub fn velocity_mm_s(&self, time_s: f64) -> Vector3<f64> {
        let after = self.legs.partition_point(|leg| leg.planned.starts_s() <= time_s);
        match after.checked_sub(1) {
            Some(last) => self.legs[last].planned.velocity_mm_s(time_s),
            None => Vector3::zeros(),
        }
    }

    /// Stops at once at `now_s` and drops all later moves. Returns the position.
    pub fn stop(&mut self, now_s: f64) -> Vector3<f64> {
        while self.legs.back().is_some_and(|leg| leg.planned.starts_s() >= now_s) {
            let dropped = self.legs.pop_back();
            if self.legs.is_empty()
                && let Some(leg) = dropped
            {
                self.parked_mm = leg.planned.start_mm();
            }
        }
        if let Some(leg) = self.legs.back_mut() {
            leg.planned.cut_at(now_s);
        }
        self.at(now_s).position_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> Vector3<f64> {
        Vector3::new(x, y, z)
    }

    fn two_moves() -> Trajectory {
        let mut trajectory = Trajectory::new(v(10.0, 10.0, 10.0), v(300.0, 300.0, 250.0));
        let there = PlannedMove::new(v(10.0, 10.0, 10.0), v(20.0, 10.0, 10.0), 100.0, 10.0, 1.0);
        trajectory.push(there);
        let ends_s = trajectory.ends_s();
        trajectory.push(PlannedMove::new(
            v(20.0, 10.0, 10.0),
            v(15.0, 10.0, 10.0),
            100.0,
            10.0,
            ends_s,
        ));
        trajectory
    }

    #[test]
    fn the_past_can_be_asked_for_while_moves_are_queued() {
        let trajectory = two_moves();
        assert_eq!(trajectory.at(0.5).position_mm, v(10.0, 10.0, 10.0));
        assert_eq!(trajectory.queued(1.0), 2);
        assert_eq!(trajectory.at(1.0 + 1.1).position_mm, v(20.0, 10.0, 10.0));
        assert_eq!(trajectory.at(99.0).position_mm, v(15.0, 10.0, 10.0));
        assert_eq!(trajectory.queued(99.0), 0);
    }

    #[test]
    fn a_full_queue_has_room_when_its_oldest_move_ends() {
        let trajectory = two_moves();
        assert_eq!(trajectory.has_room_at(3, 1.0), None);
        assert_eq!(trajectory.has_room_at(2, 1.0), Some(2.1));
        assert_eq!(trajectory.has_room_at(2, 2.5), None);
    }

    #[test]
    fn the_direction_along_x_turns_with_the_travel() {
        let trajectory = two_moves();
        assert_eq!(trajectory.at(0.0).x_direction, 0.0);
        assert_eq!(trajectory.at(2.0).x_direction, 1.0);
        let at_the_end = trajectory.at(99.0);
        assert_eq!((at_the_end.x_direction, at_the_end.x_since_reversal_mm), (-1.0, 5.0));
    }

    #[test]
    fn the_travelled_distance_adds_up_over_moves_and_does_not_change_at_rest() {
        let trajectory = two_moves();
        let travelled_mm = |time_s: f64| trajectory.at(time_s).travelled_mm;
        assert_eq!([travelled_mm(0.5), travelled_mm(2.1)], [0.0, 10.0]);
        assert_eq!([travelled_mm(50.0), travelled_mm(99.0)], [15.0, 15.0]);
        assert!((0.0..10.0).contains(&travelled_mm(1.5)));
    }

    #[test]
    fn a_stop_leaves_the_tool_head_at_its_position() {
        let mut trajectory = two_moves();
        let stopped_mm = trajectory.stop(1.5);
        assert_eq!(trajectory.at(99.0).position_mm, stopped_mm);
        assert!(stopped_mm.x > 10.0 && stopped_mm.x < 20.0);
        assert_eq!(trajectory.queued(1.5), 0);
    }
}
