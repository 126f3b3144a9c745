//! Sound pressure levels: decibels, the sensitivity of a receiver, uncertainty budgets, and limits of exposure.
//!
//! ```
//! use fieldgap_level::{Budget, Kind, Line, level_db};
//!
//! // A reading of 30 mV by a receiver of 3 mV/Pa.
//! let level = level_db(30.0 / 3.0);
//! let budget = Budget::new(vec![
//!     Line::relative("receiver's sensitivity", Kind::B, 0.05),
//!     Line::relative("repeatability", Kind::A, 0.01),
//! ]);
//! assert_eq!(format!("{level:.1} dB ± {:.1} dB (k = 2)", budget.expanded_db()), "114.0 dB ± 0.9 dB (k = 2)");
//! ```
//!
//! | file | what it holds |
//! |---|---|
//! | `decibel` | levels and pressures |
//! | `sensitivity`, `response` | what a receiver reads at a sound pressure, also at an angle |
//! | `budget` | uncertainty budgets by the GUM |
//! | `calibrator` | a receiver's sensitivity from readings in a sound calibrator |
//! | [`usual`] | uncertainties that are taken where nobody stated one |
//! | `limits` | limits of exposure, and what a level with its uncertainty says of them |
//! | `people` | places of people and limits, as files state them |
//!
//! The GUM is JCGM 100:2008, *Evaluation of measurement data – Guide to the expression of uncertainty in measurement*. All pressures
//! are root mean squares in pascals. There is no field in this crate: what depends on one is computed by its callers.

mod budget;
mod calibrator;
mod decibel;
mod limits;
mod people;
mod response;
mod sensitivity;
pub mod usual;

pub use budget::{Budget, COVERAGE_FACTOR, Kind, Line};
pub use calibrator::{CalibratedReceiver, Calibrator, NoSensitivity, Relative};
pub use decibel::{DB_PER_NEPER, REFERENCE_PA, level_db, of_level_pa};
pub use limits::{Band, KnownLimit, Limit, Standing, UnknownLimit};
pub use people::{LimitTable, People, Place, PlaceTable, sound_level};
pub use response::{AngularResponse, NoResponse};
pub use sensitivity::{
    NoSuchUnit, Per, Reads, Sensitivity, SensitivityError, SensitivityKeys, Uncertainties,
};
