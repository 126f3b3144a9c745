//! A diagnosis from beginning to end: registration, noise, search, verdict, report.

use std::collections::BTreeSet;

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{Incomparable, Registration};
use fieldgap_records::{RecordedScan, ScanSetup};
use rayon::prelude::*;

use crate::advice::found_field::FoundField;
use crate::advice::outlook::{Outlook, PossibleReading, outlook};
use crate::effect_id::EffectId;
use crate::elements_account::account;
use crate::fit::any::refined;
use crate::fit::joint_fit::{Fit, SEARCH};
use crate::limits::{
    ANOTHER_CAUSE, FEWEST_READINGS, FLUCTUATION_POSSIBLE, MOST_EFFECTS, MOST_ELEMENT_READINGS,
    MOST_ELEMENTS, NOISE_ROUNDS, READINGS_OF_A_SEARCH,
};
use crate::model::effect::Context;
use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;
use crate::noise::outliers::outliers;
use crate::noise::settle::{NoiseChange, settle_scatter, settled_again};
use crate::preparation::Prepared;
use crate::report::builder::ReportBuilder;
use crate::result::{Diagnosis, ElementsAccount, Verdict};
use crate::selection::model_search::{ModelSearch, in_question};
use crate::selection::scored_model::{ScoredModel, is_near, leaves_noise};
use crate::statistics::scatter::Scatter;
use crate::verdict::fresh::{CorrectedTest, FreshReadings, FreshTest};
use crate::verdict::gap_size::{as_believed, noise_floor};
use crate::verdict::judged::Judged;

/// How a diagnosis is made.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Options {
    /// The simulator whose gap is in question; without it, the first scan's own.
    pub simulator: Option<Simulator>,
    /// The only effects that are tried; without it, all of the catalogue.
    pub effects: Option<BTreeSet<EffectId>>,
    /// Whether phases are left out.
    pub amplitude_only: bool,
    /// Whether sets of more than three effects are left out. A loop goes on measuring where no set of few explains the gap, and all effects at once take
    /// longer than a round.
    pub few_causes: bool,
}

/// Diagnoses one scan, or several of one rig together. The same scans give the same bits.
///
/// `simulator` is the one whose gap is in question; without it, the first scan's own.
///
/// # Errors
/// [`Incomparable`] if there is nothing to compare.
pub fn diagnose(
    scans: &[RecordedScan],
    simulator: Option<Simulator>,
) -> Result<Diagnosis, Incomparable> {
    diagnose_with(scans, &Options { simulator, ..Options::default() })
}

/// As [`diagnose`], also with a part of the catalogue. Its verdict is then about that part: a gap that another effect would explain is
/// `unexplained`.
///
/// # Errors
/// [`Incomparable`] if there is nothing to compare.
pub fn diagnose_with(scans: &[RecordedScan], options: &Options) -> Result<Diagnosis, Incomparable> {
    Ok(Findings::of(scans, options)?.diagnosis())
}

/// Sets of effects that a search left in question, as they were fitted. Other readings of the same scan can be fitted from there.
#[derive(Clone)]
pub struct LiveSets {
    /// The best first.
    sets: Vec<ScoredModel>,
}

/// What a search among the effects of the catalogue found: every set that was fitted, and which is named.
pub struct Findings<'s> {
    report: ReportBuilder<'s>,
    registration: Registration,
    elements: Option<ElementsAccount>,
}

impl<'s> Findings<'s> {
    /// Of one scan, or of several of one rig together. The same scans give the same bits.
    ///
    /// # Errors
    /// [`Incomparable`] if there is nothing to compare.
    pub fn of(scans: &'s [RecordedScan], options: &Options) -> Result<Self, Incomparable> {
        Self::judged(scans, options, searched)
    }

