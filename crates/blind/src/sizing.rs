//! Gives causes the size that leaves a target gap.

use std::sync::Arc;

use super::catalogue::Sizes;
use super::causes::Causes;
use super::laboratory::Laboratory;
use super::noise_units::{Believed, gap_of};
use super::parameters::Parameters;
use super::random_sequence::RandomSequence;
use super::unmodelled::{Draw, Unmodelled};
use super::world::World;
use fieldgap_virtual_rig::counter_rng::CounterRng;

/// Tolerance on the target gap, in natural logarithms.
const NEAR: f64 = 0.05;

/// Largest number of trial sizes.
const TRIES: usize = 12;

/// A range of target gaps, in standard deviations of a reading's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TargetGaps {
    /// The smallest.
    pub least: f64,
    /// The largest.
    pub most: f64,
}

/// The scan whose causes are sized.
pub(super) struct Sizing<'a> {
    /// The laboratory.
    pub laboratory: &'a Laboratory,
    /// Its expected readings.
    pub believed: &'a Believed,
    /// The scan's random numbers.
    pub rng: CounterRng,
}

impl Sizing<'_> {
    /// The gap that causes leave.
    pub fn gap(&self, causes: &Causes) -> f64 {
        let world = World::new(self.laboratory, causes, self.believed.volts, self.rng);
        gap_of(&world, self.laboratory, self.believed)
    }

    /// Parameters of an effect of the catalogue that leave a random target gap, approximately.
    pub fn effect(
        &self,
        id: &'static str,
        sizes: Sizes,
        targets: TargetGaps,
        random: &mut RandomSequence,
    ) -> Parameters {
        let gap = |parameters: &Parameters| {
            self.gap(&Causes::of_catalogue(vec![(id, parameters.clone())]))
        };
        match sizes {
            Sizes::Any { largest, least, at } => {
                let of = |size| gap(&at(size));
                let smallest = if least > 0.0 { of(least) } else { 0.0 };
                let targets = TargetGaps { least: targets.least.max(smallest), ..targets };
                at(size(largest, targets, random, of).max(least))
            }
            Sizes::OneOf(drawn) => {
                let gaps: Vec<f64> = drawn.iter().map(gap).collect();
                let most =
                    gaps.iter().copied().fold(0.0, f64::max).clamp(targets.least, targets.most);
                let target = random.log_uniform(targets.least, most);
                let far = |n: &usize| (libm::log(gaps[*n].max(1e-9)) - libm::log(target)).abs();
                let nearest = (0..drawn.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
                drawn[nearest.expect("there are several")].clone()
            }
        }
    }

    /// An unmodelled cause that leaves a random target gap, approximately.
    pub fn unmodelled(
        &self,
        draw: &Draw,
        targets: TargetGaps,
        random: &mut RandomSequence,
    ) -> Arc<dyn Unmodelled> {
        let size = size(draw.largest, targets, random, |size| {
            self.gap(&Causes::of_unmodelled((draw.of_size)(size)))
        });
        (draw.of_size)(size)
    }
}

/// A size whose gap is a random target. Where even the largest size leaves less than the least target, that size.
fn size(
    largest: f64,
    targets: TargetGaps,
    random: &mut RandomSequence,
    gap: impl Fn(f64) -> f64,
) -> f64 {
    let most = gap(largest);
    let share = random.uniform(0.0, 1.0);
    if most <= targets.least {
        return largest;
    }
    let ratio = (most.min(targets.most) / targets.least).max(1.0);
    let target = targets.least * ratio.powf(share);
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
            // Linear interpolation, alternating with bisection: a gap that begins only at some size is far from linear.
            Some(below) if number % 2 == 0 => {
                below.0 - below.1 * (above.0 - below.0) / (above.1 - below.1)
            }
            Some(below) => 0.5 * (below.0 + above.0),
        };
        // A zero gap counts as a tiny one.
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
        fn the_size_leaves_the_target_gap(power in 0.5..2.5f64, scale in 1.0..300.0f64, dead in 0.0..0.3f64, seed: u64) {
            // A gap that begins only at some size, as that of an offset beyond the small shift.
            let gap = |size: f64| scale * (size - dead).max(0.0).powf(power);
            let targets = TargetGaps { least: 0.1, most: 10.0 };
            let found = gap(size(2.0, targets, &mut RandomSequence::new(CounterRng::new(seed)), gap));
            proptest::prop_assert!((0.08..=11.0).contains(&found), "{found}");
        }
    }
}
