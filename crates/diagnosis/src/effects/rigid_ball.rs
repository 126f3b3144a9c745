//! The wave that a rigid ball scatters.
//!
//! About the ball's centre the wave of a point source is a sum of regular spherical waves, and each is scattered so that the surface stands still (P. M. Morse
//! and K. U. Ingard, *Theoretical Acoustics*, section 8.2): p = -ik q Σ (2l + 1) jₗ'(ka)/hₗ'(ka) hₗ(kR) hₗ(kr) Pₗ(cos γ), with R the source's distance
//! from the ball, r the receiver's, and γ the angle between them.
//!
//! By the addition theorem Pₗ(cos γ) is a sum of products of a function of the source's direction and one of the receiver's: Σ Nₗₘ² Pₗᵐ(cos θ) Pₗᵐ(cos θ') (2 - δₘ₀)
//! cos m(φ - φ'), with Nₗₘ² = (l - m)!/(l + m)! (M. Abramowitz and I. A. Stegun, *Handbook of Mathematical Functions*, chapter 8). So all sources enter one
//! set of coefficients, and a receiver costs the same for any number of them.

use fieldgap_acoustics::Vec3;
use num_complex::Complex64;

use crate::model::pressure::Pressure;

/// Orders beyond ka that are summed: the next is below a millionth (W. J. Wiscombe, Appl. Opt. 19, 1505, 1980).
const BEYOND: f64 = 4.0;

/// Receivers summed at a time: the recurrences of one wait for the order before.
const LANES: usize = 8;

type Lanes = [f64; LANES];

/// The scattered wave of all sources, to be read at any place.
pub(super) struct ScatteredWave {
    centre_m: Vec3,
    radius_m: f64,
    wavenumber_rad_m: f64,
    harmonics: Harmonics,
    /// Of each degree m and order l from m on: what cos mφ and sin mφ are multiplied with.
    coefficients: Vec<[Complex64; 2]>,
}

impl ScatteredWave {
    /// Of sources at these places, each with the pressure that it has at the ball's centre.
    pub fn new(
        centre_m: Vec3,
        radius_m: f64,
        wavenumber_rad_m: f64,
        sources: &[(Vec3, Complex64)],
    ) -> Self {
        let k = wavenumber_rad_m;
        let orders = (k * radius_m + BEYOND + 4.0 * (k * radius_m).cbrt()).ceil() as usize;
        let of_ball = of_ball(orders, k * radius_m);
        let harmonics = Harmonics::new(orders);
        let mut coefficients = vec![[Complex64::ZERO; 2]; harmonics.count()];
        let mut weights = Vec::with_capacity(orders + 1);
        for some in sources.chunks(LANES) {
            let ways_m = some.iter().map(|(source_m, _)| source_m - centre_m);
            // A lane without a source has no strength.
            let mut distances = [k * radius_m; LANES];
            let mut strengths = [Complex64::ZERO; LANES];
            for (n, ((_, pressure), way_m)) in some.iter().zip(ways_m.clone()).enumerate() {
                distances[n] = k * way_m.norm().max(radius_m);
                strengths[n] = pressure * distances[n] * Complex64::cis(-distances[n]);
            }
            fill_with_outgoing(&mut weights, orders, &distances);
            for ([re, im], scattered) in weights.iter_mut().zip(&of_ball) {
                for n in 0..LANES {
                    let weight = strengths[n] * scattered * Complex64::new(re[n], im[n]);
                    [re[n], im[n]] = [weight.re, weight.im];
                }
            }
            let mut of_all = coefficients.iter_mut();
            harmonics.at(&Direction::of(ways_m), |degree, order, legendre, azimuth| {
                let both = if degree == 0 { 1.0 } else { 2.0 };
                let [re, im] = &weights[order];
                let sums = azimuth.map(|of_angle| {
                    let mut sum = Complex64::ZERO;
                    for n in 0..LANES {
                        let factor = both * legendre[n] * of_angle[n];
                        sum += Complex64::new(factor * re[n], factor * im[n]);
                    }
                    sum
                });
                let of_harmonic = of_all.next().expect("as many as harmonics");
                of_harmonic.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
            });
        }
        Self { centre_m, radius_m, wavenumber_rad_m, harmonics, coefficients }
    }

