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

use fieldgap_acoustics::Vec3;

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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn pose() -> impl Strategy<Value = Pose> {
        let mirror = prop_oneof![Just(Mirror::None), Just(Mirror::X), Just(Mirror::Y)];
        let shift = (-0.05..0.05f64, -0.05..0.05f64, -0.05..0.05f64);
        (mirror, -3.2..3.2f64, 0.8..1.25f64, shift).prop_map(
            |(mirror, turn_rad, step_ratio, (x, y, z))| Pose {
                mirror,
                turn_rad,
                step_ratio,
                shift_m: Vec3::new(x, y, z),
            },
        )
    }

    fn point() -> impl Strategy<Value = Vec3> {
        (-0.1..0.1f64, -0.1..0.1f64, 0.0..0.3f64).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn there_and_back_is_the_same_point(pose in pose(), at in point()) {
            prop_assert!((pose.to_scan(&pose.to_array(&at)) - at).norm() < 1e-15 * 100.0);
            prop_assert!((pose.to_array(&pose.to_scan(&at)) - at).norm() < 1e-15 * 100.0);
        }

        #[test]
        fn distances_grow_by_the_step_in_the_plane_and_heights_do_not(pose in pose(), a in point(), b in point()) {
            let (p, q) = (pose.to_array(&a), pose.to_array(&b));
            prop_assert!(((p - q).xy().norm() - pose.step_ratio * (a - b).xy().norm()).abs() < 1e-13);
            prop_assert!(((p - q).z - (a - b).z).abs() < 1e-15 * 10.0);
        }

        #[test]
        fn a_mirror_reverses_the_sense_of_turning(pose in pose()) {
            let origin = pose.to_array(&Vec3::zeros());
            let (x, y) = (pose.to_array(&Vec3::x()) - origin, pose.to_array(&Vec3::y()) - origin);
            let handed = x.x * y.y - x.y * y.x;
            prop_assert_eq!(handed > 0.0, pose.mirror == Mirror::None);
        }
    }

    #[test]
    fn mirrors_turn_the_axis_they_name() {
        let at = Vec3::new(1.0, 2.0, 3.0);
        let with = |mirror| Pose { mirror, ..Pose::default() }.to_array(&at);
        assert_eq!(with(Mirror::None), at);
        assert_eq!(with(Mirror::X), Vec3::new(-1.0, 2.0, 3.0));
        assert_eq!(with(Mirror::Y), Vec3::new(1.0, -2.0, 3.0));
        let quarter = Pose { turn_rad: std::f64::consts::FRAC_PI_2, ..Pose::default() };
        assert!((quarter.to_array(&at) - Vec3::new(-2.0, 1.0, 3.0)).norm() < 1e-15);
    }
}
