//! The normal distribution.

/// The number of standard deviations that a normal number departs by at most, to either side, with a probability between 0 and 1: 1.96 for
/// 0.95. Newton's method on the series and continued fraction of the error function would do; bisection of an alternating series is shorter
/// and runs once a round.
pub(crate) fn two_sided(probability: f64) -> f64 {
    let (mut low, mut high) = (0.0, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if within(middle) < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Probability of a normal number within so many standard deviations: 2 φ(x) Σ x^(2n+1) / (1·3·…·(2n+1)) (M. Abramowitz and I. A. Stegun,
/// *Handbook of Mathematical Functions*, 26.2.11).
fn within(x: f64) -> f64 {
    let density = (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
    let (mut term, mut sum, mut n) = (x, 0.0, 1.0);
    while term > 1e-17 * sum {
        sum += term;
        n += 2.0;
        term *= x * x / n;
    }
    (2.0 * density * sum).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::two_sided;

    #[test]
    fn the_usual_probabilities_have_the_usual_deviations() {
        for (probability, deviations) in [(0.682_689_5, 1.0), (0.95, 1.959_964), (0.99, 2.575_829)]
        {
            assert!((two_sided(probability) - deviations).abs() < 1e-5, "{probability}");
        }
    }
}
