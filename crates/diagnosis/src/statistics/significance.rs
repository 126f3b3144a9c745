//! Significance of a statistic, as the normal deviate of equal probability.

/// The normal deviate with the tail probability of a chi-square sum of `count` squares (E. B. Wilson and M. M. Hilferty, PNAS 17, 684,
/// 1931).
pub(crate) fn z_of_sum_of_squares(sum: f64, count: f64) -> f64 {
    if count == 0.0 {
        return 0.0;
    }
    let variance = 2.0 / (9.0 * count);
    ((sum / count).cbrt() - (1.0 - variance)) / variance.sqrt()
}

/// The deviate of the largest of `count` deviates, corrected for their number: a tail falls as exp(-z²/2).
pub(crate) fn less_by_chance(largest: f64, count: f64) -> f64 {
    (largest * largest.max(0.0) - 2.0 * count.ln()).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chi-square that one in a thousand exceeds, by the tables; a normal number exceeds 3.09 as seldom.
    #[test]
    fn sums_of_few_squares_and_of_many_are_as_rare_as_their_deviate_says() {
        for (count, sum) in [(1.0, 10.828), (4.0, 18.467), (30.0, 59.703), (100.0, 149.449)] {
            let z = z_of_sum_of_squares(sum, count);
            assert!((z - 3.09).abs() < 0.06, "{count}: {z}");
        }
    }

    /// Tails of the normal distribution by the tables: 2.87e-7 beyond five, 3.40e-6 beyond 4.5.
    #[test]
    fn the_largest_of_many_is_as_rare_as_one_that_is_by_so_many_rarer() {
        for (largest, count, z) in [(5.0, 1.0, 5.0), (5.0, 1000.0, 3.44), (4.5, 10.0, 3.98)] {
            let got = less_by_chance(largest, count);
            assert!((got - z).abs() < 0.12, "{largest} of {count}: {got}");
        }
        assert_eq!(less_by_chance(2.0, 100.0), 0.0);
        assert_eq!(less_by_chance(-4.0, 1.0), 0.0);
    }
}
