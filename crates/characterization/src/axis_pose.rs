//! The axis of a transducer.

use serde::Serialize;

use super::Readings;
use fieldgap_acoustics::Vec3;

/// A transducer's axis: its foot on the plane of the face, and its slope.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AxisPose {
    /// Foot relative to the nominal transducer, metres.
    pub foot_m: [f64; 2],
    /// Slope along x and y.
    pub lean: [f64; 2],
}

/// A point relative to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxisCoordinates {
    /// Distance from the foot, metres.
    pub distance_m: f64,
    /// Height along the axis, metres.
    pub height_m: f64,
    /// Angle from the axis, rad.
    pub theta_rad: f64,
}

impl AxisPose {
    /// Initial estimate: a line through the centroids of the readings above half of the maximum at each height.
    pub(super) fn estimate(readings: &Readings) -> Self {
        let mut largest = vec![0.0_f64; readings.heights_m.len()];
        for (&value, &height) in readings.values.iter().zip(&readings.height_of) {
            largest[height] = largest[height].max(value);
        }
        let mut sums = vec![[0.0; 3]; readings.heights_m.len()];
        for ((at_m, &value), &height) in
            readings.at_m.iter().zip(&readings.values).zip(&readings.height_of)
        {
            if value > 0.5 * largest[height] {
                let weight = value * value;
                let sum = &mut sums[height];
                *sum = [sum[0] + weight, sum[1] + weight * at_m.x, sum[2] + weight * at_m.y];
            }
        }
        let line = |axis: usize| {
            let points: Vec<(f64, f64)> = readings
                .heights_m
                .iter()
                .zip(&sums)
                .filter(|(_, sum)| sum[0] > 0.0)
                .map(|(&height, sum)| (height, sum[axis] / sum[0]))
                .collect();
            let count = points.len() as f64;
            let mean = |read: &dyn Fn(&(f64, f64)) -> f64| {
                points.iter().map(read).sum::<f64>() / count.max(1.0)
            };
            let (h, along) = (mean(&|p| p.0), mean(&|p| p.1));
            let cross: f64 = points.iter().map(|p| (p.0 - h) * (p.1 - along)).sum();
            let square: f64 = points.iter().map(|p| (p.0 - h).powi(2)).sum();
            let lean = if square > 0.0 { cross / square } else { 0.0 };
            (along - lean * h, lean)
        };
        let ((x, lean_x), (y, lean_y)) = (line(1), line(2));
        Self { foot_m: [x, y], lean: [lean_x, lean_y] }
    }

    /// Direction, unit vector.
    pub fn direction(&self) -> Vec3 {
        Vec3::new(self.lean[0], self.lean[1], 1.0).normalize()
    }

    /// Angle between the axis and the vertical, rad.
    pub fn tilt_rad(&self) -> f64 {
        self.lean[0].hypot(self.lean[1]).atan()
    }

    pub(super) fn coordinates(&self, at_m: &[Vec3]) -> Vec<AxisCoordinates> {
        let direction = self.direction();
        let foot = Vec3::new(self.foot_m[0], self.foot_m[1], 0.0);
        at_m.iter()
            .map(|at_m| {
                let from_foot = at_m - foot;
                let height_m = from_foot.dot(&direction);
                let lateral_m = (from_foot - height_m * direction).norm();
                AxisCoordinates {
                    distance_m: from_foot.norm(),
                    height_m,
                    theta_rad: lateral_m.atan2(height_m).min(std::f64::consts::FRAC_PI_2),
                }
            })
            .collect()
    }
}
