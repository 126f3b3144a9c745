//! Errors that keep a scan from starting or resuming.

mod flight_fault;

use super::references::RigChange;
use fieldgap_input::Fault;
use fieldgap_records::JournalError;
use fieldgap_rig::RigError;
pub(crate) use flight_fault::FLIGHTS;
pub use flight_fault::FlightFault;

/// Why a scan cannot start or resume.
///
/// A fault during a running scan is no error: the scan ends as partial, with the reason, and all readings are kept.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum AcquisitionError {
    /// A file is wrong.
    #[error(transparent)]
    #[diagnostic(transparent)]
    File(#[from] Fault),
    /// The record cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Journal(#[from] JournalError),
    /// A device cannot be opened.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Rig(#[from] RigError),
    /// The simulated devices of a virtual rig cannot be opened.
    #[error("{0}")]
    SimulatedDevices(Box<dyn std::error::Error + Send + Sync>),
    /// The watchdog process does not start.
    #[error("the watchdog does not start: {0}")]
    #[diagnostic(help(
        "the watchdog silences the array if this program is killed. It is the same program in a second process; check that the program file can be executed"
    ))]
    Watchdog(#[source] std::io::Error),
    /// The watchdog process was lost during a scan.
    #[error("the watchdog {reason}, and no other could be started within {} s", waited.as_secs())]
    #[diagnostic(help("find what ended it, such as a lack of memory; then resume the scan"))]
    Unguarded {
        /// Why it was lost, or why another does not start.
        reason: String,
        /// How long another was tried.
        waited: std::time::Duration,
    },
    /// The array controller drives another number of elements than the rig file describes.
    #[error(
        "the array controller drives {controller} elements, but the rig file describes {believed}"
    )]
    #[diagnostic(help("correct [array] in the rig file, or connect the array that it describes"))]
    OtherArray {
        /// Elements in the rig file.
        believed: usize,
        /// Elements that the controller reports.
        controller: usize,
    },
    /// The speed of sound cannot be computed from what the environment sensor reports.
    #[error(
        "the environment sensor reports {temperature_c} °C, {humidity_percent} % and {pressure_kpa} kPa; the speed of sound cannot be computed for such air"
    )]
    #[diagnostic(help(
        "check the sensor, or set `sound_speed = false` in [environment] of the rig file"
    ))]
    NoMedium {
        /// Temperature, °C.
        temperature_c: f64,
        /// Relative humidity, percent.
        humidity_percent: f64,
        /// Pressure, kPa.
        pressure_kpa: f64,
    },
    /// On resuming: the elements file that the rig file names describes another array.
    #[error("the array is not the one that the scan started with")]
    #[diagnostic(help("restore the elements file that the rig file names, or start a new scan"))]
    OtherSetUp,
    /// On resuming: the set-up in the record is not that of its plan and rig file.
    #[error("{} contradicts the plan and the rig file beside it: {}", path.display(), differences.join("; "))]
    #[diagnostic(help(
        "restore scan.toml from a copy: plan.toml and rig.toml in the same folder are what the scan was started with"
    ))]
    OtherRecord {
        /// The `scan.toml`.
        path: std::path::PathBuf,
        /// Each key that differs, with both values.
        differences: Vec<String>,
    },
    /// A row cannot be scanned in motion as the plan says.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Flight(#[from] FlightFault),
    /// On resuming: the truth file of a virtual rig has changed.
    #[error("the truth file {} has changed since the scan started", .0.display())]
    #[diagnostic(help("restore the truth file, or start a new scan"))]
    OtherTruth(std::path::PathBuf),
    /// On resuming: the rig file has changed.
    #[error("{} has changed since the scan started: {}", path.display(), changes.join("; "))]
    #[diagnostic(help(
        "undo the changes (only `port` and `baud` may differ), or start a new scan; the original is rig.toml in the scan's \
         folder"
    ))]
    OtherRig {
        /// The rig file.
        path: std::path::PathBuf,
        /// Each key that changed, with its old and new value.
        changes: Vec<String>,
    },
    /// The next readings of a closed loop cannot be chosen.
    #[error("the next readings cannot be chosen: {0}")]
    #[diagnostic(help("what was measured is kept; `fieldgap resume` tries again"))]
    NoNextRound(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// On resuming: points measured again differ from their first reading.
    #[error("the rig has changed since the scan stopped: {0}")]
    #[diagnostic(help(
        "find what moved or changed and restore it, or start a new scan; the readings so far are kept"
    ))]
    RigChange(#[from] RigChange),
}
