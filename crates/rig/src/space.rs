//! Where the robot is, how fast it goes, and how its axes lie to the array's.

use std::fmt;

use nalgebra::Vector3;

use fieldgap_input::Positive;

/// A place in the robot's own axes, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotPosition {
    /// Along the robot's x axis, m.
    pub x_m: f64,
    /// Along the robot's y axis, m.
    pub y_m: f64,
    /// Along the robot's z axis, m.
    pub z_m: f64,
}

impl RobotPosition {
    /// A place given axis by axis, m.
    pub fn from_axes_m([x_m, y_m, z_m]: [f64; 3]) -> Self {
        Self { x_m, y_m, z_m }
    }

    /// A place given axis by axis, mm.
    pub fn from_axes_mm(axes_mm: [f64; 3]) -> Self {
        Self::from_axes_m(axes_mm.map(|mm| mm * 1e-3))
    }

    /// The coordinates x, y, z, m.
    pub fn axes_m(self) -> [f64; 3] {
        [self.x_m, self.y_m, self.z_m]
    }

    /// The coordinates x, y, z, mm.
    pub fn axes_mm(self) -> [f64; 3] {
        self.axes_m().map(|m| m * 1e3)
    }

    /// Length of the straight path to `other`, m.
    pub fn distance_m(self, other: Self) -> f64 {
        (Vector3::from(self.axes_m()) - Vector3::from(other.axes_m())).norm()
    }

    /// The largest difference along any one axis, m: how far a readback is from a command.
    pub fn largest_axis_difference_m(self, other: Self) -> f64 {
        let differences = Vector3::from(self.axes_m()) - Vector3::from(other.axes_m());
        differences.amax()
    }

    /// Whether the two differ by no more than `tolerance_m` along each axis. What is no number is within nothing.
    pub fn is_within(self, tolerance_m: f64, other: Self) -> bool {
        let (here, there) = (self.axes_m(), other.axes_m());
        (0..3).all(|axis| (here[axis] - there[axis]).abs() <= tolerance_m)
    }
}

impl fmt::Display for RobotPosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.axes_mm();
        write!(f, "({x:.2}, {y:.2}, {z:.2}) mm")
    }
}

/// Speed of a move along its path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feed {
    mm_s: Positive,
}

impl Feed {
    /// A speed in millimetres a second.
    pub fn from_mm_s(mm_s: Positive) -> Self {
        Self { mm_s }
    }

    /// The speed, mm/s.
    pub fn mm_s(self) -> Positive {
        self.mm_s
    }

    /// The speed, m/s.
    pub fn m_s(self) -> f64 {
        self.mm_s.get() * 1e-3
    }

    /// The speed as G-code wants it, mm/min.
    pub fn mm_min(self) -> f64 {
        self.mm_s.get() * 60.0
    }
}

/// How the array lies in the robot's axes: the axes are parallel, the origins apart.
///
/// A turn between the two is not set here: it is found from the scan itself by registration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The array's centre in the robot's axes, m.
    pub origin_m: Vector3<f64>,
}

impl Frame {
    /// A point of the array's frame (m) in the robot's axes.
    pub fn to_robot(&self, point_m: Vector3<f64>) -> RobotPosition {
        RobotPosition::from_axes_m((point_m + self.origin_m).into())
    }

    /// A place in the robot's axes as a point of the array's frame, m.
    pub fn to_array(&self, position: RobotPosition) -> Vector3<f64> {
        Vector3::from(position.axes_m()) - self.origin_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_array_centre_lies_at_the_frame_origin() {
        let frame = Frame { origin_m: Vector3::new(0.15, 0.15, -0.02) };
        let robot = frame.to_robot(Vector3::new(0.01, -0.02, 0.1));
        let expected = RobotPosition::from_axes_mm([160.0, 130.0, 80.0]);
        assert!(robot.largest_axis_difference_m(expected) < 1e-12, "{robot}");
        assert!((frame.to_array(robot) - Vector3::new(0.01, -0.02, 0.1)).norm() < 1e-12);
    }

    #[test]
    fn a_feed_of_80_mm_a_second_is_f4800() {
        let feed = Feed::from_mm_s(Positive::new(80.0).expect("positive"));
        assert!((feed.mm_min() - 4800.0).abs() < 1e-9);
    }
}
