//! The search for the set of effects that the readings speak for.
//!
//! - [`evidence`]: how much the readings speak for a set, whatever its parameters.
//! - [`scored_model`]: a fitted set with that evidence.
//! - [`phase_steps`]: where the search for the steps of a driver begins.
//! - [`quick_scores`]: what a change of some elements would cost.
//! - [`turned_drives`]: the same to first order, for small turns of all elements.
//! - [`starts`]: where the search for an effect begins.
//! - [`extension`]: sets, each extended by every other effect.
//! - [`model_search`]: the search from the believed set-up to the best set.

pub mod evidence;
pub mod extension;
pub mod model_search;
pub mod phase_steps;
pub mod quick_scores;
pub mod scored_model;
pub mod starts;
pub mod turned_drives;
