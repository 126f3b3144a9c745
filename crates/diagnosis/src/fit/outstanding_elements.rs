//! Elements whose fitted departures are so large that they are rather faults of single elements.

use fieldgap_acoustics::Element;

use crate::effect_id::EffectId;
use crate::fit::joint_fit::Fit;
use crate::limits::{MOST_IN_A_SMALL_SET, MOST_OUTSTANDING, OUTSTANDING, most_in_a_set};
use crate::model::effect::{Choice, Context, Effect, Search};
use crate::model::instance::Setting;

/// An element has a fault if its weight is nearer to that of the fault than this: half of the way to a sound element.
const NEAR_THE_FAULT: f64 = 0.5;

/// Large departures may be faults of single elements. Returns the sets of elements of such an effect, each with the fit without their departures: those that
/// stand out, as small sets or as pairs to be exchanged, and all that have the weight of an element with the fault.
pub(crate) fn in_place_of_departures(
    fit: &Fit,
    effect: &'static dyn Effect,
    context: &Context,
) -> Vec<(Vec<usize>, Fit)> {
    let outstanding = outstanding(fit);
    let sets: Vec<Vec<usize>> = match effect.search() {
        Search::Sets => {
            let sizes = 1..=outstanding.len().min(MOST_IN_A_SMALL_SET);
            let mut sets: Vec<Vec<usize>> = sizes.map(|n| outstanding[..n].to_vec()).collect();
            let all = with_weight(fit, weight_in_a_set(effect, context), context);
            if all.len() > MOST_IN_A_SMALL_SET && all.len() <= most_in_a_set(elements(context)) {
                sets.push(all);
            }
            sets
        }
        Search::Exchanges => {
            let pair = |(i, &a): (usize, &usize)| {
                outstanding[i + 1..].iter().map(|&b| vec![a, b]).collect::<Vec<_>>()
            };
            outstanding.iter().enumerate().flat_map(pair).collect()
        }
        _ => Vec::new(),
    };
    let without = |mut set: Vec<usize>| {
        set.sort_unstable();
        let mut fit = fit.clone();
        for departures in of_elements(&mut fit) {
            set.iter().for_each(|&n| departures[n] = 0.0);
        }
        (set, fit)
    };
    sets.into_iter().map(without).collect()
}

/// The elements whose departures stand out of those of the others, the largest first.
fn outstanding(fit: &Fit) -> Vec<usize> {
    let mut outstanding: Vec<(f64, usize)> = Vec::new();
    for departures in of_elements(&mut fit.clone()) {
        let sizes: Vec<f64> = departures.iter().map(|value| value.abs()).collect();
        let mut sorted = sizes.clone();
        sorted.sort_by(f64::total_cmp);
        // Half of all normal numbers are within 0.67 standard deviations.
        let spread = (sorted[sorted.len() / 2] / 0.6745).max(f64::MIN_POSITIVE);
        let of_element = sizes.into_iter().enumerate().map(|(n, size)| (size / spread, n));
        outstanding.extend(of_element.filter(|(size, _)| *size > OUTSTANDING));
    }
    outstanding.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut elements: Vec<usize> = Vec::new();
    for (_, n) in outstanding {
        if !elements.contains(&n) && elements.len() < MOST_OUTSTANDING {
            elements.push(n);
        }
    }
    elements
}

/// What is left of the amplitude of an element of a set: nothing of a silent one, of a reversed one minus one times it.
pub(crate) fn weight_in_a_set(effect: &'static dyn Effect, context: &Context) -> f64 {
    let mut element = [Element::at(0.0, 0.0)];
    let before = element[0].amplitude;
    let choice = Choice::Elements(vec![0]);
    effect.elements(Setting { values: &[], choice: &choice, context }, &mut element);
    element[0].amplitude / before
}

