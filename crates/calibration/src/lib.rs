//! What each element of a phased array emits: gain and phase of every channel, from readings of coded drives at a few places or of planes.
//!
//! | to | begin with |
//! |---|---|
//! | choose drives and places | [`design::Design`] |
//! | take the readings of a recorded scan | [`CodedReadings`] |
//! | fit | [`calibrate()`], [`linear`] where readings are complex, [`plane`] where they are planes of one or a few drives |
//! | correct the drive | [`compensation`] |
//! | check on other readings | [`verification`] |
//! | hold two calibrations against each other | [`difference`] |

mod calibrate;
mod channels;
pub mod compensation;
pub mod design;
pub mod difference;
pub mod limits;
pub mod linear;
mod model;
pub mod plane;
mod readings;
mod retrieval;
pub mod verification;
mod warm_up;
mod wiring;

pub use calibrate::{Calibration, CalibrationError, Options, calibrate};
pub use model::{Setting, Weights};
pub use readings::{CodedReadings, Reading, ReadingNoise};
pub use retrieval::StartOutcome;
