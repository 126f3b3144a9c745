//! A rigid sphere in the wave of a point source, by its exact series.
//!
//! Of a source at the distance r₀ from the sphere's centre, whose free wave is exp(ikR)/R, the scattered wave at r is
//! ```text
//! -ik Σ (2n + 1) [j'ₙ(ka)/h'ₙ(ka)] hₙ(kr₀) hₙ(kr) Pₙ(cos γ)
//! ```
//! (Bowman, Senior and Uslenghi, *Electromagnetic and Acoustic Scattering by Simple Shapes*, section 10.3; Morse and Ingard, *Theoretical
//! Acoustics*, section 8.2, has the same for a plane wave). The time convention is exp(-iωt).

use num_complex::Complex64;

use fieldgap_acoustics::Vec3;

/// A rigid sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidSphere {
    /// Its centre, array's frame, m.
    pub centre_m: Vec3,
    /// Its radius, m, above zero.
    pub radius_m: f64,
}

/// The waves of many point sources, scattered by one sphere.
#[derive(Debug, Clone)]
pub struct ScatteredWaves {
    sphere: RigidSphere,
    wavenumber_rad_m: f64,
    sources: Vec<ScatteredWave>,
}

/// The scattered wave of one source.
#[derive(Debug, Clone)]
struct ScatteredWave {
    /// From the sphere's centre to the source, of unit length.
    towards: Vec3,
    /// The factor of hₙ(kr) Pₙ(cos γ).
    terms: Vec<Complex64>,
}

impl ScatteredWaves {
    /// Sources at these places, each with its free field at the sphere's centre, 1/m. A source within the sphere is taken to its surface.
    pub fn new(
        sphere: RigidSphere,
        sources: impl Iterator<Item = (Vec3, Complex64)>,
        wavenumber_rad_m: f64,
    ) -> Self {
        let k = wavenumber_rad_m;
        let ratios = ratios(k * sphere.radius_m);
        let sources = sources
            .map(|(at_m, incident)| {
                let away = at_m - sphere.centre_m;
                let distance_m = away.norm().max(sphere.radius_m);
                let free = Complex64::from_polar(1.0 / distance_m, k * distance_m);
                let strength = -Complex64::i() * k * incident / free;
                let outgoing = outgoing(k * distance_m, ratios.len());
                let term = |(n, (ratio, h)): (usize, (&Complex64, Complex64))| {
                    strength * (2 * n + 1) as f64 * ratio * h
                };
                let terms = ratios.iter().zip(outgoing).enumerate().map(term).collect();
                ScatteredWave { towards: away.try_normalize(0.0).unwrap_or_else(Vec3::z), terms }
            })
            .collect();
        Self { sphere, wavenumber_rad_m, sources }
    }

    /// The scattered wave of each source at a point, 1/m. A point within the sphere is taken to its surface.
    pub fn at(&self, at_m: Vec3) -> Vec<Complex64> {
        let away = at_m - self.sphere.centre_m;
        let distance_m = away.norm().max(self.sphere.radius_m);
        let direction = away.try_normalize(0.0).unwrap_or_else(Vec3::z);
        let orders = self.sources.first().map_or(0, |source| source.terms.len());
        let outgoing = outgoing(self.wavenumber_rad_m * distance_m, orders);
        let of = |source: &ScatteredWave| {
            let cos = direction.dot(&source.towards).clamp(-1.0, 1.0);
            let (mut before, mut legendre) = (0.0, 1.0);
            let mut sum = Complex64::ZERO;
            for (n, (term, h)) in source.terms.iter().zip(&outgoing).enumerate() {
                sum += term * h * legendre;
                let n = n as f64;
                (before, legendre) =
                    (legendre, ((2.0 * n + 1.0) * cos * legendre - n * before) / (n + 1.0));
            }
            sum
        };
        self.sources.iter().map(of).collect()
    }
}

