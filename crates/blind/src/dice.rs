//! Draws in a row from repeatable chance.

use fieldgap_virtual_rig::luck::Luck;

/// Draws one number after another from a [`Luck`]: whoever holds the same dice draws the same, on any thread.
#[derive(Debug, Clone)]
pub(super) struct Dice {
    luck: Luck,
    drawn: u64,
}

impl Dice {
    /// Dice that have not been thrown yet.
    pub fn new(luck: Luck) -> Self {
        Self { luck, drawn: 0 }
    }

    fn next(&mut self) -> u64 {
        self.drawn += 1;
        self.drawn
    }

    /// A number from `low` (included) to `high` (not).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let index = self.next();
        low + (high - low) * self.luck.uniform(index)
    }

    /// A number above zero whose logarithm is uniform.
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

    /// An angle, any as likely as another, rad.
    pub fn angle_rad(&mut self) -> f64 {
        self.uniform(0.0, std::f64::consts::TAU)
    }

    /// Puts things in an order, any as likely as another (Fisher and Yates).
    pub fn shuffle<T>(&mut self, things: &mut [T]) {
        for last in (1..things.len()).rev() {
            things.swap(last, self.index(last + 1));
        }
    }

    /// So many different numbers out of 0 to `of` - 1, ascending.
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
    fn the_same_dice_draw_the_same_and_distinct_numbers_are_distinct() {
        let mut dice = Dice::new(Luck::new(4));
        let mut again = dice.clone();
        let drawn = dice.distinct(240, 5184);
        assert_eq!(drawn, again.distinct(240, 5184));
        assert!(drawn.windows(2).all(|pair| pair[0] < pair[1]) && drawn.len() == 240);
    }

    #[test]
    fn sizes_are_as_often_between_1_and_2_as_between_2_and_4() {
        let mut dice = Dice::new(Luck::new(5));
        let below = (0..10_000).filter(|_| dice.log_uniform(1.0, 4.0) < 2.0).count();
        assert!((below as f64 / 1e4 - 0.5).abs() < 0.02, "{below}");
    }
}
