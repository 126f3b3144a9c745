//! A rig that chooses its next readings by what they would tell, until the cause of a gap is known.
//!
//! A plan with `[closed_loop]` names a box and a budget in place of points. [`Inquiry`] plans a first round, spread evenly. After each round
//! it searches for the cause (`fieldgap_diagnosis`), and chooses the readings of the next round: those that would tell the sets of effects
//! that are left apart, per second of this robot. When one set is certain the set-up is corrected in new files ([`Cure`]), and these are
//! tested on fresh readings. [`Round`] is what was decided, and why.
//!
//! The scan itself is one of `fieldgap_acquisition`: its plan grows at its end, so that all that holds of scans holds here.

mod again;
mod batch;
mod budget;
mod cure;
mod decision;
mod drives;
mod flights;
mod information;
mod inquiry;
mod log;
mod obtained;
mod places;
mod plan_text;
mod robot;
mod round;
mod route;
mod searches;

pub use again::again;
pub use budget::{Budget, Spent, UsedUp};
pub use cure::Cure;
pub use inquiry::{Decision, Inquiry, InquiryError};
pub use log::{LoggedRound, RoundsError, parse_log, read_log, write_log};
pub use obtained::obtained_bits;
pub use plan_text::{in_closed_loop, with_readings};
pub use robot::{Planned, Robot};
pub use round::{
    Corrected, End, FILE as ROUNDS_FILE, Likely, Purpose, Round, Verification, parse_rounds,
    read_rounds, verified,
};
pub use route::route;
