//! `[array]`: the elements, and the frequency at which they are driven.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::Spanned;

use super::array_table::{ArrayTable, NamedCalibration};
use super::calibration_file::{CALIBRATION_BESIDE, CalibrationFile};
use super::elements_csv::read_elements;
use super::layout::Layout;
use super::transducer_file::{TransducerFile, transducer_path};
use fieldgap_acoustics::{Array, Element, LayoutError};
use fieldgap_input::{Fault, Frequency, TomlSource};

/// Most elements of an array: twice those of the largest display known, twenty units of 249, and still computed in seconds.
const MAX_ELEMENTS: u64 = 10_000;

/// The name of a transducer file beside a record.
pub const TRANSDUCER_BESIDE: &str = "transducer.toml";

/// `[array]`, checked, with the array that it describes.
#[derive(Debug, Clone, PartialEq)]
pub struct ArraySection {
    frequency_hz: Frequency,
    layout: Layout,
    array: Array,
    transducer: Option<NamedTransducer>,
    calibration: Option<Calibration>,
}

/// A calibration file, its name in the section, and the array without it.
#[derive(Debug, Clone, PartialEq)]
struct Calibration {
    name: String,
    file: CalibrationFile,
    compensated: bool,
    uncalibrated: Array,
}

/// A transducer file and its name in the section.
#[derive(Debug, Clone, PartialEq)]
struct NamedTransducer {
    name: String,
    file: TransducerFile,
}

impl ArraySection {
    /// Checks the `[array]` of `source` and builds the array. The path of a file of elements is relative to the folder of `source`.
    ///
    /// # Errors
    /// A [`Fault`] at a key that does not belong to the layout, or naming a missing one; at the layout, if the array cannot be built;
    /// or in the file of elements.
    pub fn read(table: &Spanned<ArrayTable>, source: &TomlSource) -> Result<Self, Fault> {
        let table = table.get_ref();
        let layout = table.layout(source)?;
        let at_layout = |problem: String| {
            source.fault(table.layout_place(), problem, "change the numbers of this section")
        };
        if layout.elements() > MAX_ELEMENTS {
            return Err(at_layout(format!(
                "an array has at most {MAX_ELEMENTS} elements; this one would have more"
            )));
        }
        let folder = source.path().parent().unwrap_or(Path::new(""));
        let array = match &layout {
            Layout::Elements { file } => {
                let elements = read_elements(&folder.join(file))?;
                if elements.len() as u64 > MAX_ELEMENTS {
                    return Err(at_layout(format!(
                        "the file has {} elements; at most {MAX_ELEMENTS} are allowed",
                        elements.len()
                    )));
                }
                Array::from_elements(elements)
            }
            lattice => lattice.build(),
        };
        let array = array.map_err(|error| at_layout(error.to_string()))?;
        let mut section = Self::plain(table.frequency_hz(), layout, array);
        if let Some(name) = table.transducer() {
            section = section.with_transducer(name.get_ref(), TransducerFile::named(name, source)?);
        }
        let compensated = table.is_compensated(source)?;
        let Some(name) = table.calibration() else { return Ok(section) };
        let file = CalibrationFile::named(name, source)?;
        let (channels, elements) = (file.channels().len(), section.array.len());
        section.with_calibration(name.get_ref(), file, compensated).ok_or_else(|| {
            source.fault(
                name.span(),
                format!(
                    "the calibration has {channels} channels, and the array has {elements} elements"
                ),
                "name the calibration of this array",
            )
        })
    }

    fn plain(frequency_hz: Frequency, layout: Layout, array: Array) -> Self {
        Self { frequency_hz, layout, array, transducer: None, calibration: None }
    }

    /// The array as a calibration found it; `name` is the file's name in the section. With `compensated` its drive corrects the phases.
    /// `None` for another number of elements.
    pub fn with_calibration(
        self,
        name: &str,
        file: CalibrationFile,
        compensated: bool,
    ) -> Option<Self> {
        let uncalibrated = self.uncalibrated().clone();
        let array = file.applied_to(&uncalibrated, compensated)?;
        let calibration =
            Some(Calibration { name: name.to_owned(), file, compensated, uncalibrated });
        Some(Self { array, calibration, ..self })
    }

