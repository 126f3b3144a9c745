//! The robot's motion from stop to stop, and its position when a reading is taken.
//!
//! The robot goes at constant speed from each stop to the next, so at a stop it has the speed of its approach. A lagging receiver
//! reads the field at an earlier point of that path.

use super::survey::Stop;
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::trajectory::Kinematics;

/// The motion that each stop's reading belongs to, `lag_s` before the stop.
///
/// Where the lag is longer than the time since the last stop, the path is extended as a straight line.
pub(super) fn kinematics(stops: &[Stop], lag_s: f64) -> Vec<Kinematics> {
    let mut x_direction = 0.0;
    let mut x_since_reversal_mm = 0.0;
    let mut travelled_mm = 0.0;
    let mut before: Option<&Stop> = None;
    stops
        .iter()
        .map(|stop| {
            let mut velocity_mm_s = Vec3::zeros();
            if let Some(before) = before {
                let step_mm = stop.at_mm - before.at_mm;
                velocity_mm_s = step_mm / (stop.time_s - before.time_s);
                if step_mm.x != 0.0 && step_mm.x.signum() != x_direction {
                    x_direction = step_mm.x.signum();
                    x_since_reversal_mm = 0.0;
                }
                x_since_reversal_mm += step_mm.x.abs();
                travelled_mm += step_mm.norm();
            }
            before = Some(stop);
            Kinematics {
                position_mm: stop.at_mm - velocity_mm_s * lag_s,
                x_direction,
                x_since_reversal_mm,
                travelled_mm,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stop(time_s: f64, x_mm: f64, y_mm: f64) -> Stop {
        Stop { time_s, focus: Some(0), at_mm: Vec3::new(x_mm, y_mm, 50.0) }
    }

    #[test]
    fn a_lagging_position_trails_along_the_path_and_the_direction_is_kept_between_rows() {
        let path =
            [stop(0.0, 0.0, 0.0), stop(0.1, 2.0, 0.0), stop(0.2, 2.0, 2.0), stop(0.3, 0.0, 2.0)];
        let motions = kinematics(&path, 0.05);
        let places: Vec<Vec3> = motions.iter().map(|kinematics| kinematics.position_mm).collect();
        let expected = [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (1.0, 2.0)];
        for (place, (x, y)) in places.iter().zip(expected) {
            assert!((place - Vec3::new(x, y, 50.0)).norm() < 1e-12);
        }
        let directions: Vec<f64> =
            motions.iter().map(|kinematics| kinematics.x_direction).collect();
        assert_eq!(directions, [0.0, 1.0, 1.0, -1.0]);
        assert_eq!(motions[3].x_since_reversal_mm, 2.0);
    }
}
