//! The search through sets of effects: every single effect, then the best sets with each other effect, while the evidence grows.

use rayon::prelude::*;

use crate::effect_id::EffectId;
use crate::effects::catalogue;
use crate::fit::any::{first_steps, refined};
use crate::fit::joint_fit::{Fit, SEARCH, Start, fit};
use crate::limits::{
    ENOUGH_AT_FIRST, EXCHANGES, KEPT_IN_ANY_CASE, MATERIAL, MATERIAL_OF_VERY_LARGE, MOST_EFFECTS,
    MOST_IN_QUESTION, MOST_RIVALS, RIVALS, SETS_EXTENDED, SHORT_AT_FIRST, SINGLES_EXTENDED,
    VERY_LARGE, WORTH_EXTENDING,
};
use crate::model::effect::{Choice, Context, PerElement, Search};
use crate::model::observations::Observations;
use crate::selection::extension::{Extension, Unseen};
use crate::selection::scored_model::{ScoredModel, believed, best_first, is_near, sorted_ids};
use crate::selection::starts::extended;

/// A search under way.
pub(crate) struct ModelSearch {
    /// What was fitted to all readings, the best first when the search has ended.
    pub scored: Vec<ScoredModel>,
    /// Sorted ids of the sets that were rejected.
    given_up: Vec<Vec<EffectId>>,
    /// Sets of which these readings cannot show one effect.
    unseen: Vec<Unseen>,
    /// Whether the noise was judged from the residual of a fit.
    noise_is_settled: bool,
    /// Sorted ids of the sets whose laws were chosen on these readings, and the choices of the best set at that time.
    laws_chosen: (Vec<Vec<EffectId>>, Vec<(EffectId, Choice)>),
    /// Sorted ids of the sets from which departures of elements were carried to others.
    carried: Vec<Vec<EffectId>>,
}

impl ModelSearch {
    /// Searches from the believed set-up.
    pub fn begin(observations: &Observations, context: &Context) -> Self {
        let scored = vec![believed(observations, context)];
        let (given_up, unseen, laws_chosen, carried) = Default::default();
        let mut search =
            Self { scored, given_up, unseen, noise_is_settled: false, laws_chosen, carried };
        let size = search.mend_simulator(observations, context);
        search.go_on(size, observations, context);
        search
    }

    /// Goes on with all readings after a search on some of them, or with another noise. If that noise shows that the search was misled, single effects are looked
    /// for again.
    pub fn on_all_after(
        mut self,
        misled: bool,
        observations: &Observations,
        context: &Context,
    ) -> Self {
        if misled {
            self.given_up.clear();
        }
        let mut search = self.on_all(observations, context);
        search.choose_again(observations, context);
        if misled {
            let best = &search.scored[0].fit;
            let defects = best.instances.len() - best.physical_effects();
            search.go_on(defects, observations, context);
        }
        let size = search.scored[0].fit.instances.len();
        search.go_on(size, observations, context);
        search.choose_again(observations, context);
        search
    }

    /// Fits the sets that are near the best to all readings, after a search on some of them.
    pub fn on_all(self, observations: &Observations, context: &Context) -> Self {
        let Self { mut scored, mut given_up, unseen, carried, .. } = self;
        sort(&mut scored);
        let (hopeful, hopeless) = by_hope(scored, usize::MAX);
        given_up.extend(hopeless.iter().map(|scored| sorted_ids(&scored.fit)));
        // A larger set with less evidence than one of its parts is dropped; the extension of that part may find it again.
        let size = hopeful[0].fit.instances.len();
        let worth_more_than_its_parts = |scored: &&ScoredModel| {
            !hopeful.iter().any(|part| {
                part.fit.instances.len() >= size
                    && holds_all(&scored.fit, &part.fit)
                    && part.log_evidence > scored.log_evidence
            })
        };
        let hopeful: Vec<ScoredModel> =
            hopeful.iter().filter(worth_more_than_its_parts).cloned().collect();
        Self { given_up, unseen, carried, ..Self::fitted_to(hopeful, observations, context) }
    }

