//! Records of fields: recorded scans, plans of scans to come, the journal of a scan that is running, and
//! imports of fields measured elsewhere.
//!
//! | to | see |
//! |---|---|
//! | open, write and group a recorded scan | [`RecordedScan`], [`planes`], [`plane_map`], [`repeats`] |
//! | read a plan and walk through its points | [`Plan`], [`Plan::visits`] |
//! | keep a scan while it runs, and take it up again | [`Journal`] |
//! | bring in what was measured elsewhere | [`import`] |
//! | keep a field that is larger than memory | [`VolumeFile`] |
//!
//! `scan.toml`, the plan and the rig file share sections: [`ArraySection`], [`MediumSection`], [`FocusSection`]. Each is
//! read in two steps: a table of optional keys, which serde checks one by one, and then a section in which the keys
//! are known to go together. A fault of either step stands at its line.

mod array_section;
mod array_table;
mod durable;
mod elements_csv;
mod focus_section;
mod hooks;
pub mod import;
mod journal;
mod layout;
mod medium_section;
mod plan;
mod plane_map;
mod planes;
mod recorded;
mod repeats;
mod sample;
mod samples_csv;
mod section;
mod setup;
mod table;
mod transducer_file;
mod volume_file;

pub use array_section::ArraySection;
pub use array_section::TRANSDUCER_BESIDE;
pub use array_table::ArrayTable;
pub use elements_csv::{read_elements, write_elements};
pub use focus_section::{FocusSection, FocusTable, WrongPhaseCount};
pub use hooks::{Alarm, HookCommand, HookKind, Hooks};
pub use journal::{
    BadSample, Event, EventKind, Journal, JournalError, Record, Resumed, ScanState, read_events,
};
pub use layout::{Layout, Rims};
pub use medium_section::{MediumSection, MediumTable};
pub use plan::{
    Axis, Dark, Fly, Layers, Order, Plan, PlanPart, Reference, Region, Shape, Tolerances, Visit,
    VisitKind,
};
pub use plane_map::{MappedPlane, NotAGrid, OFF_LINE_MM, plane_map};
pub use planes::{Plane, SAME_HEIGHT_MM, planes};
pub use recorded::{RecordError, RecordedScan};
pub use repeats::{Repeat, RepeatNoise, SAME_POINT_MM, repeat_noise, repeats};
pub use sample::{RecordedSample, Spread};
pub use samples_csv::{Columns, UnwritableSample, read_samples, write_samples};
pub use setup::{ScanSetup, UnwritableSetup};
pub use transducer_file::TransducerFile;
pub use volume_file::{VolumeError, VolumeFile};
