//! Arrays of elements, as Python describes them or as a file does.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use fieldgap_acoustics::{Array, Element, LayoutError, Vec3};
use fieldgap_input::{Fault, Frequency, Gap, Length, OutOfRange, TomlSource};
use fieldgap_records::{
    ArraySection, ArrayTable, Layout, MediumSection, MediumTable, Plan, Rims, TRANSDUCER_BESIDE,
};
use numpy::{PyArray1, PyArray2, ToPyArray};
use pyo3::prelude::*;
use serde::Deserialize;
use toml::Spanned;

use crate::argument::{Numbers, Triples, length_m, numbers, place_m, rows};
use crate::error::{argument_error, file_error};
use crate::medium::PythonMedium;

/// Radius of the vibrating face of a Murata MA40S4S, m: that of `Element::at`.
const FACE_RADIUS_M: f64 = 4.5e-3;

/// Most elements of an array: as in a file, see `fieldgap_records`.
const MOST_ELEMENTS: usize = 10_000;

/// An array of ultrasonic elements.
///
/// Make one by the constructors below. Coordinates are in metres: the origin is the centre of the array on the plane of the faces, z points
/// into the field. Elements are numbered from 0.
#[pyclass(frozen, module = "fieldgap", name = "Array")]
pub struct PythonArray {
    pub array: Array,
    /// The section of the file that it was read from.
    pub section: Option<ArraySection>,
    /// The regular layout that it was made by, for the set-up of a record.
    layout: Option<Layout>,
    pub medium: Option<MediumSection>,
}

#[pymethods]
impl PythonArray {
    /// A rectangular lattice, row by row from the corner with the largest y and the smallest x.
    #[staticmethod]
    #[pyo3(signature = (columns, rows, *, pitch, face_radius=4.5e-3))]
    fn square(columns: usize, rows: usize, pitch: f64, face_radius: f64) -> PyResult<Self> {
        few_enough(columns.saturating_mul(rows))?;
        let (columns, rows) = (some(columns)?, some(rows)?);
        Self::regular(Layout::Square { columns, rows, rims: rims(pitch)? }, face_radius)
    }

    /// One row along x, from the smallest x.
    #[staticmethod]
    #[pyo3(signature = (count, *, pitch, face_radius=4.5e-3))]
    fn linear(count: usize, pitch: f64, face_radius: f64) -> PyResult<Self> {
        few_enough(count)?;
        Self::regular(Layout::Linear { count: some(count)?, rims: rims(pitch)? }, face_radius)
    }

    /// A triangular lattice of rings about the centre; ring k has 6 k elements, clockwise from the corner at 90 degrees.
    #[staticmethod]
    #[pyo3(signature = (rings, *, pitch, face_radius=4.5e-3))]
    fn hexagonal(rings: usize, pitch: f64, face_radius: f64) -> PyResult<Self> {
        few_enough(rings.saturating_add(1).saturating_mul(rings).saturating_mul(3))?;
        let rings = u32::try_from(rings).map_err(|error| argument_error(error.to_string()))?;
        Self::regular(Layout::Hexagonal { rings, rims: rims(pitch)? }, face_radius)
    }

    /// Elements at random positions without overlap, in a square of side count * pitch / 2. The same seed gives the same array.
    #[staticmethod]
    #[pyo3(signature = (count, *, pitch, seed=0, face_radius=4.5e-3))]
    fn random(count: usize, pitch: f64, seed: u32, face_radius: f64) -> PyResult<Self> {
        few_enough(count)?;
        let layout = Layout::Random { count: some(count)?, seed, rims: rims(pitch)? };
        Self::regular(layout, face_radius)
    }

