//! Where the scan's coordinates lie in the array's.
//!
//! A point that the robot calls `s` stands, in the array's coordinates, at
//!
//! ```text
//! (x, y) = turn · mirror · (step_ratio · (s_x, s_y)) + (shift_x, shift_y)
//!  z     = s_z + shift_z
//! ```
//!
//! so the shift is where the scan's origin lies in the array's frame, and a mirror is of one axis of
//! the scan. Mirroring both axes is a half turn, not a mirror.

use nalgebra::Vector2;
use serde::Serialize;
use serde::ser::SerializeStruct;

use crate::acoustics::Vec3;

/// Which axis of the scan runs against the array's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mirror {
    /// Neither: same handedness.
    #[default]
    None,
    /// The scan's x axis.
    X,
    /// The scan's y axis.
    Y,
}

/// The place of the scan's coordinates in the array's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Axis that is mirrored, before the turn.
    pub mirror: Mirror,
    /// Turn about z, counter-clockwise, radians.
    pub turn_rad: f64,
    /// True step over recorded step, in x and y; positive, dimensionless.
    pub step_ratio: f64,
    /// The scan's origin in the array's coordinates, metres.
    pub shift_m: Vec3,
}

impl Default for Pose {
    fn default() -> Self {
        Pose { mirror: Mirror::None, turn_rad: 0.0, step_ratio: 1.0, shift_m: Vec3::zeros() }
    }
}

impl Pose {
    /// A point of the scan in the array's coordinates, metres.
    pub fn to_array(&self, scan_m: &Vec3) -> Vec3 {
        let mirrored = self.mirror.apply(Vector2::new(scan_m.x, scan_m.y));
        let (sin, cos) = self.turn_rad.sin_cos();
        let s = self.step_ratio;
        Vec3::new(
            s * (cos * mirrored.x - sin * mirrored.y) + self.shift_m.x,
            s * (sin * mirrored.x + cos * mirrored.y) + self.shift_m.y,
            scan_m.z + self.shift_m.z,
        )
    }

    /// A point of the array's coordinates in those of the scan, metres.
    pub fn to_scan(&self, array_m: &Vec3) -> Vec3 {
        let p = array_m - self.shift_m;
        let (sin, cos) = self.turn_rad.sin_cos();
        let turned = Vector2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x) / self.step_ratio;
        let xy = self.mirror.apply(turned);
        Vec3::new(xy.x, xy.y, p.z)
    }
}

impl Mirror {
    /// Reverses the mirrored axis; its own inverse.
    fn apply(self, xy: Vector2<f64>) -> Vector2<f64> {
        match self {
            Mirror::None => xy,
            Mirror::X => Vector2::new(-xy.x, xy.y),
            Mirror::Y => Vector2::new(xy.x, -xy.y),
        }
    }
}

impl Serialize for Pose {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut pose = serializer.serialize_struct("Pose", 4)?;
        pose.serialize_field("mirror", &self.mirror)?;
        pose.serialize_field("turn_rad", &self.turn_rad)?;
        pose.serialize_field("step_ratio", &self.step_ratio)?;
        pose.serialize_field("shift_m", &[self.shift_m.x, self.shift_m.y, self.shift_m.z])?;
        pose.end()
    }
}
