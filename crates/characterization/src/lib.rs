//! What one transducer does: its axis, how its pressure falls along it, and its lobe, out of a scan of it alone.
//!
//! Every reading is taken for `sqrt(floor² + (amplitude · L(d, h) · D(θ))²)`, a law on the axis ([`AxisLaw`]) times a lobe
//! ([`LobeLaw`]) beside what is read where nothing arrives, about an axis whose foot and tilt are fitted with the rest. Each pair of laws is fitted to all readings at
//! once ([`PairFit`]) and weighed by its information criterion. Standard errors are those of White (Econometrica 48, 817, 1980), which
//! hold where the noise grows with the reading.
//!
//! | to | see |
//! |---|---|
//! | take the readings out of a recorded scan | [`Readings::of`] |
//! | fit every pair of laws and read off the angles | [`characterize`] |
//! | do as the thesis's own script does | [`appendix_a`] |
//! | make a transducer file of what the readings prefer | [`Characterization::transducer_file`] |

mod appendix_a;
mod axis_pose;
mod characterize;
mod laws;
mod pair_fit;
mod profile;
mod readings;
mod text;

pub use appendix_a::{AppendixA, Fitted, appendix_a};
pub use axis_pose::AxisPose;
pub use characterize::{Characterization, characterize};
pub use laws::{AxisLaw, Constant, LobeLaw};
pub use pair_fit::PairFit;
pub use profile::{LEVELS_DB, LevelAngle, LobeBin, OnAxisPoint, Profile};
pub use readings::{CharacterizationError, Readings};
pub use text::{csv, text, text_of_appendix_a};
