//! A plan run on a rig, its record kept safe: the rig file, the check before anything moves, the sequencer that
//! drives the three devices point by point, and the return to a scan that ended early.

mod air_log;
pub mod beam_axis;
mod clock;
mod drift;
mod dry_run;
mod error;
mod event;
#[cfg(test)]
mod fault_injection_tests;
mod fly;
mod hook;
mod monitor;
mod open;
mod origin;
mod pause;
mod placement;
mod planned_scan;
mod references;
mod replay_wire;
mod rig_setup;
mod rows;
mod scan_run;
mod sequencer;

pub use air_log::FILE as AIR_FILE;
pub use dry_run::{DryRun, dry_run, room_for};
pub use error::AcquisitionError;
pub use event::{Event, EventSink};
pub use fly::FlightFault;
pub use monitor::Monitor;
pub use open::{OpenSimulated, SimulatedDevices};
pub use pause::{Pause, PauseSwitch};
pub use planned_scan::PlannedScan;
pub use references::RigChange;
pub use replay_wire::replay_wire;
pub use rig_setup::RigSetup;
pub use scan_run::{Ending, ScanRun};
pub use sequencer::element_delays;
