//! `[array]`: the elements, and the frequency at which they are driven.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use toml::Spanned;

use super::array_table::ArrayTable;
use super::elements_csv::read_elements;
use super::layout::Layout;
use super::transducer_file::{TransducerFile, transducer_path};
use fieldgap_acoustics::{Array, Element, LayoutError};
use fieldgap_input::{Fault, Positive, TomlSource};

/// Most elements an array may have: a hundred times the largest known display, and still quickly computed.
const MAX_ELEMENTS: u64 = 100_000;

/// What a transducer file is called beside a record.
pub const TRANSDUCER_BESIDE: &str = "transducer.toml";

/// An array that can be built and has been.
#[derive(Debug, Clone, PartialEq)]
pub struct ArraySection {
    frequency_hz: Positive,
    layout: Layout,
    array: Array,
    transducer: Option<NamedTransducer>,
}

/// A transducer file, and what it is called in the section.
#[derive(Debug, Clone, PartialEq)]
struct NamedTransducer {
    name: String,
    file: TransducerFile,
}

impl ArraySection {
    /// Makes sense of the `[array]` of `source`, and builds it. A file of elements is looked for from the folder
    /// that `source` is in.
    ///
    /// # Errors
    /// A [`Fault`] at a key that does not belong to the layout, or naming one that is missing; at the layout, if no
    /// such array can be built; or in the file of elements.
    pub fn read(table: &Spanned<ArrayTable>, source: &TomlSource) -> Result<Self, Fault> {
        let table = table.get_ref();
        let layout = table.layout(source)?;
        let at_layout = |problem: String| {
            source.fault(table.layout_place(), problem, "change the numbers of this section")
        };
        if layout.elements() > MAX_ELEMENTS {
            return Err(at_layout(format!(
                "the array would have {} elements; {MAX_ELEMENTS} are the most",
                layout.elements()
            )));
        }
        let folder = source.path().parent().unwrap_or(Path::new(""));
        let array = match &layout {
            Layout::Elements { file } => Array::from_elements(read_elements(&folder.join(file))?),
            lattice => lattice.build(),
        };
        let array = array.map_err(|error| at_layout(error.to_string()))?;
        let section = Self { frequency_hz: table.frequency_hz(), layout, array, transducer: None };
        let Some(name) = table.transducer() else { return Ok(section) };
        Ok(section.made_of(name.get_ref(), TransducerFile::named(name, source)?))
    }

    /// The same array, made of the transducers that a file describes; `name` is what the section calls it.
    pub fn made_of(self, name: &str, file: TransducerFile) -> Self {
        let mut array = self.array;
        if let Some(radius_m) = file.face_radius_m() {
            let faced = array.elements().iter().map(|&element| Element { radius_m, ..element });
            array = Array::from_elements(faced.collect()).expect("as many elements as before");
        }
        let array = array.with_transducer(Arc::clone(file.transducer()));
        Self { array, transducer: Some(NamedTransducer { name: name.to_owned(), file }), ..self }
    }

    /// A lattice, or elements at random.
    ///
    /// # Errors
    /// [`LayoutError`] if it cannot be built; [`LayoutError::Empty`] for [`Layout::Elements`], whose elements only
    /// [`ArraySection::of_elements`] knows.
    pub fn of_layout(frequency_hz: Positive, layout: Layout) -> Result<Self, LayoutError> {
        let array = layout.build()?;
        Ok(Self { frequency_hz, layout, array, transducer: None })
    }

    /// Any elements, which go into the file `elements.csv` wherever the section is written.
    ///
    /// # Errors
    /// [`LayoutError::Empty`] if there are none.
    pub fn of_elements(
        frequency_hz: Positive,
        elements: Vec<Element>,
    ) -> Result<Self, LayoutError> {
        let layout = Layout::Elements { file: "elements.csv".to_owned() };
        let array = Array::from_elements(elements)?;
        Ok(Self { frequency_hz, layout, array, transducer: None })
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

    /// As it is written.
    pub fn table(&self) -> ArrayTable {
        let transducer = self.transducer.as_ref().map(|named| named.name.as_str());
        ArrayTable::of(self.frequency_hz, &self.layout, transducer)
    }

    /// Where that file stands, from the folder of the section.
    pub fn transducer_path(&self) -> Option<PathBuf> {
        self.transducer.as_ref().map(|named| transducer_path(&named.name))
    }

    /// The file of the transducer that the array is made of, if it is named.
    pub fn transducer_file(&self) -> Option<&TransducerFile> {
        self.transducer.as_ref().map(|named| &named.file)
    }

    /// The same array, its elements and its transducer, if they are in files, to be found in `elements.csv` and
    /// `transducer.toml` beside the section.
    pub fn with_file_beside(mut self) -> Self {
        if let Layout::Elements { file } = &mut self.layout {
            "elements.csv".clone_into(file);
        }
        if let Some(named) = &mut self.transducer {
            TRANSDUCER_BESIDE.clone_into(&mut named.name);
        }
        self
    }
}

#[cfg(test)]
mod tests;
