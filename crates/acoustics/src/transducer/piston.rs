//! The far field of a circular piston in a rigid baffle.

use super::{OnAxis, Smooth, Transducer};

/// p ~ (1/d) 2 J1(ka sin θ)/(ka sin θ).
///
/// Source: P. M. Morse and K. U. Ingard, *Theoretical Acoustics*, 1968, section 7.4. Valid where d is well above the near-field limit
/// a²/λ (2.4 mm for a = 4.5 mm at 40 kHz).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piston;

impl Transducer for Piston {
    fn smooth(&self) -> Smooth {
        Smooth::InSineSquared
    }

    fn on_axis(&self) -> OnAxis {
        OnAxis::Spherical
    }

    fn directivity(&self, theta_rad: f64, face_radius_m: f64, wavenumber_rad_m: f64) -> f64 {
        let x = wavenumber_rad_m * face_radius_m * theta_rad.sin();
        if x.abs() < 1e-4 { 1.0 - x * x / 8.0 } else { 2.0 * libm::j1(x) / x }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_null_is_at_the_zero_of_the_bessel_function() {
        // J1's first zero is 3.831706 (Abramowitz and Stegun, table 9.5).
        let radius_m = 8e-3;
        let wavenumber = 732.7;
        let null_rad = (3.831_705_970_2f64 / (wavenumber * radius_m)).asin();
        assert!(Piston.directivity(null_rad, radius_m, wavenumber).abs() < 1e-9);
        assert!(Piston.directivity(null_rad + 0.05, radius_m, wavenumber) < 0.0);
        assert!((Piston.directivity(0.0, radius_m, wavenumber) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_half_pressure_angle_is_the_tabled_one() {
        // 2 J1(x)/x = 1/2 at x = 2.21509 (from the tabled J1).
        let (radius_m, wavenumber) = (4.5e-3, 732.7);
        let half_rad = (2.215_089_5f64 / (wavenumber * radius_m)).asin();
        assert!((Piston.directivity(half_rad, radius_m, wavenumber) - 0.5).abs() < 1e-6);
    }
}
