//! The search through sets of effects: every single one, then the best of them with each of the others, as long as the
//! evidence asks for more.

use rayon::prelude::*;

use super::effects::{CATALOGUE, Choice, Context};
use super::evidence::log_evidence;
use super::extension::{Extension, is_near};
use super::fit::{Fit, SEARCH, Start, fit, fit_any, refined};
use super::observations::Observations;
use super::search::extended;

/// Sets that are extended by one effect more: single effects, and larger sets. What two do not bring near the readings a
/// third seldom does.
const EXTENDED: usize = 3;
const EXTENDED_LARGER: usize = 1;

/// Excess cost over that of the best above which a set far from the readings is not extended.
const FAR_BEHIND: f64 = 3.0;

/// Most effects in a set, the simulator's own defects not counted.
const MOST_EFFECTS: usize = 3;

/// Effects in a set near the readings with which a first search, of few readings whose noise is not settled, may end.
const ENOUGH_AT_FIRST: usize = 2;

/// Nats that a larger set must gain over the best of the smaller ones before it is extended in its turn.
const WORTH_MORE: f64 = 2.0;

/// Rounds in which effects of the best set are exchanged for others, if it is near the readings and if it is not.
const MOST_EXCHANGES: usize = 3;
const EXCHANGES_FROM_AFAR: usize = 1;

/// Share of the gap, in chi-square, that another effect must close: formulas are no better than that.
const MATERIAL: f64 = 3e-4;

/// Cost a reading from which on a gap is very large, and the share of it that another effect must close then, down to the noise.
const VERY_LARGE: f64 = 100.0;
const MATERIAL_OF_LARGE: f64 = 1e-3;

/// Nats within which sets near the readings are rivals, and extended.
const RIVALS: f64 = 12.0;

/// Nats within which a set may be named beside the best.
const MAY_BE_NAMED: f64 = 6.0;

/// Nats behind the best, on some of the readings, within which a set is fitted to all, and sets that are in any case.
const STILL_HOPEFUL: f64 = 12.0;
const ALWAYS_HOPEFUL: usize = 6;

/// A set of effects as it was fitted, with the logarithm of its evidence.
#[derive(Clone)]
pub(super) struct Tried {
    pub fit: Fit,
    pub log_evidence: f64,
}

impl Tried {
    pub fn of(fit: Fit, observations: &Observations) -> Self {
        Self { log_evidence: log_evidence(&fit, observations), fit }
    }
}

/// The believed set-up with nothing added.
pub(super) fn believed(observations: &Observations, context: &Context) -> Tried {
    let start = Start { instances: vec![], values: vec![], spreads: vec![], nuisance: None };
    Tried::of(fit(observations, context, start, SEARCH), observations)
}

impl Tried {
    /// The same set, its effects in the order in which each next closes most, by the parts of it that were tried.
    fn by_what_each_closes(self, all: &[Self]) -> Self {
        let mut order: Vec<usize> = Vec::new();
        let ids = self.fit.ids();
        while order.len() < ids.len() {
            let cost_with = |next: usize| {
                let part: Vec<&str> = order.iter().chain([&next]).map(|&n| ids[n]).collect();
                let is_part = |tried: &&Self| {
                    let others = tried.fit.ids();
                    others.len() == part.len() && part.iter().all(|id| others.contains(id))
                };
                all.iter().find(is_part).map_or(f64::INFINITY, |tried| tried.fit.cost)
            };
            let left = (0..ids.len()).filter(|n| !order.contains(n));
            let next = left.min_by(|&a, &b| cost_with(a).total_cmp(&cost_with(b)));
            order.extend(next);
        }
        Self { fit: self.fit.in_order(&order), ..self }
    }
}

/// A search under way.
pub(super) struct Pursuit {
    /// What was fitted to all readings, the best first when the search has ended.
    pub tried: Vec<Tried>,
    /// Ids, sorted, of the sets that were seen to lead nowhere.
    given_up: Vec<Vec<&'static str>>,
    /// Whether the noise was judged by what a fit leaves over.
    noise_is_settled: bool,
    /// Ids, sorted, of the sets whose laws were chosen on these readings, and what the best had chosen then.
    laws_chosen: (Vec<Vec<&'static str>>, Vec<(&'static str, Choice)>),
}

impl Pursuit {
    /// Searches from the believed set-up.
    pub fn begin(observations: &Observations, context: &Context) -> Self {
        let tried = vec![believed(observations, context)];
        let (given_up, laws_chosen) = Default::default();
        let mut pursuit = Self { tried, given_up, noise_is_settled: false, laws_chosen };
        let size = pursuit.mend_simulator(observations, context);
        pursuit.go_on(size, observations, context);
        pursuit
    }