/// The elements of nearly this weight.
fn with_weight(fit: &Fit, weight: f64, context: &Context) -> Vec<usize> {
    let model = fit.model(context);
    let is_near = |n: &usize| (model.weight_of_element(*n) - weight).norm() < NEAR_THE_FAULT;
    (0..elements(context)).filter(is_near).collect()
}

fn elements(context: &Context) -> usize {
    context.believed.array.len()
}

/// The departures of the amplitudes and phases of single elements of a fit, those of the set-up included.
fn of_elements(fit: &mut Fit) -> Vec<&mut Vec<f64>> {
    let Fit { instances, values, nuisance, .. } = fit;
    let effects = instances.iter().zip(values);
    let is_of_elements =
        |id: &EffectId| [EffectId::ElementGain, EffectId::ElementPhase].contains(id);
    let effects = effects.filter(|(instance, _)| is_of_elements(&instance.effect.id()));
    let stated = nuisance.departures.iter_mut().filter(|(id, _)| is_of_elements(id));
    effects.map(|(_, values)| values).chain(stated.map(|(_, values)| values)).collect()
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Array, Excitation};
    use num_complex::Complex64;

    use super::*;
    use crate::effects::effect;
    use crate::effects::testing::Bench;
    use crate::fit::random_elements::without_phases;
    use crate::model::instance::Instance;
    use crate::model::nuisance::Nuisances;

    /// Those of the set-up within its stated uncertainty as well as those of an effect.
    #[test]
    fn departures_of_elements_are_taken_out_wherever_they_are() {
        let bench = Bench::new();
        let mut nuisance = Nuisances::default();
        let departures = vec![0.1, -0.1, 0.9, 0.1];
        nuisance.departures.insert(EffectId::ElementPhase, departures.clone());
        let stated = Fit::of_nothing(nuisance);
        let instance = Instance { effect: effect(EffectId::ElementPhase), choice: Choice::None };
        let found = Fit {
            instances: vec![instance],
            values: vec![departures],
            spreads: vec![0.2],
            ..Fit::of_nothing(Nuisances::default())
        };
        for fit in [stated, found] {
            let of = |fit: &Fit| of_elements(&mut fit.clone())[0].clone();
            let without = without_phases(&fit).expect("it has some");
            assert_eq!(of(&without), [0.0; 4]);
            let in_place =
                in_place_of_departures(&fit, effect(EffectId::DeadElements), &bench.context);
            assert_eq!(in_place[0].0, [2]);
            assert_eq!(of(&in_place[0].1), [0.1, -0.1, 0.0, 0.1]);
        }
    }
    /// Departures of gain or of phase make four elements of 48 such as are wired in reverse, and one nearly silent.
    #[test]
    fn all_elements_with_the_weight_of_a_fault_are_a_set() {
        let array = Array::square(8, 6, 10e-3).expect("not empty");
        let context = Bench::of(array, Excitation::Uniform).context;
        let mut gains = vec![0.02; 48];
        let mut phases = vec![-0.1; 48];
        [3, 9].iter().for_each(|&n| gains[n] = -1.9);
        gains[40] = -0.9;
        (phases[20], phases[33]) = (3.0, -3.3);
        let ids = [EffectId::ElementGain, EffectId::ElementPhase];
        let instances = ids.map(|id| Instance { effect: effect(id), choice: Choice::None });
        let fit = Fit {
            instances: instances.to_vec(),
            values: vec![gains, phases],
            spreads: vec![0.3; 2],
            ..Fit::of_nothing(Nuisances::default())
        };
        let of = |id| in_place_of_departures(&fit, effect(id), &context);
        let reversed = of(EffectId::Polarity);
        let (all, without) = reversed.last().expect("some");
        assert_eq!(*all, [3, 9, 20, 33]);
        let model = without.model(&context);
        assert!(all.iter().all(|&n| model.weight_of_element(n) == Complex64::ONE));
        assert!(of(EffectId::DeadElements).iter().all(|(set, _)| set.len() <= 3));
    }
}
