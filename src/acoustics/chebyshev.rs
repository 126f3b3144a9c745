//! Functions of one variable on an interval, as Chebyshev series: the one form in which every directivity
//! enters the field kernel.

use super::lanes::Lanes;

/// Terms beyond which a series is not carried; an analytic directivity needs 15 to 40.
const MAX_TERMS: usize = 128;

/// A function on [0, 1], as a Chebyshev series in 2 t - 1.
///
/// Source: L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM 2013, ch. 3 and 8; the sum by
/// Clenshaw's recurrence, which does not lose digits as powers do.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChebyshevSeries {
    coefficients: Vec<f64>,
}

impl ChebyshevSeries {
    /// Interpolates `function` so that what is cut off lies below `tolerance` times its largest term.
    pub(super) fn fit(tolerance: f64, function: impl Fn(f64) -> f64) -> Self {
        // cos(term * angle(node)), its argument brought into one turn in whole numbers, where nothing is rounded.
        let cosine = |term: usize, node: usize| {
            let quarter_steps = (term * (2 * node + 1)) % (4 * MAX_TERMS);
            (std::f64::consts::FRAC_PI_2 * quarter_steps as f64 / MAX_TERMS as f64).cos()
        };
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
        Self { coefficients }
    }

    /// The sum at each lane's t in [0, 1].
    #[inline(always)]
    pub(super) fn at<const FUSED: bool>(&self, t: Lanes) -> Lanes {
        let x = t.add(t).sub(Lanes::splat(1.0));
        let twice_x = x.add(x);
        let (mut above, mut two_above) = (Lanes::splat(0.0), Lanes::splat(0.0));
        for &coefficient in self.coefficients[1..].iter().rev() {
            let next = twice_x.mul_add::<FUSED>(above, Lanes::splat(coefficient).sub(two_above));
            two_above = above;
            above = next;
        }
        x.mul_add::<FUSED>(above, Lanes::splat(self.coefficients[0]).sub(two_above))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn an_analytic_function_is_met_to_thirteen_digits(t in 0.0..=1.0f64, rate in 0.5..6.0f64) {
            let function = |t: f64| (rate * t).cos() * (-t * t).exp();
            let series = ChebyshevSeries::fit(2e-15, function);
            prop_assert!(series.coefficients.len() < 40);
            prop_assert!((series.at::<false>(Lanes::splat(t)).0[0] - function(t)).abs() < 1e-13);
        }
    }

    #[test]
    fn a_constant_has_one_term() {
        let series = ChebyshevSeries::fit(1e-14, |_| 2.5);
        assert_eq!(series.coefficients.len(), 1);
        assert!((series.at::<false>(Lanes::splat(0.3)).0[0] - 2.5).abs() < 1e-14);
    }
}
