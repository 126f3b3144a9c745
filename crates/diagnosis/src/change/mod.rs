//! What changed between two records of one rig: which effect's parameters differ.
//!
//! # The problem
//!
//! Neither record agrees with its simulation: both have a gap, of causes that are not known and are the same in both. The question is about
//! the difference. Reading B times the ratio of two simulated fields would predict it only where the field is strong; at a null the ratio is
//! anything. To diagnose each record and to subtract the results is no better: what is left of each gap counts twice, and a change of half a
//! percent drowns in it.
//!
//! # The method
//!
//! Readings are taken in pairs, of A and of B, at one place under one drive (`pairs`). On the scale on which readings scatter by one
//! everywhere (`NoiseScale`) the pair is
//!
//! - A: z(m(x; θ)) + d(x) + noise
//! - B: z(m(x; θ, δ)) + d(x) + noise
//!
//! with m the simulated reading, θ the effects that both have, δ the change, and d the discrepancy of the model at the place, the same in both
//! (M. C. Kennedy and A. O'Hagan, "Bayesian calibration of computer models", J. R. Stat. Soc. B 63, 425, 2001). A flexible model of A gives
//! θ (`model_of_both`); then B less d = z(A) - z(m(x; θ)) is diagnosed by the usual phases, with θ held and the noise of both readings. On this scale
//! d is a factor where the field is strong and an amount where it is weak, as errors of a model are. An error of θ cancels to first order:
//! it changes the signature of δ, and not the difference that no change would leave.
//!
//! Positions repeat from record to record, so the shift and the near field of a scan are held: an offset is a change like others. The
//! level of B is free beside every candidate.
//!
//! Where both records have phases, those of B less d = φ(A) - φ(m(x; θ)) are diagnosed beside the readings. Their noise is that of both, found from
//! B's phases less those of A; constants and drifts of the two references are one free constant and one drift. θ is found from the amplitudes: a
//! model that is off by a tenth of a radian is good enough for the signature of a change, and would leave much of precise phases.
//!
//! # What is tried
//!
//! Every effect but the simulator's own defects; amplitude or phase of one element alone (`effects::one_element`); pairs of the best
//! (`search`). Evidence, rivals and tests of the residual are those of a diagnosis.

mod model_of_both;
mod noise;
mod pairs;
mod report;
mod result;
mod search;
mod text;
mod words;

use fieldgap_acoustics::Simulator;
use fieldgap_comparison::{Incomparable, has_phases};
use fieldgap_records::RecordedScan;

use self::model_of_both::ModelOfA;
use self::noise::{MostNoise, noise_left};
use self::pairs::Pairs;
use self::report::Report;
pub use self::result::{
    ChangeCandidate, ChangeDiagnosis, ChangeVerdict, CommonModel, ParameterChange, RecordName,
};
use self::search::searched;
use crate::limits::{FEWEST_PAIRS, FEWEST_READINGS, MOST_ELEMENT_READINGS, MOST_PAIRS};
use crate::model::effect::Context;
use crate::model::forward_model::ForwardModel;
use crate::model::observations::Observations;
use crate::model::phases::PhaseMeaning;
use crate::model::stated_uncertainty::StatedUncertainty;
use crate::noise::settle::settle_scatter;
use crate::preparation::Prepared;

/// Why a change cannot be diagnosed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoChangeDiagnosis {
    /// A record cannot be compared with its simulation, or the arrays differ.
    #[error(transparent)]
    Incomparable(#[from] Incomparable),
    /// There are too few common places.
    #[error(
        "`{a}` and `{b}` have {pairs} pairs of readings at one place under one drive; to tell what changed takes {FEWEST_PAIRS}: record both \
         by one plan"
    )]
    TooFewCommon {
        /// Name of the first record.
        a: String,
        /// Name of the second record.
        b: String,
        /// Pairs.
        pairs: usize,
    },
}

/// Diagnoses what changed from record `a` to record `b`. The same records give the same bits.
///
/// Both are held against one simulation: that of A's set-up by `simulator`, driven as each was. Without it, it is that of the transducers that the
/// array's file names, or of pistons, and not A's own: what is sought is what changed, and a simulator with defects has wrong signatures.
/// A plan of 5000 readings and 36 elements takes seconds. The records need common places: readings of B at places that A does not have are left out.
///
/// # Errors
/// [`NoChangeDiagnosis`].
pub fn diagnose_change(
    a: &RecordedScan,
    b: &RecordedScan,
    simulator: Option<Simulator>,
) -> Result<ChangeDiagnosis, NoChangeDiagnosis> {
    diagnosed(a, b, simulator, true)
}

