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

/// The deviate of the kurtosis of numbers of mean zero, if these are normal (F. J. Anscombe and W. J. Glynn, Biometrika 70, 227, 1983). Positive where a
/// few of them are much larger than the others. Of fewer than twenty numbers it says nothing.
pub(crate) fn z_of_kurtosis(numbers: &[f64]) -> f64 {
    const FEWEST: usize = 20;
    if numbers.len() < FEWEST {
        return 0.0;
    }
    let n = numbers.len() as f64;
    let moment = |power: i32| numbers.iter().map(|x| x.powi(power)).sum::<f64>() / n;
    let kurtosis = moment(4) / moment(2).powi(2);
    let expected = 3.0 * (n - 1.0) / (n + 1.0);
    let variance = 24.0 * n * (n - 2.0) * (n - 3.0) / ((n + 1.0).powi(2) * (n + 3.0) * (n + 5.0));
    let x = (kurtosis - expected) / variance.sqrt();
    let skewness = 6.0 * (n * n - 5.0 * n + 2.0) / ((n + 7.0) * (n + 9.0))
        * (6.0 * (n + 3.0) * (n + 5.0) / (n * (n - 2.0) * (n - 3.0))).sqrt();
    let a = 6.0 + 8.0 / skewness * (2.0 / skewness + (1.0 + 4.0 / (skewness * skewness)).sqrt());
    let ratio = (1.0 - 2.0 / a) / (1.0 + x * (2.0 / (a - 4.0)).sqrt());
    ((1.0 - 2.0 / (9.0 * a)) - ratio.cbrt()) / (2.0 / (9.0 * a)).sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Of -9.5 to 9.5 in steps of one, by the documentation of SciPy's `kurtosistest`.
    #[test]
    fn the_kurtosis_of_a_published_example_has_its_deviate() {
        let even: Vec<f64> = (0..20).map(|n| f64::from(n) - 9.5).collect();
        let z = z_of_kurtosis(&even);
        assert!((z + 1.705_810_415_212_206_2).abs() < 1e-12, "{z}");
    }

    #[test]
    fn the_kurtosis_of_normal_numbers_is_seldom_beyond_its_limits() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut far = 0;
        for _ in 0..2000 {
            let numbers: Vec<f64> = StandardNormal.sample_iter(&mut random).take(100).collect();
            far += usize::from(z_of_kurtosis(&numbers) > 2.0);
        }
        // One in 44; of 2000, within three standard deviations.
        assert!((25..=66).contains(&far), "{far}");
        let mut few_far: Vec<f64> = StandardNormal.sample_iter(&mut random).take(1000).collect();
        few_far[..10].fill(6.0);
        assert!(z_of_kurtosis(&few_far) > 8.0);
    }

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
