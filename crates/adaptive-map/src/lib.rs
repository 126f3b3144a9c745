//! Maps of a sound field with standard errors, from as few readings as they need.

mod batch;
mod diffuse;
mod estimate;
mod linear;
mod posterior;
mod prior;
mod sizes;
mod stationary;

pub use estimate::{Estimate, Foretold};