    /// What was seen to lead nowhere is looked at again: it was seen with another noise.
    pub fn forget_what_was_given_up(&mut self) {
        self.given_up.clear();
    }

    /// Fits what is hopeful to all readings, of which the search saw some.
    pub fn on_all(self, observations: &Observations, context: &Context) -> Self {
        let Self { mut tried, mut given_up, .. } = self;
        sort(&mut tried);
        let least = tried[0].log_evidence - STILL_HOPEFUL;
        let hopeful: Vec<Vec<&str>> = tried
            .iter()
            .enumerate()
            .filter(|(number, tried)| *number < ALWAYS_HOPEFUL || tried.log_evidence > least)
            .map(|(_, tried)| tried.fit.ids())
            .collect();
        // What went into a hopeful set may do without the rest of it: some effects only make up for a noise judged wrong.
        let (hopeful, hopeless): (Vec<Tried>, Vec<Tried>) = tried.into_iter().partition(|tried| {
            let ids = tried.fit.ids();
            hopeful.iter().any(|hopeful| ids.iter().all(|id| hopeful.contains(id)))
        });
        given_up.extend(hopeless.iter().map(|tried| sorted_ids(&tried.fit)));
        // What is larger than the best and worth less than a part of it that is no smaller is looked at again beside that part, by what
        // it promises there.
        let size = hopeful[0].fit.instances.len();
        let worth_more_than_its_parts = |tried: &&Tried| {
            !hopeful.iter().any(|part| {
                part.fit.instances.len() >= size
                    && holds_all(&tried.fit, &part.fit)
                    && part.log_evidence > tried.log_evidence
            })
        };
        let hopeful: Vec<Tried> =
            hopeful.iter().filter(worth_more_than_its_parts).cloned().collect();
        let mut tried: Vec<Tried> = hopeful
            .into_par_iter()
            .map(|tried| Tried::of(refined(tried.fit, observations, context, SEARCH), observations))
            .collect();
        sort(&mut tried);
        let laws_chosen = Default::default();
        let mut pursuit = Self { tried, given_up, noise_is_settled: true, laws_chosen };
        pursuit.leave_out_the_immaterial(observations);
        pursuit
    }

    /// What was found, the best first, the effects of the first few in the order of what they close.
    pub fn found(self) -> Vec<Tried> {
        /// Sets that may be named.
        const NAMED: usize = 3;
        let mut found = self.tried.clone();
        for tried in found.iter_mut().take(NAMED) {
            *tried = tried.clone().by_what_each_closes(&self.tried);
        }
        found
    }

    /// Goes on from the best.
    pub fn and_on(mut self, observations: &Observations, context: &Context) -> Self {
        self.choose_laws(observations, context);
        let size = self.tried[0].fit.instances.len();
        self.go_on(size, observations, context);
        self.choose_laws(observations, context);
        self
    }

    /// Which of an effect's laws holds, and what was found among many minima, was chosen on few readings or beside other effects: for
    /// the best sets and what is part of the best, it is chosen again on all, and what the best chose is tried in the others.
    fn choose_laws(&mut self, observations: &Observations, context: &Context) {
        let best = self.tried[0].clone();
        let instances = best.fit.instances.iter();
        let choices_of_best: Vec<_> =
            instances.map(|i| (i.effect.id(), i.choice.clone())).collect();
        if self.laws_chosen.1 != choices_of_best {
            self.laws_chosen = (Vec::new(), choices_of_best);
        }
        let chosen = &self.laws_chosen.0;
        let matters = |tried: &&mut Tried| {
            let near = tried.log_evidence > best.log_evidence - MAY_BE_NAMED;
            (near || holds_all(&best.fit, &tried.fit)) && !chosen.contains(&sorted_ids(&tried.fit))
        };
        let now_chosen = self.tried.par_iter_mut().filter(matters).map(|tried| {
            for number in 0..tried.fit.instances.len() {
                let effect = tried.fit.instances[number].effect;
                let of_best = best.fit.instances.iter().filter(|i| i.effect.id() == effect.id());
                let of_best: Vec<Choice> = of_best.map(|i| i.choice.clone()).collect();
                for choice in effect.choices().into_iter().chain(of_best) {
                    if choice == tried.fit.instances[number].choice
                        || matches!(choice, Choice::None)
                    {
                        continue;
                    }
                    let mut fit = tried.fit.clone();
                    fit.instances[number].choice = choice;
                    let other =
                        Tried::of(refined(fit, observations, context, SEARCH), observations);
                    if other.log_evidence > tried.log_evidence {
                        *tried = other;
                    }
                }
            }
            sorted_ids(&tried.fit)
        });
        let now_chosen: Vec<_> = now_chosen.collect();
        self.laws_chosen.0.extend(now_chosen);
        sort(&mut self.tried);
    }

