//! `scan.toml`: the set-up of a recorded field.

use std::path::Path;
use std::str::FromStr;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use toml::Spanned;
use toml::value::Datetime;

use super::array_section::{ArraySection, TRANSDUCER_BESIDE};
use super::array_table::ArrayTable;
use super::calibration_file::CALIBRATION_BESIDE;
use super::elements_csv::write_elements;
use super::focus_section::{FocusSection, FocusTable};
use super::layout::Layout;
use super::medium_section::{MediumSection, MediumTable};
use super::phase::PhaseSection;
use super::setup_uncertainty::SetupUncertainty;
use fieldgap_acoustics::{Simulation, Simulator};
use fieldgap_input::{Fault, Label, TomlSource};
use fieldgap_level::{Sensitivity, SensitivityKeys};

/// The format of recorded scans that this program reads and writes.
const FORMAT: i64 = 1;

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ScanFile {
    format: Spanned<i64>,
    name: Label,
    recorded: Spanned<Datetime>,
    reading: Label,
    array: Spanned<ArrayTable>,
    medium: Spanned<MediumTable>,
    #[serde(skip_serializing_if = "Option::is_none")]
    receiver: Option<Spanned<SensitivityKeys>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    phase: Option<PhaseSection>,
    #[serde(skip_serializing_if = "Option::is_none")]
    uncertainty: Option<SetupUncertainty>,
    simulator: SimulatorTable,
    #[serde(default)]
    focus: Vec<Spanned<FocusTable>>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SimulatorTable {
    model: Simulator,
}

/// The set-up of a recorded field.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanSetup {
    /// Name of the scan.
    pub name: String,
    /// Time at which it was started.
    pub recorded: Timestamp,
    /// Unit of the readings, as text: `V`, `count`.
    pub unit: String,
    /// The array.
    pub array: ArraySection,
    /// The medium as assumed.
    pub medium: MediumSection,
    /// What the receiver reads at a sound pressure, where it is known.
    pub receiver: Option<Sensitivity>,
    /// What the phases of the readings mean, where they have phases.
    pub phase: Option<PhaseSection>,
    /// How well array, air and origin are known, where it is stated.
    pub uncertainty: Option<SetupUncertainty>,
    /// The simulator that the scan is compared with.
    pub simulator: Simulator,
    /// The drives of the array; samples refer to them by their number from 0.
    pub foci: Vec<FocusSection>,
}

/// A set-up that a `scan.toml` cannot contain: a year beyond four digits, a number that is not finite.
#[derive(Debug, thiserror::Error)]
#[error("the set-up of the scan cannot be written as TOML: {0}")]
pub struct UnwritableSetup(String);

impl ScanSetup {
    /// Reads the `scan.toml` of a record, and the files that it names.
    ///
    /// # Errors
    /// A [`Fault`] at the first key or value that does not fit the format, at a name that leads out of the record, or in a
    /// file that is named.
    pub fn read(path: &Path) -> Result<Self, Fault> {
        Self::parse(&TomlSource::read(path)?)
    }

    /// Reads a text as a `scan.toml`; the files that it names are searched beside it.
    ///
    /// # Errors
    /// As [`ScanSetup::read`].
    pub fn parse(source: &TomlSource) -> Result<Self, Fault> {
        let file: ScanFile = source.parse()?;
        file.array.get_ref().stays_in_record(source)?;
        Self::of_file(&file, source)
    }

    /// Reads a file of the form of a `scan.toml` that the user wrote: it may name files anywhere.
    ///
    /// # Errors
    /// As [`ScanSetup::read`], but for names that lead elsewhere.
    pub fn read_own(path: &Path) -> Result<Self, Fault> {
        let source = TomlSource::read(path)?;
        Self::of_file(&source.parse()?, &source)
    }

    fn of_file(file: &ScanFile, source: &TomlSource) -> Result<Self, Fault> {
        if *file.format.get_ref() != FORMAT {
            return Err(source.fault(
                file.format.span(),
                format!("format {} is unknown", file.format.get_ref()),
                format!("this program reads format {FORMAT}; a later one may read this scan"),
            ));
        }
        let array = ArraySection::read(&file.array, source)?;
        let foci = FocusSection::read_all(&file.focus, source)?;
        for (focus, table) in foci.iter().zip(&file.focus) {
            focus.fits(array.array().len()).map_err(|wrong| {
                source.fault(table.span(), wrong.to_string(), "give one phase for each element")
            })?;
        }
        Ok(Self {
            name: file.name.clone().into(),
            recorded: instant(&file.recorded, source)?,
            unit: file.reading.clone().into(),
            array,
            medium: MediumSection::read(&file.medium, source)?,
            receiver: receiver(file, source)?,
            phase: file.phase,
            uncertainty: file.uncertainty,
            simulator: file.simulator.model,
            foci,
        })
    }

