//! Where the beam's axis lies in the robot's axes: crosses scanned through it at several heights, a lobe fitted to each
//! arm, a straight line through their centres.
//!
//! The array is told to focus on its own axis. Its delays are then the same on either side, so that the beam is
//! symmetric about the array's true axis, whatever the speed of sound, the level or the elements' lobes are; what the
//! rig file says of the array's place does not enter. Symmetry is all that the fit needs.

mod cross;
mod line;
mod lobe;
mod search;
mod text;

pub use cross::{AxisError, Cross};
pub use line::{BeamAxis, Estimate, Slope};
pub use lobe::{Lobe, LobeFault, fit_lobe};
pub use search::{AxisSearch, find_axis};
pub use text::{AxisReport, in_words};
