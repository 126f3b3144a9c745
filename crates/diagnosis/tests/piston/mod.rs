//! The far field of a piston, by the C library's Bessel function.

use fieldgap_acoustics::{Element, Vec3};
use num_complex::Complex64;

use crate::square_array::WAVENUMBER_RAD_M;

/// What a piston sends to a place, its drive's phase left out: 2 J1(x)/x over the distance.
pub fn piston(element: &Element, at: &Vec3) -> Complex64 {
    let way = at - element.centre_m;
    let x = WAVENUMBER_RAD_M * element.radius_m * way.xy().norm() / way.norm();
    let lobe = if x < 1e-6 { 1.0 } else { 2.0 * libm::j1(x) / x };
    Complex64::from_polar(lobe / way.norm(), WAVENUMBER_RAD_M * way.norm())
}
