//! What keeps a scan from beginning or going on.

use super::fly::FlightFault;
use super::references::RigChange;
use fieldgap_input::Fault;
use fieldgap_records::JournalError;
use fieldgap_rig::RigError;

/// Why a scan cannot begin, or cannot go on.
///
/// What happens to a scan once it runs is not here: it ends partial, with its reason, and nothing is lost.
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
    /// The process that silences the array should this one be killed does not start.
    #[error(
        "the watchdog, which silences the array should this program be killed, does not start: {0}"
    )]
    #[diagnostic(help(
        "it is this program itself in a second process; see what the system says of it"
    ))]
    Watchdog(#[source] std::io::Error),
    /// The array's controller drives another number of elements than the rig file says.
    #[error("the array's controller drives {controller} elements; the rig file says {believed}")]
    #[diagnostic(help("correct [array] of the rig file, or connect the array that it describes"))]
    OtherArray {
        /// What the rig file says.
        believed: usize,
        /// What the controller says.
        controller: usize,
    },
    /// The sensor says that the air is such that its sound cannot be computed.
    #[error(
        "the environment sensor says {temperature_c} °C, {humidity_percent} % and {pressure_kpa} kPa, where the speed of sound cannot be computed"
    )]
    #[diagnostic(help(
        "look at the sensor, or set `sound_speed = false` in [environment] of the rig file"
    ))]
    NoMedium {
        /// Temperature, °C.
        temperature_c: f64,
        /// Relative humidity, percent.
        humidity_percent: f64,
        /// Pressure, kPa.
        pressure_kpa: f64,
    },
    /// On resuming, a file that the rig file names describes another array.
    #[error("the array is not the one that the scan was begun with")]
    #[diagnostic(help(
        "bring back the elements file that the rig file named then, or begin a new scan"
    ))]
    OtherSetUp,
    /// A row cannot be flown as the plan says.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Flight(#[from] FlightFault),
    /// On resuming, the truth file of a virtual rig is another.
    #[error("what is true behind the virtual rig was changed since the scan was begun: {} is another file", .0.display())]
    #[diagnostic(help("bring the truth file back as it was, or begin a new scan"))]
    OtherTruth(std::path::PathBuf),
    /// On resuming, the rig file says something else than it did.
    #[error("{} was changed since the scan was begun: {}", path.display(), changes.join("; "))]
    #[diagnostic(help(
        "take the changes back (ports and their speeds may be others), or begin a new scan; the file as it was is rig.toml in \
         the scan's folder"
    ))]
    OtherRig {
        /// The rig file.
        path: std::path::PathBuf,
        /// Each key that changed, with what it was and is.
        changes: Vec<String>,
    },
    /// On resuming, the rig is not as it was.
    #[error("the scan cannot go on as if nothing had happened: {0}")]
    #[diagnostic(help(
        "find what moved or changed and put it back; what was measured so far is kept as it is. Else begin a new scan"
    ))]
    RigChange(#[from] RigChange),
}
