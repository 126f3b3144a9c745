//! How the elements of an array are arranged.

use std::num::NonZeroU32;

use fieldgap_acoustics::{Array, LayoutError};
use fieldgap_input::{Gap, Length};

/// How the elements are arranged. See [`Array`] for the order in which they are numbered.
#[derive(Debug, Clone, PartialEq)]
pub enum Layout {
    /// Rows and columns.
    Square {
        /// Elements in a row.
        columns: NonZeroU32,
        /// Elements in a column.
        rows: NonZeroU32,
        /// Their size and spacing.
        rims: Rims,
    },
    /// A row along x.
    Linear {
        /// Elements.
        count: NonZeroU32,
        /// Their size and spacing.
        rims: Rims,
    },
    /// Rings of the triangular lattice about the centre.
    Hexagonal {
        /// Number of rings; with 0 there is only the centre.
        rings: u32,
        /// Their size and spacing.
        rims: Rims,
    },
    /// Rings as in the thesis, up to three.
    HexagonalThesis {
        /// Rings.
        rings: u32,
        /// Their size and spacing.
        rims: Rims,
    },
    /// At random positions without overlap.
    Random {
        /// Elements.
        count: NonZeroU32,
        /// Seed of the random positions.
        seed: u32,
        /// Their size and smallest spacing.
        rims: Rims,
    },
    /// One by one, from a file.
    Elements {
        /// The file, from the folder of the file that names it.
        file: String,
    },
}

impl std::fmt::Display for Layout {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Square { columns, rows, rims } => write!(f, "{columns} x {rows} square, {rims}"),
            Self::Linear { count, rims } => write!(f, "row of {count}, {rims}"),
            Self::Hexagonal { rings, rims } => write!(f, "hexagon of {rings} rings, {rims}"),
            Self::HexagonalThesis { rings, rims } => {
                write!(f, "hexagon of {rings} rings as in the thesis, {rims}")
            }
            Self::Random { count, seed, rims } => {
                write!(f, "{count} at random, seed {seed}, {rims}")
            }
            Self::Elements { file } => write!(f, "elements of {file}"),
        }
    }
}

/// Size and gap of the elements of a lattice, millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rims {
    /// Diameter of an element's housing.
    pub diameter_mm: Length,
    /// Gap between the rims of neighbours.
    pub spacing_mm: Gap,
}

impl std::fmt::Display for Rims {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} mm across, {} mm apart", self.diameter_mm.get(), self.spacing_mm.get())
    }
}

impl Rims {
    /// Distance between the centres of neighbours, metres.
    pub fn pitch_m(self) -> f64 {
        (self.diameter_mm.get() + self.spacing_mm.get()) / 1e3
    }
}

impl Layout {
    /// The number of elements; 0 where only the file knows it.
    pub fn elements(&self) -> u64 {
        match *self {
            Self::Square { columns, rows, .. } => u64::from(columns.get()) * u64::from(rows.get()),
            Self::Linear { count, .. } | Self::Random { count, .. } => u64::from(count.get()),
            Self::Hexagonal { rings, .. } | Self::HexagonalThesis { rings, .. } => {
                let rings = u64::from(rings);
                3_u64.saturating_mul(rings).saturating_mul(rings + 1).saturating_add(1)
            }
            Self::Elements { .. } => 0,
        }
    }

    /// The elements, in their numbered order.
    ///
    /// # Errors
    /// [`LayoutError`] if there is no such array; [`LayoutError::Empty`] for elements in a file.
    pub fn build(&self) -> Result<Array, LayoutError> {
        let whole = |count: u32| count as usize;
        match *self {
            Self::Square { columns, rows, rims } => {
                Array::square(whole(columns.get()), whole(rows.get()), rims.pitch_m())
            }
            Self::Linear { count, rims } => Array::linear(whole(count.get()), rims.pitch_m()),
            Self::Hexagonal { rings, rims } => Ok(Array::hexagonal(whole(rings), rims.pitch_m())),
            Self::HexagonalThesis { rings, rims } => {
                Array::hexagonal_thesis(whole(rings), rims.pitch_m())
            }
            Self::Random { count, seed, rims } => {
                Array::random(whole(count.get()), rims.pitch_m(), u64::from(seed))
            }
            Self::Elements { .. } => Err(LayoutError::Empty),
        }
    }
}
