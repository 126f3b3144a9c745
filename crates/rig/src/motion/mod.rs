//! Robots: what every driver is held to ([`guarded`], [`travel`](crate::travel)), ways round ([`route`]), and the drivers.

mod advice;
pub(crate) mod auto;
mod firmware;
mod firmware_table;
mod g_code;
pub mod grbl;
pub mod guarded;
pub mod klipper;
pub(crate) mod limits;
pub mod marlin;
pub(crate) mod observed;
pub mod route;

pub use advice::Advice;
pub use firmware_table::FirmwareKeys;
pub use g_code::HomeLine;
