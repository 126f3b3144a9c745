//! Files of measured fields: recorded scans, plans of scans, the journal of a running scan, and imports of other formats.
//!
//! A recorded scan is a folder with `scan.toml`, the set-up, and `samples.csv`, the readings.
//!
//! ```
//! use std::path::Path;
//!
//! use fieldgap_acoustics::{Simulator, Vec3};
//! use fieldgap_input::TomlSource;
//! use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
//!
//! let scan_toml = r#"
//!     format = 1
//!     name = "one focus"
//!     recorded = 2026-11-20T17:00:00Z
//!     reading = "V"
//!     [array]
//!     frequency_hz = 40000.0
//!     layout = "square"
//!     columns = 6
//!     rows = 6
//!     element_diameter_mm = 10.5
//!     spacing_mm = 0.0
//!     [medium]
//!     speed_of_sound_m_s = 343.0
//!     [simulator]
//!     model = "piston"
//!     [[focus]]
//!     x_mm = 0.0
//!     y_mm = 0.0
//!     z_mm = 100.0
//! "#;
//! let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), scan_toml))?;
//! let at_focus = RecordedSample::measured(0.0, Some(0), Vec3::new(0.0, 0.0, 0.1), 1.7, None);
//! let scan = RecordedScan { setup, samples: vec![at_focus] };
//!
//! let folder = tempfile::tempdir()?;
//! scan.write(folder.path())?;
//! let scan = RecordedScan::open(folder.path())?;
//! let simulation = scan.setup.simulation(Simulator::Piston, 0).expect("there is a focus 0");
//! println!("read {}, simulated {:?}", scan.samples[0].reading, simulation.magnitudes(&[scan.samples[0].position_m()]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | to | begin with |
//! |---|---|
//! | read, write and group a recorded scan | [`RecordedScan`], [`planes`], [`plane_map`], [`repeats`] |
//! | read a plan and list its points | [`Plan`], [`Plan::visits`] |
//! | record a running scan and resume it | [`Journal`] |
//! | import other formats | [`import`] |
//! | write a field that is larger than memory | [`VolumeFile`] |
//!
//! `scan.toml`, the plan and the rig file have sections in common: [`ArraySection`], [`MediumSection`], [`FocusSection`]. Each is read
//! in two steps: a table of optional keys, and then a section in which the keys are known to be consistent. An error of either step
//! names its line.

mod air;
mod array_section;
mod array_table;
mod calibration_file;
mod changed_air;
mod durable;
mod elements_csv;
mod field_setup;
mod focus_section;
mod hooks;
pub mod import;
mod inside;
mod journal;
mod layout;
mod medium_section;
mod notes;
mod phase;
mod plan;
mod plane_map;
mod planes;
mod reading_range;
mod recorded;
mod repeats;
mod sample;
mod samples_csv;
mod section;
mod setup;
mod setup_uncertainty;
mod table;
mod transducer_file;
mod volume_file;

pub use air::{AirRow, FILE as AIR_FILE};
pub use array_section::ArraySection;
pub use array_section::TRANSDUCER_BESIDE;
pub use array_table::ArrayTable;
pub use calibration_file::{
    CALIBRATION_BESIDE, CalibratedChannel, CalibrationConditions, CalibrationFile, ChannelState,
};
pub use changed_air::ChangedAir;
pub use durable::{Lines, sync_folder, write_whole};
pub use elements_csv::write_elements;
pub use field_setup::FieldSetup;
pub use focus_section::{FocusSection, FocusTable, WrongPhaseCount};
pub use hooks::{Alarm, HookCommand, HookKind, Hooks};
pub use inside::without_ways_out;
pub use journal::{
    Event, EventKind, Journal, JournalError, JournalTail, Record, Resumed, ScanState, read_events,
};
pub use layout::{Layout, Rims};
pub use medium_section::{MediumSection, MediumTable};
pub use notes::{Note, NoteError, NoteKind};
pub use phase::{PhaseConvention, PhaseReference, PhaseSection};
pub use plan::{
    AdaptiveMap, Axis, BoxMm, ClosedLoop, Criterion, Dark, FEWEST_FLOWN, Fly, Layers, MapPrior,
    Order, Plan, PlanPart, Readings, Reference, Region, Shape, Tolerances, Visit, VisitKind,
    VisitPace,
};
pub use plane_map::{MappedPlane, NotAGrid, OFF_LINE_MM, plane_map};
pub use planes::{LAYER_MM, Plane, SAME_HEIGHT_MM, are_scattered, planes};
pub use recorded::{RecordError, RecordedScan};
pub use repeats::{Repeat, SAME_POINT_MM, repeats, visited};
pub use sample::{RecordedSample, Spread};
pub use samples_csv::{Columns, UnwritableSample};
pub use setup::{ScanSetup, UnwritableSetup};
pub use setup_uncertainty::{PossibleReflection, SetupUncertainty};
pub use transducer_file::TransducerFile;
pub use volume_file::{VolumeError, VolumeFile};
