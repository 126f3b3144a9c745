//! A set of effects fitted to the readings by nonlinear least squares.
//!
//! - [`joint_fit`]: the fit of a set, gain, shift and near field beside it.
//! - [`layout`]: the order of its numbers.
//! - [`problem`]: its residuals and derivatives.
//! - [`nearly_linear`]: where it begins if single elements depart.
//! - [`random_elements`]: amplitudes or phases that differ from element to element, their spread found with them.
//! - [`departures`]: those of the set-up within its stated uncertainty, and what their freedom costs.
//! - [`left`]: what it leaves, and how likely that is beside a noise that is not known exactly.
//! - [`any`]: either kind of set.
//! - [`score_statistic`]: what the readings say of an effect before it is fitted.

pub mod any;
pub mod departures;
pub mod directions;
pub mod joint_fit;
pub mod kept_value;
pub mod layout;
pub mod left;
mod nearly_linear;
pub mod outstanding_elements;
pub mod problem;
pub mod random_elements;
pub mod score_statistic;
pub mod slopes;
