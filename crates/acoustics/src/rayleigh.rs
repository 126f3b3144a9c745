//! The field of a vibrating piston by its Rayleigh integral: the reference for the simulators.
//!
//! Every part of the face radiates a spherical wave, and the field is their sum
//! ```text
//! p(x) = 1/A ∫ exp(i k r) / r dS
//! ```
//! (Lord Rayleigh, *The Theory of Sound*, § 278, without the constant -iρck u₀ A / 2π, so that |p| = 1/d in the far field on the
//! axis). There is no far-field approximation: it holds from a few millimetres in front of the face. The time convention is
//! exp(-iωt).
//!
//! This code shares nothing with the field kernel, so that an error in either shows as a difference.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::Vec3;

/// Most patches of a face.
const MAX_PATCHES: usize = 2048;

/// A quadrature rule on the disc of radius 1: rings whose squared radii are Gauss-Legendre nodes on (0, 1), each with equally
/// spaced points.
///
/// Both parts converge exponentially for the smooth integrand: along the radius because 1/A dS = d(r²) dφ / 2π, along a ring because
/// the integrand is periodic.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscRule {
    patches: Vec<Patch>,
}

/// One patch of the unit disc; the weights of a rule sum to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Position along the first axis of the face, in radii.
    pub u: f64,
    /// Position along the second axis, in radii.
    pub v: f64,
    /// Share of the area.
    pub weight: f64,
}

impl DiscRule {
    /// The rule with a number of rings (at least 1) and of points on each (`spokes`, at least 3).
    pub fn new(rings: usize, spokes: usize) -> Self {
        let (rings, spokes) = (rings.max(1), spokes.max(3));
        let patches = gauss_legendre(rings)
            .into_iter()
            .enumerate()
            .flat_map(|(ring, (node, weight))| {
                (0..spokes).map(move |spoke| {
                    // Every other ring is turned by half a step, so that the errors of the rings differ.
                    let turn = spoke as f64 + if ring % 2 == 1 { 0.5 } else { 0.0 };
                    let (sin, cos) = (TAU * turn / spokes as f64).sin_cos();
                    let radius = node.sqrt();
                    Patch { u: radius * cos, v: radius * sin, weight: weight / spokes as f64 }
                })
            })
            .collect();
        Self { patches }
    }

    /// The coarsest rule with an error below `tolerance`, relative to the far field on the axis, for a piston of wavenumber times
    /// radius `ka` at distances from `nearest` radii.
    ///
    /// The error is measured against two closed forms: on the axis at that distance, and in the far field at every angle.
    pub fn for_piston(ka: f64, nearest: f64, tolerance: f64) -> Self {
        let mut rings = 1;
        loop {
            let spokes = (4 * rings).max(6);
            let rule = Self::new(rings, spokes);
            let good = rule.far_field_error(ka) <= tolerance
                && rule.on_axis_error(ka, nearest) * nearest <= tolerance;
            if good || rule.patches.len() >= MAX_PATCHES {
                return rule;
            }
            rings += 1;
        }
    }

    /// The same patches on a face that does not move as a whole: each weight times the velocity at its distance from the centre, in radii.
    /// The weights sum to 1 again, so that the field on the axis far away is 1/d; the mean velocity must not be zero.
    pub fn moving(mut self, velocity: impl Fn(f64) -> f64) -> Self {
        for patch in &mut self.patches {
            patch.weight *= velocity(patch.u.hypot(patch.v));
        }
        let mean: f64 = self.patches.iter().map(|patch| patch.weight).sum();
        self.patches.iter_mut().for_each(|patch| patch.weight /= mean);
        self
    }

    /// The patches.
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// Largest deviation from 2 J₁(x)/x, x = ka sin θ, over all θ up to 90°, at an azimuth on the points and one between them.
    fn far_field_error(&self, ka: f64) -> f64 {
        (0..=90)
            .flat_map(|degree| [(degree, 0.0), (degree, 0.37)])
            .map(|(degree, azimuth): (i32, f64)| {
                let x = ka * f64::from(degree).to_radians().sin();
                let (sin, cos) = azimuth.sin_cos();
                let sum: Complex64 = self
                    .patches
                    .iter()
                    .map(|p| Complex64::from_polar(p.weight, -x * (p.u * cos + p.v * sin)))
                    .sum();
                (sum - far_field_directivity(x)).norm()
            })
            .fold(0.0, f64::max)
    }