    /// Of sets that were fitted before to other readings of these scans, without a search for others.
    pub fn fitted_to(
        sets: Vec<ScoredModel>,
        observations: &Observations,
        context: &Context,
    ) -> Self {
        let fits = sets.into_par_iter().map(|scored| scored.fit);
        let mut scored: Vec<ScoredModel> = fits
            .map(|fit| ScoredModel::of(settled(fit, observations, context), observations))
            .collect();
        sort(&mut scored);
        let (given_up, unseen, laws_chosen, carried) = Default::default();
        let mut search =
            Self { scored, given_up, unseen, noise_is_settled: true, laws_chosen, carried };
        search.leave_out_immaterial_sets(observations);
        search
    }

    /// The fitted sets, the best first. The effects of the first few are in the order of how much they explain.
    pub fn found(self) -> Vec<ScoredModel> {
        let mut found = self.scored.clone();
        for scored in found.iter_mut().take(MOST_RIVALS) {
            *scored = scored.clone().by_what_each_explains(&self.scored);
        }
        for scored in &mut found {
            scored.unseen = self.unseen_beside(&scored.fit);
        }
        found
    }

    /// Laws and other discrete choices were made on few readings or beside other effects. For the best sets and the parts of the best,
    /// they are made again on all readings, and the choices of the best set are tried in the others.
    fn choose_again(&mut self, observations: &Observations, context: &Context) {
        let best = self.scored[0].clone();
        let instances = best.fit.instances.iter();
        let choices_of_best: Vec<_> =
            instances.map(|i| (i.effect.id(), i.choice.clone())).collect();
        if self.laws_chosen.1 != choices_of_best {
            self.laws_chosen = (Vec::new(), choices_of_best);
        }
        let chosen = &self.laws_chosen.0;
        let matters = |scored: &&mut ScoredModel| {
            let near = scored.log_evidence > best.log_evidence - RIVALS.get();
            (near || holds_all(&best.fit, &scored.fit))
                && !chosen.contains(&sorted_ids(&scored.fit))
        };
        let now_chosen = self.scored.par_iter_mut().filter(matters).map(|scored| {
            for number in 0..scored.fit.instances.len() {
                let effect = scored.fit.instances[number].effect;
                let of_best = best.fit.instances.iter().filter(|i| i.effect.id() == effect.id());
                let of_best: Vec<Choice> = of_best.map(|i| i.choice.clone()).collect();
                for choice in effect.choices().into_iter().chain(of_best) {
                    if choice == scored.fit.instances[number].choice
                        || matches!(choice, Choice::None)
                    {
                        continue;
                    }
                    let mut fit = scored.fit.clone();
                    fit.values[number] = effect.carried(fit.values[number].clone(), &choice);
                    fit.instances[number].choice = choice;
                    let first = ScoredModel::of(
                        first_steps(fit.into(), observations, context),
                        observations,
                    );
                    if first.log_evidence < scored.log_evidence - SHORT_AT_FIRST {
                        continue;
                    }
                    let other = ScoredModel::of(
                        refined(first.fit, observations, context, SEARCH, None),
                        observations,
                    );
                    if other.log_evidence > scored.log_evidence {
                        *scored = other;
                    }
                }
            }
            sorted_ids(&scored.fit)
        });
        let now_chosen: Vec<_> = now_chosen.collect();
        self.laws_chosen.0.extend(now_chosen);
        sort(&mut self.scored);
    }

    /// Tries the simulator's own defects first, since a bug needs no physical cause. Returns the number of defects in the best set.
    fn mend_simulator(&mut self, observations: &Observations, context: &Context) -> usize {
        let mut mended = self.scored[0].clone();
        loop {
            let ids = mended.fit.ids();
            let defects = catalogue().filter(|effect| {
                effect.is_defect()
                    && context.tries(effect.id())
                    && effect.can_act(observations)
                    && !ids.contains(&effect.id())
            });
            let one_more: Vec<ScoredModel> = defects
                .map(|effect| {
                    let mut values = mended.fit.values.clone();
                    values.push(Vec::new());
                    let mut spreads = mended.fit.spreads.clone();
                    spreads.push(f64::NAN);
                    let instances = extended(&mended.fit, effect, Choice::None);
                    let start = Start { instances, values, spreads, nuisance: None };
                    ScoredModel::of(fit(observations, context, start, SEARCH), observations)
                })
                .collect();
            self.scored.extend(one_more.iter().cloned());
            let best =
                one_more.into_iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
            match best.filter(|best| best.log_evidence > mended.log_evidence + WORTH_EXTENDING) {
                Some(best) => mended = best,
                None => break,
            }
        }
        let size = mended.fit.instances.len();
        // Other sets of the same size would otherwise be extended as well.
        self.scored.retain(|scored| {
            scored.fit.instances.len() < size || scored.fit.ids() == mended.fit.ids()
        });
        size
    }

