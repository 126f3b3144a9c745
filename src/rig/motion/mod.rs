//! Robots: what every driver is held to ([`guarded`], [`travel`]), ways round ([`route`]), and the drivers.

pub mod guarded;
pub mod marlin;
pub mod route;
pub mod travel;
