//! Comparison of a scan with its simulation: registration, then residual, correlation and focal figures at each height.
//!
//! *Registration* finds how the coordinates and the unit of the scan relate to those of the simulation. It may remove only what a
//! careful set-up of the robot would have removed: a gain, a shift, a mirrored axis. The residual after it is the gap.
//!
//! ```
//! use std::path::Path;
//!
//! use fieldgap_acoustics::{PlaneGrid, Simulator};
//! use fieldgap_comparison::{Registering, compare};
//! use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
//!
//! # let scan_toml = "format = 1\nname = \"plane\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
//! # [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
//! # [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
//! # [[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 100.0\n";
//! # let source = fieldgap_input::TomlSource::new(Path::new("scan.toml"), scan_toml);
//! # let setup = ScanSetup::parse(&source)?;
//! // Usually `RecordedScan::open(folder)`. Here the readings are 7 times the simulation: there is no gap.
//! let points = PlaneGrid::square(20e-3, 4e-3, 0.1).points();
//! let simulated = setup.simulation(Simulator::Piston, 0).expect("focus 0").magnitudes(&points);
//! let samples = points.iter().zip(simulated);
//! let samples = samples.map(|(at, p)| RecordedSample::measured(0.0, Some(0), *at, 7.0 * p, None)).collect();
//!
//! let comparison = compare(&RecordedScan { setup, samples }, Simulator::Piston, Registering::GainOnly)?;
//! assert!((comparison.registration.gain.value - 7.0).abs() < 1e-9);
//! assert!(comparison.overall.residual_rms_ratio < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Begin with [`compare`], which gives a [`Comparison`]; [`Comparison::to_text`] and [`Comparison::to_csv`] write it.
//! [`register_scan`] registers without comparing. A scan goes through these files:
//!
//! | file | what it does |
//! |---|---|
//! | `readings` | the driven readings and the simulated field at their positions |
//! | `register` | the choice between the recorded coordinates and another pose |
//! | `coarse`, `pose_search` | the search for a pose without a start value: a coarse grid, then rounds of refinement |
//! | `shift_search` | the search for a shift of any size, which is reported and left in the gap |
//! | `refine` | the least-squares fit of a [`Pose`], with the gain solved for at each step |
//! | `phase_fit` | phases in that fit, with the reference's constant and drift |
//! | `receiver_face` | a gain that falls with the angle of arrival, where this explains what a pose cannot |
//! | `identifiability`, `standard_errors` | which parameters the readings determine, and how well |
//! | `averaging` | what a reading is the mean of |
//! | `dark_readings` | quadrature noise and detector floor from readings with the array silent |
//! | `within_readings` | the same from the scatter of the magnitudes that are averaged into one reading |
//! | `plane_noise` | noise of a plane without repeats, from what its map holds beyond the wavenumber |
//! | `rice` | mean magnitude of a noisy level |
//! | `noise`, `figures`, `agreement` | noise, figures of each height with errors, correlation and residual |
//! | `comparison`, `registration`, `table` | the result as data, text and CSV |
//! | `plane_phase`, `hologram`, `phase_figures` | phases of scan and simulation, and a plane brought back to the elements |
//! | `levels`, `reception` | absolute levels with their uncertainty, where the receiver's sensitivity is known |
//! | `simulated_readings` | the registered simulation at each reading |
//! | `change` | two records of one field against each other |
//! | `gap_reduction` | the gap before and after the correction of a set-up |

mod agreement;
mod averaging;
mod change;
mod coarse;
mod compare;
mod comparison;
mod converter_steps;
mod dark_readings;
mod figures;
mod gap_reduction;
mod hologram;
mod identifiability;
mod levels;
mod levels_table;
mod noise;
mod phase_figures;
mod phase_fit;
mod plane_noise;
mod plane_phase;
mod pose;
mod pose_search;
mod readings;
mod receiver_face;
mod reception;
mod refine;
mod register;
mod registration;
mod rice;
mod shift_search;
mod simulated_readings;
mod standard_errors;
mod table;
mod within_readings;

pub use averaging::{averaged, averaged_magnitudes, has_phases, within_readings};
pub use change::{
    Aligning, Alignment, Change, ChangeFigures, Condition, HeightChange, NoChange, PlaceChange,
    Scaling, aligned_change, change,
};
pub use compare::{
    Incomparable, compare, compare_by_amplitudes, register_scan, register_scan_by_amplitudes,
};
pub use comparison::{
    Agreement, ComparedMap, Comparison, Discrepancy, FieldFigures, FocalRadiusFigure, Levels,
    Noise, NoiseSource, PeakLevel, PlaneComparison, PlaneLevels, Uncertain,
};
pub use dark_readings::{DarkNoise, DarkReadings, OF_NOISE_ALONE, USUAL_PROPORTIONAL_NOISE};
pub use gap_reduction::{GapReduction, Gaps, PlaneGaps};
pub use phase_figures::{EmittedBeside, Hologram, PlanePhase};
pub use plane_noise::PlaneNoise;
pub use pose::{Mirror, Pose};
pub use registration::{
    Estimate, PhasesUsed, Registering, Registration, TriedRegistration, UndeterminedCombination,
};
pub use rice::{lost_in_noise, rice_mean};
pub use simulated_readings::simulated_readings;
pub use within_readings::WithinReadings;
