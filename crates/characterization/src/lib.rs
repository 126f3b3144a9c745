//! Characterization of a single transducer from a scan: its axis, the decay of the pressure along it, and its directivity.
//!
//! The model of a reading is `sqrt(floor² + (amplitude · L(d, h) · D(θ))²)`: a decay on the axis ([`AxisLaw`]) times a directivity
//! ([`LobeLaw`]), and a noise floor. Position and tilt of the axis are fitted too. Each pair of laws is fitted to all readings at once
//! ([`PairFit`]), and pairs are compared by the Bayesian information criterion. Standard errors are those of White (Econometrica 48, 817,
//! 1980), which are valid if the noise depends on the reading.
//!
//! ```
//! use std::path::Path;
//!
//! use fieldgap_acoustics::{PlaneGrid, Simulator};
//! use fieldgap_characterization::{Readings, characterize};
//! use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
//!
//! # let scan_toml = "format = 1\nname = \"one\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
//! # [array]\nfrequency_hz = 40000.0\nlayout = \"linear\"\ncount = 1\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
//! # [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n[[focus]]\nphases = \"all-zero\"\n";
//! # let setup = ScanSetup::parse(&fieldgap_input::TomlSource::new(Path::new("scan.toml"), scan_toml))?;
//! // Usually `RecordedScan::open(folder)`. Here the readings are simulated, with the field of a piston.
//! let heights_m = [0.05, 0.08, 0.12, 0.16, 0.2];
//! let points: Vec<_> = heights_m.iter().flat_map(|&z_m| PlaneGrid::square(40e-3, 8e-3, z_m).points()).collect();
//! let simulated = setup.simulation(Simulator::Piston, 0).expect("focus 0").magnitudes(&points);
//! let samples = points.iter().zip(simulated);
//! let samples = samples.map(|(at, p)| RecordedSample::measured(0.0, Some(0), *at, p, None)).collect();
//!
//! let readings = Readings::of(&RecordedScan { setup, samples }, 30.0)?;
//! let characterization = characterize(&readings)?;
//! assert!(characterization.best().r_squared > 0.9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | to | begin with |
//! |---|---|
//! | take the readings from a recorded scan | [`Readings::of`] |
//! | fit every pair of laws | [`characterize`] |
//! | repeat the thesis's own analysis | [`appendix_a`] |
//! | write the best fit as a transducer file | [`Characterization::transducer_file`] |

mod appendix_a;
mod axis_pose;
mod characterize;
mod laws;
mod pair_fit;
mod profile;
mod readings;
mod text;

pub use appendix_a::{AppendixA, FittedCurve, appendix_a};
pub use axis_pose::AxisPose;
pub use characterize::{Characterization, characterize};
pub use laws::{AxisLaw, Constant, LobeLaw};
pub use pair_fit::PairFit;
pub use profile::{LEVELS_DB, LevelAngle, LobeBin, OnAxisPoint, Profile};
pub use readings::{CharacterizationError, Readings};
pub use text::{csv, text, text_of_appendix_a};
