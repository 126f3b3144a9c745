//! A piston in a rigid baffle by its Rayleigh integral, without far-field approximation.

use super::{OnAxis, Smooth, Transducer};
use crate::rayleigh::{DiscRule, Patch};

/// Smallest distance from the face, in radii, at which the integral keeps its tolerance.
const NEAREST_RADII: f64 = 2.0;

/// The face as patches that radiate spherical waves, as many as a tolerance requires.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayleighPiston {
    /// Largest error at distances from two radii, relative to the far field on the axis; above zero.
    pub tolerance: f64,
}

impl RayleighPiston {
    /// 1e-4: about 40 to 100 patches for the faces of 40 kHz transducers.
    pub const FINE: Self = Self { tolerance: 1e-4 };
}

impl Transducer for RayleighPiston {
    fn smooth(&self) -> Smooth {
        Smooth::InCosine
    }

    fn on_axis(&self) -> OnAxis {
        OnAxis::Spherical
    }

    fn directivity(&self, _theta_rad: f64, _face_radius_m: f64, _wavenumber_rad_m: f64) -> f64 {
        1.0
    }

    fn patches(&self, face_radius_m: f64, wavenumber_rad_m: f64) -> Vec<Patch> {
        let ka = wavenumber_rad_m * face_radius_m;
        DiscRule::for_piston(ka, NEAREST_RADII, self.tolerance).patches().to_vec()
    }
}
