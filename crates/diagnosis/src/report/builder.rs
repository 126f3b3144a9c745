//! The result of a diagnosis, put together from its phases.

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{Noise, NoiseSource, Registration};
use fieldgap_records::RecordedScan;
use rayon::prelude::*;
use std::collections::BTreeMap;

use crate::advice::next_measurement::next_measurement;
use crate::effect_id::{EffectId, joined};
use crate::fit::joint_fit::Fit;
use crate::fitted_parameter::FittedParameter;
use crate::limits::{ANOTHER_CAUSE, IMITATED_AMONG_MANY, MOST_CANDIDATES, MOST_EFFECTS};
use crate::model::effect::{Context, Estimate};
use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisance;
use crate::model::observations::Observations;
use crate::report::maps::{Plotted, maps};
use crate::report::sentence::{Basis, Gaps};
use crate::report::within_uncertainty::findings;
use crate::residual_structure::ResidualStructure;
use crate::residual_structure::test::Test;
use crate::result::{
    Candidate, Diagnosis, NextMeasurement, PhaseFigures, Remainder, ResidualTest, Verdict,
    WaterfallStep, WithinUncertainty,
};
use crate::selection::scored_model::ScoredModel;
use crate::verdict::gap_budget::gap_budget;
use crate::verdict::gap_size::{as_believed, gap, noise_floor, scatter_beside};
use crate::verdict::held_out::HeldOut;
use crate::verdict::judgement::Judgement;
use crate::verdict::waterfall::waterfall;

/// What the phases found, to be put together.
pub(crate) struct ReportBuilder<'s> {
    /// The scans.
    pub scans: &'s [RecordedScan],
    /// The simulator whose gap is in question.
    pub simulator: Simulator,
    /// Their readings.
    pub observations: Observations,
    /// The set-up as believed.
    pub context: Context,
    /// Every set that was fitted, the best first.
    pub scored: Vec<ScoredModel>,
    /// What the best set leaves.
    pub structure: ResidualStructure,
    /// Which set is named.
    pub judgement: Judgement,
}

