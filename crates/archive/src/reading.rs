//! Reading of what the index keeps of a record from its files.

use std::path::Path;

use fieldgap_input::{Fault, Label, TomlSource};
use fieldgap_records::{
    AirRow, FocusSection, Note, RecordedScan, SAME_HEIGHT_MM, ScanSetup, ScanState,
    without_ways_out,
};
use fieldgap_text::Uncertain;
use serde::Deserialize;

use crate::air::AirFigures;
use crate::early_report::read_early_report;
use crate::entry::{Entry, State};
use crate::figures::{REPORT, RecordFigures};

/// The copy of the rig file in a record.
const RIG: &str = "rig.toml";

/// The readings.
const SAMPLES: &str = "samples.csv";

/// The one key of a rig file that is kept; the rig may have devices of a later version.
#[derive(Deserialize)]
struct NamedRig {
    name: Option<Label>,
}

/// The record in the folder `folder` below `root`. What cannot be read is left out, and the first reason kept.
pub(crate) fn read_entry(root: &Path, folder: &Path) -> Entry {
    let mut entry = Entry { folder: folder.to_owned(), ..Entry::default() };
    let record = if folder.as_os_str().is_empty() { root.to_owned() } else { root.join(folder) };
    if let Err(fault) = without_ways_out(&record) {
        entry.fault = Some(below(&record, &fault));
        return entry;
    }
    let mut faults: Vec<Fault> = Vec::new();
    faults.extend(entry.read_set_up(&record).err());
    faults.extend(entry.read_rig(&record).err());
    faults.extend(entry.read_state(&record).err());
    faults.extend(entry.read_figures(&record).err());
    faults.extend(Note::all_of(&record).map(|notes| entry.notes = notes).err());
    entry.fault = faults.first().map(|fault| below(&record, fault));
    entry
}

/// A fault with its file relative to the record, which is listed beside it.
fn below(record: &Path, fault: &Fault) -> String {
    let file = fault.path().strip_prefix(record).unwrap_or(fault.path());
    let place = match fault.line_column() {
        Some((line, column)) => format!("{}:{line}:{column}", file.display()),
        None => file.display().to_string(),
    };
    format!("{place}: {}", fault.problem())
}

impl Entry {
    fn read_set_up(&mut self, record: &Path) -> Result<(), Fault> {
        let setup = ScanSetup::read(&record.join("scan.toml"))?;
        self.foci_mm = setup
            .foci
            .iter()
            .map(|focus| match focus {
                FocusSection::Point(at_mm) => Some([at_mm.x, at_mm.y, at_mm.z]),
                FocusSection::AllZero | FocusSection::Phases(_) => None,
            })
            .collect();
        self.name = Some(setup.name);
        self.recorded = Some(setup.recorded);
        Ok(())
    }

    fn read_rig(&mut self, record: &Path) -> Result<(), Fault> {
        let path = record.join(RIG);
        if path.is_file() {
            let NamedRig { name } = TomlSource::read(&path)?.parse()?;
            self.rig = name.map(String::from);
        }
        Ok(())
    }

    fn read_state(&mut self, record: &Path) -> Result<(), Fault> {
        self.state = match ScanState::of(record)? {
            None => State::Imported,
            Some(ScanState::Complete) => State::Complete,
            Some(ScanState::Partial { .. }) => State::Partial,
            Some(ScanState::Scanning) => State::Scanning,
        };
        Ok(())
    }

    fn read_figures(&mut self, record: &Path) -> Result<(), Fault> {
        let figures = match RecordFigures::read(record)? {
            None => read_early_report(&record.join(REPORT))?,
            read => read,
        };
        let air = || AirFigures::of(&AirRow::all_of(record));
        let Some(figures) = figures else {
            self.temperature_c = air().map(|air| air.temperature_c);
            return self.read_samples(record);
        };
        let samples = record.join(SAMPLES);
        self.take(&figures);
        self.temperature_c = figures.air.or_else(air).map(|air| air.temperature_c);
        if samples.is_file() {
            return Ok(());
        }
        Err(Fault::of_file(&samples, "is missing", "find the readings again, or remove the record"))
    }

    fn take(&mut self, figures: &RecordFigures) {
        let existing = |figure: Uncertain| figure.value.is_finite().then_some(figure);
        self.points = Some(figures.points as u64);
        self.heights_mm = in_order(figures.heights.iter().map(|height| height.z_mm).collect());
        self.simulator = Some(figures.simulator);
        self.gap = existing(figures.gap);
        self.noise_floor = Some(figures.noise_floor).filter(|floor| floor.is_finite());
        self.level = existing(figures.level);
        self.correlation = existing(figures.correlation);
        self.verdict = figures.cause.as_ref().map(|cause| cause.verdict);
        self.effects =
            figures.cause.as_ref().map(|cause| cause.effects.clone()).unwrap_or_default();
        self.figures = figures.series().into_iter().collect();
    }

    /// Counts the readings of a record that was never compared.
    fn read_samples(&mut self, record: &Path) -> Result<(), Fault> {
        let scan = RecordedScan::open(record)?;
        self.points =
            Some(scan.samples.iter().filter(|sample| sample.focus.is_some()).count() as u64);
        let planes = scan.planes(SAME_HEIGHT_MM);
        self.heights_mm = in_order(planes.iter().map(|plane| plane.z_mm).collect());
        Ok(())
    }
}

/// Heights in ascending order, each once: drives share them.
fn in_order(mut heights_mm: Vec<f64>) -> Vec<f64> {
    heights_mm.sort_by(f64::total_cmp);
    heights_mm.dedup_by(|upper, lower| (*upper - *lower).abs() <= SAME_HEIGHT_MM);
    heights_mm
}
