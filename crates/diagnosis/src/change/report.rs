//! The result of a diagnosis of a change, put together.

use std::collections::BTreeMap;

use fieldgap_acoustics::Simulator;
use fieldgap_acoustics::least_squares::Stopping;
use fieldgap_comparison::{Noise, NoiseSource, Uncertain};
use fieldgap_records::RecordedScan;
use rayon::prelude::*;

use crate::change::model_of_both::ModelOfA;
use crate::change::result::{
    ChangeCandidate, ChangeDiagnosis, ChangeVerdict, CommonModel, ParameterChange, RecordName,
};
use crate::change::words::{Clause, Headline, clause};
use crate::effect_id::EffectId;
use crate::fit::joint_fit::{Fit, Start, cost_on, fit};
use crate::fitted_parameter::FittedParameter;
use crate::limits::{
    ANOTHER_CAUSE, CARRIED, CERTAIN, COPIES, FAR_MODEL, LEVEL_SIGMA, MOST_CANDIDATES,
    SIGNATURE_SHARE,
};
use crate::model::effect::{Context, Estimate};
use crate::model::instance::Instance;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, ObservedScan};
use crate::model::phases::tells_phase;
use crate::residual_structure::ResidualStructure;
use crate::residual_structure::patterns::in_slow_patterns;
use crate::result::{ResidualTest, Verdict};
use crate::selection::scored_model::ScoredModel;
use crate::statistics::scatter::Scatter;
use crate::verdict::held_out::HeldOut;
use crate::verdict::judgement::{Judgement, judge};

/// What was found, to be put together.
pub(crate) struct Report<'s> {
    pub records: [&'s RecordedScan; 2],
    pub simulator: Simulator,
    /// B less the discrepancy of A.
    pub observations: Observations,
    pub context: Context,
    pub model: ModelOfA,
    /// The best first.
    pub scored: Vec<ScoredModel>,
    /// Of one reading of B.
    pub noise: Scatter,
    pub left_out: usize,
}

