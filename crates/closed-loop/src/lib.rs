//! A rig that chooses its next readings by what they would tell, until the cause of a gap is known.
//!
//! A plan with `[closed_loop]` names a box and a budget in place of points. [`Inquiry`] plans a first round, spread evenly. After each round
//! it searches for the cause (`fieldgap_diagnosis`), and chooses the readings of the next round: those that would tell the sets of effects
//! that are left apart, per second of this robot. When one set is certain it is tested on fresh readings. [`Round`] is what was decided, and
//! why.
//!
//! The scan itself is one of `fieldgap_acquisition`: its plan grows at its end, so that all that holds of scans holds here.

mod batch;
mod budget;
mod decision;
mod drives;
mod information;
mod inquiry;
mod log;
mod places;
mod plan_text;
mod robot;
mod round;
mod route;

pub use budget::{Budget, Spent, UsedUp};
pub use inquiry::{Inquiry, InquiryError};
pub use log::{LoggedRound, RoundsError, parse_log, read_log, write_log};
pub use plan_text::{in_closed_loop, with_readings};
pub use robot::{Planned, Robot};
pub use round::{End, Likely, Purpose, Round, Verification, parse_rounds, read_rounds};
pub use route::route;