    /// Elements at any positions.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, shape (N, 3)
    ///     Centres of the faces, m.
    /// normals : array_like, shape (N, 3), optional
    ///     Directions in which they radiate, of any length above zero; without them along z.
    /// face_radius : float
    ///     Radius of the vibrating faces, m.
    /// amplitudes : array_like, shape (N,), optional
    ///     Amplitudes relative to the nominal one, 0 or above; without them 1.
    /// phases : array_like, shape (N,), optional
    ///     Phases in addition to those of the drive, rad; without them 0.
    #[staticmethod]
    #[pyo3(signature = (positions, normals=None, *, face_radius=4.5e-3, amplitudes=None, phases=None))]
    fn from_positions(
        positions: Triples<'_>,
        normals: Option<Triples<'_>>,
        face_radius: f64,
        amplitudes: Option<Numbers<'_>>,
        phases: Option<Numbers<'_>>,
    ) -> PyResult<Self> {
        let radius_m = length_m("face_radius", face_radius)?;
        let positions = rows("positions", &positions)?;
        let count = positions.len();
        few_enough(count)?;
        let normals = match &normals {
            Some(normals) => directions(&rows("normals", normals)?, count)?,
            None => vec![Vec3::z(); count],
        };
        let per_element = |name, given: &Option<Numbers<'_>>, usual| match given {
            Some(given) => numbers(name, given, count),
            None => Ok(vec![usual; count]),
        };
        let amplitudes = per_element("amplitudes", &amplitudes, 1.0)?;
        if let Some(at) = amplitudes.iter().position(|amplitude| *amplitude < 0.0) {
            return Err(argument_error(format!(
                "amplitudes[{at}] is {}; an amplitude is 0 or above, and a phase of pi inverts it",
                amplitudes[at]
            )));
        }
        let phases = per_element("phases", &phases, 0.0)?;
        let mut elements = Vec::with_capacity(count);
        for (n, position) in positions.into_iter().enumerate() {
            elements.push(Element {
                centre_m: place_m(&format!("positions[{n}]"), position)?,
                normal: normals[n],
                radius_m,
                amplitude: amplitudes[n],
                phase_rad: phases[n],
            });
        }
        Ok(Self::plain(Array::from_elements(elements).map_err(layout_error)?))
    }

    /// The array of a rig file, a plan, or the scan.toml of a record, with its frequency and medium. A plan gives that of the rig file that it
    /// names.
    #[staticmethod]
    fn open(path: PathBuf) -> PyResult<Self> {
        read(&path).map_err(|fault| file_error(&fault))
    }

    /// Centres of the faces, m, shape (N, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        of_vectors(py, self.array.elements().iter().map(|element| element.centre_m))
    }

    /// Directions in which the elements radiate, unit vectors, shape (N, 3).
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        of_vectors(py, self.array.elements().iter().map(|element| element.normal))
    }

    /// Radii of the vibrating faces, m, shape (N,).
    #[getter]
    fn face_radii<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |element| element.radius_m)
    }

    /// Amplitudes relative to the nominal one, shape (N,); 0 is a silent element.
    #[getter]
    fn amplitudes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |element| element.amplitude)
    }

    /// Phases of the elements in addition to those of the drive, rad, shape (N,).
    #[getter]
    fn phases<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |element| element.phase_rad)
    }

    /// Drive frequency of the array's file, Hz; None for an array that is not from a file.
    #[getter]
    fn frequency(&self) -> Option<f64> {
        self.section.as_ref().map(ArraySection::frequency_hz)
    }

    /// Medium of the array's file; None for an array that is not from a file.
    #[getter]
    fn medium(&self) -> Option<PythonMedium> {
        self.medium.map(|section| PythonMedium { section })
    }

    fn __len__(&self) -> usize {
        self.array.len()
    }

    fn __repr__(&self) -> String {
        let count = self.array.len();
        match (&self.section, &self.layout) {
            (Some(section), _) => {
                format!(
                    "<Array: {}, {count} elements, {} Hz>",
                    section.layout(),
                    section.frequency_hz()
                )
            }
            (None, Some(layout)) => format!("<Array: {layout}, {count} elements>"),
            (None, None) => format!("<Array: {count} elements>"),
        }
    }
}

impl PythonArray {
    fn plain(array: Array) -> Self {
        Self { array, section: None, layout: None, medium: None }
    }

    pub fn of_section(section: ArraySection, medium: Option<MediumSection>) -> Self {
        Self { array: section.array().clone(), section: Some(section), layout: None, medium }
    }

    fn regular(layout: Layout, face_radius: f64) -> PyResult<Self> {
        let radius_m = length_m("face_radius", face_radius)?;
        let array = layout.build().map_err(layout_error)?;
        let faced = array.elements().iter().map(|&element| Element { radius_m, ..element });
        let array = Array::from_elements(faced.collect()).map_err(layout_error)?;
        // A layout in a file has the usual faces.
        let layout = (radius_m == FACE_RADIUS_M).then_some(layout);
        Ok(Self { layout, ..Self::plain(array) })
    }