/// As [`diagnose_change`], by the amplitudes alone.
///
/// # Errors
/// [`NoChangeDiagnosis`].
pub fn diagnose_change_by_amplitudes(
    a: &RecordedScan,
    b: &RecordedScan,
    simulator: Option<Simulator>,
) -> Result<ChangeDiagnosis, NoChangeDiagnosis> {
    diagnosed(a, b, simulator, false)
}

fn diagnosed(
    a: &RecordedScan,
    b: &RecordedScan,
    simulator: Option<Simulator>,
    use_phases: bool,
) -> Result<ChangeDiagnosis, NoChangeDiagnosis> {
    let simulator = simulator.unwrap_or(Simulator::Transducer);
    let with_phases = use_phases && has_phases(a) && has_phases(b);
    let prepared = Prepared::of_one_pose(&[a.clone(), b.clone()], Some(simulator), with_phases)?;
    let most = (MOST_ELEMENT_READINGS / prepared.observations.elements()).max(FEWEST_READINGS);
    let pairs = Pairs::of(a, b, prepared.simulator, &prepared)?.thinned(most.min(MOST_PAIRS));
    let Pairs { a: mut of_a, b: mut of_b, left_out } = pairs;
    // Both records are of one set-up, whatever it is.
    let context = Context { stated: StatedUncertainty::default(), ..prepared.context };
    let phase = taken_off(&mut of_a).zip(taken_off(&mut of_b)).map(|(a, b)| PhaseMeaning {
        drift_u_rad: a.drift_u_rad.hypot(b.drift_u_rad),
        moves_rad: a.moves_rad.hypot(b.moves_rad),
        each_drive: a.each_drive || b.each_drive,
        ..b
    });
    // The gain by which A's readings become those of B, without regard to what changed.
    let (readings_a, readings_b) = (of_a.readings(), of_b.readings());
    let product: f64 = readings_a.iter().zip(&readings_b).map(|(a, b)| a * b).sum();
    let gain = product / readings_a.iter().map(|a| a * a).sum::<f64>();
    let most = MostNoise::of_difference(&of_a, &of_b, gain);
    let model = ModelOfA::of(&mut of_a, most.map(|[a, _]| a), &context);
    let common = Context { common: Some(model.common()), ..context };
    judge_noise_of_b(&of_a, &mut of_b, &model, gain, &common);
    if let Some([_, of_b_at_most]) = most {
        of_b_at_most.hold(&mut of_b.scans[0]);
    }
    let apart = Context { common: None, ..common.clone() };
    let mut observations = model.beside(&of_a, &of_b, gain, phase, &apart);
    let mut scored = searched(&observations, &common);
    if let Some(factor) = noise_left(&scored[0].fit, &observations, [&of_a, &of_b], &common) {
        for of in [&mut of_a, &mut of_b] {
            let scatter = of.scans[0].scatter.clone();
            of.scans[0].set_scatter(scatter.times(factor));
        }
        observations = model.beside(&of_a, &of_b, gain, phase, &apart);
        scored = searched(&observations, &common);
    }
    let noise = of_b.scans[0].scatter.clone();
    let report = Report {
        records: [a, b],
        simulator: prepared.simulator,
        observations,
        context: common,
        model,
        scored,
        noise,
        left_out,
    };
    Ok(report.build())
}

/// What the phases of the one scan mean; without that they are not looked at.
fn taken_off(of: &mut Observations) -> Option<PhaseMeaning> {
    of.scans[0].phase.take()
}

/// The scatter of B by its own repeats and dark readings; where it has none, that of A at the gain.
fn judge_noise_of_b(
    of_a: &Observations,
    of_b: &mut Observations,
    model: &ModelOfA,
    gain: f64,
    common: &Context,
) {
    let nuisance = model.nuisance(gain);
    let held = ForwardModel::of(&[], &[], common);
    settle_scatter(of_b, &held, &nuisance, common, false);
    let own = &of_b.scans[0];
    if own.scatter.is_told_by_repeats() {
        return;
    }
    let mut scatter = own.scatter.clone();
    scatter.share = of_a.scans[0].scatter.share;
    if own.dark.is_empty() {
        scatter.additive = gain * of_a.scans[0].scatter.additive;
    }
    of_b.scans[0].set_scatter(scatter);
}
