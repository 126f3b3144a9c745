//! The position of the beam axis in the robot's axes. Crosses are scanned through the beam at several heights, a lobe is
//! fitted to each arm, and a straight line to their centres.
//!
//! The array focuses on its own axis, so the delays are symmetric. The beam is then symmetric about the true axis of the
//! array, whatever the speed of sound, the level or the directivity of the elements. The position of the array in the rig
//! file does not enter. The fit needs nothing but this symmetry.

mod cross;
mod line;
mod lobe;
mod search;
mod text;

pub use cross::{AxisError, Cross};
pub use line::{BeamAxis, Estimate, Slope};
pub use lobe::LobeFault;
pub use search::{AxisSearch, find_axis};
pub use text::{AxisReport, in_words};
