//! A sequence of draws from counter-based random numbers.

use fieldgap_virtual_rig::counter_rng::CounterRng;

/// Draws the numbers of a [`CounterRng`] in order. Equal sequences give equal draws, on any thread.
#[derive(Debug, Clone)]
pub(super) struct RandomSequence {
    rng: CounterRng,
    drawn: u64,
}

impl RandomSequence {
    /// A sequence from the first number of `rng` on.
    pub fn new(rng: CounterRng) -> Self {
        Self { rng, drawn: 0 }
    }

    fn next(&mut self) -> u64 {
        self.drawn += 1;
        self.drawn
    }

    /// A uniform number from `low` (included) to `high` (not).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let index = self.next();
        low + (high - low) * self.rng.uniform(index)
    }

    /// A number from `low` to `high`, both above zero, whose logarithm is uniform.
    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.uniform(libm::log(low), libm::log(high)))
    }

    /// +1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// True with a probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    /// A whole number from 0 to `count` - 1.
    pub fn index(&mut self, count: usize) -> usize {
        (self.uniform(0.0, count as f64) as usize).min(count.saturating_sub(1))
    }

    /// A uniform angle, 0 to 2π rad.
    pub fn angle_rad(&mut self) -> f64 {
        self.uniform(0.0, std::f64::consts::TAU)
    }

    /// Puts items in a random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.index(last + 1));
        }
    }

    /// `count` different numbers out of 0 to `of` - 1, ascending.
    pub fn distinct(&mut self, count: usize, of: usize) -> Vec<usize> {
        let mut all: Vec<usize> = (0..of).collect();
        self.shuffle(&mut all);
        all.truncate(count);
        all.sort_unstable();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_sequences_draw_the_same_and_distinct_numbers_are_distinct() {
        let mut random = RandomSequence::new(CounterRng::new(4));
        let mut again = random.clone();
        let drawn = random.distinct(240, 5184);
        assert_eq!(drawn, again.distinct(240, 5184));
        assert!(drawn.windows(2).all(|pair| pair[0] < pair[1]) && drawn.len() == 240);
    }

    #[test]
    fn a_log_uniform_number_is_as_often_between_1_and_2_as_between_2_and_4() {
        let mut random = RandomSequence::new(CounterRng::new(5));
        let below = (0..10_000).filter(|_| random.log_uniform(1.0, 4.0) < 2.0).count();
        assert!((below as f64 / 1e4 - 0.5).abs() < 0.02, "{below}");
    }
}
