//! The field of an array at any points.

use std::sync::Arc;

use fieldgap_acoustics::{Array, Element, Excitation, FieldKernel, Propagation, Simulation, Vec3};
use fieldgap_input::Frequency;
use num_complex::Complex64;
use numpy::{AllowTypeChange, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use rayon::ThreadPool;
use rayon::prelude::*;

use crate::argument::{FARTHEST_M, place_m};
use crate::array::PythonArray;
use crate::error::{argument_error, other_error};
use crate::medium::PythonMedium;
use crate::plane::{GridOfPoints, write_plane};
use crate::threads::{interruptible, pool};
use crate::transducer::{Model, ModelArgument};

/// Drive frequency where none is given, Hz: that of nearly every ultrasonic display.
pub const FREQUENCY_HZ: f64 = 40e3;

/// Pairs of point and source between two looks for Ctrl-C: about a tenth of a second on one core.
const PAIRS_OF_BLOCK: usize = 1 << 26;

/// Points of a block, least (enough for every core) and most (so that a block stays in the processor's cache).
const POINTS_OF_BLOCK: (usize, usize) = (1 << 12, 1 << 16);

/// Fewest sources for which the structure of a plane saves time. With 36 a plane took up to twice as long by its structure as point by point, with
/// 100 between 1.1 and 0.24 times as long (both with 76 x 76 to 601 x 601 points).
const SOURCES_OF_STRUCTURE: usize = 100;

/// Patches of a face that is integrated over; it takes about fifty times as long.
const PATCHES: usize = 50;

/// One complex number for each element.
type Drive<'py> = PyReadonlyArray1<'py, Complex64>;

/// The complex field at `points`; see `fieldgap.simulate`.
#[pyfunction]
#[pyo3(signature = (array, points, *, focus=None, drive=None, medium=None, frequency=None, transducer=None, attenuation=0.0, method="auto", threads=None))]
#[allow(clippy::too_many_arguments)] // keywords in Python
pub fn simulate<'py>(
    py: Python<'py>,
    array: &Bound<'py, PythonArray>,
    points: PyArrayLikeDyn<'py, f64, AllowTypeChange>,
    focus: Option<[f64; 3]>,
    drive: Option<Drive<'py>>,
    medium: Option<&Bound<'py, PythonMedium>>,
    frequency: Option<f64>,
    transducer: Option<ModelArgument<'py>>,
    attenuation: f64,
    method: &str,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyArrayDyn<Complex64>>> {
    let array = array.get();
    let model = Model::of(transducer)?;
    let sources = array.array.len() * if model.has_patches() { PATCHES } else { 1 };
    let by_structure = match method {
        "auto" => true,
        "direct" => false,
        other => {
            return Err(argument_error(format!(
                "there is no method `{other}`; choose \"auto\" or \"direct\""
            )));
        }
    };
    if !(0.0..=1e3).contains(&attenuation) {
        return Err(argument_error(format!(
            "attenuation is {attenuation}; 0 to 1000 Np/m is possible"
        )));
    }
    let medium = match (medium, array.medium) {
        (Some(medium), _) => medium.get().section,
        (None, Some(of_file)) => of_file,
        (None, None) => PythonMedium::of_room()?.section,
    };
    let (driven, excitation) = driven(&array.array, focus, drive.as_ref())?;
    let simulation = Simulation {
        simulator: model.simulator,
        array: match &model.transducer {
            Some(own) => driven.with_transducer(Arc::clone(own)),
            None => driven,
        },
        medium: medium.medium(),
        frequency_hz: frequency_of(frequency, array)?.get(),
        excitation,
    };
    let propagation = Propagation { attenuation_np_m: attenuation, ..Propagation::default() };
    let pool = pool(threads)?;

    // Points in order are read where they are; others are put in order once.
    let view = points.as_array();
    let ordered = view.as_standard_layout();
    let (Some(points_m), [leading @ .., 3]) = (ordered.as_slice(), ordered.shape()) else {
        return Err(argument_error(format!(
            "points has the shape {:?}; its last axis must be 3 long: x, y and z in metres",
            view.shape()
        )));
    };
    let field = PyArrayDyn::<Complex64>::zeros(py, leading, false);
    let mut borrowed = field.try_readwrite().map_err(|error| other_error(&error))?;
    let out = borrowed.as_slice_mut().map_err(|error| other_error(&error))?;
    let kernel = Arc::new(py.detach(|| simulation.kernel().with_propagation(propagation)));
    let sum = Sum { py, threads, pool, kernel, sources };
    match *leading {
        [.., outer, inner] if by_structure && pays(sources, outer, inner) => {
            let points_of_planes = points_m.chunks_exact(3 * outer * inner);
            for (points_m, out) in points_of_planes.zip(out.chunks_exact_mut(outer * inner)) {
                sum.on_plane(points_m, outer, inner, out)?;
            }
        }
        _ => sum.at(points_m, out)?,
    }
    drop(borrowed);
    Ok(field)
}

/// Whether the structure of a plane is worth the search for it.
fn pays(sources: usize, outer: usize, inner: usize) -> bool {
    sources >= SOURCES_OF_STRUCTURE && outer.saturating_mul(inner) >= POINTS_OF_BLOCK.0
}

/// A sum that runs without the interpreter's lock and that Ctrl-C ends.
struct Sum<'py> {
    py: Python<'py>,
    threads: Option<usize>,
    pool: Arc<ThreadPool>,
    kernel: Arc<FieldKernel>,
    sources: usize,
}

