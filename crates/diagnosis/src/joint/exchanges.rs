//! Sets that differ from a fitted one by a few effects, by the quadratic form of the cost about its fit.
//!
//! Where ten small effects act, others imitate two or three of them together. No single exchange finds these sets, and to fit all of them takes days. About
//! the fit of one set the residuals are linear in the numbers of all effects that have a slope, those of the set and all others. Then the cost of any subset
//! of them, and by Laplace's method its evidence, follow from one matrix. Thousands of subsets are compared so, and the best are fitted.

use std::collections::BTreeMap;
use std::ops::Range;

use fieldgap_acoustics::least_squares::{Factor, Linearisation, dot, inner_products};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::joint_fit::{Fit, Start, unknowns};
use crate::fit::problem::{Problem, is_plausible};
use crate::joint::widths::{all_beside, joins};
use crate::limits::{ANOTHER_EFFECT, MOST_CLIMBS, MOST_EXCHANGES};
use crate::model::effect::{Context, Search};
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;
use crate::selection::evidence::{cost_of_freedom, cost_of_likeness};

/// How many of the best subsets are looked at.
const LISTED: usize = 400;

/// A subset of the effects that can be exchanged, by their numbers among them.
type Subset = Vec<usize>;

/// Subsets with their evidence.
type Seen = BTreeMap<Subset, f64>;

/// One effect that can be in a set or not.
struct Group {
    /// Its number among the effects of the start.
    number: usize,
    /// Its numbers among those of all groups.
    range: Range<usize>,
}

/// The cost about a fit as a quadratic form of the numbers of the groups, all else fitted anew. Numbers are departures from where the groups do nothing.
struct QuadraticCost {
    start: Start,
    groups: Vec<Group>,
    /// Half of the second derivatives, the priors' own included.
    curvature: DMatrix<f64>,
    /// Half of the slope, downhill, where all groups do nothing.
    downhill: DVector<f64>,
    /// Least and largest departure of each number.
    limits: Vec<(f64, f64)>,
    /// Where all else is, in the order of the start, if all groups do nothing; and how it moves with them.
    beside: DVector<f64>,
    carried: DMatrix<f64>,
}

/// A subset's numbers where its cost is least, and the logarithm of its evidence, but for a constant.
struct Estimate {
    departures: DVector<f64>,
    log_evidence: f64,
}

/// What can be exchanged in a fitted set.
pub(crate) struct Exchanges<'o> {
    cost: QuadraticCost,
    held: Subset,
    observations: &'o Observations,
    context: &'o Context,
}

impl<'o> Exchanges<'o> {
    /// Of a fitted set; `None` where the readings do not determine its numbers.
    pub fn of(set: &Fit, observations: &'o Observations, context: &'o Context) -> Option<Self> {
        let cost = QuadraticCost::about(set, observations, context)?;
        let held = (0..cost.groups.len())
            .filter(|&group| cost.groups[group].number < set.instances.len())
            .collect();
        Some(Self { cost, held, observations, context })
    }

    /// The subsets with the greatest evidence, as starts of fits, the best first; the set itself and sets that hold a better one are not among them.
    pub fn best(&self) -> Vec<Start> {
        let seen = self.cost.climb(self.held.clone());
        let subsets = self.cost.irredundant(&seen, &self.held).take(MOST_EXCHANGES);
        subsets
            .filter_map(|subset| self.cost.start_of(&subset, self.observations, self.context))
            .collect()
    }
}

