//! The gap between a scan and its simulation: the two are registered to each other, then compared
//! height by height.
//!
//! *Registration* finds how the coordinates and the unit of the scan relate to those of the
//! simulation; it may explain what a careful setting-up of the robot would have removed (a gain, a
//! shift, a mirrored axis) and nothing else. What is left after it is the gap.
//!
//! [`compare`] is the way in; one scan goes through these, in order:
//!
//! | file | what it does |
//! |---|---|
//! | `readings` | lays the driven readings beside what the simulator is asked for them |
//! | `register` | chooses between the coordinates as recorded and another pose |
//! | `coarse`, `pose_search` | find a pose from nothing: a coarse grid, then rounds of refinement |
//! | `refine` | the least-squares fit of a [`Pose`], the gain solved for at each step |
//! | `receiver_face` | lets the gain fall off with the angle of arrival, where that explains what a pose cannot |
//! | `identifiability`, `standard_errors` | what the readings fix, how well, and what they leave open |
//! | `noise`, `figures`, `agreement` | the noise, the figures of each height with their errors, correlation and residual |
//! | `comparison`, `registration`, `table` | the result as data, as text and as CSV |
//! | `closing` | how the gap shrinks once a set-up is corrected |

mod agreement;
mod closing;
mod coarse;
mod compare;
mod comparison;
mod figures;
mod identifiability;
mod noise;
mod pose;
mod pose_search;
mod readings;
mod receiver_face;
mod refine;
mod register;
mod registration;
mod standard_errors;
mod table;

pub use closing::{Closing, Gaps, PlaneClosing};
pub use compare::{Incomparable, compare, register_scan};
pub use comparison::{
    Agreement, ComparedMap, Comparison, Discrepancy, FieldFigures, FocalRadiusFigure, Noise,
    NoiseSource, PlaneComparison, Uncertain,
};
pub use pose::{Mirror, Pose};
pub use registration::{
    Estimate, Registering, Registration, TriedRegistration, UndeterminedCombination,
};