    /// The same sets fitted to more readings of the same scan, and judged, without a search for others. The same sets and scan give the same
    /// bits.
    ///
    /// # Errors
    /// [`Incomparable`] if there is nothing to compare.
    pub fn of_live(
        scans: &'s [RecordedScan],
        options: &Options,
        live: &LiveSets,
    ) -> Result<Self, Incomparable> {
        let again = |observations: &mut Observations, context: &Context| {
            fitted_again(&live.sets, observations, context)
        };
        Self::judged(scans, options, again)
    }

    /// The sets that are left in question, to be fitted to more readings of the same scan.
    pub fn live_sets(&self) -> LiveSets {
        LiveSets { sets: in_question(&self.report.scored) }
    }

    /// Of the sets that `scored` fits to the readings, the best first.
    fn judged(
        scans: &'s [RecordedScan],
        options: &Options,
        scored: impl FnOnce(&mut Observations, &Context) -> Vec<ScoredModel>,
    ) -> Result<Self, Incomparable> {
        let Prepared { simulator, mut observations, mut context, mut registrations } =
            Prepared::of(scans, options.simulator, !options.amplitude_only)?;
        context.tried.clone_from(&options.effects);
        let scored = scored(&mut observations, &context);
        let mut judged = Judged::of(scored, &observations, &context);
        let explains_nothing = |Judged { judgement, .. }: &Judged| {
            judgement.verdict == Verdict::Unexplained && !judgement.too_faint && !options.few_causes
        };
        let account = |observations: &Observations| {
            let [scan] = scans else { return None };
            let of_dense_planes = observations.scans[0].scatter.told_by_map;
            if options.effects.is_some() || !of_dense_planes {
                return None;
            }
            account(scan, simulator, &registrations[0], noise_floor(observations))
        };
        let mut elements = None;
        let elements_first = tells_elements(&observations);
        if elements_first && explains_nothing(&judged) {
            elements = account(&observations);
        }
        if elements.is_none()
            && (explains_nothing(&judged) || is_cut_short(&judged) && !options.few_causes)
            && let Some(found) = Judged::of_many(&judged.scored, &observations, &context)
            && (explains_nothing(&judged) || found.0.judgement.verdict.names_a_cause())
        {
            (judged, observations) = found;
        }
        if !elements_first && explains_nothing(&judged) {
            elements = account(&observations);
        }
        let registration = registrations.swap_remove(0);
        let Judged { scored, structure, judgement } = judged;
        let report =
            ReportBuilder { scans, simulator, observations, context, scored, structure, judgement };
        Ok(Self { report, registration, elements })
    }

    /// The verdict.
    pub fn verdict(&self) -> Verdict {
        self.report.judgement.verdict
    }

    /// The sets with their probabilities, the most probable first; an empty set is the set-up as believed.
    pub fn probabilities(&self) -> Vec<(Vec<EffectId>, f64)> {
        let ReportBuilder { scored, judgement, .. } = &self.report;
        let ids = scored.iter().map(|scored| scored.fit.ids());
        ids.zip(judgement.probabilities.iter().copied()).collect()
    }

    /// The named set, or the rivals.
    pub fn named(&self) -> Vec<Vec<EffectId>> {
        let ReportBuilder { scored, judgement, .. } = &self.report;
        judgement.named.iter().map(|&number| scored[number].fit.ids()).collect()
    }

    /// What the `most` most probable sets expect of readings that could be taken next, in the order of the probabilities.
    pub fn outlooks(&self, possible: &[PossibleReading], most: usize) -> Vec<Outlook> {
        let ReportBuilder { observations, context, scored, judgement, .. } = &self.report;
        let sets = scored.iter().zip(&judgement.probabilities).take(most);
        let sets: Vec<_> = sets.collect();
        sets.into_par_iter()
            .map(|(scored, &probability)| {
                outlook(observations, context, scored, probability, possible)
            })
            .collect()
    }

    /// Probability that no set of the catalogue holds the cause: the rate at which that happens unseen; one where the verdict says so.
    pub fn outside_the_catalogue(&self) -> f64 {
        let judgement = &self.report.judgement;
        let seen = judgement.verdict == Verdict::Unexplained && !judgement.too_faint;
        if seen { 1.0 } else { ANOTHER_CAUSE }
    }

