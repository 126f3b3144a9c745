//! A diffuse field: plane waves of random phase from all directions.
//!
//! With independent complex amplitudes of mean square s² together, E\[p(x) p(y)*\] = s² j₀(k |x - y|), j₀(r) = sin r / r (R. K. Cook et al.,
//! J. Acoust. Soc. Am. 27, 1072, 1955). It is the covariance of whatever reaches the receiver by many ways: reflections, scattering.

use fieldgap_acoustics::Vec3;

/// j₀(k |x - y|).
pub(crate) fn correlation(wavenumber_rad_m: f64, one_m: &Vec3, other_m: &Vec3) -> f64 {
    let turns = wavenumber_rad_m * (one_m - other_m).norm();
    // Below, the series is right to the last digit.
    if turns < 1e-4 { 1.0 - turns * turns / 6.0 } else { turns.sin() / turns }
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal, UnitSphere};

    use super::*;

    #[test]
    fn it_is_the_correlation_of_random_plane_waves() {
        let wavenumber_rad_m = 733.0;
        let places = [0.0, 1.0, 2.0, 4.0, 7.5].map(|mm| Vec3::new(0.6, 0.0, 0.8) * mm * 1e-3);
        let mut draws = ChaCha8Rng::seed_from_u64(1);
        let waves = 200_000;
        let mut sums = [Complex64::ZERO; 5];
        for _ in 0..waves {
            let direction = Vec3::from(UnitSphere.sample(&mut draws));
            let [re, im]: [f64; 2] = [(); 2].map(|()| StandardNormal.sample(&mut draws));
            let amplitude = Complex64::new(re, im) / 2f64.sqrt();
            let at =
                |place: &Vec3| amplitude * Complex64::cis(wavenumber_rad_m * direction.dot(place));
            for (sum, place) in sums.iter_mut().zip(&places) {
                *sum += at(place) * at(&places[0]).conj();
            }
        }
        for (sum, place) in sums.iter().zip(&places) {
            let expected = correlation(wavenumber_rad_m, place, &places[0]);
            // Four standard errors.
            let error = (sum / f64::from(waves) - expected).norm();
            assert!(error < 4.0 * 1.5 / f64::from(waves).sqrt(), "{sum} {expected}");
        }
    }
}
