//! Tactile displays: fixed, moving and alternating foci, modulated so that skin feels them.
//!
//! Begin with [`DisplayFile`], which describes a display, and [`compose`], which turns it into the drive program of a
//! controller. [`play`] plays the program on a rig; [`Playback`] and [`stimulus`] compute its field and what acts on skin.
//!
//! ```
//! use std::path::Path;
//!
//! use fieldgap_acoustics::transducer::Piston;
//! use fieldgap_acoustics::{Array, Medium};
//! use fieldgap_display::{DisplayFile, RadiatingArray, compose};
//! use fieldgap_input::TomlSource;
//! use fieldgap_rig::ArrayIdentity;
//!
//! let text = r#"
//!     name = "circle"
//!     rig = "rig.toml"
//!     [modulation.am]
//!     frequency_hz = 200.0
//!     [[focus]]
//!     path.circle = { centre_mm = [0, 0, 100], radius_mm = 15 }
//!     loops_per_s = 1.0
//! "#;
//! let display = DisplayFile::parse(TomlSource::new(Path::new("circle.toml"), text))?;
//! let array = Array::square(6, 6, 10.5e-3)?;
//! let radiating = RadiatingArray {
//!     array: &array,
//!     medium: Medium { speed_of_sound_m_s: 343.0 },
//!     frequency_hz: 40e3,
//!     transducer: &Piston,
//! };
//! let controller = ArrayIdentity::of_thesis(36, 40e3);
//! let composed = compose(&display, &radiating, &controller)?;
//! assert_eq!(composed.program.loop_periods(), 40_000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The steps from the file to the field:
//!
//! ```text
//!  path ── track ── timeline ── solver, delays ── DriveProgram ── wire ── controller
//!                               modulation ───────┘        └── Playback: the field of what was sent
//! ```
//!
//! A [`track`] is the path of one focus, divided into pieces of known duration. The [`timeline`] joins the tracks into slots
//! of whole carrier periods. Each slot becomes a [`DriveFrame`](fieldgap_rig::focus_array::DriveFrame) of delays and levels
//! that the controller can produce. A [`Playback`] uses only what was decoded from the wire, so that its field includes all
//! rounding by the controller.
//!
//! Skin receptors respond to 40 to 800 Hz, and best to 200 to 300 Hz (thesis, table 1). Modulations that make a focus
//! perceptible:
//!
//! | modulation | what changes | source |
//! |---|---|---|
//! | [`Am`] | the amplitude of all elements, by a waveform and a depth | Iwamoto et al., EuroHaptics 2008 |
//! | [`Fm`] | the same with a frequency that is swept up and down | named by the thesis beside AM and PWM, after its reference 15 |
//! | [`Pwm`] | the array is on for a part of each period | the thesis's controller, 200 Hz |
//! | [`Lateral`] | the focus oscillates about its position at full drive | Takahashi, Hasegawa and Shinoda, IEEE Trans. Haptics 13, 334 (2020) |
//! | [`Spatiotemporal`] | the focus runs repeatedly along its whole path at full drive | Frier et al., EuroHaptics 2018 |
//!
//! [`Am`]: Modulation::Am
//! [`Fm`]: Modulation::Fm
//! [`Pwm`]: Modulation::Pwm
//! [`Lateral`]: Modulation::Lateral
//! [`Spatiotemporal`]: Modulation::Spatiotemporal

mod compose;
mod error;
mod file;
mod modulation;
mod path;
mod play;
mod playback;
mod stimulus;
pub mod timeline;
pub mod track;

pub use compose::{ComposedDisplay, RadiatingArray, compose};
pub use error::DisplayError;
pub use file::{DisplayFile, DisplayFocus, Foci, Output, Picture};
pub use modulation::{Fm, Modulation, Sweep, Waveform};
pub use path::{FieldPoint, Path};
pub use play::{PlaybackEnd, play};
pub use playback::Playback;
pub use stimulus::{FocusStimulus, Stimulus, stimulus};