    /// Continues from the best sets of this size.
    fn go_on(&mut self, size: usize, observations: &Observations, context: &Context) {
        let n = observations.len() as f64;
        let of_size = |scored: &&ScoredModel| scored.fit.instances.len() == size;
        let mut frontier: Vec<ScoredModel> = self.scored.iter().filter(of_size).cloned().collect();
        let gap = self.gap(n);
        loop {
            sort(&mut frontier);
            let best = frontier[0].clone();
            let effects = best.fit.physical_effects();
            if effects == MOST_EFFECTS {
                break;
            }
            let near = is_near(&best.fit, observations);
            if near && effects >= ENOUGH_AT_FIRST && !self.noise_is_settled {
                break;
            }
            frontier.truncate(if near || effects < 2 { SINGLES_EXTENDED } else { SETS_EXTENDED });
            // Far from the readings every set is far behind, and any may become the best with the next effect.
            frontier
                .retain(|scored| !near || scored.log_evidence >= best.log_evidence - RIVALS.get());
            let before = best_log_evidence(&self.scored);
            let goes_on = |grown: &[ScoredModel]| {
                grown.first().is_some_and(|grown| {
                    grown.log_evidence > before + WORTH_EXTENDING
                        && explains_more(&best.fit, &grown.fit, gap, n)
                })
            };
            let mut grown = self.extend(&frontier, self.known(), observations, context);
            sort(&mut grown);
            // Far from the readings walls and objects are looked for only where nothing else goes on.
            if !goes_on(&grown) && !near && !best.fit.instances.is_empty() {
                let noise = self.noise_is_settled;
                let Extension { fitted, given_up, .. } =
                    Extension::by_stray_waves(&best, self.known(), noise, observations, context);
                grown.extend(fitted);
                sort(&mut grown);
                self.given_up.extend(given_up);
            }
            self.scored.extend(grown.iter().cloned());
            if !goes_on(&grown) {
                break;
            }
            frontier = grown;
        }
        self.leave_out_immaterial_sets(observations);
        for _ in 0..EXCHANGES {
            let best = sorted_ids(&self.scored[0].fit);
            self.exchange(observations, context);
            if sorted_ids(&self.scored[0].fit) == best {
                break;
            }
        }
    }

    /// Drops sets that explain immaterially more than one of their parts: they compensate for errors of the formulas.
    fn leave_out_immaterial_sets(&mut self, observations: &Observations) {
        let n = observations.len() as f64;
        let gap = self.gap(n);
        let all = self.scored.clone();
        self.scored.retain(|scored| {
            !all.iter().any(|other| {
                scored.log_evidence > other.log_evidence
                    && holds_all(&scored.fit, &other.fit)
                    && !explains_more(&other.fit, &scored.fit, gap, n)
            })
        });
        sort(&mut self.scored);
    }

    /// The gap of the believed set-up in chi-square. (A failed fit of another set may leave more.)
    fn gap(&self, n: f64) -> f64 {
        let believed = self.scored.iter().find(|scored| scored.fit.instances.is_empty());
        believed.expect("it is part of every set").fit.cost_with_setup() - n
    }