    /// Deviation from the closed form on the axis at `distance` radii, in units of 1/radius.
    fn on_axis_error(&self, ka: f64, distance: f64) -> f64 {
        let sum: Complex64 = self
            .patches
            .iter()
            .map(|p| {
                let r = (distance * distance + p.u * p.u + p.v * p.v).sqrt();
                Complex64::from_polar(p.weight / r, ka * r)
            })
            .sum();
        (sum - on_axis(ka, 1.0, distance)).norm()
    }
}

/// The closed form on the axis of a piston, at `distance_m` from its face: the Rayleigh integral is exact there
/// (Pierce, *Acoustics*, section 5-7): (2/(i k a²)) (exp(i k √(z² + a²)) - exp(i k z)).
pub fn on_axis(wavenumber_rad_m: f64, radius_m: f64, distance_m: f64) -> Complex64 {
    let edge_m = distance_m.hypot(radius_m);
    let difference = Complex64::from_polar(1.0, wavenumber_rad_m * edge_m)
        - Complex64::from_polar(1.0, wavenumber_rad_m * distance_m);
    2.0 / (Complex64::i() * wavenumber_rad_m * radius_m * radius_m) * difference
}

/// 2 J₁(x)/x, the far-field directivity of a piston at x = k a sin θ.
pub fn far_field_directivity(x: f64) -> f64 {
    if x.abs() < 1e-6 { 1.0 - x * x / 8.0 } else { 2.0 * libm::j1(x) / x }
}

/// Patches that are summed side by side.
const LANES: usize = 4;

/// Largest turn, rad, of which sine and cosine are computed side by side: three doublings of an angle of one.
const MOST_TURN_RAD: f64 = 8.0;

/// A piston in space as a set of patches.
#[derive(Debug, Clone)]
pub struct Piston {
    centre_m: Vec3,
    radius_m: f64,
    /// Place and weight of the patches, some side by side, filled up with patches without weight.
    patches_m: Vec<[[f64; LANES]; 4]>,
}

impl Piston {
    /// A piston with any centre, unit normal and radius.
    pub fn new(centre_m: Vec3, normal: Vec3, radius_m: f64, rule: &DiscRule) -> Self {
        let (first, second) = across(normal);
        let side_by_side = |patches: &[Patch]| {
            let mut places = [[0.0; LANES]; 4];
            for lane in 0..LANES {
                let patch = patches.get(lane).unwrap_or(&Patch { u: 0.0, v: 0.0, weight: 0.0 });
                let at_m = centre_m + radius_m * (patch.u * first + patch.v * second);
                for (place, number) in places.iter_mut().zip([at_m.x, at_m.y, at_m.z, patch.weight])
                {
                    place[lane] = number;
                }
            }
            places
        };
        let patches_m = rule.patches.chunks(LANES).map(side_by_side).collect();
        Self { centre_m, radius_m, patches_m }
    }

