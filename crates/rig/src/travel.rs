//! Where the robot may go: its travel, and boxes it must keep out of.
//!
//! A move is a straight path in the robot's axes. The target must lie within travel and no point of the path
//! within (or on the face of) a keep-out box. The robot is a point here, the tip of its receiver: a
//! keep-out box must be drawn larger than the thing it guards by what the receiver's holder
//! sticks out to that side.

use std::fmt;

use crate::space::RobotPosition;

/// A target on the very edge of travel must not be refused for the rounding of a sum: one nanometre.
const EDGE_M: f64 = 1e-9;

/// A box with faces along the robot's axes, faces included, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisBox {
    /// The corner of least coordinates x, y, z, m.
    pub least_m: [f64; 3],
    /// The corner of largest coordinates x, y, z, m.
    pub largest_m: [f64; 3],
}

impl AxisBox {
    /// Whether the path straight from `from` to `to` touches the box.
    ///
    /// The slab method: on each axis the path lies between the two faces during an interval of the
    /// path's parameter; the box is touched where the three intervals have an instant in common
    /// (T. Kay and J. Kajiya, "Ray tracing complex scenes", SIGGRAPH 1986). Rounding of the divisions is
    /// answered by counting near misses as hits.
    pub fn touches(&self, from: RobotPosition, to: RobotPosition) -> bool {
        const ROUNDING: f64 = 1e-12;
        let (start, end) = (from.axes_m(), to.axes_m());
        let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
        for axis in 0..3 {
            let (least, largest) = (self.least_m[axis], self.largest_m[axis]);
            let length = end[axis] - start[axis];
            if length == 0.0 {
                if start[axis] < least || start[axis] > largest {
                    return false;
                }
                continue;
            }
            let at_least = (least - start[axis]) / length;
            let at_largest = (largest - start[axis]) / length;
            enters = enters.max(at_least.min(at_largest));
            leaves = leaves.min(at_least.max(at_largest));
        }
        enters <= leaves + ROUNDING
    }
}

/// A box to stay out of, and what stands there.
#[derive(Debug, Clone, PartialEq)]
pub struct KeepOut {
    /// What stands there, for messages.
    pub name: String,
    /// Where.
    pub space: AxisBox,
}

/// Where the robot may go.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// The travel of the three axes.
    pub travel: AxisBox,
    /// What stands within it.
    pub keep_out: Vec<KeepOut>,
}

impl Envelope {
    /// Whether the robot may stand at `target`.
    ///
    /// # Errors
    /// [`PathFault`] with what is in the way.
    pub fn check_target(&self, target: RobotPosition) -> Result<(), PathFault> {
        self.check_path(target, target)
    }

    /// Whether the robot may go straight from `from` to `to`.
    ///
    /// A robot that stands outside travel (some stand so after homing) may come back in.
    ///
    /// # Errors
    /// [`PathFault`] with what is in the way.
    pub fn check_path(&self, from: RobotPosition, to: RobotPosition) -> Result<(), PathFault> {
        for axis in Axis::ALL {
            let (at_m, least_m, largest_m) = (
                to.axes_m()[axis as usize],
                self.travel.least_m[axis as usize],
                self.travel.largest_m[axis as usize],
            );
            // Written so that NaN is outside.
            if !(at_m >= least_m - EDGE_M && at_m <= largest_m + EDGE_M) {
                return Err(PathFault::OutsideTravel { target: to, axis, least_m, largest_m });
            }
        }
        match self.keep_out.iter().find(|keep_out| keep_out.space.touches(from, to)) {
            Some(keep_out) => Err(PathFault::KeepOut { from, to, name: keep_out.name.clone() }),
            None => Ok(()),
        }
    }
}

/// One of the robot's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// x
    X,
    /// y
    Y,
    /// z
    Z,
}

impl Axis {
    const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        })
    }
}

