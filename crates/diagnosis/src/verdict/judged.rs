//! Sets of effects with their verdict; where no set of few effects explains a gap, of sets of many.
//!
//! Of many small effects some have rivals: other effects explain the readings as well in their place. The others are in every likely set. They are
//! named, with the share of the gap that they leave.

use crate::effect_id::EffectId;
use crate::fit::any::refined;
use crate::fit::joint_fit::{Fit, SEARCH};
use crate::joint::many_causes::{ManyCauses, of_many_causes, one_less};
use crate::limits::{CERTAIN, LEAST_SHARE_OF_MOST};
use crate::model::effect::Context;
use crate::model::observations::Observations;
use crate::residual_structure::ResidualStructure;
use crate::residual_structure::test::Test;
use crate::result::Verdict;
use crate::selection::model_search::{ModelSearch, in_question};
use crate::selection::scored_model::{ScoredModel, believed, best_first};
use crate::verdict::judgement::{Judgement, PartOf, judge, support};

/// Sets of effects, the best first, with the verdict.
pub(crate) struct Judged {
    pub scored: Vec<ScoredModel>,
    /// What the best leaves.
    pub structure: ResidualStructure,
    pub judgement: Judgement,
}

impl Judged {
    /// Judges scored sets, the best first.
    pub fn of(scored: Vec<ScoredModel>, observations: &Observations, context: &Context) -> Self {
        let base = believed_of(&scored, observations, context);
        let structure = ResidualStructure::of(&scored[0].fit, observations, context);
        let judgement = judge(observations, &scored, &base, &structure);
        Self { scored, structure, judgement }
    }

    /// Judges sets of many effects beside those of few, none of which explains the gap; `None` if no set of many does either. The readings come back
    /// with the noise that the set of many leaves.
    pub fn of_many(
        few: &[ScoredModel],
        observations: &Observations,
        context: &Context,
    ) -> Option<(Self, Observations)> {
        let base = believed_of(few, observations, context);
        let structure_of = |set: &ScoredModel, observations: &Observations| {
            let structure = ResidualStructure::of(&set.fit, observations, context);
            structure.tests.iter().map(Test::over_limit).fold(0.0, f64::max)
        };
        let ManyCauses { set, others, observations, noise_changed } =
            of_many_causes(&few[0], &base, observations, context, structure_of)?;
        let mut sets = match noise_changed {
            true => ModelSearch::fitted_to(in_question(few), &observations, context).scored,
            false => few.to_vec(),
        };
        sets.push(set.clone());
        let without_rivals = Self::of(best_first(sets.clone()), &observations, context);
        if !without_rivals.judgement.verdict.names_a_cause() {
            // Rivals of what explains nothing say nothing.
            return None;
        }
        sets.extend(one_less(&set, &observations, context));
        sets.extend(others);
        let judged = Self::of(best_first(sets), &observations, context);
        match judged.judgement.verdict {
            Verdict::Explained | Verdict::MostlyExplained => Some((judged, observations)),
            Verdict::Ambiguous => {
                Some((judged.with_common_part(&observations, context), observations))
            }
            Verdict::Unexplained | Verdict::None => None,
        }
    }

    /// Names the effects that all likely sets share, if these alone explain most of the gap.
    fn with_common_part(mut self, observations: &Observations, context: &Context) -> Self {
        let Self { scored, judgement, .. } = &self;
        let held = in_all_likely(scored, &judgement.probabilities);
        if held.is_empty() {
            return self;
        }
        let base = believed_of(scored, observations, context);
        let part = scored[0].fit.only(&held);
        let part = refined(part, observations, context, SEARCH, None);
        let n = observations.len() as f64;
        let excess = |fit: &Fit| (fit.cost - n).max(0.0);
        if excess(&part) > (1.0 - LEAST_SHARE_OF_MOST) * excess(&base.fit) {
            return self;
        }
        let rests = judgement.named.iter().map(|&number| {
            let mut rest = scored[number].fit.ids();
            rest.retain(|id| !held.contains(id));
            rest
        });
        let left_to = rests.filter(|rest| !rest.is_empty()).collect();
        // The part comes before them.
        let rivals = judgement.named.iter().map(|number| number + 1).collect();
        let probability = support(&held, scored, &judgement.probabilities);
        let structure = ResidualStructure::of(&part, observations, context);
        let part = ScoredModel { fit: part, unseen: 0.0, ..scored[0] };
        self.scored.insert(0, part);
        self.judgement.probabilities.insert(0, probability);
        let judgement = Judgement {
            verdict: Verdict::MostlyExplained,
            named: vec![0],
            rivals: 1,
            part_of: Some(PartOf { rivals, left_to }),
            ..self.judgement
        };
        Self { structure, judgement, ..self }
    }
}

/// The set-up as believed among these sets.
fn believed_of(
    scored: &[ScoredModel],
    observations: &Observations,
    context: &Context,
) -> ScoredModel {
    let none = scored.iter().find(|scored| scored.fit.instances.is_empty());
    none.cloned().unwrap_or_else(|| believed(observations, context))
}

/// The effects of the best set that are in almost every likely set.
fn in_all_likely(scored: &[ScoredModel], probabilities: &[f64]) -> Vec<EffectId> {
    let mut held = scored[0].fit.ids();
    held.retain(|id| support(&[*id], scored, probabilities) >= CERTAIN.get());
    held
}