/// j'ₙ(x)/h'ₙ(x) of as many orders as count. The terms fall faster than exponentially beyond n = x.
fn ratios(x: f64) -> Vec<Complex64> {
    // Wiscombe's number of terms (Appl. Opt. 19, 1505, 1980), with some more because source and receiver can be near.
    let orders = (x + 4.05 * x.cbrt() + 12.0).ceil() as usize;
    let (j, h) = (regular(x, orders + 1), outgoing(x, orders + 1));
    // f'₀ = -f₁, f'ₙ = fₙ₋₁ - (n + 1)/x fₙ.
    let slope_j = |n: usize| if n == 0 { -j[1] } else { j[n - 1] - (n + 1) as f64 / x * j[n] };
    let slope_h = |n: usize| if n == 0 { -h[1] } else { h[n - 1] - (n + 1) as f64 / x * h[n] };
    (0..orders).map(|n| slope_j(n) / slope_h(n)).collect()
}

/// jₙ(x), n = 0 to `orders` - 1: upwards below n = x, where both solutions oscillate, and otherwise by Miller's downward recurrence.
fn regular(x: f64, orders: usize) -> Vec<f64> {
    if x > orders as f64 {
        return upwards(x, orders, [x.sin() / x, (x.sin() / x - x.cos()) / x]);
    }
    let start = orders + 20 + x.ceil() as usize;
    let mut values = vec![0.0; orders];
    let (mut above, mut here) = (0.0, 1e-300);
    for n in (0..=start).rev() {
        if n < orders {
            values[n] = here;
        }
        // From n to n - 1.
        (above, here) = (here, (2 * n + 1) as f64 / x * here - above);
        if here.abs() > 1e200 {
            above *= 1e-200;
            here *= 1e-200;
            values.iter_mut().for_each(|value| *value *= 1e-200);
        }
    }
    // After the last step `above` is what stands for j₀ and `here` for cos(x)/x: one of the two is far from zero.
    let (sin, cos) = x.sin_cos();
    let scale = if sin.abs() > cos.abs() { sin / x / above } else { cos / x / here };
    values.into_iter().map(|value| value * scale).collect()
}

/// hₙ(x) = jₙ(x) + i yₙ(x), n = 0 to `orders` - 1; yₙ by upward recurrence, which is stable.
fn outgoing(x: f64, orders: usize) -> Vec<Complex64> {
    let (sin, cos) = x.sin_cos();
    let singular = upwards(x, orders, [-cos / x, -(cos / x + sin) / x]);
    regular(x, orders).into_iter().zip(singular).map(|(j, y)| Complex64::new(j, y)).collect()
}

