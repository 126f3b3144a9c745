//! The noise of a scan, from dark readings, repeats, and the residuals of a fit.
//!
//! - [`repeats`]: readings of one place that were taken again.
//! - [`by_direction`]: the play or the lag that these show.
//! - [`judge`]: the scatter that dark readings and repeats show, and what the residuals add.
//! - [`fluctuating`]: whether all readings together show a fluctuating field.
//! - [`slow`]: slow noise of the level, along the time of a scan.
//! - [`settle`]: the scatter of every scan, given a forward model.

pub mod by_direction;
pub mod fluctuating;
pub mod judge;
pub mod outliers;
pub mod repeats;
pub mod settle;
pub mod slow;
