//! Why a scan and its simulation differ.

mod advice;
mod diagnose;
mod effect_id;
mod effects;
mod fit;
mod fitted_parameter;
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

pub use advice::distinguish::{AlikeEffects, alike_effects};
pub use diagnose::diagnose;
pub use effect_id::{EffectId, UnknownEffect, joined};
pub use fitted_parameter::FittedParameter;
pub use remedy::{Remedy, SetupKey};
pub use result::{
    Candidate, DiagnosedPlane, Diagnosis, KindShares, NextMeasurement, PlaneShare, Region,
    RegionShare, ResidualTest, Verdict, WaterfallStep, Where,
};
pub use text::Standing;
