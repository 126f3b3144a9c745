//! Robots: what every driver is held to ([`guarded`], [`travel`]), and the drivers.

pub mod guarded;
pub mod marlin;
pub mod travel;
