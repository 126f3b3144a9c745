//! The mechanics that any robot firmware drives: motors that run planned moves, a frame that ends the travel, and momentum.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nalgebra::Vector3;

use super::planner::{PlannedMove, feed_within};
use super::trajectory::Trajectory;
use fieldgap_input::{Exact, Length, Positive, Speed};

/// Acceleration and speed of motion without motors: a falling axis, or a tool head that coasts after the step pulses ended.
const FREE_ACCELERATION_MM_S2: f64 = 1e4;
const FREE_SPEED_MM_S: f64 = 1e3;

/// A gantry with three axes. Positions are in mm from the switches at the low ends.
#[derive(Debug)]
pub(super) struct Gantry {
    trajectory: Arc<Mutex<Trajectory>>,
    travel_mm: Vector3<f64>,
    acceleration_mm_s2: f64,
    max_feed_mm_s: Exact<Speed, 3>,
}

impl Gantry {
    /// A gantry of these limits on each axis.
    pub fn new(
        trajectory: Arc<Mutex<Trajectory>>,
        travel_mm: Exact<Length, 3>,
        acceleration_mm_s2: Positive,
        max_feed_mm_s: Exact<Speed, 3>,
    ) -> Self {
        let travel_mm = Vector3::from(travel_mm.map(f64::from));
        let acceleration_mm_s2 = acceleration_mm_s2.get();
        Self { trajectory, travel_mm, acceleration_mm_s2, max_feed_mm_s }
    }

    /// Its whole motion, past and planned.
    pub fn trajectory(&self) -> MutexGuard<'_, Trajectory> {
        self.trajectory.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Plans a move after all others, at the given speed or the highest that every axis allows. A move of length zero is not
    /// kept.
    pub fn push(
        &mut self,
        from_mm: Vector3<f64>,
        to_mm: Vector3<f64>,
        feed_mm_s: f64,
        now_s: f64,
    ) -> PlannedMove {
        let path_mm = to_mm - from_mm;
        let feed_mm_s = feed_within(path_mm, feed_mm_s, self.max_feed_mm_s);
        let mut trajectory = self.trajectory();
        let starts_s = now_s.max(trajectory.ends_s());
        let planned =
            PlannedMove::new(from_mm, to_mm, self.acceleration_mm_s2, feed_mm_s, starts_s);
        if path_mm.norm() > 0.0 {
            trajectory.push(planned);
        }
        planned
    }

    /// The nearest place within the frame.
    pub fn within_frame(&self, position_mm: Vector3<f64>) -> Vector3<f64> {
        position_mm.sup(&Vector3::zeros()).inf(&self.travel_mm)
    }

    /// Ends the step pulses at once. Returns where that happens, and the distance that the tool head coasts from there, mm.
    pub fn cut_pulses(&mut self, now_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let velocity_mm_s = self.trajectory().velocity_mm_s(now_s);
        let stopped_mm = self.trajectory().stop(now_s);
        let coast_mm = velocity_mm_s * velocity_mm_s.norm() / (2.0 * self.acceleration_mm_s2);
        if coast_mm.norm() == 0.0 {
            return (stopped_mm, Vector3::zeros());
        }
        let rests_mm = self.within_frame(stopped_mm + coast_mm);
        self.slide(stopped_mm, rests_mm, now_s);
        (stopped_mm, rests_mm - stopped_mm)
    }

    /// Lets the z axis fall by `sag_mm`, at most onto its switch. Returns the displacement, mm.
    pub fn fall(&mut self, sag_mm: f64, at_s: f64) -> Vector3<f64> {
        let from_mm = self.trajectory().end_mm();
        let fallen_mm = Vector3::new(0.0, 0.0, -sag_mm.min(from_mm.z.max(0.0)));
        if fallen_mm.z < 0.0 {
            self.slide(from_mm, from_mm + fallen_mm, at_s);
        }
        fallen_mm
    }

    fn slide(&mut self, from_mm: Vector3<f64>, to_mm: Vector3<f64>, at_s: f64) {
        let slide =
            PlannedMove::new(from_mm, to_mm, FREE_ACCELERATION_MM_S2, FREE_SPEED_MM_S, at_s);
        self.trajectory().push(slide);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::literal;

    fn gantry() -> Gantry {
        let travel_mm = Vector3::new(300.0, 300.0, 250.0);
        let trajectory = Trajectory::new(Vector3::new(100.0, 100.0, 0.4), travel_mm);
        let travel_mm = [300.0, 300.0, 250.0].map(literal).into();
        let feeds_mm_s = [50.0; 3].map(literal).into();
        Gantry::new(Arc::new(Mutex::new(trajectory)), travel_mm, literal(500.0), feeds_mm_s)
    }

    #[test]
    fn cut_in_full_motion_it_coasts_by_the_speed_squared_over_twice_the_deceleration() {
        let mut gantry = gantry();
        let from_mm = gantry.trajectory().end_mm();
        gantry.push(from_mm, from_mm + Vector3::x() * 100.0, 200.0, 0.0);
        let (stopped_mm, coast_mm) = gantry.cut_pulses(1.0);
        // Limited to 50 mm/s, which is reached after 0.1 s and 2.5 mm.
        assert!((stopped_mm.x - 147.5).abs() < 1e-9, "{stopped_mm}");
        assert!((coast_mm - Vector3::x() * 2.5).norm() < 1e-9, "{coast_mm}");
        assert_eq!(gantry.cut_pulses(9.0).1, Vector3::zeros(), "at rest nothing coasts");
    }

    #[test]
    fn it_falls_no_lower_than_its_switch() {
        let mut gantry = gantry();
        assert_eq!(gantry.fall(1.0, 0.0), Vector3::new(0.0, 0.0, -0.4));
        assert_eq!(gantry.fall(1.0, 5.0).norm(), 0.0);
    }
}