    /// Adds it to the pressures at some places. A place within the ball is taken to be on its surface: the robot would have touched it.
    pub fn add_to(&self, pressures: &mut [Pressure], points_m: &[Vec3]) {
        let mut waves = Vec::with_capacity(self.harmonics.orders + 1);
        for (pressures, points_m) in pressures.chunks_mut(LANES).zip(points_m.chunks(LANES)) {
            let ways_m = points_m.iter().map(|at_m| at_m - self.centre_m);
            let direction = Direction::of(ways_m.clone());
            let mut distances = [self.wavenumber_rad_m * self.radius_m.max(1e-6); LANES];
            for (distance, way_m) in distances.iter_mut().zip(ways_m) {
                *distance = distance.max(self.wavenumber_rad_m * way_m.norm());
            }
            fill_with_outgoing(&mut waves, self.harmonics.orders, &distances);
            let mut sum = [[0.0; LANES]; 2];
            let mut of_all = self.coefficients.iter();
            self.harmonics.at(&direction, |_, order, legendre, [cos, sin]| {
                let [of_cos, of_sin] = of_all.next().expect("as many as harmonics");
                let [re, im] = &waves[order];
                for n in 0..LANES {
                    let [a, b] = [legendre[n] * cos[n], legendre[n] * sin[n]];
                    let factor_re = a * of_cos.re + b * of_sin.re;
                    let factor_im = a * of_cos.im + b * of_sin.im;
                    sum[0][n] += re[n] * factor_re - im[n] * factor_im;
                    sum[1][n] += re[n] * factor_im + im[n] * factor_re;
                }
            });
            for (n, pressure) in pressures.iter_mut().enumerate() {
                pressure.coherent += Complex64::new(sum[0][n], sum[1][n]);
            }
        }
    }
}

/// Directions about the z axis, one a lane.
struct Direction {
    /// Cosine and sine of the angle to the axis.
    polar: [Lanes; 2],
    /// Cosine and sine of the angle about it.
    azimuth: [Lanes; 2],
}

impl Direction {
    /// Of up to [`LANES`] ways; other lanes, and a way of no length, point along the axis.
    fn of(ways_m: impl Iterator<Item = Vec3>) -> Self {
        let mut direction =
            Self { polar: [[1.0; LANES], [0.0; LANES]], azimuth: [[1.0; LANES], [0.0; LANES]] };
        for (n, way_m) in ways_m.enumerate() {
            let (across_m, along_m) = (way_m.x.hypot(way_m.y), way_m.norm());
            if along_m > 0.0 {
                [direction.polar[0][n], direction.polar[1][n]] =
                    [way_m.z / along_m, across_m / along_m];
            }
            if across_m > 0.0 {
                [direction.azimuth[0][n], direction.azimuth[1][n]] =
                    [way_m.x / across_m, way_m.y / across_m];
            }
        }
        direction
    }
}

/// The functions Nₗₘ Pₗᵐ of all orders and degrees.
struct Harmonics {
    orders: usize,
    /// Of each degree m and order l from m on: the factors of the recurrence by order, on cos θ times the function before and on the one before that.
    factors: Vec<[f64; 2]>,
}

impl Harmonics {
    fn new(orders: usize) -> Self {
        let factors = (0..=orders).flat_map(|m| (m..=orders).map(move |l| (l, m)));
        let factors = factors.map(|(l, m)| {
            let [l, m] = [l as f64, m as f64];
            let size = (l * l - m * m).sqrt();
            let before = ((l - 1.0).powi(2) - m * m).max(0.0).sqrt();
            [(2.0 * l - 1.0) / size, before / size]
        });
        Self { orders, factors: factors.collect() }
    }