impl ReportBuilder<'_> {
    /// The diagnosis; `registration` is that of the first scan.
    pub fn build(&self, registration: Registration) -> Diagnosis {
        let Self { scans, simulator, observations, context, judgement, .. } = self;
        let nuisance = as_believed(observations);
        let before = ForwardModel::believed().expected_readings(observations, &nuisance);
        let best = &self.scored[0].fit;
        let after = best.model(context).expected_readings(observations, &best.nuisance);
        let held_out = HeldOut::of(observations);
        let ranked = self.ranked(&held_out);
        let gaps = Gaps {
            before: gap(observations, &before),
            before_held_out: held_out.before(),
            noise: noise_floor(observations),
        };
        let noise_beside: Vec<f64> = ranked
            .iter()
            .zip(&self.scored)
            .map(|(_, scored)| scatter_beside(observations, &scored.fit, context))
            .collect();
        let waterfall = waterfall(observations, context, &self.scored, gaps.before);
        let remainder = self.remainder(&waterfall, ranked[0].gap_after, noise_beside[0]);
        // A fit of the nominal set-up would take up an offset by its free shift.
        let nominal = Fit::of_nothing(nuisance.clone());
        let structure_before = ResidualStructure::patterns_only(&nominal, observations, context);
        let plotted = Plotted {
            before: &before,
            after: &after,
            residual_before: &structure_before.residuals,
            residual_after: &self.structure.residuals,
        };
        let (effects, alternatives) = self.named();
        let undetermined = registration.undetermined.iter();
        let undetermined = undetermined.map(|combination| combination.explanation.clone());
        let untried = context.tried.as_ref().map(|tried| {
            let tried: Vec<EffectId> = tried.iter().copied().collect();
            let tried = if tried.is_empty() { "none".to_owned() } else { joined(&tried, ", ") };
            format!("Of the catalogue only a part was tried ({tried}): another effect may explain the gap as well or better.")
        });
        let uncertainty = self.uncertainty();
        Diagnosis {
            format: 1,
            scan: scans[0].setup.name.clone(),
            scans: scans.iter().map(|scan| scan.setup.name.clone()).collect(),
            simulator: *simulator,
            reading_unit: scans[0].setup.unit.clone(),
            points: observations.len(),
            outliers: observations.outliers(),
            verdict: judgement.verdict,
            sentence: Basis {
                judgement,
                structure: &self.structure,
                ranked: &ranked,
                noise_beside: &noise_beside,
                gaps: &gaps,
                remainder: remainder.as_ref(),
                all_tried: context.tried.is_none(),
                uncertainty: uncertainty.as_ref(),
            }
            .sentence(),
            remainder,
            effects,
            alternatives,
            gap_before: gaps.before,
            gap_before_held_out: gaps.before_held_out,
            held_out_by: held_out.by,
            held_out_block_mm: held_out.block_m.map(|m| (1e4 * m).round() / 10.0),
            noise_floor: gaps.noise,
            elements: None,
            uncertainty,
            explained_fraction: gaps.explained_fraction(ranked[0].gap_after_held_out),
            r#where: gap_budget(observations, &nuisance, &before, &after),
            next_measurement: self.advice(),
            noise: self.noise(),
            slow_noise: observations.scans[0].scatter.slow.map(|slow| slow.share),
            phase: self.phase(&nuisance),
            planes: maps(observations, &registration, &plotted),
            residual_tests: self.residual_tests(&structure_before),
            waterfall,
            undetermined: undetermined.chain(untried).collect(),
            registration,
            ranked,
        }
    }

    fn phase(&self, as_believed: &[Nuisance]) -> Option<PhaseFigures> {
        let Self { observations, context, .. } = self;
        let noise = observations.scans.iter().find_map(|scan| Some(scan.phase?.noise))?;
        let left = |model: &ForwardModel<'_>, nuisance: &[Nuisance]| {
            let pressures = model.pressures(observations, nuisance);
            let residuals = model.residuals(observations, &pressures, nuisance);
            let (mut squares, mut weights, mut told) = (0.0, 0.0, 0);
            for phases in residuals.phases_of_scans.iter().flatten() {
                told += phases.told();
                for (weight, difference_rad) in phases.weighted_differences_rad() {
                    squares += weight * difference_rad * difference_rad;
                    weights += weight;
                }
            }
            (told, (squares / f64::max(weights, f64::MIN_POSITIVE)).sqrt())
        };
        let best = &self.scored[0].fit;
        let (_, rms_before_rad) = left(&ForwardModel::believed(), as_believed);
        let (readings, rms_after_rad) = left(&best.model(context), &best.nuisance);
        Some(PhaseFigures { readings, noise_rad: noise.rad, rms_before_rad, rms_after_rad })
    }

    /// The best candidates, each with its gap over readings kept out of the fit.
    fn ranked(&self, held_out: &HeldOut) -> Vec<Candidate> {
        let named = self.judgement.named.iter().map(|number| number + 1);
        let listed = named.fold(MOST_CANDIDATES, usize::max);
        let mut ranked: Vec<Candidate> = self
            .scored
            .iter()
            .take(listed)
            .enumerate()
            .map(|(number, scored)| self.candidate(number, scored))
            .collect();
        ranked.par_iter_mut().zip(&self.scored).for_each(|(candidate, scored)| {
            candidate.gap_after_held_out = held_out.after(&scored.fit, &self.context);
        });
        ranked
    }

    /// The named cause, and the rivals.
    fn named(&self) -> (Vec<EffectId>, Vec<Vec<EffectId>>) {
        let mut named = self.judgement.named.iter().map(|number| self.scored[*number].fit.ids());
        match self.judgement.verdict {
            Verdict::Explained | Verdict::MostlyExplained => {
                (named.next().unwrap_or_default(), Vec::new())
            }
            Verdict::Ambiguous => (Vec::new(), named.collect()),
            Verdict::Unexplained | Verdict::None => (Vec::new(), Vec::new()),
        }
    }

    /// What the set-up as stated explains within its uncertainty, where that is stated.
    fn uncertainty(&self) -> Option<WithinUncertainty> {
        let Self { observations, context, scored, .. } = self;
        let departures = findings(&scored[0].fit, context);
        let alone = scored.iter().find(|scored| scored.fit.instances.is_empty());
        let alone = alone.filter(|_| context.stated.is_any())?;
        let expected =
            alone.fit.model(context).expected_readings(observations, &alone.fit.nuisance);
        Some(WithinUncertainty { gap: gap(observations, &expected), departures })
    }

    fn noise(&self) -> Noise {
        let scatter = &self.observations.scans[0].scatter;
        let source = match (scatter.is_told_by_repeats(), scatter.told_by_map) {
            (true, _) => NoiseSource::Repeats,
            (false, true) => NoiseSource::Maps,
            (false, false) => NoiseSource::Residual,
        };
        Noise { additive: scatter.additive, multiplicative: scatter.share, source }
    }

    fn residual_tests(&self, before: &ResidualStructure) -> Vec<ResidualTest> {
        let tests = self.structure.tests.iter();
        let of_same_name =
            |test: &Test| before.tests.iter().find(|other| other.name == test.name).map(|t| t.z);
        tests
            .map(|test| ResidualTest {
                name: test.name,
                z: test.z,
                z_before: of_same_name(test),
                limit: test.limit,
                sign_of: test.sign_of.clone().filter(|_| test.fails()),
            })
            .collect()
    }

    fn advice(&self) -> Option<NextMeasurement> {
        let Judgement { named, part_of, .. } = &self.judgement;
        let rivals = part_of.as_ref().map_or(named, |part_of| &part_of.rivals);
        let [one, other, ..] = rivals[..] else { return None };
        next_measurement(
            &self.observations,
            &self.context,
            [&self.scored[one].fit, &self.scored[other].fit],
            self.simulator,
            &self.scans[0].setup.name,
            seconds_a_reading(&self.scans[0]),
        )
    }

    fn candidate(&self, number: usize, scored: &ScoredModel) -> Candidate {
        let fit = &scored.fit;
        let mut parameters: BTreeMap<String, FittedParameter> = BTreeMap::new();
        let mut readings = Vec::new();
        // The parameters of a part are those that it has beside the rest.
        let whole = self.judgement.part_of.as_ref().filter(|_| number == 0);
        let told = whole.map_or(fit, |part_of| &self.scored[part_of.rivals[0]].fit);
        let fitted = told.instances.iter().zip(fitted(told));
        let held = fit.ids();
        for (instance, fitted) in fitted.filter(|(i, _)| held.contains(&i.effect.id())) {
            let finding = instance.effect.describe(&fitted, &instance.choice, &self.context);
            let id = instance.effect.id();
            parameters
                .extend(finding.parameters.into_iter().map(|(p, v)| (format!("{id}.{p}"), v)));
            readings.push(finding.sentence);
        }
        let model = fit.model(&self.context);
        let after = model.expected_readings(&self.observations, &fit.nuisance);
        let of_many = whole.is_some() || fit.physical_effects() > MOST_EFFECTS;
        let imitated = if of_many { IMITATED_AMONG_MANY } else { 0.0 };
        Candidate {
            effects: fit.ids(),
            probability: (1.0 - ANOTHER_CAUSE)
                * (1.0 - imitated)
                * self.judgement.probabilities[number]
                / (1.0 + scored.unseen),
            log_evidence: scored.log_evidence - self.scored[0].log_evidence,
            parameters,
            readings,
            gap_after: gap(&self.observations, &after),
            gap_after_held_out: f64::NAN,
        }
    }

    /// What the best set leaves beyond noise, if it has structure or others explain it.
    fn remainder(
        &self,
        waterfall: &[WaterfallStep],
        gap_after: f64,
        noise: f64,
    ) -> Option<Remainder> {
        let mut failed: Vec<&Test> = self.structure.tests.iter().filter(|t| t.fails()).collect();
        failed.sort_by(|one, other| other.over_limit().total_cmp(&one.over_limit()));
        let looks_like: Vec<String> = failed.into_iter().map(Test::in_words).collect();
        let part_of = self.judgement.part_of.as_ref();
        let left_to = part_of.map_or(Vec::new(), |part_of| part_of.left_to.clone());
        let share = waterfall.last().map_or(1.0, |step| step.share);
        let gap = (gap_after * gap_after - noise * noise).max(0.0).sqrt();
        let is_any = !looks_like.is_empty() || !left_to.is_empty();
        is_any.then_some(Remainder { share, gap, looks_like, left_to })
    }
}

/// The parameters of each effect of a fit, as its own file says them.
fn fitted(fit: &Fit) -> Vec<Vec<Estimate>> {
    fit.ranges()
        .into_iter()
        .zip(&fit.values)
        .zip(&fit.spreads)
        .map(|((range, values), spread)| {
            let mut fitted = fit.estimates(values, range);
            if spread.is_finite() {
                fitted.push(Estimate::of_spread(*spread, values.len()));
            }
            fitted
        })
        .collect()
}

/// The pace of a scan, moves included, s; `None` where its readings have no times.
fn seconds_a_reading(scan: &RecordedScan) -> Option<f64> {
    let driven = || scan.samples.iter().filter(|sample| sample.focus.is_some());
    let (first, last) = (driven().next()?, driven().next_back()?);
    let pace_s = (last.time_s - first.time_s) / (driven().count() - 1) as f64;
    (pace_s.is_finite() && pace_s > 0.0).then_some(pace_s)
}
