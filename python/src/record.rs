//! Recorded scans as arrays, read from a folder or made from arrays.

use std::path::PathBuf;
use std::sync::Arc;

use fieldgap_acoustics::Vec3;
use fieldgap_acoustics::metrics::PlaneMap;
use fieldgap_input::NonNegative;
use fieldgap_records::{
    FocusSection, OFF_LINE_MM, PhaseConvention, PhaseReference, PhaseSection, RecordedSample,
    RecordedScan, SAME_HEIGHT_MM, ScanSetup, plane_map,
};
use jiff::Timestamp;
use numpy::{
    AllowTypeChange, PyArray1, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods, ToPyArray,
};
use pyo3::prelude::*;

use crate::argument::{Numbers, Triples, numbers, place_m, rows, simulator};
use crate::array::{PythonArray, of_vectors};
use crate::error::{argument_error, file_error, other_error};
use crate::medium::PythonMedium;
use crate::simulate::frequency_of;

/// A recorded scan.
#[pyclass(frozen, module = "fieldgap._native", name = "Record")]
pub struct PythonRecord {
    pub scan: Arc<RecordedScan>,
    folder: Option<PathBuf>,
}

/// Columns, rows and values of a map.
type MapArrays<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// Drive, height in metres, and the map or the reason why there is none.
type PlaneArrays<'py> = (usize, f64, Option<MapArrays<'py>>, Option<String>);