    fn count(&self) -> usize {
        self.factors.len()
    }

    /// Gives each function in its order, with its degree and order, the function's values, and cos mφ and sin mφ.
    #[inline(always)]
    fn at(&self, direction: &Direction, mut take: impl FnMut(usize, usize, &Lanes, [&Lanes; 2])) {
        let [cos, sin] = &direction.polar;
        let [cos_one, sin_one] = &direction.azimuth;
        let mut first = [1.0; LANES];
        let (mut cos_m, mut sin_m) = ([1.0; LANES], [0.0; LANES]);
        let mut factors = self.factors.iter();
        for m in 0..=self.orders {
            // Of order m: √((2m - 1)/(2m)) sin θ times that of the degree before.
            let (mut before, mut now) = ([0.0; LANES], first);
            for l in m..=self.orders {
                let [on_before, on_first] = factors.next().expect("one for each order");
                if l > m {
                    for n in 0..LANES {
                        let next = on_before * cos[n] * now[n] - on_first * before[n];
                        (before[n], now[n]) = (now[n], next);
                    }
                }
                take(m, l, &now, [&cos_m, &sin_m]);
            }
            let of_next = ((2 * m + 1) as f64 / (2 * m + 2) as f64).sqrt();
            for n in 0..LANES {
                first[n] *= of_next * sin[n];
                (cos_m[n], sin_m[n]) = (
                    cos_m[n] * cos_one[n] - sin_m[n] * sin_one[n],
                    sin_m[n] * cos_one[n] + cos_m[n] * sin_one[n],
                );
            }
        }
    }
}

/// What a rigid ball makes of each order: -i (2l + 1) jₗ'(ka)/hₗ'(ka).
fn of_ball(orders: usize, ka: f64) -> Vec<Complex64> {
    let j = regular(orders + 1, ka);
    let h = outgoing(orders + 1, ka);
    (0..=orders)
        .map(|l| {
            // f' = l/x f - f of the next order.
            let by_order = l as f64 / ka;
            let slope_j = by_order * j[l] - j[l + 1];
            let slope_h = by_order * h[l] - h[l + 1];
            -Complex64::I * (2 * l + 1) as f64 * slope_j / slope_h
        })
        .collect()
}

/// Outgoing spherical waves hₗ(x) = jₗ + i yₗ of orders 0 to `orders`.
fn outgoing(orders: usize, x: f64) -> Vec<Complex64> {
    let mut waves = Vec::new();
    fill_with_outgoing(&mut waves, orders, &[x; LANES]);
    waves.iter().map(|[re, im]| Complex64::new(re[0], im[0])).collect()
}

/// The same at several arguments, real and imaginary parts; upwards, which is stable for them.
fn fill_with_outgoing(waves: &mut Vec<[Lanes; 2]>, orders: usize, x: &Lanes) {
    let mut first = [[0.0; LANES]; 2];
    let mut second = [[0.0; LANES]; 2];
    for n in 0..LANES {
        let (sin, cos) = x[n].sin_cos();
        // h₀ = -i exp(ix)/x and h₁ = h₀ (1/x - i).
        let [re, im] = [sin / x[n], -cos / x[n]];
        [first[0][n], first[1][n]] = [re, im];
        [second[0][n], second[1][n]] = [re / x[n] + im, im / x[n] - re];
    }
    waves.clear();
    waves.extend([first, second]);
    for l in 1..orders {
        let mut next = [[0.0; LANES]; 2];
        for n in 0..LANES {
            let factor = (2 * l + 1) as f64 / x[n];
            next[0][n] = factor * waves[l][0][n] - waves[l - 1][0][n];
            next[1][n] = factor * waves[l][1][n] - waves[l - 1][1][n];
        }
        waves.push(next);
    }
    waves.truncate(orders + 1);
}

