//! The search for the set of effects that the readings speak for.
//!
//! - [`evidence`]: how much the readings speak for a set, whatever its parameters.
//! - [`scored_model`]: a fitted set with that evidence.
//! - [`phase_steps`]: where the search for the steps of a driver begins.
//! - [`quick_scores`]: what a change of some elements would cost.
//! - [`cost_by_gain`]: the cost after a refit of the gain.
//! - [`changed_readings`]: the same by a short formula, for thousands of changes.
//! - [`turned_drives`]: the same to first order, for small turns of all elements.
//! - [`starts`]: where the search for an effect begins.
//! - [`stray_waves`]: the same for planes and objects.
//! - [`walls`]: the same for walls.
//! - [`extension`]: sets, each extended by every other effect.
//! - [`model_search`]: the search from the believed set-up to the best set.

pub mod changed_readings;
pub mod cost_by_gain;
pub mod evidence;
pub mod extension;
pub mod model_search;
pub mod phase_steps;
pub mod quick_scores;
pub mod scored_model;
pub mod starts;
pub mod stray_waves;
pub mod turned_drives;
mod walls;
