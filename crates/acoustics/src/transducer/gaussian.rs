//! A lobe that is a Gaussian in the angle, symmetric about the axis.

use super::{OnAxis, Smooth, Transducer};

/// p ~ (1/d) exp(-(θ/width)²).
///
/// The thesis's Gaussian has its centre 4.1° off the axis, which a circular transducer cannot have; this one is symmetric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SymmetricGaussian {
    /// Angle at which the pressure falls to 1/e of the axis, rad, above zero.
    pub width_rad: f64,
}

impl SymmetricGaussian {
    /// The lobe of the thesis's transducer ([`super::MurataFit`]) made symmetric, with the same half-pressure angle of 25.70°.
    pub const MURATA: Self = Self { width_rad: 0.538_704 };
}

impl Transducer for SymmetricGaussian {
    fn smooth(&self) -> Smooth {
        Smooth::InCosine
    }

    fn on_axis(&self) -> OnAxis {
        OnAxis::Spherical
    }

    fn directivity(&self, theta_rad: f64, _face_radius_m: f64, _wavenumber_rad_m: f64) -> f64 {
        (-(theta_rad / self.width_rad).powi(2)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::super::MurataFit;
    use super::*;

    #[test]
    fn the_half_pressure_angle_is_that_of_the_thesis() {
        let half_rad = SymmetricGaussian::MURATA.width_rad * std::f64::consts::LN_2.sqrt();
        let thesis = |theta_rad| MurataFit::CENTIMETRES.directivity(theta_rad, 0.0, 0.0);
        assert!((thesis(half_rad) / thesis(0.0) - 0.5).abs() < 1e-5, "{}", half_rad.to_degrees());
        assert!((half_rad.to_degrees() - 25.697).abs() < 0.001, "{}", half_rad.to_degrees());
    }
}
