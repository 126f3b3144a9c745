//! Characteristic lengths of an array: the limit of the near field and the critical pitch.

use super::Vec3;

/// The length of the near field of a disc of radius a: `a²/λ`, metres.
///
/// For a piston this is close to the last maximum of the pressure on its axis (source: L. E. Kinsler et al., *Fundamentals of
/// Acoustics*, 4th ed., 2000, section 7.4). For a whole array it is the largest distance at which delays still form a focus; farther
/// away they do not narrow the beam.
pub fn near_field_limit_m(radius_m: f64, wavelength_m: f64) -> f64 {
    radius_m * radius_m / wavelength_m
}

/// The largest pitch (centre to centre) of a regular array that has no grating lobe when it is steered up to
/// `steering_rad`: `λ/(1 + sin θ)`, metres.
///
/// Source: S.-C. Wooh and Y. Shi, "Influence of phased array element size on beam steering behavior", Ultrasonics 36,
/// 737 (1998). The condition is strict: no grating lobe in front of the array at any angle, however weak.
pub fn critical_pitch_m(wavelength_m: f64, steering_rad: f64) -> f64 {
    wavelength_m / (1.0 + steering_rad.sin())
}

/// The angle from the array's normal at which the farthest edge sees a focus, radians: the larger of the angles along x and y, as in
/// the thesis. `half_size_m` is half the array's size along x and y, about the origin.
pub fn steering_rad(half_size_m: [f64; 2], focus_m: &Vec3) -> f64 {
    let along = |axis: usize| (half_size_m[axis] + focus_m[axis].abs()).atan2(focus_m.z);
    along(0).max(along(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rayleigh;

    #[test]
    fn the_last_maximum_on_a_pistons_axis_is_at_the_limit() {
        // |p| ~ |sin(k/2 (sqrt(z² + a²) - z))| has its last maximum at z = a²/λ - λ/4.
        let (radius_m, wavelength_m) = (30e-3, 8.575e-3);
        let k = std::f64::consts::TAU / wavelength_m;
        let level = |z: f64| rayleigh::on_axis(k, radius_m, z).norm();
        let limit_m = near_field_limit_m(radius_m, wavelength_m);
        let last_m = limit_m - wavelength_m / 4.0;
        assert!(level(last_m) > level(last_m * 0.98) && level(last_m) > level(last_m * 1.02));
        let beyond: Vec<f64> =
            (0..20).map(|step| level(limit_m * (1.0 + f64::from(step)))).collect();
        assert!(beyond.windows(2).all(|pair| pair[1] < pair[0]));
    }

    #[test]
    fn the_thesis_s_critical_spacing_is_six_millimetres() {
        // θ = atan((3 D + 2.5 s)/z) is 25 degrees for D = 10.5 mm, s = 6 mm, z = 100 mm.
        let steering = steering_rad([46.5e-3, 46.5e-3], &Vec3::new(0.0, 0.0, 0.1));
        assert!((steering.to_degrees() - 25.0).abs() < 0.1);
        assert!((critical_pitch_m(8.575e-3, steering) - 6.03e-3).abs() < 0.01e-3);
    }

    #[test]
    fn at_the_critical_pitch_the_grating_lobe_lies_in_the_array_s_plane() {
        // Grating lobes are at sin θ' = sin θ - λ/pitch.
        for steering in [0.0, 0.3, 0.9] {
            let pitch_m = critical_pitch_m(8e-3, steering);
            assert!((f64::sin(steering) - 8e-3 / pitch_m + 1.0).abs() < 1e-12);
        }
    }
}