    /// The simulator's own defects come first: nobody looks for physics in what a slip of the program explains. Gives
    /// the number of those that are taken in.
    fn mend_simulator(&mut self, observations: &Observations, context: &Context) -> usize {
        let mut mended = self.tried[0].clone();
        loop {
            let ids = mended.fit.ids();
            let defects = CATALOGUE.into_iter().filter(|effect| {
                effect.is_defect() && effect.can_act(observations) && !ids.contains(&effect.id())
            });
            let one_more: Vec<Tried> = defects
                .map(|effect| {
                    let mut values = mended.fit.values.clone();
                    values.push(Vec::new());
                    let mut spreads = mended.fit.spreads.clone();
                    spreads.push(f64::NAN);
                    let instances = extended(&mended.fit, effect, Choice::None);
                    let start = Start { instances, values, spreads, nuisance: None };
                    Tried::of(fit(observations, context, start, SEARCH), observations)
                })
                .collect();
            self.tried.extend(one_more.iter().cloned());
            let best =
                one_more.into_iter().max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
            match best.filter(|best| best.log_evidence > mended.log_evidence + WORTH_MORE) {
                Some(best) => mended = best,
                None => break,
            }
        }
        let size = mended.fit.instances.len();
        // What else was tried with as many would be searched on from as well.
        self.tried.retain(|tried| {
            tried.fit.instances.len() < size || tried.fit.ids() == mended.fit.ids()
        });
        size
    }

    /// Goes on from the best sets of a size.
    fn go_on(&mut self, size: usize, observations: &Observations, context: &Context) {
        let n = observations.len() as f64;
        let of_size = |tried: &&Tried| tried.fit.instances.len() == size;
        let mut frontier: Vec<Tried> = self.tried.iter().filter(of_size).cloned().collect();
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
            frontier.truncate(if near || effects < 2 { EXTENDED } else { EXTENDED_LARGER });
            frontier.retain(|tried| match near {
                true => tried.log_evidence >= best.log_evidence - RIVALS,
                false => tried.fit.cost - n <= FAR_BEHIND * (best.fit.cost - n),
            });
            let before = best_log_evidence(&self.tried);
            let mut grown = self.extend(&frontier, self.known(), observations, context);
            self.tried.extend(grown.iter().cloned());
            sort(&mut grown);
            let goes_on = grown.first().is_some_and(|grown| {
                grown.log_evidence > before + WORTH_MORE && closes(&best.fit, &grown.fit, gap, n)
            });
            if !goes_on {
                break;
            }
            frontier = grown;
        }
        self.leave_out_the_immaterial(observations);
        let near = is_near(&self.tried[0].fit, observations);
        for _ in 0..if near { MOST_EXCHANGES } else { EXCHANGES_FROM_AFAR } {
            let best = sorted_ids(&self.tried[0].fit);
            self.exchange(observations, context);
            if sorted_ids(&self.tried[0].fit) == best {
                break;
            }
        }
    }

    /// Leaves out what closes next to nothing that a part of it does not close: it makes up for the formulas' own error.
    fn leave_out_the_immaterial(&mut self, observations: &Observations) {
        let n = observations.len() as f64;
        let gap = self.gap(n);
        let all = self.tried.clone();
        self.tried.retain(|tried| {
            !all.iter().any(|other| {
                tried.log_evidence > other.log_evidence
                    && holds_all(&tried.fit, &other.fit)
                    && !closes(&other.fit, &tried.fit, gap, n)
            })
        });
        sort(&mut self.tried);
    }

    /// The gap of the believed set-up in chi-square. (Another set may leave more: a fit that went astray.)
    fn gap(&self, n: f64) -> f64 {
        let believed = self.tried.iter().find(|tried| tried.fit.instances.is_empty());
        believed.expect("it is part of every set").fit.cost_with_shifts() - n
    }

    /// Tries every other effect in the place of each of the best set: what was taken in first, as the best alone, need not be
    /// part of the best together.
    fn exchange(&mut self, observations: &Observations, context: &Context) {
        let best = self.tried[0].fit.clone();
        if best.instances.len() < 2 {
            return;
        }
        // What was chosen among many minima may be chosen otherwise now that the rest is known.
        let mut known = self.known();
        if best.instances.iter().any(|instance| instance.effect.search().has_many_minima()) {
            let ids = sorted_ids(&best);
            known.retain(|known| *known != ids);
        }
        // Departures show what single elements suffer; what was looked for before they were known may have missed it.
        if best.has_random_elements() {
            let ids = best.ids();
            let of_elements: Vec<&str> = CATALOGUE
                .into_iter()
                .filter(|effect| effect.search().is_of_elements())
                .map(|effect| effect.id())
                .collect();
            known.retain(|known| {
                let others: Vec<_> = known.iter().filter(|id| !ids.contains(id)).collect();
                !matches!(others[..], [id] if of_elements.contains(id))
            });
        }
        let without: Vec<Tried> = (0..best.instances.len())
            .filter(|&number| !best.instances[number].effect.is_defect())
            .map(|number| {
                let Fit { mut instances, mut values, mut spreads, nuisance, .. } = best.clone();
                instances.remove(number);
                values.remove(number);
                spreads.remove(number);
                let start = Start { instances, values, spreads, nuisance: Some(nuisance) };
                Tried::of(fit_any(observations, context, start, SEARCH), observations)
            })
            .collect();
        let extended = self.extend(&without, known, observations, context);
        self.tried.extend(extended);
        self.tried.extend(without);
        sort(&mut self.tried);
        let mut seen: Vec<Vec<&str>> = Vec::new();
        self.tried.retain(|tried| {
            let ids = sorted_ids(&tried.fit);
            let is_new = !seen.contains(&ids);
            seen.push(ids);
            is_new
        });
    }

    /// What was fitted or given up.
    fn known(&self) -> Vec<Vec<&'static str>> {
        let tried = self.tried.iter().map(|tried| sorted_ids(&tried.fit));
        tried.chain(self.given_up.iter().cloned()).collect()
    }

    /// Every set worth a fit that has one effect more than one of these, and was not looked at before.
    fn extend(
        &mut self,
        frontier: &[Tried],
        known: Vec<Vec<&'static str>>,
        observations: &Observations,
        context: &Context,
    ) -> Vec<Tried> {
        let Extension { fitted, given_up } =
            Extension::of(frontier, known, self.noise_is_settled, observations, context);
        self.given_up.extend(given_up);
        fitted
    }
}

