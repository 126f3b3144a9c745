//! A piston's beam as the sum of ten Gaussian beams.

use num_complex::Complex64;

use super::{OnAxis, Smooth, Transducer};

/// A uniform disc of radius 1 as Σ A exp(-B ρ²): the terms (Re A, Im A, Re B, Im B).
///
/// Source: J. J. Wen and M. A. Breazeale, "A diffraction beam field expressed as the superposition of Gaussian beams", J. Acoust.
/// Soc. Am. 83, 1752 (1988), table I.
const TERMS: [[f64; 4]; 10] = [
    [11.428, 0.95175, 4.0697, 0.22726],
    [0.06002, -0.08013, 1.1531, -20.933],
    [-4.2743, -8.5562, 4.4608, 5.1268],
    [1.6576, 2.7015, 4.3521, 14.997],
    [-5.0418, 3.2488, 4.5443, 10.003],
    [1.1227, -0.68854, 3.8478, 20.078],
    [-1.0106, -0.26955, 2.5280, -10.310],
    [-2.5974, 3.2202, 3.3197, -4.8008],
    [-0.14840, -0.31193, 1.9002, -15.820],
    [-0.20850, -0.23851, 2.6340, 25.009],
];

fn terms() -> impl Iterator<Item = (Complex64, Complex64)> {
    TERMS.into_iter().map(|[ar, ai, br, bi]| (Complex64::new(ar, ai), Complex64::new(br, bi)))
}

/// The far field of [`multi_gaussian_beam`]: p ~ (1/d) Re Σ (A/B) exp(-(ka sin θ)²/(4B)).
///
/// Each Gaussian on the face has a Gaussian far field. Their sum deviates from the field of a piston by at most 0.92 % of the value on
/// the axis for ka sin θ up to 12; the largest deviation is on the axis. A face that moves in phase has no imaginary part: that of the
/// fit (0.33 %) is an error and left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MultiGaussian;

impl Transducer for MultiGaussian {
    fn smooth(&self) -> Smooth {
        Smooth::InSineSquared
    }

    fn on_axis(&self) -> OnAxis {
        OnAxis::Spherical
    }

    fn directivity(&self, theta_rad: f64, face_radius_m: f64, wavenumber_rad_m: f64) -> f64 {
        let x = wavenumber_rad_m * face_radius_m * theta_rad.sin();
        terms().map(|(a, b)| (a / b * (-0.25 * x * x / b).exp()).re).sum()
    }
}

/// The beam of a piston at `distance_m` along its axis and `off_axis_m` from the axis, in the unit of
/// [`rayleigh`](crate::rayleigh): |p| = 1/d in the far field on the axis.
///
/// p = (2/(i k a²)) (-1) exp(ikz) Σ A/(1 + iBz/z₀) exp(-B(ρ/a)²/(1 + iBz/z₀)), z₀ = k a²/2 (Wen and Breazeale, equation 11). This is
/// the paraxial field: valid within about 20° of the axis and for ka well above 1, also near the face.
pub fn multi_gaussian_beam(
    wavenumber_rad_m: f64,
    radius_m: f64,
    distance_m: f64,
    off_axis_m: f64,
) -> Complex64 {
    let rayleigh_m = 0.5 * wavenumber_rad_m * radius_m * radius_m;
    let spread = (off_axis_m / radius_m).powi(2);
    let sum: Complex64 = terms()
        .map(|(a, b)| {
            let widening = 1.0 + Complex64::i() * b * (distance_m / rayleigh_m);
            a / widening * (-b * spread / widening).exp()
        })
        .sum();
    // The face moves with amplitude 1 in units of iρck u₀ A / 2π, hence i/z₀.
    Complex64::from_polar(1.0, wavenumber_rad_m * distance_m) * sum * Complex64::i() / rayleigh_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;
    use crate::rayleigh::{DiscRule, Piston, far_field_directivity, on_axis};

    #[test]
    fn its_far_field_is_that_of_a_piston_to_one_percent() {
        for step in 0..=120 {
            let x = 0.1 * f64::from(step);
            let ours = MultiGaussian.directivity(std::f64::consts::FRAC_PI_2, x, 1.0);
            assert!((ours - far_field_directivity(x)).abs() < 9.3e-3, "{x}: {ours}");
        }
    }

    #[test]
    fn on_the_axis_of_a_wide_face_it_is_the_closed_form() {
        // ka = 60, so that the beam is paraxial; below half of z₀ the ten Gaussians leave ripples.
        let (k, a) = (732.7, 60.0 / 732.7);
        let rayleigh_m = 0.5 * k * a * a;
        for share in [0.3, 0.5, 0.8, 1.0, 2.0, 4.0] {
            let z = share * rayleigh_m;
            let error = multi_gaussian_beam(k, a, z, 0.0) - on_axis(k, a, z);
            let scale = 2.0 / rayleigh_m;
            assert!(error.norm() < 0.02 * scale, "{share}: {}", error.norm() / scale);
        }
    }

    #[test]
    fn off_the_axis_of_a_wide_face_it_is_the_rayleigh_integral() {
        let (k, a) = (732.7, 60.0 / 732.7);
        let rayleigh_m = 0.5 * k * a * a;
        let piston = Piston::new(Vec3::zeros(), Vec3::z(), a, &DiscRule::new(40, 120));
        for share in [0.5, 1.0, 2.0] {
            for off_axis in [0.3, 0.8, 1.5] {
                let (z, rho) = (share * rayleigh_m, off_axis * a);
                let error =
                    multi_gaussian_beam(k, a, z, rho) - piston.field(Vec3::new(rho, 0.0, z), k);
                let scale = 2.0 / rayleigh_m;
                assert!(
                    error.norm() < 0.02 * scale,
                    "{share} {off_axis}: {}",
                    error.norm() / scale
                );
            }
        }
    }
}
