//! A tactile display: foci that stand, move and alternate, several at once, modulated so that skin feels them.
//!
//! A [display file](DisplayFile) says what is to be felt. It becomes, step by step:
//!
//! ```text
//!  path ── track ── timeline ── solver, delays ── DriveProgram ── wire ── controller
//!                               modulation ───────┘        └── Playback: the field of what was sent
//! ```
//!
//! A [`track`] is the path of one focus cut into pieces that last; the [`timeline`] joins the tracks into slots
//! of whole periods of the carrier; each slot becomes a [`DriveFrame`](fieldgap_rig::focus_array::DriveFrame) of delays and levels
//! that the controller can make. A [`Playback`] is made from what was decoded from the wire and from nothing else, so
//! that its field has in it all that the controller rounds.
//!
//! Ways to make a focus felt, of which skin's receptors hear 40 to 800 Hz and 200 to 300 Hz best (thesis, table 1):
//!
//! | modulation | what changes | source |
//! |---|---|---|
//! | [`Am`] | the amplitude of all elements, by a waveform and a depth | Iwamoto et al., EuroHaptics 2008 |
//! | [`Fm`] | the rate of that goes up and down | named by the thesis beside AM and PWM, after its reference 15 |
//! | [`Pwm`] | the array is on for a share of each period | the thesis's controller, 200 Hz |
//! | [`Lateral`] | the focus swings across its place at full drive | Takahashi, Hasegawa and Shinoda, IEEE Trans. Haptics 13, 334 (2020) |
//! | [`Spatiotemporal`] | the focus runs along its whole path so many times a second, at full drive | Frier et al., EuroHaptics 2018 |
//!
//! [`Am`]: Modulation::Am
//! [`Fm`]: Modulation::Fm
//! [`Pwm`]: Modulation::Pwm
//! [`Lateral`]: Modulation::Lateral
//! [`Spatiotemporal`]: Modulation::Spatiotemporal

mod compose;
mod error;
mod feel;
mod file;
mod modulation;
mod path;
mod playback;
mod session;
pub mod timeline;
pub mod track;

pub use compose::{Composed, SoundingArray, compose};
pub use error::DisplayError;
pub use feel::{Felt, FeltFocus, felt};
pub use file::{DisplayFile, Foci, FocusSection, Output, Picture};
pub use modulation::{Fm, Modulation, Sweep, Waveform};
pub use path::{FieldPoint, Path};
pub use playback::Playback;
pub use session::{Ended, play};