impl Report<'_> {
    pub fn build(self) -> ChangeDiagnosis {
        let nothing = self.nothing();
        let structure =
            ResidualStructure::of(&self.scored[0].fit, &self.observations, &self.context);
        let judgement = self.lenient(
            judge(&self.observations, &self.scored, nothing, &structure),
            nothing,
            &structure,
        );
        let ranked = self.ranked(&judgement);
        let count = self.observations.len() as f64;
        let unchanged = self.cost_unchanged(&self.observations);
        let level = self.level(&self.scored[0].fit);
        let verdict = self.verdict(&judgement);
        let named = |number: &usize| self.scored[*number].fit.ids();
        let effects = match verdict.names_a_cause() {
            true => judgement.named.first().map(named).unwrap_or_default(),
            false => Vec::new(),
        };
        let alternatives = match verdict {
            ChangeVerdict::Ambiguous => judgement.named.iter().map(named).collect(),
            _ => Vec::new(),
        };
        let [a, b] = self.records.map(|scan| RecordName {
            name: scan.setup.name.clone(),
            recorded: scan.setup.recorded.to_string(),
        });
        let residual_tests: Vec<ResidualTest> = structure
            .tests
            .iter()
            .map(|test| ResidualTest {
                name: test.name,
                z: test.z,
                z_before: None,
                limit: test.limit,
                sign_of: test.sign_of.clone().filter(|_| test.fails()),
            })
            .collect();
        // A pair has the noise of two readings, and the change is in one.
        let noise_left = match verdict {
            ChangeVerdict::None => unchanged,
            ChangeVerdict::Unexplained => count,
            _ => self.scored[0].fit.cost,
        };
        let size_in_sigma = (2.0 * (unchanged - noise_left) / count).max(0.0).sqrt();
        let sentence = Headline {
            records: [&a, &b],
            verdict,
            named: judgement.named.iter().filter_map(|&number| ranked.get(number)).collect(),
            level,
            size_in_sigma,
            structure: structure
                .tests
                .iter()
                .filter(|test| test.fails())
                .map(|test| test.in_words())
                .chain(self.is_far().then(|| {
                    format!(
                        "the model of the first record by {} leaves {:.0} times the square of its noise: try another --simulator",
                        self.simulator, self.model.cost_a_reading[1]
                    )
                }))
                .collect(),
        }
        .sentence();
        let source = match self.noise.is_told_by_repeats() {
            true => NoiseSource::Repeats,
            false => NoiseSource::Residual,
        };
        ChangeDiagnosis {
            format: 1,
            simulator: self.simulator,
            reading_unit: self.records[1].setup.unit.clone(),
            pairs: self.observations.len(),
            left_out: self.left_out,
            verdict,
            sentence,
            effects,
            alternatives,
            level,
            size_in_sigma,
            chi_square_unchanged: self.chi_square(unchanged),
            chi_square_with_level: self.chi_square(nothing.fit.cost),
            chi_square_after: self.chi_square(self.scored[0].fit.cost),
            explained_fraction: ranked[0].explained_fraction,
            noise: Noise {
                additive: self.noise.additive,
                multiplicative: self.noise.share,
                source,
            },
            common: CommonModel {
                effects: self.model.effects(),
                chi_square_believed: self.model.cost_a_reading[0],
                chi_square_fitted: self.model.cost_a_reading[1],
            },
            ranked,
            residual_tests,
            a,
            b,
        }
    }

    /// A clear cause that leaves a small share of a large change with structure explains most of it: the signature of an effect is as good
    /// as the model of A.
    fn lenient(
        &self,
        judgement: Judgement,
        nothing: &ScoredModel,
        structure: &ResidualStructure,
    ) -> Judgement {
        let best = &self.scored[0];
        let count = self.observations.len() as f64;
        if self.chi_square(self.cost_unchanged(&self.observations)) < COPIES {
            let number = self.scored.iter().position(|set| set.fit.instances.is_empty());
            let named = number.into_iter().collect();
            return Judgement { verdict: Verdict::None, named, ..judgement };
        }
        let left =
            (best.fit.cost - count).max(in_slow_patterns(&self.observations, &structure.residuals));
        let is_small = left < SIGNATURE_SHARE * (nothing.fit.cost - count);
        let is_clear =
            judgement.probabilities[0] >= CERTAIN.get() && !best.fit.instances.is_empty();
        match judgement.verdict == Verdict::Unexplained && is_small && is_clear {
            true => Judgement { verdict: Verdict::MostlyExplained, named: vec![0], ..judgement },
            false => judgement,
        }
    }

    fn nothing(&self) -> &ScoredModel {
        let nothing = self.scored.iter().find(|set| set.fit.instances.is_empty());
        nothing.expect("it is tried first")
    }

    /// Whether the model of A leaves so much that the signatures of changes by it are not those of the array.
    fn is_far(&self) -> bool {
        self.model.cost_a_reading[1] > FAR_MODEL
    }

    fn verdict(&self, judgement: &Judgement) -> ChangeVerdict {
        match judgement.verdict {
            Verdict::Explained | Verdict::MostlyExplained | Verdict::Ambiguous if self.is_far() => {
                ChangeVerdict::Unexplained
            }
            Verdict::Explained => ChangeVerdict::Explained,
            Verdict::MostlyExplained => ChangeVerdict::MostlyExplained,
            Verdict::Ambiguous => ChangeVerdict::Ambiguous,
            Verdict::Unexplained => ChangeVerdict::Unexplained,
            Verdict::None => {
                let level = self.level(&self.nothing().fit);
                match (level.value - 1.0).abs() > LEVEL_SIGMA * level.standard_error {
                    true => ChangeVerdict::Level,
                    false => ChangeVerdict::None,
                }
            }
        }
    }

    /// Level of B over that of A. The error of A's own gain is in the discrepancy, so that it cancels.
    fn level(&self, fit: &Fit) -> Uncertain {
        let value = (fit.nuisance[0].log_gain - self.model.log_gain()).exp();
        let error =
            fit.covariance.as_ref().map_or(f64::NAN, |covariance| covariance[(0, 0)].sqrt());
        Uncertain { value, standard_error: value * error }
    }

    fn unchanged(&self) -> Vec<Nuisance> {
        self.model.nuisance(1.0)
    }

    /// Mean squared residual of a cost, phases that say something included. (A cost has of them what exceeds their noise.)
    fn chi_square(&self, cost: f64) -> f64 {
        let phases = self.observations.scans.iter().filter(|scan| scan.phase.is_some());
        let of_scan = |scan: &ObservedScan| -> usize {
            let drives = scan.drives.iter();
            drives
                .map(|drive| {
                    (0..drive.visits.len()).filter(|&n| tells_phase(scan, drive, n)).count()
                })
                .sum()
        };
        let told = phases.map(of_scan).sum::<usize>() as f64;
        (cost + told) / (self.observations.len() as f64 + told)
    }

    fn cost_unchanged(&self, observations: &Observations) -> f64 {
        cost_on(observations, &Fit::of_nothing(self.unchanged()), &self.context)
    }

    fn ranked(&self, judgement: &Judgement) -> Vec<ChangeCandidate> {
        let listed =
            judgement.named.iter().map(|number| number + 1).fold(MOST_CANDIDATES, usize::max);
        let held_out = HeldOut::of(&self.observations);
        let count = held_out.kept_out.len() as f64;
        let before = self.cost_unchanged(&held_out.kept_out) - count;
        self.scored
            .par_iter()
            .take(listed)
            .enumerate()
            .map(|(number, set)| {
                let after = self.cost_held_out(&held_out, &set.fit) - count;
                let explained_fraction = match before > 0.0 {
                    true => (1.0 - after.max(0.0) / before).clamp(0.0, 1.0),
                    false => 0.0,
                };
                let (parameters, readings) = self.parameters(&set.fit);
                ChangeCandidate {
                    effects: set.fit.ids(),
                    probability: (1.0 - ANOTHER_CAUSE) * judgement.probabilities[number],
                    log_evidence: set.log_evidence - self.scored[0].log_evidence,
                    parameters,
                    readings,
                    level: self.level(&set.fit),
                    chi_square: self.chi_square(set.fit.cost),
                    explained_fraction,
                }
            })
            .collect()
    }

    /// The cost of a fit, repeated on the training points, on those that were kept out.
    fn cost_held_out(&self, held_out: &HeldOut, of: &Fit) -> f64 {
        let start = Start {
            instances: of.instances.clone(),
            values: of.values.clone(),
            spreads: of.spreads.clone(),
            nuisance: Some(of.nuisance.clone()),
        };
        let few = Stopping { iterations: 3, step: 1e-2, fall: 1e-6, carried: CARRIED };
        let again = fit(&held_out.training, &self.context, start, few);
        cost_on(&held_out.kept_out, &again, &self.context)
    }

    /// What changed, and in words, one clause an effect.
    fn parameters(&self, fit: &Fit) -> (BTreeMap<String, ParameterChange>, Vec<String>) {
        let mut parameters = BTreeMap::new();
        let mut clauses = Vec::new();
        let error = |index: usize| {
            fit.covariance.as_ref().map_or(f64::NAN, |covariance| covariance[(index, index)].sqrt())
        };
        let of_instances = fit.instances.iter().zip(&fit.values).zip(fit.ranges());
        for (((instance, values), range), spread) in of_instances.zip(&fit.spreads) {
            let errors: Vec<f64> = range.map(error).collect();
            let mut of_effect = self.changes(instance, values, &errors, *spread);
            clauses.push(clause(&Clause {
                id: instance.effect.id(),
                changes: &of_effect,
                reading_unit: &self.records[1].setup.unit,
            }));
            let id = instance.effect.id();
            while let Some((name, change)) = of_effect.pop_first() {
                parameters.insert(format!("{id}.{name}"), change);
            }
        }
        (parameters, clauses)
    }

    /// The parameters of one effect in A and in B. What A's model has of the same effect is where it starts from.
    fn changes(
        &self,
        instance: &Instance,
        values: &[f64],
        errors: &[f64],
        spread: f64,
    ) -> BTreeMap<&'static str, ParameterChange> {
        let effect = instance.effect;
        let neutral = effect.neutral();
        let random = neutral.len() != values.len();
        let known = self.context.common.iter().flat_map(|common| &common.effects);
        let before = known
            .filter(|(other, known)| {
                other.effect.id() == effect.id() && known.len() == values.len()
            })
            .filter(|_| !random && effect.id() != EffectId::Offset)
            .map(|(_, known)| known.clone())
            .next()
            .unwrap_or_else(|| if random { vec![0.0; values.len()] } else { neutral.clone() });
        // Ratios multiply, and all else adds up.
        let after: Vec<f64> = match random {
            true => values.to_vec(),
            false => (0..values.len())
                .map(|n| match neutral[n] == 1.0 {
                    true => before[n] * values[n],
                    false => before[n] + values[n] - neutral[n],
                })
                .collect(),
        };
        let describe = |values: &[f64], errors: &[f64], spread: Option<Estimate>| {
            let estimates = values.iter().zip(errors);
            let estimates = estimates.map(|(&value, &error)| Estimate { value, error });
            let estimates: Vec<Estimate> = estimates.chain(spread).collect();
            effect.describe(&estimates, &instance.choice, &self.context).parameters
        };
        // A spread from n draws has a relative error of 1/√(2n).
        let of_spread =
            |value: f64| Estimate { value, error: value / (2.0 * values.len() as f64).sqrt() };
        let spread_after = random.then(|| of_spread(spread));
        let spread_before = random.then(|| of_spread(0.0));
        let mut of_a = describe(&before, &vec![0.0; before.len()], spread_before);
        let of_b = describe(&after, errors, spread_after);
        of_b.into_iter()
            .map(|(name, after)| {
                let before = of_a.remove(name);
                (name, parameter_change(before, after))
            })
            .collect()
    }
}

fn parameter_change(before: Option<FittedParameter>, after: FittedParameter) -> ParameterChange {
    let number = |parameter: &FittedParameter| match parameter {
        FittedParameter::Real { value, .. } if value.is_finite() => Some(*value),
        _ => None,
    };
    let before = before.as_ref().and_then(number);
    let change = match (&after, before) {
        (FittedParameter::Real { value, standard_error }, Some(before)) => {
            Some(Uncertain { value: value - before, standard_error: *standard_error })
        }
        _ => None,
    };
    ParameterChange { before, after, change: change.filter(|change| change.value.is_finite()) }
}
