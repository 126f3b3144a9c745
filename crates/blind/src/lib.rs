//! How good diagnoses are, on scans whose causes nobody knows who diagnoses.
//!
//! A set is made, diagnosed and scored, one after the other:
//!
//! | step | what it does |
//! |---|---|
//! | [`SetToMake::make`] | draws a laboratory and its causes for every scan, and writes what is read there |
//! | [`Seal::close`] | locks the answers away and commits to them and to every scan |
//! | [`Run`] | diagnoses every scan; it never opens the seal |
//! | [`Seal::open`], [`Score`] | compares the diagnoses with the answers, beside targets and 95 % intervals |
//!
//! Beside these, [`seal_truth()`] withholds what is true behind a virtual rig from whoever scans it.
//!
//! The scans come from vibrating pistons, summed by their Rayleigh integrals with the virtual rig's effects, so the
//! model that diagnoses is not the one that made them. Effects are as often as one another; their sizes are uniform in the
//! logarithm of the gap that they leave. The simulator's own defects (`phase-plane`, `on-axis-unit`) are in no set: no world
//! has them, and they arise only with the simulator as it was written.

mod answer;
mod assignment;
mod carriage;
mod catalogue;
mod causes;
mod dice;
mod error;
mod laboratory;
mod make;
mod noise_units;
mod outside;
mod run;
mod said;
mod score;
mod seal;
mod seal_truth;
mod sizing;
mod survey;
mod world;

pub use answer::{Answer, Answers};
pub use assignment::{Category, Shares};
pub use error::BlindError;
pub use make::SetToMake;
pub use run::{Diagnosed, Run};
pub use said::{Said, SaidCandidate, SaidParameter, SaidVerdict};
pub use score::{
    Calibration, CalibrationBin, ConfusionRow, Figure, ParameterScore, Rate, Score, Target,
    VerdictRow,
};
pub use seal::{Seal, fresh_seed};
pub use seal_truth::seal_truth;
