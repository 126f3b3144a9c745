//! Data acquisition: runs a plan on a rig and records the readings safely.
//!
//! Begin with [`PlannedScan`], a plan with the [`RigSetup`] of a rig file; its [dry run](PlannedScan::dry_run) checks both
//! without opening a device. [`ScanRun`] runs the scan and resumes one that ended early; [`Event`] reports its progress and
//! [`Monitor`] raises alarms. [`beam_axis`] finds the axis of the array.
//!
//! This crate knows no virtual rig. Whoever starts a scan passes an [`OpenSimulated`] function, which may open
//! [`SimulatedDevices`].
//!
//! ```
//! use std::path::Path;
//!
//! use fieldgap_acquisition::PlannedScan;
//!
//! let scan = PlannedScan::read(Path::new("../../scans/quick-look.toml"), None)?;
//! let check = scan.dry_run()?;
//! assert_eq!(check.visits, 2 + 13 * 13);
//! assert!(check.about_s < 600.0);
//! # Ok::<(), fieldgap_acquisition::AcquisitionError>(())
//! ```

mod air_log;
pub mod beam_axis;
mod clock;
mod difference;
mod drift;
mod dry_run;
mod error;
mod event;
#[cfg(test)]
mod fault_injection_tests;
mod fly;
mod hook;
mod itinerary;
mod monitor;
mod open;
mod origin;
mod pause;
mod placement;
mod planned_scan;
mod recorded_setup;
mod references;
mod replay_wire;
mod rig_setup;
mod rows;
mod scan_run;
mod sequencer;
mod suspension;
mod transcript;
pub mod watchdog;

pub use dry_run::{DryRun, move_s, pass_s, reading_s};
pub use error::{AcquisitionError, FlightFault};
pub use event::{Event, EventSink};
pub use fly::lead_m;
pub use hook::{HookFault, TIME_LIMIT as HOOK_TIME_LIMIT, run_hook};
pub use monitor::Monitor;
pub use open::{OpenSimulated, SimulatedDevices, read_air};
pub use origin::original_rig;
pub use pause::{Pause, PauseSwitch};
pub use planned_scan::{PlannedScan, rig_of};
pub use references::RigChange;
pub use replay_wire::replay_wire;
pub use rig_setup::RigSetup;
pub use scan_run::{ChooseRounds, Ending, NextRound, NoNextRound, ScanRun};
pub use sequencer::element_delays;
pub use suspension::SuspensionClock;
pub use transcript::check_with_transcript;

// Written here, and read by whoever has the record.
pub use fieldgap_records::{AIR_FILE, AirRow};