/// Regular spherical waves jₗ(x) of orders 0 to `orders`, downwards from far above (J. C. P. Miller's method).
fn regular(orders: usize, x: f64) -> Vec<f64> {
    let start = orders + 15 + x.ceil() as usize;
    let mut waves = vec![0.0; start + 2];
    waves[start] = 1e-250;
    for l in (1..=start).rev() {
        waves[l - 1] = (2 * l + 1) as f64 / x * waves[l] - waves[l + 1];
        if waves[l - 1].abs() > 1e200 {
            waves.iter_mut().for_each(|wave| *wave *= 1e-200);
        }
    }
    // Near a zero of the one the other is large.
    let (zeroth, first) = (x.sin() / x, x.sin() / (x * x) - x.cos() / x);
    let scale = if zeroth.abs() > first.abs() { zeroth / waves[0] } else { first / waves[1] };
    waves.truncate(orders + 1);
    waves.iter_mut().for_each(|wave| *wave *= scale);
    waves
}

#[cfg(test)]
mod tests {
    use super::*;

    /// jₗ and yₗ of the recurrences have the Wronskian 1/x².
    #[test]
    fn the_spherical_waves_are_independent_solutions() {
        for x in [0.3, 2.0, std::f64::consts::PI, 11.0] {
            let (j, h) = (regular(8, x), outgoing(8, x));
            for l in 0..8 {
                let y = |l: usize| h[l].im;
                let wronskian = j[l + 1] * y(l) - j[l] * y(l + 1);
                assert!((wronskian * x * x - 1.0).abs() < 1e-9, "{x} {l}: {wronskian}");
            }
        }
    }

    /// The wave of three sources by the series itself, with Legendre polynomials of the angle between source and receiver.
    #[test]
    fn the_coefficients_of_all_sources_give_the_series_of_each() {
        let (k, radius_m, centre_m) = (733.0, 6e-3, Vec3::new(5e-3, -2e-3, 0.05));
        let sources = [
            (Vec3::new(0.02, 0.01, 0.0), Complex64::new(1.0, -0.3)),
            (Vec3::new(-0.03, 0.0, 0.001), Complex64::new(-0.2, 0.7)),
            // Straight below: the angle about the axis has no meaning there.
            (Vec3::new(5e-3, -2e-3, 0.0), Complex64::new(0.4, 0.4)),
        ];
        // As many places as fill lanes and one more; the first two on the axis.
        let mut points_m = vec![centre_m + Vec3::z() * 0.02, centre_m - Vec3::z() * 0.01];
        points_m.extend((0..LANES - 1).map(|n| {
            centre_m + Vec3::new(0.01, 0.004 * n as f64 - 0.01, 0.013 - 0.003 * n as f64)
        }));
        let wave = ScatteredWave::new(centre_m, radius_m, k, &sources);
        let mut pressures = vec![Pressure::steady(Complex64::ONE); points_m.len()];
        wave.add_to(&mut pressures, &points_m);
        let orders = wave.harmonics.orders;
        let scattered = of_ball(orders, k * radius_m);
        for (pressure, at_m) in pressures.iter().zip(&points_m) {
            let mut expected = Complex64::ONE;
            for (source_m, of_source) in &sources {
                let (towards_m, way_m) = (source_m - centre_m, at_m - centre_m);
                let cos = towards_m.dot(&way_m) / (towards_m.norm() * way_m.norm());
                let [from, to] = [towards_m, way_m].map(|way| outgoing(orders, k * way.norm()));
                let strength =
                    of_source * k * towards_m.norm() * Complex64::cis(-k * towards_m.norm());
                let (mut before, mut now) = (0.0, 1.0);
                for l in 0..=orders {
                    expected += strength * scattered[l] * from[l] * to[l] * now;
                    let next =
                        ((2 * l + 1) as f64 * cos * now - l as f64 * before) / (l + 1) as f64;
                    (before, now) = (now, next);
                }
            }
            let off = (pressure.coherent - expected).norm();
            assert!(off < 1e-10 * expected.norm(), "{at_m}: {off}");
        }
    }
}