/// Whether a set closes more of a gap than a part of it does, by what is worth an effect. Of a very large gap only what is beyond the
/// noise counts; what takes the place of random departures need not close anything.
fn closes(smaller: &Fit, larger: &Fit, gap: f64, n: f64) -> bool {
    let [smaller_cost, larger_cost] = [smaller, larger].map(Fit::cost_with_shifts);
    let material = match gap > VERY_LARGE * n {
        true => smaller_cost.max(n) - larger_cost.max(n) > MATERIAL_OF_LARGE * gap,
        false => smaller_cost - larger_cost > MATERIAL * gap,
    };
    material || smaller.has_random_elements()
}

/// Whether a set holds all effects of another and more.
fn holds_all(larger: &Fit, smaller: &Fit) -> bool {
    let ids = larger.ids();
    ids.len() > smaller.instances.len() && smaller.ids().iter().all(|id| ids.contains(id))
}

fn sorted_ids(fit: &Fit) -> Vec<&'static str> {
    let mut ids = fit.ids();
    ids.sort_unstable();
    ids
}

fn best_log_evidence(tried: &[Tried]) -> f64 {
    tried.iter().map(|tried| tried.log_evidence).fold(f64::NEG_INFINITY, f64::max)
}

fn sort(tried: &mut [Tried]) {
    tried.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
}

#[cfg(test)]
mod tests {
    use super::super::fit::Instance;
    use super::super::likelihood::Nuisance;
    use super::*;

    fn tried(id: Option<&str>, cost: f64, shift_m: f64) -> Tried {
        let instance = |id: &str| Instance {
            effect: CATALOGUE.into_iter().find(|effect| effect.id() == id).expect("an effect"),
            choice: Choice::None,
        };
        let mut nuisance = Nuisance::from_slice(&[0.0; Nuisance::COUNT]);
        nuisance.shift_m.x = shift_m;
        let instances = id.map(instance).into_iter().collect();
        let fit = Fit { instances, cost, ..Fit::of_nothing(vec![nuisance]) };
        Tried { fit, log_evidence: -0.5 * cost }
    }

    /// Else what closes all that is left but for noise would close next to nothing of what a fit that went astray leaves.
    #[test]
    fn a_fit_that_went_astray_makes_no_gap() {
        let tried = vec![tried(None, 1000.0, 0.0), tried(Some("aperture"), 1e9, 0.0)];
        let (given_up, laws_chosen) = Default::default();
        let pursuit = Pursuit { tried, given_up, noise_is_settled: false, laws_chosen };
        assert_eq!(pursuit.gap(100.0), 900.0);
    }

    #[test]
    fn an_offset_closes_what_the_shift_took_up() {
        let (drift, gap, n) = (tried(Some("gain-drift"), 5000.0, 5e-4).fit, 20_000.0, 5000.0);
        let still = tried(Some("gain-drift"), 4998.0, 5e-4).fit;
        let unshifted = tried(Some("offset"), 4998.0, 0.0).fit;
        assert!(!closes(&drift, &still, gap, n));
        assert!(closes(&drift, &unshifted, gap, n));
    }
}
