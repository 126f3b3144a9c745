//! The `fieldgap` program: it scans an ultrasonic field, simulates the same set-up, and says why the two differ.
//!
//! The library crates can be used without it. This crate holds the [commands](cli) and the [full-screen views](terminal), and
//! names the library crates under short names:
//!
//! | module | what it holds |
//! |---|---|
//! | [`input`] | reading files: faults located by file, line and column; quantities that cannot hold a wrong value |
//! | [`acoustics`] | arrays, medium, excitations, simulators, the field kernel, metrics, least squares |
//! | [`level`] | sound pressure levels: sensitivity of a receiver, uncertainty budgets, limits |
//! | [`records`] | recorded scans, plans, the journal of a running scan, imports |
//! | [`jobs`] | independent pieces of work, on this computer or by Slurm |
//! | [`monitoring`] | figures followed over time: baselines, control charts and alarms |
//! | [`study`] | how a field's figures depend on any parameter of array, focus, medium or model |
//! | [`characterization`] | the decay, directivity and axis of one transducer, from a scan of it |
//! | [`comparison`] | registration of scan to simulation, and the comparison height by height |
//! | [`exchange`] | files of other programs: import of measured points, export of records |
//! | [`exposure`] | the level of an array where people are, against limits, and the minutes that add up |
//! | [`diagnosis`] | which unmodelled effect explains the gap between scan and simulation |
//! | [`archive`] | an index of all records below a folder, and queries of it |
//! | [`reanalysis`] | records compared and diagnosed again, beside their first results |
//! | [`rig`] | devices, links, safety; no physics |
//! | [`display`] | tactile displays: paths, modulations, several foci, drive programs, what skin feels |
//! | [`sensing`] | hand swipes recognised from what four elements receive |
//! | [`virtual_rig`] | firmware on pseudo-terminals with physics behind the receiver |
//! | [`acquisition`] | a plan run on a rig, the record kept safe |
//! | [`adaptive_map`] | maps of the field with standard errors, from as few readings as they need |
//! | [`calibration`] | what each element of an array emits, from coded drives |
//! | [`campaign`] | many scans against many simulations, by a schedule, on several rigs |
//! | [`correction`] | set-up files corrected by what a diagnosis found |
//! | [`report`] | pictures, tables and the report page |
//! | [`blind`] | sealed sets of scans, and how well diagnoses find their causes |
//!
//! Two pages beside: [the thesis's tables and figures](thesis), and [when to trust which transducer model](transducer_models).

// Output goes through `cli::output`, which makes control characters visible and does not panic.
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub use fieldgap_acoustics as acoustics;
pub use fieldgap_acquisition as acquisition;
pub use fieldgap_adaptive_map as adaptive_map;
pub use fieldgap_archive as archive;
pub use fieldgap_blind as blind;
pub use fieldgap_calibration as calibration;
pub use fieldgap_campaign as campaign;
pub use fieldgap_characterization as characterization;
pub use fieldgap_closed_loop as closed_loop;
pub use fieldgap_comparison as comparison;
pub use fieldgap_correction as correction;
pub use fieldgap_diagnosis as diagnosis;
pub use fieldgap_display as display;
pub use fieldgap_exchange as exchange;
pub use fieldgap_exposure as exposure;
pub use fieldgap_input as input;
pub use fieldgap_jobs as jobs;
pub use fieldgap_level as level;
pub use fieldgap_monitoring as monitoring;
pub use fieldgap_reanalysis as reanalysis;
pub use fieldgap_records as records;
pub use fieldgap_report as report;
pub use fieldgap_rig as rig;
pub use fieldgap_sensing as sensing;
pub use fieldgap_study as study;
pub use fieldgap_virtual_rig as virtual_rig;

pub mod cli;
pub mod rig_file;
pub mod terminal;

#[doc = include_str!("thesis.md")]
pub mod thesis {}

#[doc = include_str!("transducer_models.md")]
pub mod transducer_models {}
