//! fieldgap scans an ultrasonic field, simulates the same set-up, and says why the two differ.
//!
//! The layers, from the bottom up; each may use those above it in this list and none below:
//!
//! | module | what it holds |
//! |---|---|
//! | [`input`] | reading what people write: faults located by file, line and column; quantities that cannot hold a wrong value |
//! | [`least_squares`] | nonlinear least squares with priors |
//! | `cipher` | bytes locked away under a key |
//! | [`acoustics`] | pure physics: arrays, medium, drives, simulators, the field kernel, metrics |
//! | [`scan`] | records: recorded scans, plans, the journal of a running scan, imports |
//! | [`study`] | how a field's figures go with any parameter of array, focus, medium or model; the thesis's studies |
//! | [`characterization`] | one transducer's decay, lobe and axis out of a scan of it |
//! | [`gap`] | registration of scan to simulation, and the comparison height by height |
//! | [`rig`] | devices, links, safety; knows no physics |
//! | [`display`] | tactile displays: paths, modulations, several foci, what the controller is told, what skin feels |
//! | [`sensing`] | swipes of a hand told from what four elements hear; knows no physics |
//! | [`virtual_rig`] | firmware on pseudo-terminals with physics behind the receiver |
//! | [`campaign`] | a plan run on a rig, the record kept safe |
//! | [`beam_axis`] | where the beam's axis lies: crosses scanned through it, fitted |
//! | [`correction`] | set-up files corrected by what a diagnosis found |
//! | [`report`] | pictures, tables and the report page |
//! | [`blind`] | sets of scans whose causes are sealed away, and how well diagnoses find them |
//! | [`terminal`] | full-screen views: a robot jogged by keys, a scan as it runs |
//! | [`cli`] | the commands |
//!
//! Two pages beside: [the thesis's tables and figures](thesis), and [when to trust which transducer model](transducer_models).
#![warn(missing_docs)]

pub mod acoustics;
pub mod beam_axis;
pub mod blind;
pub mod campaign;
pub mod characterization;
mod cipher;
pub mod cli;
pub mod correction;
pub mod display;
pub mod gap;
pub mod input;
pub mod least_squares;
pub mod report;
pub mod rig;
pub mod scan;
pub mod sensing;
pub mod study;
pub mod terminal;
pub mod virtual_rig;

#[doc = include_str!("thesis.md")]
pub mod thesis {}

#[doc = include_str!("transducer_models.md")]
pub mod transducer_models {}
