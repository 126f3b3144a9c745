//! What the index keeps of a record.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use fieldgap_acoustics::Simulator;
use fieldgap_diagnosis::{EffectId, Verdict};
use fieldgap_records::Note;
use fieldgap_text::Uncertain;
use jiff::Timestamp;
use serde::Serialize;

use crate::series::SeriesName;

/// A record, as far as its files can be read.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Entry {
    /// Its folder below that of the index; empty if it is that folder.
    #[serde(serialize_with = "readable")]
    pub folder: PathBuf,
    /// What is wrong with its files, with the name of the file; `None` if all that were read are good.
    pub fault: Option<String>,
    /// Its name.
    pub name: Option<String>,
    /// When it was started.
    pub recorded: Option<Timestamp>,
    /// Name of the rig, from the copy of its file.
    pub rig: Option<String>,
    /// How far the scan got.
    pub state: State,
    /// Intended focus of each drive, mm, in the array's coordinates; `None` for a drive without one.
    pub foci_mm: Vec<Option<[f64; 3]>>,
    /// Heights, mm, ascending.
    pub heights_mm: Vec<f64>,
    /// Readings taken with the array driven.
    pub points: Option<u64>,
    /// The simulator that it was compared with; `None` if it was never compared.
    pub simulator: Option<Simulator>,
    /// The gap; its error is unknown for a record that was compared by an early version.
    pub gap: Option<Uncertain>,
    /// The gap that noise alone makes.
    pub noise_floor: Option<f64>,
    /// Reading per unit of the simulation.
    pub level: Option<Uncertain>,
    /// Correlation of scan and simulation.
    pub correlation: Option<Uncertain>,
    /// The judgement of its diagnosis.
    pub verdict: Option<Verdict>,
    /// The named effects.
    pub effects: Vec<EffectId>,
    /// Mean temperature of the air, °C.
    pub temperature_c: Option<Uncertain>,
    /// Its notes, the oldest first.
    pub notes: Vec<Note>,
    /// Figures by name; from the index only those that were asked for.
    pub figures: BTreeMap<SeriesName, Uncertain>,
}

/// A path as text; what is no text in it is replaced.
fn readable<S: serde::Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// How far a scan got.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// Every point was measured.
    Complete,
    /// It ended before its last point.
    Partial,
    /// It is running, or was killed.
    Scanning,
    /// It has no journal: it was imported, or made by a program.
    #[default]
    Imported,
}

impl State {
    /// Every state.
    pub const ALL: [Self; 4] = [Self::Complete, Self::Partial, Self::Scanning, Self::Imported];

    /// Its name in tables and in the index.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Partial => "partial",
            Self::Scanning => "scanning",
            Self::Imported => "imported",
        }
    }
}