/// The recurrence fₙ₊₁ = (2n + 1)/x fₙ - fₙ₋₁ from its first two values.
fn upwards(x: f64, orders: usize, [mut before, mut here]: [f64; 2]) -> Vec<f64> {
    let mut values = Vec::with_capacity(orders);
    for n in 1..=orders {
        values.push(before);
        (before, here) = (here, (2 * n + 1) as f64 / x * here - before);
    }
    values
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    const K: f64 = 732.7;

    fn free(from_m: Vec3, at_m: Vec3) -> Complex64 {
        let distance_m = (at_m - from_m).norm();
        Complex64::from_polar(1.0 / distance_m, K * distance_m)
    }

    fn of_one(sphere: RigidSphere, source_m: Vec3) -> ScatteredWaves {
        let source = (source_m, free(source_m, sphere.centre_m));
        ScatteredWaves::new(sphere, std::iter::once(source), K)
    }

    /// Amplitude of the scattered wave far away for a plane wave of unit amplitude that goes along z, at an angle from z, m.
    fn plane_wave(ka: f64, theta_rad: f64) -> Complex64 {
        let sphere = RigidSphere { centre_m: Vec3::zeros(), radius_m: ka / K };
        // Orders of up to 230 are far away from n²/k = 70 m on.
        let far_m = 2e3;
        let source_m = Vec3::z() * -far_m;
        let at_m = Vec3::new(theta_rad.sin(), 0.0, theta_rad.cos()) * far_m;
        let incident = Complex64::ONE;
        let waves = ScatteredWaves::new(sphere, std::iter::once((source_m, incident)), K);
        waves.at(at_m)[0] / free(Vec3::zeros(), at_m)
    }

    #[test]
    fn spherical_functions_are_those_of_low_orders_in_closed_form() {
        for x in [1e-3, 0.3, PI, 7.0, 40.0] {
            let (sin, cos) = f64::sin_cos(x);
            let (j, h) = (regular(x, 4), outgoing(x, 4));
            assert!((j[0] - sin / x).abs() < 1e-13, "{x}: {}", j[0]);
            // The closed form itself cancels near zero.
            assert!((j[1] - (sin / x - cos) / x).abs() < 1e-9, "{x}: {}", j[1]);
            assert!((h[1].im / (-(cos / x + sin) / x) - 1.0).abs() < 1e-9, "{x}");
            // The Wronskian jₙ yₙ₋₁ - jₙ₋₁ yₙ = 1/x² holds for every order.
            let wronskian = j[3] * h[2].im - j[2] * h[3].im;
            assert!((wronskian * x * x - 1.0).abs() < 1e-9, "{x}: {wronskian}");
        }
    }

    #[test]
    fn a_small_sphere_is_a_monopole_and_a_dipole() {
        // -(k²a³/3)(1 - (3/2) cos θ): Morse and Ingard, equation 8.2.19.
        let ka: f64 = 0.02;
        for degree in [0.0, 48.2, 90.0, 135.0, 180.0] {
            let theta_rad = f64::to_radians(degree);
            let expected = -ka.powi(3) / (3.0 * K) * (1.0 - 1.5 * theta_rad.cos());
            let got = plane_wave(ka, theta_rad);
            assert!((got - expected).norm() < 1e-3 * ka.powi(3) / K, "{degree}: {got} {expected}");
        }
    }

    #[test]
    fn a_large_sphere_reflects_as_a_mirror_and_throws_a_shadow() {
        // Backwards |f| is half the radius; the total cross-section, 4π/k Im f(0), is twice the disc, as half of it is the shadow. What it
        // lacks falls with (ka)^(-2/3), the width of the edge of the shadow.
        for (ka, lacks) in [(60.0, 0.07), (200.0, 0.03)] {
            let radius_m = ka / K;
            let backwards = plane_wave(ka, PI).norm() / (0.5 * radius_m);
            assert!((backwards - 1.0).abs() < 0.01, "{ka}: {backwards}");
            let section = 4.0 * PI / K * plane_wave(ka, 0.0).im;
            let discs = section / (PI * radius_m * radius_m);
            assert!(discs < 2.0 && discs > 2.0 * (1.0 - lacks), "{ka}: {discs}");
        }
    }

    proptest! {
        /// The boundary condition itself: no velocity into the sphere, anywhere on it.
        #[test]
        fn on_the_sphere_the_pressure_has_no_slope(
            radius_mm in 0.5..15.0f64, away in 1.6..20.0f64,
            source in prop::array::uniform3(-1.0..1.0f64), point in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let (source, point) = (Vec3::from(source), Vec3::from(point));
            prop_assume!(source.norm() > 0.1 && point.norm() > 0.1);
            let sphere = RigidSphere { centre_m: Vec3::new(0.01, 0.0, 0.05), radius_m: radius_mm * 1e-3 };
            let source_m = sphere.centre_m + source.normalize() * away * sphere.radius_m;
            let waves = of_one(sphere, source_m);
            let outwards = point.normalize();
            let pressure = |r_m: f64| {
                let at_m = sphere.centre_m + outwards * r_m;
                free(source_m, at_m) + waves.at(at_m)[0]
            };
            let step_m = 1e-6;
            // A one-sided quotient of second order.
            let [p0, p1, p2] = [0.0, 1.0, 2.0].map(|n| pressure(sphere.radius_m + n * step_m));
            let slope = (-1.5 * p0 + 2.0 * p1 - 0.5 * p2) / step_m;
            let scale = K.max(1.0 / sphere.radius_m) * p0.norm().max(free(source_m, sphere.centre_m).norm());
            prop_assert!(slope.norm() < 2e-3 * scale, "{slope} {scale}");
        }
    }
}
