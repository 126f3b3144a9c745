//! A real robot, as the virtual receiver that it carries knows it: by what it is told to do and what it reports.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;

use super::clock::Clock;
use super::planner::PlannedMove;
use super::trajectory::Trajectory;
use fieldgap_input::Positive;
use fieldgap_rig::{Feed, RobotObserver, RobotPosition};

/// Acceleration and speed by which the shadow goes to a reported place at once: 100 mm take 0.1 ms.
const AT_ONCE_MM_S2: f64 = 1e12;
const AT_ONCE_MM_S: f64 = 1e6;

/// The place of a real robot at any instant. A move is assumed to begin when it is sent, and to run with the feed of the rig file
/// and the acceleration of `[virtual.robot]`. When the robot reports where it stands, the shadow is there.
pub struct RobotShadow {
    pub(super) trajectory: Arc<Mutex<Trajectory>>,
    pub(super) clock: Arc<Clock>,
    pub(super) acceleration_mm_s2: Positive,
    /// The robot's zero from the world's, mm.
    pub(super) zero_mm: Vector3<f64>,
}

impl RobotShadow {
    fn goes_to(&self, to: RobotPosition, acceleration_mm_s2: f64, speed_mm_s: f64) {
        let now_s = self.clock.now_s();
        let to_mm = Vector3::from(to.axes_m()) * 1e3 + self.zero_mm;
        let mut trajectory = self.trajectory();
        let from_mm = trajectory.stop(now_s);
        if (to_mm - from_mm).norm() > 0.0 {
            trajectory.push(PlannedMove::new(
                from_mm,
                to_mm,
                acceleration_mm_s2,
                speed_mm_s,
                now_s,
            ));
        }
    }

    fn trajectory(&self) -> MutexGuard<'_, Trajectory> {
        self.trajectory.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl RobotObserver for RobotShadow {
    fn sets_out(&mut self, target: RobotPosition, feed: Feed) {
        self.goes_to(target, self.acceleration_mm_s2.get(), feed.mm_s().get());
    }

    fn stands(&mut self, position: RobotPosition) {
        self.goes_to(position, AT_ONCE_MM_S2, AT_ONCE_MM_S);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::Pace;

    #[test]
    fn it_is_on_its_way_during_a_move_and_where_the_robot_reports_to_be_afterwards() {
        let positive = |value| Positive::new(value).expect("above zero");
        let travel_mm = Vector3::new(300.0, 300.0, 250.0);
        let trajectory = Arc::new(Mutex::new(Trajectory::new(Vector3::zeros(), travel_mm)));
        let clock = Arc::new(Clock::new(Pace::Lockstep));
        let mut shadow = RobotShadow {
            trajectory: trajectory.clone(),
            clock: clock.clone(),
            acceleration_mm_s2: positive(1000.0),
            zero_mm: Vector3::new(5.0, 0.0, 0.0),
        };
        let x_mm = |at_s: f64| trajectory.lock().expect("not poisoned").at(at_s).position_mm.x;
        let at = |x_mm: f64| RobotPosition::from_axes_mm([x_mm, 0.0, 0.0]);
        clock.jump_to(1.0);
        shadow.stands(at(0.0));
        clock.jump_to(2.0);
        shadow.sets_out(at(100.0), Feed::from_mm_s(positive(100.0)));
        // 100 mm at 100 mm/s, with 0.1 s for each ramp: half of the way after 0.55 s.
        assert!((x_mm(2.55) - 55.0).abs() < 1e-9, "{}", x_mm(2.55));
        clock.jump_to(2.8);
        shadow.stands(at(99.99));
        assert!((x_mm(2.801) - 104.99).abs() < 1e-9, "{}", x_mm(2.801));
        assert!((x_mm(9.0) - 104.99).abs() < 1e-9);
        // A robot that was sent on before it was thought to have arrived goes on from there.
        clock.jump_to(9.0);
        shadow.sets_out(at(0.0), Feed::from_mm_s(positive(100.0)));
        clock.jump_to(9.5);
        let before_mm = x_mm(9.5);
        shadow.sets_out(at(100.0), Feed::from_mm_s(positive(100.0)));
        assert!((x_mm(9.5) - before_mm).abs() < 1e-9);
    }
}