#[pymethods]
impl PythonRecord {
    #[staticmethod]
    fn open(folder: PathBuf) -> PyResult<Self> {
        let scan = RecordedScan::open(&folder).map_err(|fault| file_error(&fault))?;
        Ok(Self { scan: Arc::new(scan), folder: Some(folder) })
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments)] // keywords in Python
    fn from_arrays(
        array: &Bound<'_, PythonArray>,
        positions: Triples<'_>,
        readings: Numbers<'_>,
        reading_phases: Option<(Numbers<'_>, String, String, Option<f64>)>,
        foci: Option<Triples<'_>>,
        phases: Option<PyArrayLike2<'_, f64, AllowTypeChange>>,
        drives: Option<PyArrayLike1<'_, i64, AllowTypeChange>>,
        times: Option<Numbers<'_>>,
        medium: Option<&Bound<'_, PythonMedium>>,
        frequency: Option<f64>,
        simulator_name: &str,
        unit: String,
        name: String,
    ) -> PyResult<Self> {
        let array = array.get();
        let foci = match (&foci, &phases) {
            (Some(foci), None) => rows("focus", foci)?
                .into_iter()
                .map(|focus| Ok(FocusSection::Point(place_m("focus", focus)? * 1e3)))
                .collect::<PyResult<Vec<_>>>()?,
            (None, Some(phases)) => phases
                .as_array()
                .outer_iter()
                .map(|of_drive| FocusSection::Phases(of_drive.to_vec()))
                .collect(),
            (None, None) => vec![FocusSection::AllZero],
            (Some(_), Some(_)) => return Err(argument_error("give focus or phases, not both")),
        };
        for focus in &foci {
            focus.fits(array.array.len()).map_err(|wrong| argument_error(wrong.to_string()))?;
        }
        let medium = match (medium, array.medium) {
            (Some(medium), _) => medium.get().section,
            (None, Some(of_file)) => of_file,
            (None, None) => PythonMedium::of_room()?.section,
        };
        let mut samples =
            samples(foci.len(), &positions, &readings, drives.as_ref(), times.as_ref())?;
        let phase = match reading_phases {
            Some((phases, reference, convention, drift)) => {
                let phases = numbers("the phases of readings", &phases, samples.len())?;
                for (sample, phase_rad) in samples.iter_mut().zip(phases) {
                    *sample = sample.with_phase(Some(phase_rad));
                }
                Some(phase_section(&reference, &convention, drift)?)
            }
            None => None,
        };
        let setup = ScanSetup {
            name,
            recorded: Timestamp::now(),
            unit,
            array: array.section_at(frequency_of(frequency, array)?)?,
            medium,
            receiver: None,
            phase,
            uncertainty: None,
            simulator: simulator(simulator_name)?,
            foci,
        };
        // A name or unit that a file cannot hold is an error here, not on writing.
        setup.to_toml().map_err(|error| argument_error(error.to_string()))?;
        Ok(Self { scan: Arc::new(RecordedScan { setup, samples }), folder: None })
    }

    fn write(&self, folder: PathBuf) -> PyResult<()> {
        self.scan.write(&folder).map_err(|error| other_error(&error))
    }

    #[getter]
    fn folder(&self) -> Option<PathBuf> {
        self.folder.clone()
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scan.setup.name
    }

    #[getter]
    fn unit(&self) -> &str {
        &self.scan.setup.unit
    }

    /// The time at which it was started, ISO 8601 with zone Z.
    #[getter]
    fn recorded(&self) -> String {
        self.scan.setup.recorded.to_string()
    }

    #[getter]
    fn simulator(&self) -> String {
        self.scan.setup.simulator.to_string()
    }

    #[getter]
    fn layout(&self) -> String {
        self.scan.setup.array.layout().to_string()
    }

    #[getter]
    fn array(&self) -> PythonArray {
        let setup = &self.scan.setup;
        PythonArray::of_section(setup.array.clone(), Some(setup.medium))
    }

    #[getter]
    fn medium(&self) -> PythonMedium {
        PythonMedium { section: self.scan.setup.medium }
    }

    #[getter]
    fn frequency(&self) -> f64 {
        self.scan.setup.array.frequency_hz()
    }

    /// The focus of each drive, m; None where a drive has none.
    #[getter]
    fn foci(&self) -> Vec<Option<(f64, f64, f64)>> {
        let setup = &self.scan.setup;
        let point =
            |focus: &FocusSection| focus.excitation().focus_m().map(|at| (at.x, at.y, at.z));
        setup.foci.iter().map(point).collect()
    }

    /// The phases of each drive, rad, shape (drives, elements).
    #[getter]
    fn phases<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let setup = &self.scan.setup;
        let (array, medium) = (setup.array.array(), setup.medium.medium());
        let phases: Vec<f64> = setup
            .foci
            .iter()
            .flat_map(|focus| {
                focus.excitation().phases_rad(array, &medium, setup.array.frequency_hz())
            })
            .collect();
        phases.to_pyarray(py).reshape([setup.foci.len(), array.len()])
    }

    fn __len__(&self) -> usize {
        self.scan.samples.len()
    }

    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        of_vectors(py, self.scan.samples.iter().map(RecordedSample::position_m))
    }

    #[getter]
    fn readings<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |sample| sample.reading)
    }

    /// Reference, convention and drift of the phases; None where the record has none.
    #[getter]
    fn phase(&self) -> Option<(&'static str, &'static str, f64)> {
        self.scan.setup.phase.map(|phase| {
            let (reference, convention) = phase.named();
            (reference, convention, phase.drift_u_rad())
        })
    }

    /// Phase of each reading in the convention exp(-iωt), rad; NaN where there is none.
    #[getter]
    fn reading_phases<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let convention = self.scan.setup.phase.map(|phase| phase.convention);
        self.each(py, |sample| {
            let turned = convention.zip(sample.phase_rad);
            turned.map_or(f64::NAN, |(convention, phase_rad)| convention.turned(phase_rad))
        })
    }

    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |sample| sample.time_s)
    }

    /// Number of the drive of each reading; -1 with the array silent.
    #[getter]
    fn drives<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.each(py, |sample| sample.focus.map_or(-1, |focus| focus as i64))
    }

    /// Standard deviation of the single readings behind each; NaN where the receiver gives none.
    #[getter]
    fn spreads<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |sample| sample.spread.map_or(f64::NAN, |spread| spread.std))
    }

    /// Number of single readings behind each; 0 where the receiver gives none.
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.each(py, |sample| sample.spread.map_or(0, |spread| i64::from(spread.count)))
    }

    /// The planes by drive, then height: drive, height in m, columns, rows and readings of the map, or why there is no map.
    fn planes<'py>(&self, py: Python<'py>) -> PyResult<Vec<PlaneArrays<'py>>> {
        let planes = self.scan.planes(SAME_HEIGHT_MM);
        planes
            .iter()
            .map(|plane| {
                let height_m = plane.z_mm / 1e3;
                match plane_map(plane, OFF_LINE_MM) {
                    Ok(mapped) => Ok((plane.focus, height_m, Some(arrays(py, &mapped.map)?), None)),
                    Err(why) => Ok((plane.focus, height_m, None, Some(why.to_string()))),
                }
            })
            .collect()
    }
}