    /// The text of the `scan.toml`.
    ///
    /// # Errors
    /// [`UnwritableSetup`] if the format cannot express it.
    pub fn to_toml(&self) -> Result<String, UnwritableSetup> {
        let recorded = Datetime::from_str(&self.recorded.to_string())
            .map_err(|_| UnwritableSetup(format!("{} is not a date of TOML", self.recorded)))?;
        let label = |text: &str| {
            Label::try_from(text.to_owned()).map_err(|wrong| UnwritableSetup(wrong.to_string()))
        };
        let file = ScanFile {
            format: Spanned::new(0..0, FORMAT),
            name: label(&self.name)?,
            recorded: Spanned::new(0..0, recorded),
            reading: label(&self.unit)?,
            array: Spanned::new(0..0, self.array.table()),
            medium: Spanned::new(0..0, self.medium.table()),
            receiver: self
                .receiver
                .as_ref()
                .map(|receiver| Spanned::new(0..0, receiver.keys().clone())),
            phase: self.phase,
            uncertainty: self.uncertainty,
            simulator: SimulatorTable { model: self.simulator },
            focus: self.foci.iter().map(|focus| Spanned::new(0..0, focus.table())).collect(),
        };
        toml::to_string(&file).map_err(|error| UnwritableSetup(error.to_string()))
    }

    /// The files of the set-up, by name: elements, transducer and calibration first, if they are in files, and `scan.toml`, which refers to them,
    /// last.
    ///
    /// # Errors
    /// As [`ScanSetup::to_toml`].
    pub fn files(&self) -> Result<Vec<(&'static str, Vec<u8>)>, UnwritableSetup> {
        let mut files = Vec::new();
        let beside = Self { array: self.array.clone().with_file_beside(), ..self.clone() };
        if let Layout::Elements { .. } = self.array.layout() {
            let mut bytes = Vec::new();
            write_elements(&mut bytes, self.array.uncalibrated().elements())
                .map_err(|error| UnwritableSetup(error.to_string()))?;
            files.push(("elements.csv", bytes));
        }
        if let Some(transducer) = self.array.transducer_file() {
            files.push((TRANSDUCER_BESIDE, transducer.text().as_bytes().to_vec()));
        }
        if let Some(calibration) = self.array.calibration_file() {
            files.push((CALIBRATION_BESIDE, calibration.text().as_bytes().to_vec()));
        }
        files.push(("scan.toml", beside.to_toml()?.into_bytes()));
        Ok(files)
    }

    /// The simulation of the set-up driven by one of the foci; `None` if there is no such focus.
    pub fn simulation(&self, simulator: Simulator, focus: usize) -> Option<Simulation> {
        Some(Simulation {
            simulator,
            array: self.array.array().clone(),
            medium: self.medium.medium(),
            frequency_hz: self.array.frequency_hz(),
            excitation: self.foci.get(focus)?.excitation(),
        })
    }
}

/// The sensitivity of the receiver, for the unit of the readings.
fn receiver(file: &ScanFile, source: &TomlSource) -> Result<Option<Sensitivity>, Fault> {
    let Some(keys) = &file.receiver else { return Ok(None) };
    let fault = |wrong: String| {
        source.fault(keys.span(), wrong, "docs/levels.md lists the keys of a sensitivity")
    };
    let found =
        Sensitivity::of_keys(keys.get_ref().clone()).map_err(|wrong| fault(wrong.to_string()))?;
    if let Some(sensitivity) = &found {
        sensitivity.rms_pa_of(file.reading.as_str()).map_err(|wrong| fault(wrong.to_string()))?;
    }
    Ok(found)
}

fn instant(recorded: &Spanned<Datetime>, source: &TomlSource) -> Result<Timestamp, Fault> {
    recorded.get_ref().to_string().parse().map_err(|_| {
        source.fault(
            recorded.span(),
            format!("{} is not a point in time", recorded.get_ref()),
            "write date, time and zone, such as 2026-11-20T17:00:00Z",
        )
    })
}

#[cfg(test)]
mod tests;
