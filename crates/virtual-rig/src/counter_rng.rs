//! Counter-based random numbers: each is a function of seed, stream and index.
//!
//! A generator with a running state would give other noise as soon as one more reading is taken, or as two devices draw in
//! another order. Here the number of an index does not depend on what was drawn before.

use std::f64::consts::TAU;

/// A family of random numbers for one purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CounterRng {
    key: u64,
}

impl CounterRng {
    /// The numbers of `seed`.
    pub fn new(seed: u64) -> Self {
        Self { key: mix(seed ^ 0x9e37_79b9_7f4a_7c15) }
    }

    /// An independent family, for the named purpose.
    pub fn stream(self, purpose: &str) -> Self {
        Self { key: purpose.bytes().fold(self.key, |key, byte| mix(key ^ u64::from(byte))) }
    }

    /// An independent family for each index: for each element, or each scan.
    pub fn substream(self, index: u64) -> Self {
        Self { key: mix(self.key ^ mix(index.wrapping_add(0xd1b5_4a32_d192_ed03))) }
    }

    /// A uniform number from 0 (included) to 1 (not).
    pub fn uniform(self, index: u64) -> f64 {
        let bits = mix(self.key.wrapping_add(index.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        (bits >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number of the standard normal distribution, by the Box-Muller transform.
    pub fn normal(self, index: u64) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.uniform(2 * index))).sqrt();
        radius * libm::cos(TAU * self.uniform(2 * index + 1))
    }
}

/// The output function of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): every bit of the result depends on every
/// bit of the argument.
fn mix(mut bits: u64) -> u64 {
    bits = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(draw: impl Fn(u64) -> f64) -> [f64; 4] {
        let n = 100_000;
        let mut sums = [0.0; 4];
        for i in 0..n {
            let value = draw(i);
            for (power, sum) in sums.iter_mut().enumerate() {
                *sum += value.powi(power as i32 + 1) / n as f64;
            }
        }
        sums
    }

    #[test]
    fn normal_numbers_have_the_moments_of_their_distribution() {
        let rng = CounterRng::new(7).stream("noise");
        let [mean, variance, skew, kurtosis] = moments(|i| rng.normal(i));
        assert!(mean.abs() < 0.01 && (variance - 1.0).abs() < 0.015);
        assert!(skew.abs() < 0.03 && (kurtosis - 3.0).abs() < 0.08);
    }

    #[test]
    fn streams_and_neighbours_are_uncorrelated() {
        let rng = CounterRng::new(7);
        let (a, b) = (rng.stream("a"), rng.stream("b"));
        let [across, ..] = moments(|i| a.normal(i) * b.normal(i));
        let [along, ..] = moments(|i| a.normal(i) * a.normal(i + 1));
        let [subs, ..] = moments(|i| a.substream(i).normal(0) * a.substream(i + 1).normal(0));
        assert!(across.abs() < 0.015 && along.abs() < 0.015 && subs.abs() < 0.015);
    }

    #[test]
    fn the_same_address_always_gives_the_same_number() {
        assert_eq!(
            CounterRng::new(1).stream("x").normal(9),
            CounterRng::new(1).stream("x").normal(9)
        );
        assert_ne!(CounterRng::new(1).normal(9), CounterRng::new(2).normal(9));
    }
}