    /// Tries every other effect in place of each effect of the best set: the best single effect need not be part of the best set.
    fn exchange(&mut self, observations: &Observations, context: &Context) {
        let best = self.scored[0].fit.clone();
        if best.instances.len() < 2 {
            if best.instances.len() == 1 && context.stated.holds_elements() {
                // Departures of elements have several minima, and the fit of the effect may have found a better one for the set-up as believed.
                self.scored.push(without(&best, 0, observations, context));
                self.scored = best_first(std::mem::take(&mut self.scored));
            }
            return;
        }
        // A choice among many minima may differ now that the other effects are known.
        let mut known = self.known();
        if best.instances.iter().any(|instance| instance.effect.search().has_many_minima()) {
            let ids = sorted_ids(&best);
            known.retain(|known| *known != ids);
        }
        // Departures of elements reveal faults of single elements that an earlier search may have missed.
        if best.has_random_elements() {
            let ids = best.ids();
            let of_elements: Vec<EffectId> = catalogue()
                .filter(|effect| effect.search().is_of_elements())
                .map(|effect| effect.id())
                .collect();
            known.retain(|known| {
                let others: Vec<_> = known.iter().filter(|id| !ids.contains(id)).collect();
                !matches!(others[..], [id] if of_elements.contains(id))
            });
        }
        // From these departures sets are fitted again that were fitted from others: a fit of many departures to few readings has many minima.
        let departs = best.has_random_elements();
        let ids = sorted_ids(&best);
        if departs && !self.carried.contains(&ids) {
            known.retain(|known| {
                known.len() != ids.len() || known.iter().filter(|id| !ids.contains(id)).count() != 1
            });
            self.carried.push(ids);
        }
        let parts: Vec<ScoredModel> = (0..best.instances.len())
            .filter(|&number| !best.instances[number].effect.is_defect())
            .map(|number| without(&best, number, observations, context))
            .collect();
        // Fitted without the phases or axes of single elements, all else is wrong, and no other account of these is recognised beside it. Departures of elements
        // that are fitted without another effect imitate it, and nothing that would take its place is recognised beside them.
        let beside = (0..best.instances.len()).filter_map(|number| {
            let effect = best.instances[number].effect;
            let of_each =
                matches!(effect.facts().per_element, PerElement::Phase | PerElement::Axis);
            let one_of_all = departs && effect.search() == Search::Smooth && !effect.is_defect();
            (of_each || one_of_all).then(|| {
                ScoredModel::of(best.clone().less(number, observations, context), observations)
            })
        });
        let frontier: Vec<ScoredModel> = beside.chain(parts.iter().cloned()).collect();
        let extended = self.extend(&frontier, known, observations, context);
        self.scored.extend(extended);
        self.scored.extend(parts);
        self.scored = best_first(std::mem::take(&mut self.scored));
    }

    /// Sets that were fitted or rejected.
    fn known(&self) -> Vec<Vec<EffectId>> {
        let scored = self.scored.iter().map(|scored| sorted_ids(&scored.fit));
        scored.chain(self.given_up.iter().cloned()).collect()
    }

    /// Evidence for one more effect than these, any of those that the readings cannot show, over that for these alone.
    fn unseen_beside(&self, fit: &Fit) -> f64 {
        let of = sorted_ids(fit);
        let unseen = self.unseen.iter().filter(|unseen| unseen.of == of);
        unseen.map(|unseen| unseen.nats.exp()).sum()
    }

    /// Every new set that extends one of these by one effect and is worth a fit.
    fn extend(
        &mut self,
        frontier: &[ScoredModel],
        known: Vec<Vec<EffectId>>,
        observations: &Observations,
        context: &Context,
    ) -> Vec<ScoredModel> {
        let Extension { fitted, given_up, unseen } =
            Extension::of(frontier, known, self.noise_is_settled, observations, context);
        self.given_up.extend(given_up);
        // More readings may show what fewer could not.
        let again = |ids: &Vec<EffectId>| frontier.iter().any(|set| sorted_ids(&set.fit) == *ids);
        self.unseen.retain(|earlier| !again(&earlier.of));
        self.unseen.extend(unseen);
        fitted
    }
}

/// A fit without one of its effects, fitted again.
fn without(
    fit: &Fit,
    number: usize,
    observations: &Observations,
    context: &Context,
) -> ScoredModel {
    let fit = refined(fit.without(number), observations, context, SEARCH, None);
    ScoredModel::of(fit, observations)
}

/// A fit on other readings, until it can fall no further by as much as one standard deviation makes.
fn settled(fit: Fit, observations: &Observations, context: &Context) -> Fit {
    let mut fit = refined(fit, observations, context, SEARCH, None);
    for _ in 0..MORE_FITS {
        if fit.expected_fall < SETTLED || !is_near(&fit, observations) {
            break;
        }
        fit = refined(fit, observations, context, SEARCH, None);
    }
    fit
}

/// Decrease of the cost still expected of a settled fit: what one standard deviation of one number makes.
const SETTLED: f64 = 1.0;

/// Fits after the first until it is settled, at most. Set by judgement.
const MORE_FITS: usize = 3;

