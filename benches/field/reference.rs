//! The plain loop: one pair at a time, with library functions for sine, cosine and square root.

use fieldgap::acoustics::{Array, Vec3};
use num_complex::Complex64;

/// Positions and drives of elements that face z.
pub struct Elements {
    pub centres_m: Vec<Vec3>,
    pub phases_rad: Vec<f64>,
}

impl Elements {
    pub fn new(array: &Array, phases_rad: &[f64]) -> Self {
        let centres_m = array.elements().iter().map(|element| element.centre_m).collect();
        Self { centres_m, phases_rad: phases_rad.to_vec() }
    }
}

/// 2 J1(x)/x = Σ (-x²/4)^n / (n! (n+1)!), in powers of sin² θ for x = ka sin θ.
pub fn piston_series<const N: usize>(ka: f64) -> [f64; N] {
    let mut series = [1.0; N];
    for n in 1..N {
        series[n] = series[n - 1] * -0.25 * ka * ka / (n * (n + 1)) as f64;
    }
    series
}

/// The defining sum for pistons.
pub fn plain(elements: &Elements, wavenumber: f64, ka: f64, points_m: &[Vec3]) -> Vec<Complex64> {
    let series = piston_series::<12>(ka);
    points_m
        .iter()
        .map(|x| {
            let mut sum = Complex64::ZERO;
            for (centre_m, phase_rad) in elements.centres_m.iter().zip(&elements.phases_rad) {
                let r = x - centre_m;
                let d = r.norm();
                let cosine = r.z / d;
                let square = 1.0 - cosine * cosine;
                let lobe = series.iter().rev().fold(0.0, |sum, c| sum * square + c);
                let (sin, cos) = (wavenumber * d + phase_rad).sin_cos();
                let magnitude = lobe / d;
                sum += Complex64::new(magnitude * cos, magnitude * sin);
            }
            sum
        })
        .collect()
}
