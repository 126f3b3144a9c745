//! The forward model: what the receiver should read, given a set-up and the effects added to it.
//!
//! - [`observations`]: the readings of one or several scans, each with where and when it was taken.
//! - [`phases`]: measured minus expected phases.
//! - [`wandering_reference`]: the reference of the phases, taken out of what is left of them.
//! - [`planes`]: readings of one height, and the step between neighbours.
//! - [`effect`]: the trait that an effect implements: where it acts, and how it is looked for.
//! - [`instance`]: an effect with the numbers at which it acts.
//! - [`nuisance`]: gain, shift, near field and departures of the set-up, which are free in every fit.
//! - [`stated_uncertainty`]: the departures that a record allows its set-up.
//! - [`pressure`]: the pressure at a reading, its steady and its random part.
//! - [`waves`]: the waves of the elements, for drives that follow one another at the same places.
//! - [`forward_model`]: the pressures under a set of effects.
//! - [`receiver`]: what the receiver makes of a pressure.
//! - [`residuals`]: measured minus expected, in standard deviations, and the likelihood.

pub mod effect;
pub mod forward_model;
pub mod instance;
pub mod mirror;
pub mod motion;
pub mod nuisance;
pub mod observations;
pub mod phases;
pub mod planes;
pub mod pressure;
pub mod receiver;
pub mod residuals;
pub mod stated_uncertainty;
pub mod wandering_reference;
pub mod waves;
