//! The normal and Student's t distribution, as far as control charts need them.

use libm::{erfc, exp, lgamma, log, sqrt};

/// Scores beyond this are not told apart: the probability of 20 standard errors is 10^-89.
const MOST_SCORE: f64 = 20.0;

/// Density of the standard normal distribution.
pub fn density(z: f64) -> f64 {
    const ONE_BY_ROOT_TWO_PI: f64 = 0.398_942_280_401_432_7;
    ONE_BY_ROOT_TWO_PI * exp(-0.5 * z * z)
}

/// Probability that a standard normal number is below `z`.
pub fn below(z: f64) -> f64 {
    0.5 * erfc(-z / std::f64::consts::SQRT_2)
}

/// The z that a standard normal number exceeds with probability `tail`, 0 < `tail` <= 1/2.
///
/// Start value from Abramowitz and Stegun 26.2.23 (error below 4.5e-4), then Newton's steps on the logarithm, which
/// converge far into the tail too.
fn exceeded_with(tail: f64) -> f64 {
    let t = sqrt(-2.0 * log(tail));
    let above = 2.515517 + t * (0.802853 + t * 0.010328);
    let beneath = 1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308));
    let mut z = t - above / beneath;
    for _ in 0..4 {
        let probability = below(-z);
        z += probability / density(z) * (log(probability) - log(tail));
    }
    z
}

/// The normal score of a t value: the standard normal number with the same probability below it.
///
/// A quotient of an error by a standard deviation that is itself estimated with `degrees_of_freedom` is thus brought to the
/// scale on which limits are computed. Limited to ±20.
pub fn score_of_t(t: f64, degrees_of_freedom: f64) -> f64 {
    let tail = t_tail(t.abs(), degrees_of_freedom);
    let score = if tail > 1e-88 { exceeded_with(tail).min(MOST_SCORE) } else { MOST_SCORE };
    score.copysign(t)
}

/// Probability that Student's t with ν degrees of freedom exceeds `t` >= 0: half of I_x(ν/2, 1/2), x = ν/(ν + t²).
/// The normal score of a score's size, whatever its sign: normal too where nothing changed.
/// Limited to ±20.
pub fn score_of_size(score: f64) -> f64 {
    let tail = 2.0 * below(-score.abs());
    match tail {
        // (Of a score of zero, the tail is one.)
        _ if tail > 0.5 => -exceeded_with((1.0 - tail).max(1e-12)),
        _ if tail > 1e-88 => exceeded_with(tail).min(MOST_SCORE),
        _ => MOST_SCORE,
    }
}

fn t_tail(t: f64, degrees_of_freedom: f64) -> f64 {
    let x = degrees_of_freedom / (degrees_of_freedom + t * t);
    0.5 * incomplete_beta(x, 0.5 * degrees_of_freedom, 0.5)
}

/// The regularised incomplete beta function I_x(a, b), by its continued fraction (DLMF 8.17.22) in Lentz's way.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let front = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(x) + b * log(1.0 - x));
    // The fraction converges quickly below this x only.
    if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(x, a, b) / a
    } else {
        1.0 - front * beta_fraction(1.0 - x, b, a) / b
    }
}

fn beta_fraction(x: f64, a: f64, b: f64) -> f64 {
    const LEAST: f64 = 1e-300;
    let off_zero = |value: f64| if value.abs() < LEAST { LEAST } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / off_zero(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    for m in 1..500 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / off_zero(1.0 + even * d);
        c = off_zero(1.0 + even / c);
        fraction *= c * d;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / off_zero(1.0 + odd * d);
        c = off_zero(1.0 + odd / c);
        let step = c * d;
        fraction *= step;
        if (step - 1.0).abs() < 1e-14 {
            break;
        }
    }
    fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of the t distribution from printed tables (Fisher and Yates): t that is exceeded with probability 0.025 and 0.005.
    #[test]
    fn tails_of_t_are_those_of_printed_tables() {
        for (degrees_of_freedom, t_025, t_005) in [
            (1.0, 12.706, 63.657),
            (5.0, 2.571, 4.032),
            (24.0, 2.064, 2.797),
            (120.0, 1.980, 2.617),
        ] {
            assert!((t_tail(t_025, degrees_of_freedom) - 0.025).abs() < 2e-5);
            assert!((t_tail(t_005, degrees_of_freedom) - 0.005).abs() < 1e-5);
        }
    }

    #[test]
    fn scores_are_normal_quantiles() {
        // Exceeded with 0.025 and 0.005 by the normal distribution.
        assert!((score_of_t(2.570_58, 5.0) - 1.959_96).abs() < 1e-4);
        assert!((score_of_t(-4.032_14, 5.0) + 2.575_83).abs() < 1e-4);
        assert!((score_of_t(3.0, 1e7) - 3.0).abs() < 1e-5);
        assert!((score_of_t(8.0, 1e9) - 8.0).abs() < 1e-5);
        assert!(score_of_t(0.0, 3.0).abs() < 1e-12);
        assert_eq!(score_of_t(1e9, 1e3), MOST_SCORE);
    }

    /// With one degree of freedom t is Cauchy's distribution, whose tail is known in closed form.
    /// Two-sided quantiles of the normal distribution.
    #[test]
    fn sizes_have_scores_of_their_two_sided_probability() {
        for (size, score) in [(1.959_964, 1.644_854), (2.575_829, 2.326_348), (0.674_490, 0.0)] {
            for signed in [size, -size] {
                assert!((score_of_size(signed) - score).abs() < 1e-5, "{size}");
            }
        }
        assert!(score_of_size(0.0) < -6.0 && score_of_size(0.0) > -10.0);
        assert_eq!(score_of_size(40.0), MOST_SCORE);
    }

    #[test]
    fn one_degree_of_freedom_is_cauchy() {
        for t in [0.1, 1.0, 30.0, 1e4] {
            let tail = (1.0_f64 / t).atan() / std::f64::consts::PI;
            assert!((t_tail(t, 1.0) / tail - 1.0).abs() < 1e-9, "{t}");
        }
    }
}
