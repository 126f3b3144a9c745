//! One receiving element: its level at rest, its noise, and its departure from rest.

/// Time constant of the level at rest, s.
const REST_S: f64 = 0.4;

/// Time constant of the noise, s.
const NOISE_S: f64 = 2.0;

/// Smallest noise, as a share of the level at rest.
const LEAST_NOISE: f64 = 2e-3;

/// The signal of one element relative to its level at rest.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    period_s: f64,
    rest: f64,
    /// Mean square of the difference between successive samples, which a moving hand hardly changes.
    roughness: f64,
    last: f64,
    samples: u64,
}

impl Channel {
    pub fn new(rate_hz: f64) -> Self {
        Self { period_s: 1.0 / rate_hz, rest: 0.0, roughness: 0.0, last: 0.0, samples: 0 }
    }

    /// Takes a reading; `at_rest`: no hand is present.
    pub fn take(&mut self, volts: f64, at_rest: bool) {
        if self.samples == 0 {
            (self.rest, self.last) = (volts, volts);
        }
        self.samples += 1;
        let step = volts - self.last;
        self.last = volts;
        if at_rest {
            // At first a mean over all samples; later an exponential mean with the time constants.
            let share =
                |constant_s: f64| (self.period_s / constant_s).max(1.0 / self.samples as f64);
            let (rest, noise) = (share(REST_S), share(NOISE_S));
            self.rest += rest * (volts - self.rest);
            self.roughness += noise * (step * step - self.roughness);
        }
    }

    /// Standard deviation of its noise. The difference of independent samples has twice their variance.
    pub fn noise(&self) -> f64 {
        (0.5 * self.roughness).sqrt().max(LEAST_NOISE * self.rest.abs())
    }

    /// Departure of a reading from rest, in standard deviations of the noise.
    pub fn departure(&self, volts: f64) -> f64 {
        let noise = self.noise();
        if noise > 0.0 { (volts - self.rest).abs() / noise } else { 0.0 }
    }

    /// Takes a level as the level at rest.
    pub fn settle(&mut self, volts: f64) {
        self.rest = volts;
        self.last = volts;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_at_rest_and_noise_are_estimated() {
        let mut channel = Channel::new(250.0);
        // Pseudo-random, standard deviation 0.01 about 0.3.
        let mut state = 1u64;
        for _ in 0..2000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let uniform = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            channel.take(0.3 + 0.01 * 12f64.sqrt() * uniform, true);
        }
        assert!((channel.noise() / 0.01 - 1.0).abs() < 0.15, "{}", channel.noise());
        assert!((channel.departure(0.35) - 5.0).abs() < 1.2, "{}", channel.departure(0.35));
    }

    #[test]
    fn a_hand_does_not_change_the_level_at_rest() {
        let mut channel = Channel::new(250.0);
        (0..500).for_each(|n| channel.take(0.3 + 1e-3 * f64::from(n % 2), true));
        (0..500).for_each(|_| channel.take(0.6, false));
        assert!(channel.departure(0.6) > 50.0);
        channel.settle(0.6);
        assert_eq!(channel.departure(0.6), 0.0);
    }
}
