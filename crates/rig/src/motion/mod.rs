//! Robots: what every driver is held to ([`guarded`], [`travel`]), ways round ([`route`]), and the drivers.

mod advice;
pub(crate) mod auto;
mod firmware_table;
pub mod grbl;
pub mod guarded;
mod home_line;
pub mod klipper;
pub(crate) mod limits;
pub mod marlin;
pub mod route;
pub mod travel;

pub use advice::Advice;
pub use firmware_table::FirmwareKeys;
pub use home_line::HomeLine;
