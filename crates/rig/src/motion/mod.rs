//! Robots: what every driver is held to ([`guarded`], [`travel`]), ways round ([`route`]), and the drivers.

mod advice;
pub mod auto;
pub mod grbl;
pub mod guarded;
pub mod marlin;
pub mod route;
pub mod travel;

pub use advice::Advice;
