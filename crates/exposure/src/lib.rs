//! The sound level of an array where people are, against limits, and the minutes with the array driven that add up over a day.
//!
//! The level is simulated. Its absolute scale is that of a [`SourceLevel`]: a data sheet's, or that of a record whose receiver has a
//! known sensitivity. Without one, the level is unknown, and this is said.
//!
//! | file | what it holds |
//! |---|---|
//! | `section` | `[exposure]` of a rig file |
//! | `source` | the level of one element, and where it comes from |
//! | `assess` | the levels at the places, their uncertainty, and the limits |
//! | `text` | the result as text |
//! | `sounding` | the log of the times with the array driven |
//!
//! Begin with [`Exposure`] and [`assess`].

mod assess;
mod section;
mod sounding;
mod source;
mod text;

pub use assess::{Against, Assessment, Drives, PlaceLevel, Radiating, assess};
pub use section::{Exposure, ExposureTable, SourceStatement};
pub use sounding::{Sounding, SoundingError, SoundingLog, driven_s};
pub use source::{DataSheet, SourceLevel};
