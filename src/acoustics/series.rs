//! Functions of one variable on an interval as polynomials: the one form in which every directivity enters the field
//! kernel.

use std::sync::LazyLock;

use super::lanes::Lanes;

/// Terms beyond which a series is not carried; an analytic directivity needs 12 to 40.
const MAX_TERMS: usize = 128;

/// A function on [0, 1] as a polynomial in x = 2 t - 1.
///
/// It is found as a Chebyshev series (L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM 2013, ch. 3
/// and 8) and kept in powers of x, which take one operation a term instead of two. Powers lose digits where
/// Chebyshev coefficients fall more slowly than (1 + √2)^-n; those of directivities fall faster.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Series {
    /// Coefficients of 1, x², x⁴, ... and of x, x³, x⁵, ...: two sums that do not wait for each other.
    even: Vec<f64>,
    odd: Vec<f64>,
}

impl Series {
    /// Interpolates `function` so that what is cut off lies below `tolerance` times its largest term.
    pub(super) fn fit(tolerance: f64, function: impl Fn(f64) -> f64) -> Self {
        let powers = powers(&chebyshev(tolerance, function));
        Self {
            even: powers.iter().step_by(2).copied().collect(),
            odd: powers.iter().skip(1).step_by(2).copied().collect(),
        }
    }

    /// The sum at each lane's t in [0, 1].
    #[inline(always)]
    pub(super) fn at<const FUSED: bool>(&self, t: Lanes) -> Lanes {
        let x = t.add(t).sub(Lanes::splat(1.0));
        let square = x.mul(x);
        let odd = square.polynomial::<FUSED>(&self.odd);
        x.mul_add::<FUSED>(odd, square.polynomial::<FUSED>(&self.even))
    }
}

/// The Chebyshev coefficients of a function on [0, 1] in 2 t - 1; at least one.
fn chebyshev(tolerance: f64, function: impl Fn(f64) -> f64) -> Vec<f64> {
    /// The cosines of all multiples of half the nodes' spacing: a fit is made for each new set-up, and there are
    /// many.
    static COSINES: LazyLock<Vec<f64>> = LazyLock::new(|| {
        let steps = (0..4 * MAX_TERMS).map(|step| step as f64 / MAX_TERMS as f64);
        steps.map(|step| (std::f64::consts::FRAC_PI_2 * step).cos()).collect()
    });
    let cosines: &[f64] = &COSINES;
    // cos(term * angle(node)), its argument brought into one turn in whole numbers, where nothing is rounded.
    let cosine = |term: usize, node: usize| cosines[(term * (2 * node + 1)) % (4 * MAX_TERMS)];
    let values: Vec<f64> =
        (0..MAX_TERMS).map(|node| function(0.5 + 0.5 * cosine(1, node))).collect();
    let mut coefficients: Vec<f64> = (0..MAX_TERMS)
        .map(|term| {
            let projection: f64 =
                values.iter().enumerate().map(|(node, value)| value * cosine(term, node)).sum();
            projection * if term == 0 { 1.0 } else { 2.0 } / MAX_TERMS as f64
        })
        .collect();
    let largest = coefficients.iter().fold(0.0f64, |largest, c| largest.max(c.abs()));
    let last = coefficients.iter().rposition(|c| c.abs() > tolerance * largest);
    coefficients.truncate(last.map_or(1, |last| last + 1));
    coefficients
}

/// Turns Chebyshev coefficients into those of powers, by T(n+1) = 2 x T(n) - T(n-1).
fn powers(coefficients: &[f64]) -> Vec<f64> {
    let mut powers = vec![0.0; coefficients.len()];
    let (mut before, mut current) = (vec![], vec![1.0]);
    for &coefficient in coefficients {
        for (power, t) in powers.iter_mut().zip(&current) {
            *power += coefficient * t;
        }
        let mut next = vec![0.0; current.len() + 1];
        let doubling = if current.len() == 1 { 1.0 } else { 2.0 };
        for (power, t) in current.iter().enumerate() {
            next[power + 1] += doubling * t;
        }
        for (power, t) in before.iter().enumerate() {
            next[power] -= t;
        }
        before = std::mem::replace(&mut current, next);
    }
    powers
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn an_analytic_function_is_met_to_thirteen_digits(t in 0.0..=1.0f64, rate in 0.5..6.0f64) {
            let function = |t: f64| (rate * t).cos() * (-t * t).exp();
            let series = Series::fit(2e-15, function);
            prop_assert!(series.even.len() < 20);
            prop_assert!((series.at::<false>(Lanes::splat(t)).0[0] - function(t)).abs() < 1e-13);
            prop_assert!((series.at::<true>(Lanes::splat(t)).0[5] - function(t)).abs() < 1e-13);
        }
    }

    #[test]
    fn a_constant_has_one_term() {
        let series = Series::fit(1e-14, |_| 2.5);
        assert_eq!((series.even.len(), series.odd.len()), (1, 0));
        assert!((series.at::<false>(Lanes::splat(0.3)).0[0] - 2.5).abs() < 1e-14);
    }

    #[test]
    fn chebyshev_polynomials_turn_into_their_powers() {
        // T4 = 8 x^4 - 8 x^2 + 1
        assert_eq!(powers(&[0.0, 0.0, 0.0, 0.0, 1.0]), [1.0, 0.0, -8.0, 0.0, 8.0]);
        assert_eq!(powers(&[1.0, 2.0]), [1.0, 2.0]);
    }
}
