//! How one transducer radiates: a law on its axis times a directivity.
//!
//! A new model is one file here, and one line where [`super::Simulator`] names its transducer.

mod murata_fit;
mod piston;
mod widened;

pub use murata_fit::MurataFit;
pub use piston::Piston;
pub use widened::Widened;

/// How the amplitude on the axis falls with distance.
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
}

/// The variable in which a directivity is a polynomial of few terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smooth {
    /// sin² θ: for directivities that are smooth across the axis, as those of plane faces are.
    InSineSquared,
    /// tan(θ/2), from 0 on the axis to 1 at a right angle: for those with a corner on the axis.
    InHalfTangent,
}

/// A transducer model: amplitude(d, theta) = on-axis law times directivity.
pub trait Transducer: Sync {
    /// In which variable the directivity is smooth.
    fn smooth(&self) -> Smooth;

    /// The law on the axis.
    fn on_axis(&self) -> OnAxis;

    /// The directivity at an angle from the axis, 0 to pi/2 rad, for a face of the given radius at the given
    /// wavenumber. It may be negative beyond a null: the sign is the phase's.
    fn directivity(&self, theta_rad: f64, face_radius_m: f64, wavenumber_rad_m: f64) -> f64;
}