impl PythonRecord {
    fn each<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        number: impl Fn(&RecordedSample) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_iter(py, self.scan.samples.iter().map(number))
    }
}

/// What phases mean, by the words of a scan.toml.
fn phase_section(reference: &str, convention: &str, drift: Option<f64>) -> PyResult<PhaseSection> {
    let reference = match reference {
        "drive-sync" => PhaseReference::DriveSync,
        "each-drive" => PhaseReference::EachDrive,
        other => {
            return Err(argument_error(format!(
                "there is no reference `{other}`; choose drive-sync or each-drive"
            )));
        }
    };
    let convention =
        convention.parse::<PhaseConvention>().map_err(|error| argument_error(error.to_string()))?;
    let drift_u_rad = drift
        .map(|drift| {
            NonNegative::new(drift).map_err(|_| {
                argument_error(format!(
                    "drift is {drift}; it is an uncertainty in rad, zero or above"
                ))
            })
        })
        .transpose()?;
    Ok(PhaseSection { drift_u_rad, reference, ..PhaseSection::of_drive_sync(convention) })
}

fn arrays<'py>(py: Python<'py>, map: &PlaneMap) -> PyResult<MapArrays<'py>> {
    let shape = [map.y_m().len(), map.x_m().len()];
    let values = map.values().to_pyarray(py).reshape(shape)?;
    Ok((map.x_m().to_pyarray(py), map.y_m().to_pyarray(py), values))
}

/// Readings from arrays: finite, zero or above, each with a drive that there is.
fn samples(
    drives_in_all: usize,
    positions: &Triples<'_>,
    readings: &Numbers<'_>,
    drives: Option<&PyArrayLike1<'_, i64, AllowTypeChange>>,
    times: Option<&Numbers<'_>>,
) -> PyResult<Vec<RecordedSample>> {
    let positions = rows("positions", positions)?;
    let count = positions.len();
    let readings = numbers("readings", readings, count)?;
    let times_s = match times {
        Some(times) => numbers("times", times, count)?,
        None => (0..count).map(|number| number as f64).collect(),
    };
    let drives = match drives {
        Some(drives) => drives.as_array().to_vec(),
        None => vec![0; count],
    };
    if drives.len() != count {
        return Err(argument_error(format!(
            "drives has {} numbers; {count} are needed",
            drives.len()
        )));
    }
    let sample = |number: usize| {
        if readings[number] < 0.0 {
            return Err(argument_error(format!(
                "readings[{number}] is {}; a reading is a magnitude, zero or above",
                readings[number]
            )));
        }
        let drive = match drives[number] {
            -1 => None,
            drive => match usize::try_from(drive) {
                Ok(drive) if drive < drives_in_all => Some(drive),
                _ => {
                    return Err(argument_error(format!(
                        "drives[{number}] is {drive}; there are the drives 0 to {}, and -1 stands for a silent array",
                        drives_in_all - 1
                    )));
                }
            },
        };
        let at_m: Vec3 = place_m(&format!("positions[{number}]"), positions[number])?;
        Ok(RecordedSample::measured(times_s[number], drive, at_m, readings[number], None))
    };
    (0..count).map(sample).collect()
}
