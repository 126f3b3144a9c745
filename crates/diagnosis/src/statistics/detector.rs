//! Mean and variance of the magnitude of a noisy level, after a detector and the rest of a receiver.
//!
//! With r = |m + n₁ + i n₂| the power r² has mean m² + σ₁² + σ₂², variance 4 m² σ₁² + 2 (σ₁⁴ + σ₂⁴) and third cumulant
//! 24 m² σ₁⁴ + 8 (σ₁⁶ + σ₂⁶), σ₁ along the level and σ₂ across it. Two weighted values of the power have
//! the same three moments. Mean and variance of any function of a reading are taken over these two values.

use fieldgap_comparison::rice_mean;

/// The magnitude of a noisy level, as two values with weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Detected {
    values: [f64; 2],
    weights: [f64; 2],
    /// Mean square of both quadratures' noise.
    noise_power: f64,
    /// Relative difference of Rice's mean from that of the two values: the square root has a corner at zero power.
    lack: f64,
}

impl Detected {
    /// Of a level, with noise of these standard deviations along and across it.
    pub fn of(level: f64, along: f64, across: f64) -> Self {
        let (m2, a2, c2) = (level * level, along * along, across * across);
        let noise_power = 0.5 * (a2 + c2);
        let (values, weights) = two_values(m2, a2, c2);
        // The correction is that for equal noise in both quadratures; it matters only where the level is below the noise.
        let (alike, their_weights) = match a2 == c2 {
            true => (values, weights),
            false => two_values(m2, noise_power, noise_power),
        };
        let mean = mean_of(alike, their_weights).max(f64::MIN_POSITIVE);
        let strong = m2 / (24.0 * noise_power.max(f64::MIN_POSITIVE));
        let lack = (rice_mean(level, noise_power.sqrt()) / mean - 1.0) / (1.0 + strong * strong);
        Self { values, weights, noise_power, lack }
    }

    /// Mean and variance after a receiver that adds a floor in power last.
    pub fn received(&self, floor: f64, receiver: impl Fn(f64) -> f64) -> (f64, f64) {
        let received = self.values.map(receiver);
        let square = mean_of(received.map(|r| r * r), self.weights);
        // A floor rounds this corner.
        let rounded = 1.0 + floor * floor / self.noise_power.max(f64::MIN_POSITIVE);
        let mean = mean_of(received, self.weights) * (1.0 + self.lack / rounded.powi(3));
        (mean, (square - mean * mean).max(0.0))
    }
}

/// The roots of two powers with the mean, the variance and the third cumulant of a level's power `m2` with noise of variance `a2`
/// along it and `c2` across it, and their weights.
fn two_values(m2: f64, a2: f64, c2: f64) -> ([f64; 2], [f64; 2]) {
    let mean = m2 + a2 + c2;
    let variance = 4.0 * m2 * a2 + 2.0 * (a2 * a2 + c2 * c2);
    if variance <= 0.0 {
        return ([m2.sqrt(); 2], [0.5; 2]);
    }
    let third = 24.0 * m2 * a2 * a2 + 8.0 * (a2 * a2 * a2 + c2 * c2 * c2);
    let deviation = variance.sqrt();
    let half_skew = 0.5 * third / (variance * deviation);
    let apart = (1.0 + half_skew * half_skew).sqrt();
    let powers = [half_skew - apart, half_skew + apart].map(|at| mean + deviation * at);
    let low = 0.5 * (1.0 + half_skew / apart);
    (powers.map(|power| power.max(0.0).sqrt()), [low, 1.0 - low])
}

fn mean_of(values: [f64; 2], weights: [f64; 2]) -> f64 {
    weights[0] * values[0] + weights[1] * values[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and variance by summing over a fine grid of both quadratures' noise.
    fn by_summing(level: f64, along: f64, across: f64, receiver: impl Fn(f64) -> f64) -> [f64; 2] {
        const STEPS: i32 = 120;
        let at = |step: i32| 6.0 * f64::from(step) / f64::from(STEPS);
        let (mut sum, mut mean, mut square) = (0.0, 0.0, 0.0);
        for first in -STEPS..=STEPS {
            for second in -STEPS..=STEPS {
                let (x, y) = (at(first), at(second));
                let weight = (-0.5 * (x * x + y * y)).exp();
                let received = receiver((level + along * x).hypot(across * y));
                sum += weight;
                mean += weight * received;
                square += weight * received * received;
            }
        }
        let mean = mean / sum;
        [mean, square / sum - mean * mean]
    }

    #[test]
    fn it_has_the_mean_and_the_spread_of_all_noisy_readings() {
        for level in [0.0, 0.4, 1.0, 2.0, 4.0, 20.0] {
            for floor in [0.0f64, 0.5, 1.0, 3.0] {
                let receiver = |reading: f64| {
                    let compressed = reading / (1.0 + (reading / 8.0).powi(2)).sqrt();
                    compressed.hypot(floor)
                };
                let [mean, variance] = by_summing(level, 1.0, 1.0, receiver);
                let ours = Detected::of(level, 1.0, 1.0).received(floor, receiver);
                let deviation = variance.sqrt();
                assert!(
                    (ours.0 - mean).abs() < 0.03 * deviation,
                    "{level} {floor} {ours:?} {mean}"
                );
                assert!((ours.1.sqrt() / deviation - 1.0).abs() < 0.1, "{level} {floor}");
            }
        }
    }

    #[test]
    fn noise_across_a_strong_level_hardly_shows() {
        let [mean, variance] = by_summing(10.0, 0.1, 1.0, |reading| reading);
        let ours = Detected::of(10.0, 0.1, 1.0).received(0.0, |reading| reading);
        assert!((ours.0 - mean).abs() < 0.02 * variance.sqrt(), "{ours:?} {mean}");
        assert!((ours.1 / variance - 1.0).abs() < 0.1, "{ours:?} {variance}");
    }

    #[test]
    fn without_noise_it_is_what_it_is() {
        assert_eq!(Detected::of(3.0, 0.0, 0.0).received(4.0, |r| r.hypot(4.0)), (5.0, 0.0));
    }
}
