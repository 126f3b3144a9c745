//! `[array]`: the elements, and the frequency at which they are driven.

use std::path::Path;

use toml::Spanned;

use super::array_table::ArrayTable;
use super::elements_csv::read_elements;
use super::layout::Layout;
use crate::acoustics::{Array, Element, LayoutError};
use crate::input::{Fault, Positive, TomlSource};

/// Most elements an array may have: a hundred times the largest known display, and still quickly computed.
const MAX_ELEMENTS: u64 = 100_000;

/// An array that can be built and has been.
#[derive(Debug, Clone, PartialEq)]
pub struct ArraySection {
    frequency_hz: Positive,
    layout: Layout,
    array: Array,
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
        let array = match &layout {
            Layout::Elements { file } => {
                let folder = source.path().parent().unwrap_or(Path::new(""));
                Array::from_elements(read_elements(&folder.join(file))?)
            }
            lattice => lattice.build(),
        };
        let array = array.map_err(|error| at_layout(error.to_string()))?;
        Ok(Self { frequency_hz: table.frequency_hz(), layout, array })
    }

    /// A lattice, or elements at random.
    ///
    /// # Errors
    /// [`LayoutError`] if it cannot be built; [`LayoutError::Empty`] for [`Layout::Elements`], whose elements only
    /// [`ArraySection::of_elements`] knows.
    pub fn of_layout(frequency_hz: Positive, layout: Layout) -> Result<Self, LayoutError> {
        let array = layout.build()?;
        Ok(Self { frequency_hz, layout, array })
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
        Ok(Self { frequency_hz, layout, array: Array::from_elements(elements)? })
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
    pub(crate) fn table(&self) -> ArrayTable {
        ArrayTable::of(self.frequency_hz, &self.layout)
    }

    /// The same array, its elements, if they are in a file, to be found in `elements.csv` beside the section.
    pub(crate) fn with_file_beside(mut self) -> Self {
        if let Layout::Elements { file } = &mut self.layout {
            "elements.csv".clone_into(file);
        }
        self
    }
}

#[cfg(test)]
mod tests;
