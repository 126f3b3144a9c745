//! What keeps a campaign from beginning or going on.

use super::references::Moved;
use crate::input::Fault;
use crate::rig::RigError;
use crate::scan::JournalError;
use crate::virtual_rig::VirtualRigError;

/// Why a scan cannot begin, or cannot go on.
///
/// What happens to a scan once it runs is not here: it ends partial, with its reason, and nothing is lost.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum CampaignError {
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
    /// The virtual rig cannot be opened.
    #[error(transparent)]
    #[diagnostic(transparent)]
    VirtualRig(#[from] VirtualRigError),
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
    /// On resuming, the rig is not as it was.
    #[error("the scan cannot go on as if nothing had happened: {0}")]
    #[diagnostic(help(
        "find what moved or changed and put it back; what was measured so far is kept as it is. Else begin a new scan"
    ))]
    Moved(#[from] Moved),
}
