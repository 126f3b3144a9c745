//! The gap between a scan and its simulation: the two are registered to each other, then compared
//! height by height.
//!
//! *Registration* finds how the coordinates and the unit of the scan relate to those of the
//! simulation; it may explain what a careful setting-up of the robot would have removed (a gain, a
//! shift, a mirrored axis) and nothing else. What is left after it is the gap.

mod agreement;
mod coarse;
mod compare;
pub mod comparison;
mod figures;
mod identifiability;
mod levenberg_marquardt;
mod noise;
pub mod pose;
mod pose_search;
pub mod readings;
pub mod refine;
pub mod register;
pub mod registration;
mod standard_errors;
mod table;

pub use compare::{Incomparable, compare};
pub use comparison::{
    Agreement, ComparedMap, Comparison, Discrepancy, FieldFigures, FocalRadiusFigure, Noise,
    NoiseSource, PlaneComparison, Uncertain,
};
pub use pose::{Mirror, Pose};
pub use registration::{
    Estimate, Registering, Registration, TriedRegistration, UndeterminedCombination,
};
