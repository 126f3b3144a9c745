//! A rigid ball in the field scatters the waves of all elements.
//!
//! The wave of an element is taken for that of a point with the pressure that the element has at the ball. About the ball's centre it is
//! a sum of regular spherical waves, and each is scattered so that the surface stands still (P. M. Morse and K. U. Ingard, *Theoretical Acoustics*, section
//! 8.2): p = -ik q Σ (2l + 1) jₗ'(ka)/hₗ'(ka) hₗ(kR) hₗ(kr) Pₗ(cos γ), with R the element's distance from the ball, r the receiver's, and γ the angle
//! between them.

use fieldgap_acoustics::{Simulator, Vec3};
use num_complex::Complex64;

use crate::effect_id::EffectId;
use crate::model::effect::{
    Choice, Context, Effect, Estimate, Facts, Finding, Parameter, PerElement, Search, Stage,
    SurroundingField, Timing,
};
use crate::model::instance::Setting;
use crate::model::pressure::Pressure;
use crate::remedy::Remedy;

/// The effect.
pub(crate) struct Scatterer;

/// Place of the ball's centre, mm.
const PLACE: Parameter = Parameter { neutral: 0.0, scale: 0.05, least: -400.0, most: 400.0 };

/// Orders beyond ka that are summed: the next is below a millionth (W. J. Wiscombe, Appl. Opt. 19, 1505, 1980).
const BEYOND: f64 = 4.0;

/// A receiver nearer to the ball's centre than this many radii is taken to be there: the robot would have touched it.
const TOUCHED: f64 = 1.0;

impl Scatterer {
    /// A ball whose scattered wave has this strength, the pressure at one metre over the incident one, m.
    pub fn of_strength(at_m: Vec3, strength_m: f64, wavenumber_rad_m: f64) -> Vec<f64> {
        // A large ball scatters as half its radius; a small one as k²a³/2 sidewards (Morse and Ingard).
        let large_m = 2.0 * strength_m;
        let small_m = (2.0 * strength_m / wavenumber_rad_m.powi(2)).cbrt();
        let at_mm = 1e3 * at_m;
        vec![at_mm.x, at_mm.y, at_mm.z, 1e3 * large_m.max(small_m).min(0.03)]
    }
}

impl Effect for Scatterer {
    fn id(&self) -> EffectId {
        EffectId::Scatterer
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[PLACE, PLACE, PLACE, Parameter { neutral: 0.0, scale: 0.05, least: 0.05, most: 40.0 }]
    }

    fn facts(&self) -> Facts {
        Facts {
            stage: Stage::Field,
            timing: Timing::Place,
            per_element: PerElement::No,
            mimics: &[],
            independent_check: Some("look for an object in the path of the sound, and remove it"),
        }
    }

    fn remedy(&self, _simulator: Simulator) -> Remedy {
        Remedy::Manual("the simulators model a free field only; remove the object")
    }

    fn search(&self) -> Search {
        Search::Objects
    }

    fn added_waves(
        &self,
        at: Setting<'_>,
        field: &dyn SurroundingField,
        pressures: &mut [Pressure],
    ) {
        let centre_m = 1e-3 * Vec3::new(at.values[0], at.values[1], at.values[2]);
        let radius_m = 1e-3 * at.values[3];
        let k = field.wavenumber_rad_m();
        let ball = Ball::of(k * radius_m);
        let scattered = |(source_m, pressure): (Vec3, Complex64)| {
            let way_m = source_m - centre_m;
            let distance_m = way_m.norm().max(radius_m);
            let strength = pressure * distance_m * Complex64::cis(-k * distance_m);
            let mut weights = outgoing(ball.orders, k * distance_m);
            weights.iter_mut().zip(&ball.scattered).for_each(|(h, t)| *h *= strength * k * t);
            (way_m / distance_m, weights)
        };
        let sources: Vec<_> = field.waves_at(&centre_m).into_iter().map(scattered).collect();
        let sources: Vec<Sources> = sources.chunks(LANES).map(Sources::of).collect();
        let mut waves = Vec::with_capacity(ball.orders + 2);
        for (pressure, at_m) in pressures.iter_mut().zip(field.points_m()) {
            let way_m = at_m - centre_m;
            let distance_m = way_m.norm().max(TOUCHED * radius_m).max(1e-6);
            fill_with_outgoing(&mut waves, ball.orders, k * distance_m);
            let direction = way_m / distance_m;
            let parts = sources.iter().map(|some| some.scattered_towards(direction, &waves));
            pressure.coherent += parts.sum::<Complex64>();
        }
    }

