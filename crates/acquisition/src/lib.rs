//! A plan run on a rig, its record kept safe: the rig file, the check before anything moves, the conductor that
//! drives the three devices point by point, and the return to a scan that ended early.

mod air_log;
mod attendant;
pub mod beam_axis;
mod clock;
mod conductor;
mod drift;
mod dry_run;
mod error;
mod event;
mod flight;
mod fly;
mod hook;
mod lab;
mod open;
mod origin;
mod pause;
mod plan_on_rig;
mod references;
mod replay_wire;
mod rows;
mod session;
#[cfg(test)]
mod troubled_tests;

pub use air_log::FILE as AIR_FILE;
pub use attendant::Attendant;
pub use conductor::element_delays;
pub use dry_run::{DryRun, dry_run, room_for};
pub use error::CampaignError;
pub use event::{Event, Watch};
pub use fly::FlightFault;
pub use lab::Lab;
pub use open::{OpenRig, open_virtual};
pub use pause::{Pause, PauseSwitch};
pub use plan_on_rig::Campaign;
pub use references::Moved;
pub use replay_wire::replay_wire;
pub use session::{Ending, Session};