impl QuadraticCost {
    /// About a fit; `None` where the readings do not determine what is in every subset.
    fn about(set: &Fit, observations: &Observations, context: &Context) -> Option<Self> {
        let can_be_exchanged =
            |effect| joins(effect, observations, context) && effect.search() == Search::Smooth;
        let mut start = all_beside(set, observations, context, can_be_exchanged);
        for number in 0..start.instances.len() {
            let Instance { effect, choice } = start.instances[number].clone();
            let laws = effect.choices().into_iter().filter(|law| *law != choice);
            for choice in laws.filter(|_| can_be_exchanged(effect)) {
                let instance = Instance { effect, choice };
                start.values.push(instance.neutral());
                start.spreads.push(f64::NAN);
                start.instances.push(instance);
            }
        }
        let nuisance = start.nuisance.clone().unwrap_or_default();
        let unknowns =
            unknowns(&start.instances, &start.values, &start.spreads, &nuisance, context);
        let at: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let problem = Problem::new(observations, context, &start.instances, &start.values);
        let Linearisation { residuals, columns } = problem.linearise(&at, &unknowns, &mut None);
        let mut groups = Vec::new();
        let mut beside: Vec<usize> = (0..problem.layout.first()).collect();
        let mut own = Vec::new();
        let mut from = beside.len();
        for (number, (instance, values)) in start.instances.iter().zip(&start.values).enumerate() {
            let all = from..from + values.len();
            from = all.end;
            if can_be_exchanged(instance.effect) {
                groups.push(Group { number, range: own.len()..own.len() + values.len() });
                own.extend(all);
            } else {
                beside.extend(all);
            }
        }
        let size = columns.len();
        let mut curvature = inner_products(&columns);
        let mut downhill =
            DVector::from_iterator(size, columns.iter().map(|column| -dot(column, &residuals)));
        for (n, unknown) in unknowns.iter().enumerate() {
            if let Some((mean, sd)) = unknown.prior {
                curvature[(n, n)] += sd.powi(-2);
                downhill[n] -= (at[n] - mean) / (sd * sd);
            }
        }
        let block = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| curvature[(rows[i], columns[j])])
        };
        let part = |rows: &[usize]| DVector::from_fn(rows.len(), |i, _| downhill[rows[i]]);
        let across = block(&beside, &own);
        let within = Factor::of(block(&beside, &beside))?;
        let carried = within.solve(&across);
        let curvature = block(&own, &own) - across.transpose() * &carried;
        let neutral: Vec<f64> =
            groups.iter().flat_map(|group| start.instances[group.number].neutral()).collect();
        let from_neutral = DVector::from_fn(own.len(), |n, _| at[own[n]] - neutral[n]);
        let alone = within.solve(&part(&beside));
        let downhill = part(&own) - across.transpose() * &alone + &curvature * &from_neutral;
        let there = DVector::from_fn(beside.len(), |n, _| at[beside[n]]);
        let beside = there + alone + &carried * from_neutral;
        let limits = groups.iter().flat_map(|group| {
            let instance = &start.instances[group.number];
            instance
                .effect
                .parameters_of(&instance.choice)
                .iter()
                .map(|p| (p.least - p.neutral, p.most - p.neutral))
        });
        let limits = limits.collect();
        Some(Self { start, groups, curvature, downhill, limits, beside, carried })
    }

    /// Climbs to the greatest evidence; all subsets that are compared, with their evidence.
    fn climb(&self, mut at: Subset) -> Seen {
        let mut best = self.log_evidence(&at);
        let mut seen = Seen::from([(at.clone(), best)]);
        for _ in 0..MOST_CLIMBS {
            let mut new = self.beside(&at);
            new.retain(|subset| !seen.contains_key(subset));
            let new = new.into_par_iter().map(|subset| {
                let log_evidence = self.log_evidence(&subset);
                (subset, log_evidence)
            });
            seen.extend(new.collect::<Vec<_>>());
            match seen.iter().max_by(|a, b| a.1.total_cmp(b.1)) {
                Some((subset, &log_evidence)) if log_evidence > best => {
                    (best, at) = (log_evidence, subset.clone());
                }
                _ => break,
            }
        }
        seen
    }

    /// What was seen, the best first, but for the set itself and what is better without one of its effects.
    fn irredundant<'s>(
        &'s self,
        seen: &'s Seen,
        held: &'s Subset,
    ) -> impl Iterator<Item = Subset> + 's {
        let mut sets: Vec<(&Subset, f64)> = seen
            .iter()
            .map(|(subset, log_evidence)| (subset, *log_evidence))
            .filter(|(subset, log_evidence)| *subset != held && log_evidence.is_finite())
            .collect();
        sets.sort_by(|a, b| b.1.total_cmp(&a.1));
        let is_irredundant = move |(subset, log_evidence): &(&Subset, f64)| {
            (0..subset.len()).all(|n| {
                let mut less = (*subset).clone();
                less.remove(n);
                seen.get(&less).copied().unwrap_or_else(|| self.log_evidence(&less)) < *log_evidence
            })
        };
        sets.into_iter().take(LISTED).filter(is_irredundant).map(|(subset, _)| subset.clone())
    }

    fn log_evidence(&self, subset: &[usize]) -> f64 {
        self.estimate(subset).map_or(f64::NEG_INFINITY, |estimate| estimate.log_evidence)
    }

    /// Subsets with one or two effects more, one or two less, and others in place of one or two: two for one, one for two.
    fn beside(&self, subset: &[usize]) -> Vec<Subset> {
        let others: Vec<usize> =
            (0..self.groups.len()).filter(|group| !subset.contains(group)).collect();
        let at_most_one = |all: &[usize]| -> Vec<Vec<usize>> {
            let each = all.iter().map(|&one| vec![one]);
            std::iter::once(Vec::new()).chain(each).collect()
        };
        let mut exchanged: Vec<(Vec<usize>, Vec<usize>)> = Vec::new();
        for out in at_most_one(subset) {
            let into = at_most_one(&others).into_iter().chain(pairs(&others));
            exchanged.extend(into.map(|into| (out.clone(), into)));
        }
        for out in pairs(subset) {
            exchanged.extend(at_most_one(&others).into_iter().map(|into| (out.clone(), into)));
        }
        let subset_of = |(out, into): (Vec<usize>, Vec<usize>)| {
            let kept = subset.iter().copied().filter(|group| !out.contains(group));
            let mut subset: Subset = kept.chain(into).collect();
            subset.sort_unstable();
            subset
        };
        let mut subsets: Vec<Subset> = exchanged.into_iter().map(subset_of).collect();
        subsets.retain(|subset| pairs(subset).iter().all(|pair| !self.are_one(pair[0], pair[1])));
        subsets
    }

    /// Whether two groups are one effect by different laws.
    fn are_one(&self, one: usize, other: usize) -> bool {
        let id = |group: usize| self.start.instances[self.groups[group].number].effect.id();
        id(one) == id(other)
    }

    fn numbers(&self, subset: &[usize]) -> Vec<usize> {
        subset.iter().flat_map(|&group| self.groups[group].range.clone()).collect()
    }

    /// `None` where the readings do not determine the numbers of a subset, or where these are not plausible.
    fn estimate(&self, subset: &[usize]) -> Option<Estimate> {
        let numbers = self.numbers(subset);
        let curvature = DMatrix::from_fn(numbers.len(), numbers.len(), |i, j| {
            self.curvature[(numbers[i], numbers[j])]
        });
        let downhill = DVector::from_fn(numbers.len(), |i, _| self.downhill[numbers[i]]);
        let cholesky = curvature.cholesky()?;
        let departures = cholesky.solve(&downhill);
        let plausible = departures.iter().zip(&numbers).all(|(departure, &number)| {
            let (least, most) = self.limits[number];
            (least..=most).contains(departure)
        });
        if !plausible {
            return None;
        }
        let covariance = cholesky.inverse();
        let mut log_evidence = 0.5 * downhill.dot(&departures);
        let mut from = 0;
        let mut ranges = Vec::new();
        for &group in subset {
            let count = self.groups[group].range.len();
            let own = covariance.view((from, from), (count, count)).into_owned().cholesky()?;
            let departures = departures.rows(from, count).into_owned();
            log_evidence -= cost_of_freedom(count, departures.dot(&own.solve(&departures)).sqrt());
            ranges.push(from..from + count);
            from += count;
        }
        log_evidence -=
            cost_of_likeness(&covariance, &ranges) + ANOTHER_EFFECT.get() * subset.len() as f64;
        Some(Estimate { departures, log_evidence })
    }

    /// Where all else is, in the order of the start, if the groups have these departures.
    fn beside_at(&self, departures: &DVector<f64>) -> DVector<f64> {
        &self.beside - &self.carried * departures
    }

    /// Where a fit of a subset begins, with the effects that are in every subset before it; `None` where the quadratic form leads to what is not plausible.
    fn start_of(
        &self,
        subset: &[usize],
        observations: &Observations,
        context: &Context,
    ) -> Option<Start> {
        let estimate = self.estimate(subset)?;
        let mut departures = DVector::from_element(self.downhill.len(), 0.0);
        for (departure, number) in estimate.departures.iter().zip(self.numbers(subset)) {
            departures[number] = *departure;
        }
        let beside = self.beside_at(&departures);
        let mut beside = beside.iter().copied();
        let Start { instances, spreads, nuisance, values } = &self.start;
        let nuisance = nuisance.clone().unwrap_or_default();
        let of_scan =
            |_| Nuisance::from_slice(&beside.by_ref().take(Nuisance::COUNT).collect::<Vec<_>>());
        let scans = (0..nuisance.len()).map(of_scan).collect();
        let mut nuisance = nuisance.with_scans(scans);
        for departure in context.stated.beside(instances) {
            let values = beside.by_ref().take(departure.priors.len()).collect();
            nuisance.departures.insert(departure.id(), values);
        }
        let exchanged = |number: usize| self.groups.iter().find(|group| group.number == number);
        let mut start =
            Start { instances: vec![], values: vec![], spreads: vec![], nuisance: Some(nuisance) };
        for (number, instance) in instances.iter().enumerate() {
            let values: Vec<f64> = match exchanged(number) {
                None => beside.by_ref().take(values[number].len()).collect(),
                Some(group) if subset.iter().any(|&one| self.groups[one].number == number) => {
                    let departures = departures.rows(group.range.start, group.range.len());
                    instance.neutral().iter().zip(&departures).map(|(n, d)| n + d).collect()
                }
                Some(_) => continue,
            };
            if instance.effect.search() != Search::Random
                && !is_plausible(observations, context, instance, &values)
            {
                return None;
            }
            start.instances.push(instance.clone());
            start.values.push(values);
            start.spreads.push(spreads[number]);
        }
        Some(start)
    }
}

