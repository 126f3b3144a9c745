//! What is free in every fit: the gain, a small shift, and the elements' near field.

use nalgebra::Vector3;

use fieldgap_acoustics::Vec3;

/// What is free in every scan, whatever the effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Nuisance {
    /// Natural logarithm of the reading per unit of the simulation.
    pub log_gain: f64,
    /// Shift of the scan's coordinates, m.
    pub shift_m: Vector3<f64>,
    /// Share of a piston's near field that the elements show, 0 to 1; simulators leave it out.
    pub near_field: f64,
}

impl Nuisance {
    /// Numbers in it.
    pub const COUNT: usize = 5;

    /// What they are called.
    pub const NAMES: [&str; Self::COUNT] = [
        "the gain",
        "the place along x",
        "the place along y",
        "the place along z",
        "the near field",
    ];

    /// From its numbers: log gain, then x, y, z, then the near field.
    pub fn from_slice(numbers: &[f64]) -> Self {
        let shift_m = Vec3::new(numbers[1], numbers[2], numbers[3]);
        Self { log_gain: numbers[0], shift_m, near_field: numbers[4] }
    }
}
