//! How the carriage moves from stop to stop, and where it is when a reading is taken.
//!
//! It goes at constant speed from each stop to the next, so at a stop it has the speed with which it came. A receiver that
//! lags hears the field of some moments earlier on that way.

use super::survey::Stop;
use fieldgap_acoustics::Vec3;
use fieldgap_virtual_rig::trajectory::Carriage;

/// The carriage as each stop's reading hears it, `lag_s` before the stop.
///
/// The way is taken as going on straight where the lag is longer than the time since the last stop.
pub(super) fn carriages(stops: &[Stop], lag_s: f64) -> Vec<Carriage> {
    let mut x_direction = 0.0;
    let mut x_since_reversal_mm = 0.0;
    let mut travelled_mm = 0.0;
    let mut before: Option<&Stop> = None;
    stops
        .iter()
        .map(|stop| {
            let mut velocity_mm_s = Vec3::zeros();
            if let Some(before) = before {
                let way_mm = stop.at_mm - before.at_mm;
                velocity_mm_s = way_mm / (stop.time_s - before.time_s);
                if way_mm.x != 0.0 && way_mm.x.signum() != x_direction {
                    x_direction = way_mm.x.signum();
                    x_since_reversal_mm = 0.0;
                }
                x_since_reversal_mm += way_mm.x.abs();
                travelled_mm += way_mm.norm();
            }
            before = Some(stop);
            Carriage {
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
    fn what_is_heard_trails_along_the_travel_and_the_direction_is_kept_between_rows() {
        let way =
            [stop(0.0, 0.0, 0.0), stop(0.1, 2.0, 0.0), stop(0.2, 2.0, 2.0), stop(0.3, 0.0, 2.0)];
        let heard = carriages(&way, 0.05);
        let places: Vec<Vec3> = heard.iter().map(|carriage| carriage.position_mm).collect();
        let expected = [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (1.0, 2.0)];
        for (place, (x, y)) in places.iter().zip(expected) {
            assert!((place - Vec3::new(x, y, 50.0)).norm() < 1e-12);
        }
        let directions: Vec<f64> = heard.iter().map(|carriage| carriage.x_direction).collect();
        assert_eq!(directions, [0.0, 1.0, 1.0, -1.0]);
        assert_eq!(heard[3].x_since_reversal_mm, 2.0);
    }
}
