//! The thesis's transducer: an exponential decay on the axis and a Gaussian directivity, both fitted to a scan of one Murata MA40S4S
//! driven at 19 V.

use super::{OnAxis, Smooth, Transducer};

/// The thesis's fits p1(z) = 1.115436 exp(-0.052927 z) (R² 0.977248) and
/// p2(θ) = 1.071272 exp(-((θ + 4.108851)/35.458904)²) (R² 0.991386), z in centimetres and θ in degrees.
///
/// Source: H. W. Park, *Modeling and Simulation of Acoustic Pressure Field for Ultrasonic Tactile Displays*, MS
/// thesis, Lehigh University, section 3.1 and listing `gen_mag`. The centre of the Gaussian is off the axis, which gives the
/// directivity a corner at θ = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MurataFit {
    decay_per_m: f64,
}

impl MurataFit {
    /// The fit in its own unit: z in centimetres.
    pub const CENTIMETRES: Self = Self { decay_per_m: 5.2927 };
    /// The fit evaluated with z in metres, as in the thesis's simulator: there is almost no decay.
    pub const FED_METRES: Self = Self { decay_per_m: 0.052927 };
}

impl Transducer for MurataFit {
    fn smooth(&self) -> Smooth {
        Smooth::InHalfTangent
    }

    fn on_axis(&self) -> OnAxis {
        OnAxis::Exponential { amplitude: 1.115436, decay_per_m: self.decay_per_m }
    }

    fn directivity(&self, theta_rad: f64, _face_radius_m: f64, _wavenumber_rad_m: f64) -> f64 {
        1.071272 * (-((theta_rad.to_degrees() + 4.108851) / 35.458904).powi(2)).exp()
    }
}
