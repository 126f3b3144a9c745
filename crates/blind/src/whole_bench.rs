//! A bench on which everything is a little wrong: many small effects of the catalogue, and one that dominates.

use super::catalogue;
use super::causes::Causes;
use super::parameters::Parameters;
use super::random_sequence::RandomSequence;
use super::sizing::{Sizing, TargetGaps};

/// Gaps alone of all effects but the dominant one.
const SMALL: TargetGaps = TargetGaps { least: 0.3, most: 1.0 };

/// Gaps alone of the dominant effect.
const DOMINANT: TargetGaps = TargetGaps { least: 1.5, most: 6.0 };

/// The dominant gap over the next one, at least.
const TWICE: f64 = 2.0;

/// A size meets its target to this factor; effects of whole elements have few sizes.
const ABOUT: f64 = 1.15;

/// Six to ten effects, in the order of the catalogue. Those that the set-up has anyway are left out.
pub(super) fn effects(
    sizing: &Sizing<'_>,
    random: &mut RandomSequence,
) -> Vec<(&'static str, Parameters)> {
    let laboratory = sizing.laboratory;
    let is_extra =
        |id: &&'static str| laboratory.imperfections.iter().all(|(anyway, _)| anyway != id);
    let mut ids: Vec<&'static str> = catalogue::IDS.into_iter().filter(is_extra).collect();
    random.shuffle(&mut ids);
    let mut ids = ids.into_iter();
    let count = 6 + random.index(5);
    let mut next = |targets: TargetGaps, random: &mut RandomSequence| loop {
        let id = ids.next()?;
        let sizes = catalogue::draw(id, laboratory, random);
        let parameters = sizing.effect(id, sizes, targets, random);
        let gap = sizing.gap(&Causes::of_catalogue(vec![(id, parameters.clone())]));
        // What cannot show in this survey, as a lag of a robot at rest, leaves no gap.
        if (targets.least / ABOUT..=targets.most * ABOUT).contains(&gap) {
            return Some((id, parameters, gap));
        }
    };
    // The dominant one first: there is always one, and the others must stay below half of it.
    let mut chosen = Vec::new();
    let dominant = next(DOMINANT, random);
    let most =
        dominant.as_ref().map_or(SMALL.most, |(.., gap)| SMALL.most.min(gap / TWICE / ABOUT));
    chosen.extend(dominant);
    while chosen.len() < count
        && let Some(small) = next(TargetGaps { most, ..SMALL }, random)
    {
        chosen.push(small);
    }
    let place = |id: &str| catalogue::IDS.iter().position(|known| *known == id);
    chosen.sort_by_key(|(id, ..)| place(id));
    chosen.into_iter().map(|(id, parameters, _)| (id, parameters)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::laboratory::Laboratory;
    use super::super::noise_units::Believed;
    use super::super::varied;
    use super::*;
    use fieldgap_virtual_rig::counter_rng::CounterRng;

    #[test]
    fn one_effect_dominates_and_all_others_are_small() {
        for seed in 0..4 {
            let mut random = RandomSequence::new(CounterRng::new(seed));
            let mut laboratory = match seed {
                0 => Laboratory::draw(&mut random),
                _ => varied::laboratory(&[], &mut random),
            };
            if seed > 1 {
                varied::make_imperfect(&mut laboratory, &[], &mut random);
            }
            let rng = CounterRng::new(9);
            let believed = Believed::new(&laboratory, rng);
            let sizing = Sizing { laboratory: &laboratory, believed: &believed, rng };
            let effects = effects(&sizing, &mut random);
            let ids: Vec<&str> = effects.iter().map(|(id, _)| *id).collect();
            assert!((6..=10).contains(&ids.len()), "{seed}: {ids:?}");
            assert!(laboratory.imperfections.iter().all(|(id, _)| !ids.contains(id)), "{ids:?}");
            let causes = Causes::of_catalogue(effects);
            let mut gaps: Vec<f64> =
                causes.each_alone().iter().map(|alone| sizing.gap(alone)).collect();
            gaps.sort_by(f64::total_cmp);
            let dominant = gaps.pop().expect("the dominant one");
            assert!((1.3..7.0).contains(&dominant), "{seed}: {dominant} {gaps:?}");
            let next = gaps.last().expect("the next one");
            assert!(dominant >= 2.0 * next, "{seed}: {dominant} {gaps:?}");
            assert!(gaps.iter().all(|gap| (0.25..1.2).contains(gap)), "{seed}: {gaps:?}");
        }
    }
}