/// The sets that are near the best, and the rest; sorted sets, the best first.
///
/// Parts of the sets near the best are kept too: some effects only compensate for a misjudged noise.
fn by_hope(scored: Vec<ScoredModel>, most: usize) -> (Vec<ScoredModel>, Vec<ScoredModel>) {
    let least = scored[0].log_evidence - RIVALS.get();
    let hopeful: Vec<Vec<EffectId>> = scored
        .iter()
        .enumerate()
        .take(most)
        .filter(|(number, scored)| *number < KEPT_IN_ANY_CASE || scored.log_evidence > least)
        .map(|(_, scored)| scored.fit.ids())
        .collect();
    scored.into_iter().partition(|scored| {
        let ids = scored.fit.ids();
        hopeful.iter().any(|hopeful| ids.iter().all(|id| hopeful.contains(id)))
    })
}

/// The sets that more readings may still name, the best first.
pub(crate) fn in_question(scored: &[ScoredModel]) -> Vec<ScoredModel> {
    by_hope(scored.to_vec(), MOST_IN_QUESTION).0
}

/// Whether a set explains materially more of a gap than a part of it does. Of a very large gap only the excess over the noise counts. Where
/// the field fluctuates, the gap is in the noise alone, and no larger than the readings' own scatter counts. One cause in place of random
/// departures need not explain more than they do.
fn explains_more(smaller: &Fit, larger: &Fit, gap: f64, n: f64) -> bool {
    let gap = if smaller.fluctuation().0 > 0.0 { gap.min(n) } else { gap };
    let [smaller_cost, larger_cost] = [smaller, larger].map(Fit::cost_with_setup);
    let material = match gap > VERY_LARGE * n {
        true => smaller_cost.max(n) - larger_cost.max(n) > MATERIAL_OF_VERY_LARGE * gap,
        false => smaller_cost - larger_cost > MATERIAL.get() * gap,
    };
    let departures = |fit: &Fit| {
        fit.instances.iter().filter(|instance| instance.effect.search() == Search::Random).count()
    };
    material || departures(smaller) > 0 && departures(larger) == departures(smaller)
}

/// Whether a set holds all effects of another and more.
fn holds_all(larger: &Fit, smaller: &Fit) -> bool {
    let ids = larger.ids();
    ids.len() > smaller.instances.len() && smaller.ids().iter().all(|id| ids.contains(id))
}

fn best_log_evidence(scored: &[ScoredModel]) -> f64 {
    scored.iter().map(|scored| scored.log_evidence).fold(f64::NEG_INFINITY, f64::max)
}