    /// The complex field at a point in front of the face, 1/m.
    pub fn field(&self, at_m: Vec3, wavenumber_rad_m: f64) -> Complex64 {
        const NEAREST_M: f64 = 1e-9;
        // No patch is farther from the point than the centre by more than a radius.
        let turns_little = wavenumber_rad_m * self.radius_m <= MOST_TURN_RAD;
        let way_m = (at_m - self.centre_m).norm();
        let (mut real, mut imaginary) = ([0.0; LANES], [0.0; LANES]);
        for [x, y, z, weight] in &self.patches_m {
            let (mut turn_rad, mut strength) = ([0.0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                let (dx, dy, dz) = (at_m.x - x[lane], at_m.y - y[lane], at_m.z - z[lane]);
                let r = (dx * dx + dy * dy + dz * dz).sqrt().max(NEAREST_M);
                turn_rad[lane] = wavenumber_rad_m * (r - way_m);
                strength[lane] = weight[lane] / r;
            }
            let (sin, cos) = match turns_little {
                true => sin_cos_side_by_side(turn_rad),
                false => (turn_rad.map(f64::sin), turn_rad.map(f64::cos)),
            };
            for lane in 0..LANES {
                real[lane] += strength[lane] * cos[lane];
                imaginary[lane] += strength[lane] * sin[lane];
            }
        }
        let sum = Complex64::new(real.iter().sum(), imaginary.iter().sum());
        sum * Complex64::cis(wavenumber_rad_m * way_m)
    }
}

/// Sine and cosine of angles up to [`MOST_TURN_RAD`] to a few times the rounding error, without branches: the series of an eighth of the angle, which is
/// doubled three times (sin 2x = 2 sin x cos x, 1 - cos 2x = 2 sin² x).
fn sin_cos_side_by_side(angles_rad: [f64; LANES]) -> ([f64; LANES], [f64; LANES]) {
    const EIGHTH: f64 = 0.125;
    /// Terms of both series after the first: the next are below 1e-16 of it.
    const TERMS: u32 = 8;
    let x = angles_rad.map(|angle_rad| EIGHTH * angle_rad);
    let (mut sines, mut versines) = ([1.0; LANES], [1.0; LANES]);
    // By Horner's scheme, each factor x²/(2n(2n±1)).
    for term in (1..=TERMS).rev() {
        let even = f64::from(2 * term);
        let of_sine = (even * (even + 1.0)).recip();
        let of_versine = ((even + 1.0) * (even + 2.0)).recip();
        for lane in 0..LANES {
            let square = x[lane] * x[lane];
            sines[lane] = 1.0 - square * of_sine * sines[lane];
            versines[lane] = 1.0 - square * of_versine * versines[lane];
        }
    }
    for lane in 0..LANES {
        let (mut sine, mut versine) =
            (x[lane] * sines[lane], 0.5 * x[lane] * x[lane] * versines[lane]);
        for _ in 0..3 {
            (sine, versine) = (2.0 * sine * (1.0 - versine), 2.0 * sine * sine);
        }
        (sines[lane], versines[lane]) = (sine, versine);
    }
    (sines, versines.map(|versine| 1.0 - versine))
}

/// Two unit vectors perpendicular to a unit normal and to each other.
pub(super) fn across(normal: Vec3) -> (Vec3, Vec3) {
    // Any pair will do: the first is perpendicular to the axis that the normal has the smallest component along.
    let aside = Vec3::ith(normal.iamin(), 1.0);
    let first = normal.cross(&aside).normalize();
    (first, normal.cross(&first))
}

/// Nodes and weights on (0, 1): the roots of the Legendre polynomial by Newton's method from Tricomi's estimate.
fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    (0..count)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..50 {
                let (mut before, mut value) = (1.0, x);
                for j in 2..=count {
                    let j = j as f64;
                    (before, value) =
                        (value, ((2.0 * j - 1.0) * x * value - (j - 1.0) * before) / j);
                }
                slope = n * (x * value - before) / (x * x - 1.0);
                let step = value / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const K: f64 = TAU * 40_000.0 / 343.0;

    fn rule(radius_m: f64) -> DiscRule {
        DiscRule::for_piston(K * radius_m, 2.0, 1e-4)
    }

    #[test]
    fn gauss_legendre_is_exact_for_polynomials_up_to_its_degree() {
        for count in 1..12usize {
            for power in 0..2 * count {
                let sum: f64 = gauss_legendre(count)
                    .iter()
                    .map(|(x, weight)| weight * x.powi(power as i32))
                    .sum();
                assert!((sum - 1.0 / (power as f64 + 1.0)).abs() < 1e-13, "{count} {power}");
            }
        }
    }

    #[test]
    fn on_the_axis_the_sum_is_the_closed_form() {
        for radius_m in [4.5e-3, 5.25e-3] {
            let piston = Piston::new(Vec3::zeros(), Vec3::z(), radius_m, &rule(radius_m));
            for distance_m in [10.5e-3, 20e-3, 50e-3, 0.1, 0.3] {
                let error =
                    piston.field(Vec3::z() * distance_m, K) - on_axis(K, radius_m, distance_m);
                assert!(error.norm() * distance_m < 1e-4, "{radius_m} {distance_m} {error}");
            }
        }
    }

    #[test]
    fn far_away_the_sum_has_the_bessel_directivity() {
        let (radius_m, distance_m) = (4.5e-3, 50.0);
        let piston = Piston::new(Vec3::zeros(), Vec3::z(), radius_m, &rule(radius_m));
        for degree in (0..=85).step_by(5) {
            let (sin, cos) = f64::from(degree).to_radians().sin_cos();
            let p = piston.field(Vec3::new(distance_m * sin, 0.0, distance_m * cos), K);
            let expected = far_field_directivity(K * radius_m * sin);
            assert!((p.norm() * distance_m - expected.abs()).abs() < 2e-4, "{degree}");
        }
    }

    /// The far field of velocities (1 - (r/a)²)^n is 2^(n+1) (n+1)! J(n+1)(x)/x^(n+1)
    /// (M. Greenspan, J. Acoust. Soc. Am. 65, 608, 1979).
    #[test]
    fn a_face_that_moves_less_at_its_rim_has_the_lobe_of_the_closed_form() {
        let (radius_m, distance_m) = (4.5e-3, 50.0);
        for (n, factor) in [(1, 8.0), (2, 48.0)] {
            let rule = DiscRule::new(8, 32).moving(|s| (1.0 - s * s).powi(n));
            let face = Piston::new(Vec3::zeros(), Vec3::z(), radius_m, &rule);
            for degree in (10..=85).step_by(15) {
                let (sin, cos) = f64::from(degree).to_radians().sin_cos();
                let p = face.field(Vec3::new(distance_m * sin, 0.0, distance_m * cos), K);
                let x = K * radius_m * sin;
                let expected = factor * libm::jn(n + 1, x) / x.powi(n + 1);
                assert!((p.norm() * distance_m - expected.abs()).abs() < 2e-4, "{n} {degree}");
            }
        }
    }

    #[test]
    fn a_hundred_patches_are_enough_for_the_arrays_elements_everywhere_in_a_scan() {
        // Off the axis near the face there is no closed form: a rule of 4,800 patches is the reference.
        for radius_m in [4.5e-3, 5.25e-3] {
            let chosen = rule(radius_m);
            assert!(chosen.patches().len() <= 100, "{} patches", chosen.patches().len());
            let coarse = Piston::new(Vec3::zeros(), Vec3::z(), radius_m, &chosen);
            let dense = Piston::new(Vec3::zeros(), Vec3::z(), radius_m, &DiscRule::new(40, 120));
            for x_mm in (0..=100).step_by(4) {
                for z_mm in [15.0, 20.0, 30.0, 60.0, 150.0] {
                    let at_m = Vec3::new(f64::from(x_mm), 3.0, z_mm) * 1e-3;
                    let error = (coarse.field(at_m, K) - dense.field(at_m, K)).norm() * at_m.norm();
                    assert!(error < 2e-4, "{radius_m} {x_mm} {z_mm}: {error}");
                }
            }
        }
    }

    #[test]
    fn sines_side_by_side_are_those_of_the_library() {
        for n in -8000..8000i32 {
            let x = 1e-3 * f64::from(n);
            let (sines, cosines) = sin_cos_side_by_side([x, -x, 0.5 * x, 0.0]);
            let (sin, cos) = x.sin_cos();
            assert!((sines[0] - sin).abs() < 4e-15 && (cosines[0] - cos).abs() < 4e-15, "{x}");
            assert_eq!((sines[1], cosines[1]), (-sines[0], cosines[0]));
            assert_eq!((sines[3], cosines[3]), (0.0, 1.0));
        }
    }

    /// A face that is small and one whose patches turn by more than the series holds for, against the sum as it is written.
    #[test]
    fn the_sum_side_by_side_is_the_sum_of_the_patches() {
        for (radius_m, k) in [(5e-3, K), (20e-3, K), (5e-3, 10.0 * K)] {
            let rule = DiscRule::new(3, 13);
            let (centre_m, normal) = (Vec3::new(0.01, -0.02, 0.0), Vec3::new(0.6, 0.0, 0.8));
            let piston = Piston::new(centre_m, normal, radius_m, &rule);
            let (first, second) = across(normal);
            let at_m = Vec3::new(0.03, 0.01, 0.09);
            let wave = |patch: &Patch| {
                let from_m = centre_m + radius_m * (patch.u * first + patch.v * second);
                let r = (at_m - from_m).norm();
                Complex64::from_polar(patch.weight / r, k * r)
            };
            let expected: Complex64 = rule.patches().iter().map(wave).sum();
            let field = piston.field(at_m, k);
            assert!((field - expected).norm() < 1e-11 * expected.norm(), "{field} {expected}");
        }
    }

    proptest! {
        #[test]
        fn a_turned_and_moved_piston_has_its_field_turned_and_moved(
            axis in prop::array::uniform3(-1.0..1.0f64), angle in 0.0..3.0f64,
            shift in prop::array::uniform3(-0.1..0.1f64), at in prop::array::uniform3(-0.05..0.05f64),
        ) {
            prop_assume!(Vec3::from(axis).norm() > 0.1);
            let turn = nalgebra::Rotation3::new(Vec3::from(axis).normalize() * angle);
            let (shift, at) = (Vec3::from(shift), Vec3::from(at) + Vec3::z() * 0.1);
            let rule = rule(4.5e-3);
            let plain = Piston::new(Vec3::zeros(), Vec3::z(), 4.5e-3, &rule).field(at, K);
            let moved = Piston::new(shift, turn * Vec3::z(), 4.5e-3, &rule).field(turn * at + shift, K);
            // The patches lie turned about the normal, so equal up to the rule's own error.
            prop_assert!((plain - moved).norm() < 2e-4 * plain.norm().max(10.0));
        }
    }
}