    /// The field that the most probable set expects, of the (one) scan of these findings.
    pub fn field(&self) -> FoundField<'_> {
        let ReportBuilder { observations, context, scored, judgement, .. } = &self.report;
        let number = judgement.named.first().copied().unwrap_or(0);
        FoundField::of(observations, context, &scored[number].fit)
    }

    /// Holds the named set, or the most probable one, against the readings of `whole` that follow those of the (one) scan of these findings.
    pub fn on_fresh(&self, whole: &RecordedScan) -> FreshTest {
        self.fresh(whole).test()
    }

    /// The same readings simulated with a set-up that was corrected by the named set; `accounted` are its effects that the set-up does not
    /// hold.
    pub fn on_fresh_corrected(
        &self,
        whole: &RecordedScan,
        corrected: &ScanSetup,
        accounted: &[EffectId],
    ) -> CorrectedTest {
        self.fresh(whole).corrected(corrected, accounted)
    }

    fn fresh<'a>(&'a self, whole: &'a RecordedScan) -> FreshReadings<'a> {
        let ReportBuilder { simulator, observations, context, scored, judgement, .. } =
            &self.report;
        let number = judgement.named.first().copied().unwrap_or(0);
        FreshReadings::of(observations, whole, *simulator, &scored[number], context)
    }

    /// The whole diagnosis.
    pub fn diagnosis(&self) -> Diagnosis {
        let mut diagnosis = self.report.build(self.registration.clone());
        if let Some(elements) = &self.elements {
            diagnosis.sentence += &elements.in_short();
            diagnosis.elements = Some(elements.clone());
        }
        diagnosis
    }
}

/// Searches beside the noise that repeats tell. Few of them may not tell a fluctuating field from a steady one with more noise: where nothing explains the gap
/// beside steady noise, and they prefer a fluctuating field, the search beside that counts if it explains the gap.
fn searched(observations: &mut Observations, context: &Context) -> Vec<ScoredModel> {
    let mut fluctuating = observations.clone();
    let sets = searched_beside_noise(observations, context);
    let scatters = || observations.scans.iter().map(|scan| &scan.scatter);
    let may_fluctuate = |scatter: &Scatter| {
        scatter.fluctuation == 0.0 && scatter.prefers_fluctuation > FLUCTUATION_POSSIBLE
    };
    if is_near(&sets[0].fit, observations) || !scatters().any(may_fluctuate) {
        return sets;
    }
    fluctuating.scans.iter_mut().for_each(|scan| scan.scatter.may_fluctuate = true);
    let others = searched_beside_noise(&mut fluctuating, context);
    if !is_near(&others[0].fit, &fluctuating) {
        return sets;
    }
    *observations = fluctuating;
    others
}

/// Searches first on some of the readings, with the noise that repeats and dark readings give. The best set then refines the noise, and
/// the search continues on more readings until noise and effects agree. The noise is judged from all readings, because few of
/// them hold few repeats. The best sets are fitted to all readings at the end.
fn searched_beside_noise(observations: &mut Observations, context: &Context) -> Vec<ScoredModel> {
    let nuisance = as_believed(observations);
    settle_scatter(observations, &ForwardModel::believed(), &nuisance, context, false);
    leave_out_outliers(observations, &ForwardModel::believed(), &nuisance);
    let most = (MOST_ELEMENT_READINGS / observations.elements()).max(FEWEST_READINGS);
    let mut search = ModelSearch::begin(&observations.thinned(READINGS_OF_A_SEARCH), context);
    let noise_is_told = observations.is_noise_told();
    let mut best = refined(search.scored[0].fit.clone(), observations, context, SEARCH, None);
    if leave_out_outliers(observations, &best.model(context), &best.nuisance) {
        best = refined(best, observations, context, SEARCH, None);
    }
    let mut noise = if !noise_is_told || leaves_noise(&best, observations) {
        settled_again(observations, &best.model(context), &best.nuisance, context)
    } else if is_near(&best, observations) {
        NoiseChange::Alike
    } else {
        // A fit far from the readings says nothing about their noise.
        let Some((others, noise)) = nearer_beside_noise(best, observations, context) else {
            return search.on_all(observations, context).found();
        };
        *observations = others;
        noise
    };
    let mut some = observations.thinned(most);
    search = search.on_all_after(noise == NoiseChange::Misled, &some, context);
    for _ in 0..NOISE_ROUNDS {
        let best = search.scored[0].fit.clone();
        if noise == NoiseChange::Alike || !leaves_noise(&best, observations) {
            break;
        }
        noise = settled_again(observations, &best.model(context), &best.nuisance, context);
        if noise != NoiseChange::Alike {
            some = observations.thinned(most);
            search = search.on_all_after(noise == NoiseChange::Misled, &some, context);
        }
    }
    if tells_elements(observations) && !is_near(&search.scored[0].fit, &some) {
        // More readings do not bring a set near that is far from many.
        let few = in_question(&search.scored);
        return ModelSearch::fitted_to(few, observations, context).found();
    }
    if some.len() < observations.len() {
        search = search.on_all_after(false, observations, context);
    }
    search.found()
}

