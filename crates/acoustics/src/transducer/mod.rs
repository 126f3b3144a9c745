//! Models of one transducer: the decay of the pressure on its axis times a directivity.
//!
//! | model | on the axis | directivity | range of validity |
//! |---|---|---|---|
//! | [`MurataFit`] | fitted exponential | fitted Gaussian with its centre off the axis | 20 to 200 mm, where it was fitted |
//! | [`SymmetricGaussian`] | 1/d | Gaussian | within the half-pressure angle |
//! | [`MultiGaussian`] | 1/d | ten Gaussians for a piston | as a piston, to 1 % of the axis, for ka sin θ up to 12 |
//! | [`Piston`] | 1/d | Bessel | beyond about ten times a²/λ (25 mm at 40 kHz for a = 4.5 mm) |
//! | [`RayleighPiston`] | integral over the face | integral over the face | from two radii in front of the face |
//! | [`MeasuredTable`] | any law | measured | between its angles |
//!
//! A new model is one file here, and one line in [`super::Simulator`].

mod described;
mod gaussian;
mod multi_gaussian;
mod murata_fit;
mod piston;
mod rayleigh_piston;
mod shaped;
mod table;
mod widened;

pub use described::{DescribedTransducer, Directivity};
pub use gaussian::SymmetricGaussian;
pub use multi_gaussian::{MultiGaussian, multi_gaussian_beam};
pub use murata_fit::MurataFit;
pub use piston::Piston;
pub use rayleigh_piston::RayleighPiston;
pub use shaped::Shaped;
pub use table::{MeasuredTable, TableError};
pub use widened::Widened;

use super::rayleigh::Patch;

/// The decay of the amplitude on the axis with distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OnAxis {
    /// `amplitude * exp(-decay_per_m * h)`, h the height above the face along its normal.
    Exponential {
        /// Amplitude extrapolated to the face.
        amplitude: f64,
        /// Decay per metre.
        decay_per_m: f64,
    },
    /// `1/d`, d the distance from the face's centre in metres.
    Spherical,
    /// `d^-exponent`; 1 is spherical, 0.5 cylindrical, 0 no decay.
    Power {
        /// The exponent.
        exponent: f64,
    },
    /// `amplitude * exp(-attenuation_np_m * d) / d`: spherical in absorbing air.
    Absorbed {
        /// Amplitude at one metre without absorption.
        amplitude: f64,
        /// Attenuation, Np/m.
        attenuation_np_m: f64,
    },
}

/// The variable in which a directivity is smooth, so that a polynomial of few terms represents it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smooth {
    /// sin² θ: for the directivities of plane faces, which are functions of ka sin θ alone.
    InSineSquared,
    /// cos θ: for directivities that are even in θ and so smooth across the axis.
    InCosine,
    /// tan(θ/2), from 0 on the axis to 1 at a right angle: for directivities with a corner on the axis.
    InHalfTangent,
}

/// A transducer model: amplitude(d, θ) is the decay on the axis times the directivity.
pub trait Transducer: Sync {
    /// The variable in which the directivity is smooth.
    fn smooth(&self) -> Smooth;

    /// The decay on the axis.
    fn on_axis(&self) -> OnAxis;

    /// The directivity at an angle from the axis, 0 to π/2 rad, for a face of the given radius at the given wavenumber. Only
    /// directivities that are smooth in sin² θ may depend on radius and wavenumber. Negative values beyond a null mean opposite phase.
    fn directivity(&self, theta_rad: f64, face_radius_m: f64, wavenumber_rad_m: f64) -> f64;

    /// Angles at which the directivity or one of its derivatives jumps, rad, ascending, between 0 and π/2; none for most models.
    fn corners_rad(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The patches of the face, each of which radiates as the model states; for most models one, in the centre.
    fn patches(&self, _face_radius_m: f64, _wavenumber_rad_m: f64) -> Vec<Patch> {
        vec![Patch { u: 0.0, v: 0.0, weight: 1.0 }]
    }
}