    fn describe(&self, fitted: &[Estimate], _choice: &Choice, _believed: &Context) -> Finding {
        let [x, y, z, radius] = [fitted[0], fitted[1], fitted[2], fitted[3]];
        let sentence = format!(
            "an object scatters like a rigid ball of {:.2} ± {:.2} mm radius at ({:.1}, {:.1}, {:.1}) mm in the array's frame",
            radius.value, radius.error, x.value, y.value, z.value
        );
        Finding::new(
            [
                ("x_mm", x.real()),
                ("y_mm", y.real()),
                ("z_mm", z.real()),
                ("radius_mm", radius.real()),
            ],
            sentence,
        )
    }
}

/// What a rigid ball makes of each order.
struct Ball {
    orders: usize,
    /// -i (2l + 1) jₗ'(ka)/hₗ'(ka).
    scattered: Vec<Complex64>,
}

impl Ball {
    fn of(ka: f64) -> Self {
        let orders = (ka + BEYOND + 4.0 * ka.cbrt()).ceil() as usize;
        let j = regular(orders + 1, ka);
        let h = outgoing(orders + 1, ka);
        let scattered = (0..=orders)
            .map(|l| {
                // f' = l/x f - f of the next order.
                let by_order = l as f64 / ka;
                let slope_j = by_order * j[l] - j[l + 1];
                let slope_h = by_order * h[l] - h[l + 1];
                -Complex64::I * (2 * l + 1) as f64 * slope_j / slope_h
            })
            .collect();
        Self { orders, scattered }
    }
}

/// Sources summed at a time: the recurrence of one waits for its order before.
const LANES: usize = 8;

/// What the ball scatters of the waves of some sources. Lanes beyond the last source have no weight.
struct Sources {
    /// From the ball to each, along each axis.
    towards: [[f64; LANES]; 3],
    /// Real and imaginary parts of the weight of each order.
    weights: Vec<[[f64; LANES]; 2]>,
}

impl Sources {
    /// Up to [`LANES`] sources: the direction of each, and the weights of the orders of its scattered wave.
    fn of(sources: &[(Vec3, Vec<Complex64>)]) -> Self {
        let mut towards = [[0.0; LANES]; 3];
        let mut weights = vec![[[0.0; LANES]; 2]; sources[0].1.len()];
        for (lane, (direction, of_source)) in sources.iter().enumerate() {
            (0..3).for_each(|axis| towards[axis][lane] = direction[axis]);
            for (of_order, weight) in weights.iter_mut().zip(of_source) {
                [of_order[0][lane], of_order[1][lane]] = [weight.re, weight.im];
            }
        }
        Self { towards, weights }
    }

    /// Σ aₗ hₗ Pₗ(cos γ) over orders and sources in a direction, by the recurrence of the Legendre polynomials.
    fn scattered_towards(&self, direction: Vec3, waves: &[Complex64]) -> Complex64 {
        let [x, y, z] = &self.towards;
        let cos: [f64; LANES] =
            std::array::from_fn(|n| x[n] * direction.x + y[n] * direction.y + z[n] * direction.z);
        let mut sum = [[0.0; LANES]; 2];
        let (mut before, mut now) = ([0.0; LANES], [1.0; LANES]);
        for (l, ([re, im], wave)) in self.weights.iter().zip(waves).enumerate() {
            let of_next = 1.0 / (l as f64 + 1.0);
            let [by_now, by_before] = [(2 * l + 1) as f64 * of_next, l as f64 * of_next];
            for n in 0..LANES {
                sum[0][n] += now[n] * (re[n] * wave.re - im[n] * wave.im);
                sum[1][n] += now[n] * (re[n] * wave.im + im[n] * wave.re);
                let next = by_now * cos[n] * now[n] - by_before * before[n];
                (before[n], now[n]) = (now[n], next);
            }
        }
        let [re, im] = sum.map(|lanes| lanes.iter().sum());
        Complex64::new(re, im)
    }
}

