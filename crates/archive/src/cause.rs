//! What a diagnosis says of a record, as numbers that can be followed from record to record.

use std::collections::BTreeMap;

use fieldgap_diagnosis::{Diagnosis, EffectId, FittedParameter, Verdict};
use fieldgap_text::Uncertain;
use serde::{Deserialize, Serialize};

/// The cause of a gap.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CauseFigures {
    /// The judgement.
    pub verdict: Verdict,
    /// The named effects; empty unless the verdict names a cause.
    pub effects: Vec<EffectId>,
    /// Probability of the account that the diagnosis stands for, 0 to 1: the named one, else the most probable.
    pub probability: f64,
    /// Fitted parameters of the named effects as `effect.parameter`, in the unit at the end of the name. Of a complex number, `.re` and
    /// `.im`. Lists of elements and values for each element are left out: the diagnosis itself has them.
    pub parameters: BTreeMap<String, Uncertain>,
}

impl CauseFigures {
    /// Those of a diagnosis.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let best = diagnosis.best();
        let named = best.filter(|_| diagnosis.verdict.names_a_cause());
        let mut parameters = BTreeMap::new();
        for (name, parameter) in named.into_iter().flat_map(|candidate| &candidate.parameters) {
            match parameter {
                FittedParameter::Real { value, standard_error } => {
                    let (value, standard_error) = (*value, *standard_error);
                    parameters.insert(name.clone(), Uncertain { value, standard_error });
                }
                FittedParameter::Complex { value, standard_error } => {
                    for (part, (value, standard_error)) in
                        ["re", "im"].into_iter().zip(value.iter().zip(*standard_error))
                    {
                        let part_of = Uncertain { value: *value, standard_error };
                        parameters.insert(format!("{name}.{part}"), part_of);
                    }
                }
                FittedParameter::Word { .. }
                | FittedParameter::Elements { .. }
                | FittedParameter::Each { .. } => {}
            }
        }
        Self {
            verdict: diagnosis.verdict,
            effects: diagnosis.effects.clone(),
            probability: best.map_or(f64::NAN, |candidate| candidate.probability),
            parameters,
        }
    }
}