fn sort(scored: &mut [ScoredModel]) {
    scored.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Array, Excitation};

    use super::*;
    use crate::effects::effect;
    use crate::effects::testing::{Bench, read};
    use crate::limits::SHIFT_PRIOR_M;
    use crate::model::instance::Instance;
    use crate::model::nuisance::Nuisance;

    fn scored(id: Option<EffectId>, cost: f64, shift_m: f64) -> ScoredModel {
        let instance = |id: EffectId| Instance { effect: effect(id), choice: Choice::None };
        let mut nuisance = Nuisance::from_slice(&[0.0; Nuisance::COUNT]);
        nuisance.shift_m.x = shift_m;
        let instances: Vec<Instance> = id.map(instance).into_iter().collect();
        let (values, spreads) = instances.iter().map(|_| (Vec::new(), f64::NAN)).unzip();
        let of_setup = (shift_m / SHIFT_PRIOR_M.get()).powi(2);
        let nothing = Fit { of_setup, ..Fit::of_nothing(vec![nuisance]) };
        let fit = Fit { instances, values, spreads, cost, ..nothing };
        ScoredModel { fit, log_evidence: -0.5 * cost, unseen: 0.0 }
    }

    /// Otherwise a good set would seem immaterial beside the large cost of a failed fit.
    #[test]
    fn a_fit_that_went_astray_makes_no_gap() {
        let scored = vec![scored(None, 1000.0, 0.0), scored(Some(EffectId::Aperture), 1e9, 0.0)];
        let (given_up, unseen, laws_chosen, carried) = Default::default();
        let search =
            ModelSearch { scored, given_up, unseen, noise_is_settled: false, laws_chosen, carried };
        assert_eq!(search.gap(100.0), 900.0);
    }

    /// Each set has what cannot be seen beside it, and not beside another.
    #[test]
    fn what_cannot_be_seen_beside_a_set_is_counted_with_it() {
        let scored = vec![scored(None, 100.0, 0.0), scored(Some(EffectId::Aperture), 120.0, 0.0)];
        let beside_aperture = || Unseen { of: vec![EffectId::Aperture], nats: -2.0 };
        let unseen = vec![Unseen { of: vec![], nats: -4.0 }, beside_aperture(), beside_aperture()];
        let (given_up, laws_chosen, carried) = Default::default();
        let search =
            ModelSearch { scored, given_up, unseen, noise_is_settled: true, laws_chosen, carried };
        let found = search.found();
        assert_eq!(found[0].unseen, f64::exp(-4.0));
        assert_eq!(found[1].unseen, 2.0 * f64::exp(-2.0));
    }

    #[test]
    fn an_offset_closes_what_the_shift_took_up() {
        let (drift, gap, n) =
            (scored(Some(EffectId::GainDrift), 5000.0, 5e-4).fit, 20_000.0, 5000.0);
        let still = scored(Some(EffectId::GainDrift), 4998.0, 5e-4).fit;
        let unshifted = scored(Some(EffectId::Offset), 4998.0, 0.0).fit;
        assert!(!explains_more(&drift, &still, gap, n));
        assert!(explains_more(&drift, &unshifted, gap, n));
    }

    /// Beside the best set no exchange would find it: only the set-up as believed is extended by it alone.
    #[test]
    fn a_rejected_effect_is_looked_for_again_where_the_noise_misled() {
        let array = Array::square(4, 4, 10e-3).expect("not empty");
        let bench = Bench::of(array, Excitation::Uniform);
        let mut observations = Bench::in_six_planes(10e-3);
        read(&mut observations, &bench.model(EffectId::Pitch, &[1.01]));
        let tried = Some([EffectId::Pitch, EffectId::SoundSpeed].into());
        let context = Context { tried, ..bench.context.clone() };
        let start = Start {
            instances: vec![Instance { effect: effect(EffectId::Pitch), choice: Choice::None }],
            values: vec![vec![1.01]],
            spreads: vec![f64::NAN],
            nuisance: None,
        };
        let pitch = ScoredModel::of(fit(&observations, &context, start, SEARCH), &observations);
        for misled in [false, true] {
            let scored = vec![pitch.clone(), believed(&observations, &context)];
            let given_up = vec![vec![EffectId::SoundSpeed]];
            let (unseen, laws_chosen, carried) = Default::default();
            let search = ModelSearch {
                scored,
                given_up,
                unseen,
                noise_is_settled: true,
                laws_chosen,
                carried,
            };
            let found = search.on_all_after(misled, &observations, &context);
            assert_eq!(found.scored[0].fit.ids(), [EffectId::Pitch]);
            let is_rejected = |set: &ScoredModel| set.fit.ids() == [EffectId::SoundSpeed];
            assert_eq!(found.scored.iter().any(is_rejected), misled);
        }
    }

    /// The set-up as believed, whose departures a search fitted badly, beside an effect that does nothing.
    #[test]
    fn the_set_up_as_believed_is_fitted_again_from_the_departures_beside_an_effect() {
        let array = Array::square(4, 4, 10e-3).expect("not empty");
        let bench = Bench::of(array, Excitation::Uniform).with_elements_known_to(0.08, 0.13);
        let context = &bench.context;
        let observations = Bench::in_six_planes(10e-3);
        let best = believed(&observations, context);
        let start = Start {
            instances: vec![Instance { effect: effect(EffectId::Pitch), choice: Choice::None }],
            values: vec![vec![1.0]],
            spreads: vec![f64::NAN],
            nuisance: Some(best.fit.nuisance.clone()),
        };
        let pitch = ScoredModel::of(fit(&observations, context, start, SEARCH), &observations);
        let bad = ScoredModel { log_evidence: best.log_evidence - 50.0, ..best.clone() };
        let (given_up, unseen, laws_chosen, carried) = Default::default();
        let scored = vec![pitch, bad];
        let mut search =
            ModelSearch { scored, given_up, unseen, noise_is_settled: true, laws_chosen, carried };
        search.exchange(&observations, context);
        assert!(search.scored[0].fit.instances.is_empty());
        assert!((search.scored[0].log_evidence - best.log_evidence).abs() < 0.1);
    }
}