/// Why a path is not allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PathFault {
    /// The target lies outside travel.
    #[error(
        "{target} in the robot's axes is outside its travel: {axis} goes from {:.2} to {:.2} mm",
        least_m * 1e3, largest_m * 1e3
    )]
    OutsideTravel {
        /// Where the robot was to go.
        target: RobotPosition,
        /// The first axis that does not reach it.
        axis: Axis,
        /// Where this axis begins, m.
        least_m: f64,
        /// Where this axis ends, m.
        largest_m: f64,
    },
    /// Something stands in the way.
    #[error(
        "the straight path from {from} to {to} (robot's axes) touches the keep-out box `{name}`"
    )]
    KeepOut {
        /// Where the path begins.
        from: RobotPosition,
        /// Where the path ends.
        to: RobotPosition,
        /// The box.
        name: String,
    },
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;

    pub fn mm(x: f64, y: f64, z: f64) -> RobotPosition {
        RobotPosition::from_axes_mm([x, y, z])
    }

    pub fn envelope() -> Envelope {
        Envelope {
            travel: AxisBox { least_m: [0.0; 3], largest_m: [0.3, 0.3, 0.25] },
            keep_out: vec![KeepOut {
                name: "array".into(),
                space: AxisBox { least_m: [0.1, 0.1, 0.0], largest_m: [0.2, 0.2, 0.05] },
            }],
        }
    }

    #[test]
    fn a_target_outside_travel_is_refused_with_its_axis() {
        let fault = envelope().check_target(mm(10.0, 10.0, 251.0)).expect_err("too high");
        assert!(matches!(fault, PathFault::OutsideTravel { axis: Axis::Z, .. }));
        assert!(fault.to_string().contains("z goes from 0.00 to 250.00 mm"), "{fault}");
        assert!(envelope().check_target(mm(f64::NAN, 10.0, 10.0)).is_err());
    }

    #[test]
    fn ends_in_free_space_do_not_make_a_path_free() {
        let (left, right) = (mm(50.0, 150.0, 20.0), mm(250.0, 150.0, 20.0));
        assert!(envelope().check_target(left).is_ok() && envelope().check_target(right).is_ok());
        let fault = envelope().check_path(left, right).expect_err("the array is in between");
        assert!(fault.to_string().contains("`array`"), "{fault}");
    }

    #[test]
    fn a_path_over_the_box_or_round_its_corner_is_free() {
        let over = (mm(50.0, 150.0, 50.1), mm(250.0, 150.0, 50.1));
        assert_eq!(envelope().check_path(over.0, over.1), Ok(()));
        let corner = (mm(50.0, 149.0, 20.0), mm(149.0, 50.0, 20.0));
        assert_eq!(envelope().check_path(corner.0, corner.1), Ok(()));
    }

    #[test]
    fn a_path_along_a_face_touches() {
        assert!(envelope().check_path(mm(50.0, 150.0, 50.0), mm(250.0, 150.0, 50.0)).is_err());
        assert!(envelope().check_path(mm(100.0, 50.0, 20.0), mm(100.0, 250.0, 20.0)).is_err());
    }

    #[test]
    fn a_robot_outside_travel_may_come_back_in() {
        assert_eq!(envelope().check_path(mm(-5.0, 0.0, 100.0), mm(10.0, 10.0, 100.0)), Ok(()));
    }

    fn place() -> impl Strategy<Value = RobotPosition> {
        // Multiples of a quarter make flush paths, shared faces and grazed corners common.
        (0i32..=12, 0i32..=12, 0i32..=12).prop_map(|(x, y, z)| {
            RobotPosition::from_axes_m([x, y, z].map(|quarter| f64::from(quarter) * 0.25))
        })
    }

    fn distance_to_box_m(space: &AxisBox, at: RobotPosition) -> f64 {
        let outside = |axis: usize| {
            let value = at.axes_m()[axis];
            (space.least_m[axis] - value).max(value - space.largest_m[axis]).max(0.0)
        };
        (0..3).map(|axis| outside(axis).powi(2)).sum::<f64>().sqrt()
    }

    fn along(from: RobotPosition, to: RobotPosition, t: f64) -> RobotPosition {
        let (a, b) = (from.axes_m(), to.axes_m());
        RobotPosition::from_axes_m(std::array::from_fn(|axis| a[axis] + t * (b[axis] - a[axis])))
    }

    proptest! {
        /// The second method: the distance from the box is convex along the path, so a ternary search
        /// finds how near the path comes.
        #[test]
        fn a_path_touches_where_its_nearest_point_does(
            from in place(), to in place(), a in place(), b in place()
        ) {
            let (a, b) = (a.axes_m(), b.axes_m());
            let space = AxisBox {
                least_m: std::array::from_fn(|axis| a[axis].min(b[axis])),
                largest_m: std::array::from_fn(|axis| a[axis].max(b[axis])),
            };
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..200 {
                let (t1, t2) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                let near = |t| distance_to_box_m(&space, along(from, to, t));
                if near(t1) <= near(t2) { high = t2 } else { low = t1 }
            }
            let nearest_m = distance_to_box_m(&space, along(from, to, low));
            // Between coordinates that are multiples of 1/4 no miss is as close as this.
            prop_assert_eq!(space.touches(from, to), nearest_m < 1e-6, "nearest {} m", nearest_m);
            prop_assert_eq!(space.touches(from, to), space.touches(to, from));
        }
    }
}