/// The readings with the noise that a fit far from them shows, within what few repeats allow, if the fit is near them then.
fn nearer_beside_noise(
    fit: Fit,
    observations: &Observations,
    context: &Context,
) -> Option<(Observations, NoiseChange)> {
    let mut others = observations.clone();
    let noise = settled_again(&mut others, &fit.model(context), &fit.nuisance, context);
    let again = refined(fit, &others, context, SEARCH, None);
    is_near(&again, &others).then_some((others, noise))
}

/// Whether rivals may only lack effects that a set of few has no room for.
fn is_cut_short(judged: &Judged) -> bool {
    let best = &judged.scored[0].fit;
    judged.judgement.verdict == Verdict::Ambiguous && best.physical_effects() == MOST_EFFECTS
}

/// Whether dense planes of one scan of an array that is too large for departures of single elements in the catalogue tell what each emits. The account
/// of the elements then takes the place of fits of all effects to all readings, which take minutes.
fn tells_elements(observations: &Observations) -> bool {
    let [scan] = &observations.scans[..] else { return false };
    let elements = observations.elements();
    scan.scatter.told_by_map
        && elements > MOST_ELEMENTS
        && scan.len() > MOST_ELEMENT_READINGS / elements
}

/// Leaves out the readings that stand out of what these expected readings leave; whether there are any.
fn leave_out_outliers(
    observations: &mut Observations,
    model: &ForwardModel<'_>,
    nuisance: &[Nuisance],
) -> bool {
    let pressures = model.pressures(observations, nuisance);
    let residuals = model.residuals(observations, &pressures, nuisance);
    let levels: Vec<f64> =
        pressures.iter().flatten().flatten().map(|pressure| pressure.coherent.norm()).collect();
    let outliers = outliers(observations, &residuals.scaled, &levels);
    if !outliers.is_empty() {
        *observations = observations.part(|scan, visit| !outliers.contains(&(scan, visit.number)));
        for (scan, _) in outliers.iter() {
            observations.scans[*scan].outliers += 1;
        }
    }
    !outliers.is_empty()
}

/// Fits sets again, from where they were. The noise is judged anew, since it is judged from all readings.
fn fitted_again(
    sets: &[ScoredModel],
    observations: &mut Observations,
    context: &Context,
) -> Vec<ScoredModel> {
    let nuisance = as_believed(observations);
    settle_scatter(observations, &ForwardModel::believed(), &nuisance, context, false);
    let mut best = refined(sets[0].fit.clone(), observations, context, SEARCH, None);
    if leave_out_outliers(observations, &best.model(context), &best.nuisance) {
        best = refined(best, observations, context, SEARCH, None);
    }
    if leaves_noise(&best, observations) {
        settled_again(observations, &best.model(context), &best.nuisance, context);
    }
    ModelSearch::fitted_to(sets.to_vec(), observations, context).found()
}