/// Every pair of them.
fn pairs(of: &[usize]) -> Vec<Vec<usize>> {
    let with_later =
        |(n, &one): (usize, &usize)| of[n + 1..].iter().map(move |&other| vec![one, other]);
    of.iter().enumerate().flat_map(with_later).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect_id::EffectId;
    use crate::effects::effect;
    use crate::effects::testing::Bench;
    use crate::fit::joint_fit::{SEARCH, fit};
    use crate::model::effect::Choice;

    const READINGS: usize = 400;

    /// Effects of one number each.
    const EFFECTS: [EffectId; 4] =
        [EffectId::SoundSpeed, EffectId::Pitch, EffectId::Absorption, EffectId::Spreading];

    /// A quadratic form about a point where the first two of four effects act. The third column is nearly the sum of these, and the readings are three
    /// times the third, beside a gain.
    fn cost() -> (QuadraticCost, Vec<Vec<f64>>, Vec<f64>) {
        let wave =
            |rate: f64| -> Vec<f64> { (0..READINGS).map(|n| (rate * n as f64).sin()).collect() };
        let [one, other, own, fourth, gain] = [0.11, 0.23, 0.37, 0.53, 0.71].map(wave);
        let third: Vec<f64> = (0..READINGS).map(|n| one[n] + other[n] + 0.5 * own[n]).collect();
        let readings: Vec<f64> = (0..READINGS).map(|n| 3.0 * third[n] + 2.0 * gain[n]).collect();
        let columns = vec![gain, one, other, third, fourth];
        let block = |i: usize, j: usize| dot(&columns[i], &columns[j]);
        let start = Start {
            instances: EFFECTS
                .map(|id| Instance { effect: effect(id), choice: Choice::None })
                .to_vec(),
            values: EFFECTS.map(|id| effect(id).neutral()).to_vec(),
            spreads: vec![f64::NAN; 4],
            nuisance: None,
        };
        let across = DMatrix::from_fn(1, 4, |_, j| block(0, j + 1));
        let carried = &across / block(0, 0);
        let alone = DVector::from_element(1, dot(&columns[0], &readings) / block(0, 0));
        let cost = QuadraticCost {
            start,
            groups: (0..4).map(|number| Group { number, range: number..number + 1 }).collect(),
            curvature: DMatrix::from_fn(4, 4, |i, j| block(i + 1, j + 1))
                - across.transpose() * &carried,
            downhill: DVector::from_fn(4, |i, _| dot(&columns[i + 1], &readings))
                - across.transpose() * &alone,
            limits: vec![(-10.0, 10.0); 4],
            beside: alone,
            carried,
        };
        (cost, columns, readings)
    }

    /// By least squares over the columns themselves.
    #[test]
    fn the_numbers_of_a_subset_are_those_of_least_squares() {
        let (cost, columns, readings) = cost();
        let estimate = cost.estimate(&[0, 3]).expect("determined");
        let design = DMatrix::from_fn(READINGS, 3, |n, j| columns[[0, 1, 4][j]][n]);
        let solution =
            design.svd(true, true).solve(&DVector::from_vec(readings), 1e-12).expect("solved");
        assert!((estimate.departures[0] - solution[1]).abs() < 1e-9);
        assert!((estimate.departures[1] - solution[2]).abs() < 1e-9);
        let mut departures = DVector::from_element(4, 0.0);
        (departures[0], departures[3]) = (estimate.departures[0], estimate.departures[1]);
        let beside = cost.beside_at(&departures);
        assert!((beside[0] - solution[0]).abs() < 1e-9, "{beside} {solution}");
    }

    /// Neither effect alone can be exchanged for it: the other would be in the way.
    #[test]
    fn one_effect_takes_the_place_of_two_that_imitate_it() {
        let (cost, ..) = cost();
        let seen = cost.climb(vec![0, 1]);
        let best = seen.iter().max_by(|a, b| a.1.total_cmp(b.1)).expect("some were seen");
        assert_eq!(*best.0, [2]);
        let alternatives: Vec<Subset> = cost.irredundant(&seen, &vec![0, 1]).collect();
        assert_eq!(alternatives[0], [2]);
        // What holds the best set and more is not among them.
        assert!(!alternatives.iter().skip(1).any(|subset| subset.contains(&2)), "{alternatives:?}");
    }

    /// The law of an effect may change in one exchange.
    #[test]
    fn no_subset_holds_two_laws_of_one_effect() {
        let (mut cost, ..) = cost();
        let law =
            |law| Instance { effect: effect(EffectId::Directivity), choice: Choice::Law(law) };
        cost.start.instances[2..].clone_from_slice(&[law(0), law(1)]);
        let beside = cost.beside(&[0, 2]);
        assert!(beside.iter().all(|subset| !(subset.contains(&2) && subset.contains(&3))));
        assert!(beside.contains(&vec![0, 3]));
    }

    /// A wider pitch is a larger field at a shorter wavelength. From a fit of these two causes the way leads to the one.
    #[test]
    fn a_start_leads_to_what_made_the_readings() {
        const RATIO: f64 = 1.01;
        let mut observations = Bench::in_six_planes(10e-3);
        let true_drive = Bench::in_six_planes(10e-3 * RATIO).scans.remove(0).drives.remove(0);
        let drive = &mut observations.scans[0].drives[0];
        (drive.readings, drive.stabilised) = (true_drive.readings, true_drive.stabilised);
        let bench = Bench::new();
        let context = &bench.context;
        let ids = [EffectId::SoundSpeed, EffectId::AxisScale];
        let start = Start {
            instances: ids.map(|id| Instance { effect: effect(id), choice: Choice::None }).to_vec(),
            values: ids.map(|id| effect(id).neutral()).to_vec(),
            spreads: vec![f64::NAN; 2],
            nuisance: None,
        };
        let imitated = fit(&observations, context, start, SEARCH);
        let exchanges = Exchanges::of(&imitated, &observations, context).expect("determined");
        let is_pitch = |start: &Start| {
            start.instances.len() == 1 && start.instances[0].effect.id() == EffectId::Pitch
        };
        let start = exchanges.best().into_iter().find(is_pitch).expect("among the best");
        let found = fit(&observations, context, start, SEARCH);
        assert!((found.values[0][0] - RATIO).abs() < 1e-3, "{:?}", found.values);
        assert!(found.cost < imitated.cost + 1.0, "{} {}", found.cost, imitated.cost);
    }
}