    /// The elements as the layout has them, without a calibration.
    pub fn uncalibrated(&self) -> &Array {
        self.calibration.as_ref().map_or(&self.array, |calibration| &calibration.uncalibrated)
    }

    /// The calibration file, if one is named.
    pub fn calibration_file(&self) -> Option<&CalibrationFile> {
        self.calibration.as_ref().map(|calibration| &calibration.file)
    }

    /// The phase that is added to the drive of each channel, rad: minus that of the calibration where the drive is compensated, otherwise
    /// zero.
    pub fn compensation_rad(&self) -> Vec<f64> {
        match &self.calibration {
            Some(Calibration { file, compensated: true, .. }) => {
                file.channels().iter().map(|channel| -channel.phase_rad).collect()
            }
            _ => vec![0.0; self.array.len()],
        }
    }

    /// The same array with the transducers that a file describes; `name` is the file's name in the section.
    pub fn with_transducer(self, name: &str, file: TransducerFile) -> Self {
        let mut array = self.array;
        if let Some(radius_m) = file.face_radius_m() {
            let faced = array.elements().iter().map(|&element| Element { radius_m, ..element });
            array = Array::from_elements(faced.collect()).expect("as many elements as before");
        }
        let array = array.with_transducer(Arc::clone(file.transducer()));
        Self { array, transducer: Some(NamedTransducer { name: name.to_owned(), file }), ..self }
    }

    /// A regular or random layout.
    ///
    /// # Errors
    /// [`LayoutError`] if it cannot be built; [`LayoutError::Empty`] for [`Layout::Elements`], for which there is
    /// [`ArraySection::of_elements`].
    pub fn of_layout(frequency_hz: Frequency, layout: Layout) -> Result<Self, LayoutError> {
        let array = layout.build()?;
        Ok(Self::plain(frequency_hz, layout, array))
    }

    /// Any elements; they are written to the file `elements.csv` beside the section.
    ///
    /// # Errors
    /// [`LayoutError::Empty`] if there are none.
    pub fn of_elements(
        frequency_hz: Frequency,
        elements: Vec<Element>,
    ) -> Result<Self, LayoutError> {
        let layout = Layout::Elements { file: "elements.csv".to_owned() };
        let array = Array::from_elements(elements)?;
        Ok(Self::plain(frequency_hz, layout, array))
    }

    /// Drive frequency, Hz.
    pub fn frequency_hz(&self) -> f64 {
        self.frequency_hz.get()
    }

    /// How the elements are arranged.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The elements.
    pub fn array(&self) -> &Array {
        &self.array
    }

    /// The section for writing.
    pub fn table(&self) -> ArrayTable {
        let transducer = self.transducer.as_ref().map(|named| named.name.as_str());
        let calibration = self.calibration.as_ref().map(|calibration| NamedCalibration {
            name: &calibration.name,
            compensated: calibration.compensated,
        });
        ArrayTable::of(self.frequency_hz, &self.layout, transducer, calibration)
    }

    /// The path of the transducer file, relative to the folder of the section.
    pub fn transducer_path(&self) -> Option<PathBuf> {
        self.transducer.as_ref().map(|named| transducer_path(&named.name))
    }

    /// The transducer file, if one is named.
    pub fn transducer_file(&self) -> Option<&TransducerFile> {
        self.transducer.as_ref().map(|named| &named.file)
    }

    /// The same array with the files of its elements, transducer and calibration, if any, called `elements.csv`, `transducer.toml` and
    /// `calibration.toml` beside the section.
    pub fn with_file_beside(mut self) -> Self {
        if let Layout::Elements { file } = &mut self.layout {
            "elements.csv".clone_into(file);
        }
        if let Some(named) = &mut self.transducer {
            TRANSDUCER_BESIDE.clone_into(&mut named.name);
        }
        if let Some(calibration) = &mut self.calibration {
            CALIBRATION_BESIDE.clone_into(&mut calibration.name);
        }
        self
    }
}

#[cfg(test)]
mod tests;
