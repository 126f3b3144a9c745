//! One transducer of an array.

use super::Vec3;

/// Radius of the vibrating face of the thesis's transducer (Murata MA40S4S), metres.
///
/// Its housing measures 10.5 mm across; the face that radiates is smaller.
pub const FACE_RADIUS_M: f64 = 4.5e-3;

/// One transducer: where it stands, where it looks, how large its face is, and what it adds of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element {
    /// Centre of the face, metres, array frame.
    pub centre_m: Vec3,
    /// Direction in which it radiates, of unit length.
    pub normal: Vec3,
    /// Radius of the vibrating face, metres, above zero.
    pub radius_m: f64,
    /// Its own amplitude, relative to the nominal one; 0 is a silent element.
    pub amplitude: f64,
    /// Its own phase, radians, added to whatever it is driven with.
    pub phase_rad: f64,
}

impl Element {
    /// A nominal element on the array's plane, looking along z.
    pub fn at(x_m: f64, y_m: f64) -> Self {
        Self {
            centre_m: Vec3::new(x_m, y_m, 0.0),
            normal: Vec3::z(),
            radius_m: FACE_RADIUS_M,
            amplitude: 1.0,
            phase_rad: 0.0,
        }
    }
}
