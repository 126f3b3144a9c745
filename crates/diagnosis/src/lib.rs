//! Why a scan and its simulation differ: where the gap lies, which unmodelled effect causes it, how far it shrinks
//! once that effect is added.

mod account;
mod converter_steps;
mod course;
mod detection;
#[allow(clippy::module_inception)] // the module's one result
mod diagnosis;
mod distinguish;
mod effects;
mod element_order;
mod evidence;
mod extension;
mod fit;
mod flicker;
mod gap_size;
mod golden;
mod judgement;
mod levels;
mod likelihood;
mod maps;
mod next_measurement;
mod observations;
mod pair;
mod preparation;
mod problem;
mod promises;
mod pursuit;
mod random_elements;
mod rarity;
mod residual_tests;
mod scale;
mod scatter;
mod score_tests;
mod search;
mod silence;
mod stray_wave;
mod structure;
mod supposed;
mod text;

pub use diagnosis::{
    Candidate, DiagnosedPlane, Diagnosis, FittedParameter, KindShares, NextMeasurement, PlaneShare,
    Region, RegionShare, ResidualTest, Verdict, WaterfallStep, Where,
};
pub use text::Standing;

pub use course::diagnose;
pub use distinguish::{AlikeEffects, alike_effects};