/// Outgoing spherical waves hₗ(x) = jₗ + i yₗ of orders 0 to `orders`, upwards, which is stable for them.
fn outgoing(orders: usize, x: f64) -> Vec<Complex64> {
    let mut waves = Vec::with_capacity(orders + 2);
    fill_with_outgoing(&mut waves, orders, x);
    waves
}

fn fill_with_outgoing(waves: &mut Vec<Complex64>, orders: usize, x: f64) {
    let per_x = 1.0 / x;
    let first = -Complex64::I * Complex64::cis(x) * per_x;
    waves.clear();
    waves.extend([first, first * (per_x - Complex64::I)]);
    for l in 1..orders {
        let next = (2 * l + 1) as f64 * per_x * waves[l] - waves[l - 1];
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
    use crate::effects::testing::Bench;
    use crate::model::mirror::Mirror;

    /// One source and some places.
    struct Beside {
        source_m: Vec3,
        points_m: Vec<Vec3>,
    }

    const K: f64 = 733.0;

    impl SurroundingField for Beside {
        fn points_m(&self) -> &[Vec3] {
            &self.points_m
        }
        fn wavenumber_rad_m(&self) -> f64 {
            K
        }
        fn images(&self, _mirror: &Mirror) -> Vec<Complex64> {
            Vec::new()
        }
        fn waves_at(&self, at_m: &Vec3) -> Vec<(Vec3, Complex64)> {
            let distance_m = (at_m - self.source_m).norm();
            vec![(self.source_m, Complex64::cis(K * distance_m) / distance_m)]
        }
    }

    fn scattered(source_m: Vec3, points_m: Vec<Vec3>, radius_mm: f64) -> Vec<Complex64> {
        let bench = Bench::new();
        let mut pressures = vec![Pressure::steady(Complex64::ZERO); points_m.len()];
        let field = Beside { source_m, points_m };
        Scatterer.added_waves(bench.at(&[0.0, 0.0, 0.0, radius_mm]), &field, &mut pressures);
        pressures.iter().map(|pressure| pressure.coherent).collect()
    }

    /// On the surface of a rigid ball the air does not move: the slopes of both waves along the radius cancel.
    #[test]
    fn the_air_stands_still_at_the_surface() {
        let (radius_mm, step_m) = (5.0, 1e-6);
        let source_m = Vec3::new(0.0, 0.02, -0.06);
        for direction in [Vec3::z(), -Vec3::z(), Vec3::new(0.6, 0.0, 0.8), Vec3::y()] {
            let at_m = |beyond: f64| direction * (1e-3 * radius_mm + beyond);
            let [near, far] = [1.0, 3.0].map(|n| at_m(n * step_m));
            let incident = |at_m: Vec3| {
                let distance_m = (at_m - source_m).norm();
                Complex64::cis(K * distance_m) / distance_m
            };
            let waves = scattered(source_m, vec![near, far], radius_mm);
            let slope = |near: Complex64, far: Complex64| (far - near) / (2.0 * step_m);
            let [of_incident, of_scattered] =
                [slope(incident(near), incident(far)), slope(waves[0], waves[1])];
            let left = (of_incident + of_scattered).norm();
            assert!(left < 0.01 * K * incident(near).norm(), "{direction}: {left}");
        }
    }

    /// Far from a small ball, and far from the source, the scattered wave is k²a³/3 (1 - 3/2 cos θ) of the incident one over the distance, in opposite phase, with θ the
    /// angle by which it is deflected (Rayleigh; Morse and Ingard, eq. 8.2.18).
    #[test]
    fn a_small_ball_scatters_as_rayleigh_says() {
        let (radius_m, far_m) = (1e-4, 30.0);
        for theta in [0.0, 1.0, 2.0, 3.1f64] {
            let at_m = Vec3::new(theta.sin(), 0.0, theta.cos()) * far_m;
            let source_m = -Vec3::z() * far_m;
            let wave = scattered(source_m, vec![at_m], 1e3 * radius_m)[0];
            let incident = Complex64::cis(K * far_m) / far_m;
            let strength = -K * K * radius_m.powi(3) / 3.0 * (1.0 - 1.5 * theta.cos());
            let expected = incident * strength * Complex64::cis(K * far_m) / far_m;
            assert!(
                (wave - expected).norm() < 0.01 * expected.norm(),
                "{theta}: {wave} {expected}"
            );
        }
    }

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
}
