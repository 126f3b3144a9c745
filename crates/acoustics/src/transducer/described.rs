//! A transducer with any decay on the axis and any directivity, as a transducer file describes it.

use super::{
    MeasuredTable, MultiGaussian, OnAxis, Piston, RayleighPiston, Smooth, SymmetricGaussian,
    Transducer,
};
use crate::rayleigh::Patch;

/// A directivity.
#[derive(Debug, Clone, PartialEq)]
pub enum Directivity {
    /// The same in all directions.
    Even,
    /// `exp(-((θ - centre)/width)²)`, which has a corner on the axis unless its centre is 0.
    Gaussian {
        /// Angle of the maximum, rad.
        centre_rad: f64,
        /// Angle from the centre at which it falls to 1/e, rad, above zero.
        width_rad: f64,
    },
    /// The far field of a piston.
    Piston,
    /// Ten Gaussians for a piston.
    MultiGaussian,
    /// The integral over a piston's face.
    Rayleigh,
    /// A measured table.
    Table(MeasuredTable),
}

/// A transducer with any decay on the axis and any directivity.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribedTransducer {
    /// The decay on the axis.
    pub on_axis: OnAxis,
    /// The directivity.
    pub directivity: Directivity,
}

impl Transducer for DescribedTransducer {
    fn smooth(&self) -> Smooth {
        match self.directivity {
            Directivity::Gaussian { centre_rad: 0.0, .. }
            | Directivity::Even
            | Directivity::Rayleigh => Smooth::InCosine,
            Directivity::Gaussian { .. } | Directivity::Table(_) => Smooth::InHalfTangent,
            Directivity::Piston | Directivity::MultiGaussian => Smooth::InSineSquared,
        }
    }

    fn on_axis(&self) -> OnAxis {
        self.on_axis
    }

    fn directivity(&self, theta_rad: f64, face_radius_m: f64, wavenumber_rad_m: f64) -> f64 {
        let of = |model: &dyn Transducer, theta_rad: f64| {
            model.directivity(theta_rad, face_radius_m, wavenumber_rad_m)
        };
        match self.directivity {
            // Each patch of the face radiates equally in all directions.
            Directivity::Even | Directivity::Rayleigh => 1.0,
            Directivity::Gaussian { centre_rad, width_rad } => {
                of(&SymmetricGaussian { width_rad }, theta_rad - centre_rad)
            }
            Directivity::Piston => of(&Piston, theta_rad),
            Directivity::MultiGaussian => of(&MultiGaussian, theta_rad),
            Directivity::Table(ref table) => table.at(theta_rad),
        }
    }

    fn corners_rad(&self) -> Vec<f64> {
        match &self.directivity {
            Directivity::Table(table) => table.angles_rad().to_vec(),
            _ => Vec::new(),
        }
    }

    fn patches(&self, face_radius_m: f64, wavenumber_rad_m: f64) -> Vec<Patch> {
        match self.directivity {
            Directivity::Rayleigh => RayleighPiston::FINE.patches(face_radius_m, wavenumber_rad_m),
            _ => Piston.patches(face_radius_m, wavenumber_rad_m),
        }
    }
}
