//! Why a scan and its simulation differ: where the gap lies, which unmodelled effect causes it, and how far it shrinks once that
//! effect is added.
//!
//! Begin with [`diagnose`], which takes recorded scans and gives a [`Diagnosis`]; [`Diagnosis::to_text`] prints it, and serde writes it
//! as JSON. [`diagnose_with`] tries a part of the catalogue. [`EffectId`] names the effects of the catalogue. [`alike_effects`] tells which of them a scan can separate at all.
//!
//! ```
//! use fieldgap_acoustics::Simulator;
//! use fieldgap_diagnosis::{EffectId, Remedy};
//!
//! let effect: EffectId = "backlash".parse()?;
//! let Remedy::Manual(what_to_do) = effect.remedy(Simulator::Piston) else {
//!     panic!("no set-up file has a key for play")
//! };
//! assert!(what_to_do.starts_with("remove the play from the robot"));
//! # Ok::<(), fieldgap_diagnosis::UnknownEffect>(())
//! ```
//!
//! The example `diagnose_a_record` makes a scan whose air is warmer than believed, and diagnoses it.
//!
//! # What happens to the readings
//!
//! A diagnosis is a model comparison. Readings are compared with what a forward model of the measurement expects, once for the set-up
//! as believed and once for each set of effects worth a fit. The phases are rooms of this crate; each uses only rooms above it in this
//! table.
//!
//! | phase | what happens | where |
//! |---|---|---|
//! | statistics | Mean, variance and likelihood of noisy magnitudes, without a field. | `statistics` |
//! | model | Readings become observations: position, velocity, direction and time of each. The forward model follows the chain from the drive to the reading; effects change its links. Residuals are measured minus expected, in standard deviations. | `model`, `effects` |
//! | noise | Dark readings and repeats give the noise of a reading: additive, proportional, a floor, a fluctuation of the field. The residuals of a good fit refine it. | `noise` |
//! | fit | A set of effects is fitted by nonlinear least squares, with the gain, a small shift and the near field of each scan free. Derivatives are difference quotients of the forward model, carried along between steps that they predict well. | `fit` |
//! | selection | Sets grow by one effect at a time. The evidence (the likelihood integrated over the parameters, by Laplace's method) decides which sets are kept, exchanged and extended. | `selection` |
//! | joint | Where no set of few effects explains the readings: all effects at once, each with a prior whose width the evidence chooses. | `joint` |
//! | elements | Where no set explains dense planes of a scan: gain, phase, place and lean of each element, fitted by the calibration to all readings, and what is left of blocks that it did not see. | `elements_account` |
//! | residual structure | What the best set leaves is tested for patterns, and for causes that the catalogue does not have. | `residual_structure` |
//! | verdict | Probabilities of the sets, the size of the gap, and its shares by height, region and kind. | `verdict` |
//! | advice | The scan that would separate the rivals best, and which effects a scan can separate at all. | `advice` |
//! | report | The result, put together and in words. | `report`, `text` |
//! | change | What changed between two records: the same phases on the readings of the second, less what the first leaves unexplained. | `change` |
//!
//! `diagnose.rs` runs the phases in this order; noise, fit and selection are repeated until they agree. Everything that decides
//! something has its value, reason and source in `limits.rs`.
//!
//! # An effect
//!
//! One file in `effects` holds all that an effect is: its physics with formula and source, parameters and priors, where it acts, what it
//! is mistaken for, what shows it without a scan, and what corrects it. The trait `Effect` in `model/effect.rs` lists the points of the
//! chain where an effect may act. A test compares each with the virtual rig's effect of the same name, which was written
//! independently.

mod advice;
mod change;
mod decisive_limit;
mod diagnose;
mod effect_id;
mod effects;
mod elements_account;
mod fit;
mod fitted_parameter;
mod joint;
mod limits;
mod model;
mod noise;
mod preparation;
mod remedy;
mod report;
mod residual_structure;
mod result;
mod selection;
mod statistics;
mod text;
mod verdict;

pub use advice::distinguish::{
    AlikeEffects, alike_effects, alike_effects_by_amplitudes, are_alike,
};
pub use advice::found_field::{Departure, FieldSamples, FoundField, Received};
pub use advice::outlook::{Outlook, PossibleReading};
pub use change::{
    ChangeCandidate, ChangeDiagnosis, ChangeVerdict, CommonModel, NoChangeDiagnosis,
    ParameterChange, RecordName, diagnose_change, diagnose_change_by_amplitudes,
};
pub use decisive_limit::{DecisiveLimit, VariedLimit};
pub use diagnose::{Findings, LiveSets, Options, diagnose, diagnose_with};
pub use effect_id::{EffectId, UnknownEffect, joined};
pub use fitted_parameter::FittedParameter;
pub use limits::decisive_limits;
pub use remedy::{Remedy, SetupKey};
pub use result::{
    Candidate, DiagnosedPlane, Diagnosis, ElementFault, ElementsAccount, ElementsSpread, HeldOutBy,
    KindShares, NextMeasurement, PhaseFigures, PlaneShare, Region, RegionShare, Remainder,
    ResidualTest, StatedFinding, Verdict, WaterfallPart, WaterfallStep, Where, WithinUncertainty,
};
pub use text::Standing;
pub use verdict::fresh::{CorrectedTest, FreshTest};
