//! One transducer of an array.

use super::Vec3;

/// Radius of the vibrating face of the thesis's transducer (Murata MA40S4S), metres.
///
/// The housing has a diameter of 10.5 mm; the radiating face is smaller.
pub const FACE_RADIUS_M: f64 = 4.5e-3;

/// One transducer: position, direction, size of its face, and its own amplitude and phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Element {
    /// Centre of the face, metres, array frame.
    pub centre_m: Vec3,
    /// Direction in which it radiates, a unit vector.
    pub normal: Vec3,
    /// Radius of the vibrating face, metres, above zero.
    pub radius_m: f64,
    /// Amplitude relative to the nominal one; 0 is a silent element.
    pub amplitude: f64,
    /// Phase in addition to the drive's, radians.
    pub phase_rad: f64,
}

impl Element {
    /// A nominal element on the array's plane that faces along z.
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
