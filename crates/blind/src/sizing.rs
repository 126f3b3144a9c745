//! Causes are given the size that leaves the wanted gap.

use std::sync::Arc;

use super::catalogue::Sizes;
use super::causes::{Causes, Parameters};
use super::dice::Dice;
use super::laboratory::Laboratory;
use super::noise_units::{Believed, gap_of};
use super::outside::{Draw, Outside};
use super::world::World;
use fieldgap_virtual_rig::luck::Luck;

/// How near the wanted gap is near enough, in natural logarithms.
const NEAR: f64 = 0.05;

/// Sizes that are tried at most.
const TRIES: usize = 12;

/// Gaps that are wanted, in standard deviations of a reading's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wanted {
    /// The smallest.
    pub least: f64,
    /// The largest.
    pub most: f64,
}

/// Where sizes are tried out.
pub(super) struct Sizing<'a> {
    /// The laboratory.
    pub laboratory: &'a Laboratory,
    /// What it believes.
    pub believed: &'a Believed,
    /// The scan's chance.
    pub luck: Luck,
}

impl Sizing<'_> {
    /// The gap that causes leave.
    pub fn gap(&self, causes: &Causes) -> f64 {
        let world = World::new(self.laboratory, causes, self.believed.volts, self.luck);
        gap_of(&world, self.laboratory, self.believed)
    }

    /// Parameters of an effect of the catalogue that leave a gap drawn from those wanted, or come near.
    pub fn effect(
        &self,
        id: &'static str,
        sizes: Sizes,
        wanted: Wanted,
        dice: &mut Dice,
    ) -> Parameters {
        let gap = |parameters: &Parameters| {
            self.gap(&Causes::of_catalogue(vec![(id, parameters.clone())]))
        };
        match sizes {
            Sizes::Any { largest, at } => at(size(largest, wanted, dice, |size| gap(&at(size)))),
            Sizes::OneOf(drawn) => {
                let gaps: Vec<f64> = drawn.iter().map(gap).collect();
                let most =
                    gaps.iter().copied().fold(0.0, f64::max).clamp(wanted.least, wanted.most);
                let target = dice.log_uniform(wanted.least, most);
                let far = |n: &usize| (libm::log(gaps[*n].max(1e-9)) - libm::log(target)).abs();
                let nearest = (0..drawn.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
                drawn[nearest.expect("there are several")].clone()
            }
        }
    }

    /// A cause outside the catalogue that leaves a gap drawn from those wanted, or comes near.
    pub fn outside(&self, draw: &Draw, wanted: Wanted, dice: &mut Dice) -> Arc<dyn Outside> {
        let size = size(draw.largest, wanted, dice, |size| {
            self.gap(&Causes::of_outside((draw.of_size)(size)))
        });
        (draw.of_size)(size)
    }
}

/// A size whose gap is as drawn. Where the largest size leaves less than the least gap, that one.
fn size(largest: f64, wanted: Wanted, dice: &mut Dice, gap: impl Fn(f64) -> f64) -> f64 {
    let most = gap(largest);
    let chance = dice.uniform(0.0, 1.0);
    if most <= wanted.least {
        return largest;
    }
    let ratio = most.min(wanted.most) / wanted.least;
    let target = wanted.least * ratio.powf(chance);
    // Logarithms of a size with too small a gap, and of one with too large a gap, and by how much.
    let mut below: Option<(f64, f64)> = None;
    let mut above = (libm::log(largest), libm::log(most / target));
    let mut slope = 1.0;
    for number in 0..TRIES {
        if above.1 < NEAR || below.is_some_and(|below| -below.1 < NEAR) {
            break;
        }
        let guess = match below {
            None => above.0 - above.1 / slope - 0.5 * NEAR,
            // By the straight line between the two; every other time in their middle, as a gap that begins only at some
            // size is far from straight.
            Some(below) if number % 2 == 0 => {
                below.0 - below.1 * (above.0 - below.0) / (above.1 - below.1)
            }
            Some(below) => 0.5 * (below.0 + above.0),
        };
        // A gap of nothing is as a tiny one.
        let miss = libm::log(gap(libm::exp(guess)).max(1e-3 * target) / target);
        if miss < 0.0 {
            below = Some((guess, miss));
        } else {
            slope = ((above.1 - miss) / (above.0 - guess)).clamp(0.3, 3.0);
            above = (guess, miss);
        }
    }
    let nearer = below.filter(|below| -below.1 < above.1).unwrap_or(above);
    libm::exp(nearer.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    proptest::proptest! {
        #[test]
        fn the_size_leaves_the_wanted_gap(power in 0.5..2.5f64, scale in 1.0..300.0f64, dead in 0.0..0.3f64, seed: u64) {
            // A gap that begins only at some size, as that of an offset within the small shift does.
            let gap = |size: f64| scale * (size - dead).max(0.0).powf(power);
            let wanted = Wanted { least: 0.1, most: 10.0 };
            let found = gap(size(2.0, wanted, &mut Dice::new(Luck::new(seed)), gap));
            proptest::prop_assert!((0.08..=11.0).contains(&found), "{found}");
        }
    }
}