    fn each<'py>(
        &self,
        py: Python<'py>,
        number: impl Fn(&Element) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.array.elements().iter().map(number))
    }

    /// The section for a record, at a frequency that may not be that of the array's file.
    pub fn section_at(&self, frequency: Frequency) -> PyResult<ArraySection> {
        let of_file = self.section.as_ref();
        if let Some(section) = of_file.filter(|own| own.frequency_hz() == frequency.get()) {
            return Ok(section.clone());
        }
        let section = match self.layout.as_ref().or(of_file.map(ArraySection::layout)) {
            None | Some(Layout::Elements { .. }) => {
                ArraySection::of_elements(frequency, self.array.elements().to_vec())
            }
            Some(layout) => ArraySection::of_layout(frequency, layout.clone()),
        };
        let section = section.map_err(layout_error)?;
        Ok(match of_file.and_then(ArraySection::transducer_file) {
            Some(file) => section.with_transducer(TRANSDUCER_BESIDE, file.clone()),
            None => section,
        })
    }
}

/// A number of elements above zero.
fn some(count: usize) -> PyResult<NonZeroU32> {
    u32::try_from(count)
        .ok()
        .and_then(NonZeroU32::new)
        .ok_or_else(|| argument_error(LayoutError::Empty.to_string()))
}

/// Elements that touch, at a pitch in metres.
fn rims(pitch: f64) -> PyResult<Rims> {
    let refused = |refused: OutOfRange| argument_error(refused.to_string());
    // To the nanometre, so that 10.5e-3 m is 10.5 mm and not 10.500000000000002.
    let pitch_mm = (length_m("pitch", pitch)? * 1e9).round() / 1e6;
    let diameter_mm = Length::new(pitch_mm).map_err(refused)?;
    Ok(Rims { diameter_mm, spacing_mm: Gap::new(0.0).map_err(refused)? })
}

/// Vectors as an array of shape (N, 3).
pub fn of_vectors(
    py: Python<'_>,
    vectors: impl Iterator<Item = Vec3>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    use numpy::PyArrayMethods;
    let numbers: Vec<f64> = vectors.flat_map(|vector| [vector.x, vector.y, vector.z]).collect();
    numbers.to_pyarray(py).reshape([numbers.len() / 3, 3])
}

fn directions(rows: &[[f64; 3]], count: usize) -> PyResult<Vec<Vec3>> {
    if rows.len() != count {
        return Err(argument_error(format!(
            "normals has {} rows; {count} are needed, one for each position",
            rows.len()
        )));
    }
    let unit = |(n, row): (usize, &[f64; 3])| {
        let vector = Vec3::from(*row);
        let length = vector.norm();
        if length.is_finite() && length > 0.0 {
            return Ok(vector / length);
        }
        Err(argument_error(format!("normals[{n}] is {row:?}, which is no direction")))
    };
    rows.iter().enumerate().map(unit).collect()
}

fn few_enough(count: usize) -> PyResult<()> {
    if count <= MOST_ELEMENTS {
        return Ok(());
    }
    Err(argument_error(format!(
        "an array has at most {MOST_ELEMENTS} elements; this one would have {count}"
    )))
}

fn layout_error(error: LayoutError) -> PyErr {
    argument_error(error.to_string())
}

/// The sections of a rig file or of a scan.toml that describe the array; all others are left to the programs that use them.
#[derive(Deserialize)]
struct SetUp {
    array: Spanned<ArrayTable>,
    medium: Spanned<MediumTable>,
}

/// What tells a plan from the other files: it alone says nothing of the array.
#[derive(Deserialize)]
struct Kind {
    array: Option<toml::Value>,
}

fn read(path: &Path) -> Result<PythonArray, Fault> {
    let source = TomlSource::read(path)?;
    if source.parse::<Kind>()?.array.is_some() {
        return set_up(&source);
    }
    let plan = Plan::parse(source)?;
    let Some(rig) = plan.rig else {
        return Err(Fault::of_file(
            path,
            "the plan names no rig file, and so no array",
            "open the rig file instead, or add `rig = \"...\"` to the plan",
        ));
    };
    set_up(&TomlSource::read(&rig)?)
}

fn set_up(source: &TomlSource) -> Result<PythonArray, Fault> {
    let file: SetUp = source.parse()?;
    let section = ArraySection::read(&file.array, source)?;
    let medium = MediumSection::read(&file.medium, source)?;
    Ok(PythonArray::of_section(section, Some(medium)))
}