impl Sum<'_> {
    /// The field at points of shape (`outer`, `inner`, 3), by the structure of their plane where they are its grid.
    fn on_plane(
        &self,
        points_m: &[f64],
        outer: usize,
        inner: usize,
        out: &mut [Complex64],
    ) -> PyResult<()> {
        let found = self.py.detach(|| GridOfPoints::of(points_m, outer, inner));
        let Some(GridOfPoints { grid, x_outer }) = found.filter(|found| found.is_near()) else {
            return self.at(points_m, out);
        };
        let kernel = Arc::clone(&self.kernel);
        let columns = grid.x_m.len();
        let sum = interruptible(self.py, self.threads, move || kernel.on_plane(&grid))?;
        self.py.detach(|| write_plane(&sum.field, columns, x_outer, out));
        Ok(())
    }

    /// The field at any points, block by block.
    fn at(&self, points_m: &[f64], out: &mut [Complex64]) -> PyResult<()> {
        let (least, most) = POINTS_OF_BLOCK;
        let points = (PAIRS_OF_BLOCK / self.sources).clamp(least, most);
        for (number, (block_m, out)) in
            points_m.chunks(3 * points).zip(out.chunks_mut(points)).enumerate()
        {
            let (pool, kernel) = (&self.pool, &self.kernel);
            let bad = self.py.detach(|| pool.install(|| sum_block(kernel, block_m, out)));
            if let Some(at) = bad {
                return Err(argument_error(format!(
                    "point {} of points (counted in C order from 0) is not finite, or is more than 10 m away; are the points in metres?",
                    number * points + at
                )));
            }
            self.py.check_signals()?;
        }
        Ok(())
    }
}

/// Sums one block; gives the first point that is no place instead, if there is one.
fn sum_block(kernel: &FieldKernel, block_m: &[f64], out: &mut [Complex64]) -> Option<usize> {
    let places: Vec<Vec3> =
        block_m.par_chunks_exact(3).map(|point| Vec3::new(point[0], point[1], point[2])).collect();
    let bad = places.iter().position(|place| !is_place(place));
    if bad.is_none() {
        out.copy_from_slice(&kernel.at(&places));
    }
    bad
}

/// Whether a point is within ten metres of the array along each axis.
fn is_place(point: &Vec3) -> bool {
    point.iter().all(|along| along.abs() < FARTHEST_M)
}

/// The frequency of a call: as given, else that of the array's file, else 40 kHz.
pub fn frequency_of(given: Option<f64>, array: &PythonArray) -> PyResult<Frequency> {
    let of_file = array.section.as_ref().map(|section| section.frequency_hz());
    Frequency::new(given.or(of_file).unwrap_or(FREQUENCY_HZ))
        .map_err(|refused| argument_error(refused.to_string()))
}

/// The array with the amplitudes of a drive, and its phases or focus.
fn driven(
    array: &Array,
    focus: Option<[f64; 3]>,
    drive: Option<&Drive<'_>>,
) -> PyResult<(Array, Excitation)> {
    match (focus, drive) {
        (Some(_), Some(_)) => Err(argument_error("give focus or drive, not both")),
        (Some(focus), None) => Ok((array.clone(), Excitation::Focus(place_m("focus", focus)?))),
        (None, None) => Ok((array.clone(), Excitation::Uniform)),
        (None, Some(drive)) => with_drive(array, &drive.as_array().to_vec()),
    }
}

fn with_drive(array: &Array, drive: &[Complex64]) -> PyResult<(Array, Excitation)> {
    if drive.len() != array.len() {
        return Err(argument_error(format!(
            "drive has {} numbers, and the array has {} elements",
            drive.len(),
            array.len()
        )));
    }
    if let Some(at) = drive.iter().position(|number| !number.is_finite()) {
        return Err(argument_error(format!("drive[{at}] is {}", drive[at])));
    }
    let elements = array.elements().iter().zip(drive).map(|(element, number)| Element {
        amplitude: element.amplitude * number.norm(),
        ..*element
    });
    let scaled = Array::from_elements(elements.collect())
        .map_err(|error| argument_error(error.to_string()))?;
    let scaled = match array.transducer() {
        Some(transducer) => scaled.with_transducer(Arc::new(transducer.clone())),
        None => scaled,
    };
    let phases_rad = drive.iter().map(|number| number.arg()).collect();
    Ok((scaled, Excitation::Phases(phases_rad)))
}
