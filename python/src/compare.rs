//! Comparisons of a recorded scan with its simulation.

use std::sync::Arc;

use fieldgap_comparison::{
    Comparison, Registering, compare as compare_scan, compare_by_amplitudes,
};
use fieldgap_input::{visible, visible_json};
use numpy::{PyArray1, PyArray2, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;

use crate::argument::simulator;
use crate::error::{argument_error, incomparable, other_error};
use crate::record::PythonRecord;
use crate::threads::interruptible;

/// A comparison.
#[pyclass(frozen, module = "fieldgap._native", name = "Comparison")]
pub struct PythonComparison {
    comparison: Comparison,
}

/// Columns, rows, readings and simulation of a map.
type MapArrays<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
);

#[pymethods]
impl PythonComparison {
    /// The JSON of `fieldgap compare --json`.
    fn to_json(&self) -> PyResult<String> {
        json(&self.comparison)
    }

    /// The table of `fieldgap compare`.
    fn to_text(&self) -> String {
        visible(&self.comparison.to_text()).into_owned()
    }

    /// The map of each plane; None where its points lie on no grid.
    fn maps<'py>(&self, py: Python<'py>) -> PyResult<Vec<Option<MapArrays<'py>>>> {
        let map = |plane: &fieldgap_comparison::PlaneComparison| {
            let Some(map) = &plane.map else { return Ok(None) };
            let shape = [map.y_m.len(), map.x_m.len()];
            Ok(Some((
                map.x_m.to_pyarray(py),
                map.y_m.to_pyarray(py),
                map.scan.to_pyarray(py).reshape(shape)?,
                map.simulation.to_pyarray(py).reshape(shape)?,
            )))
        };
        self.comparison.planes.iter().map(map).collect()
    }
}

/// Registers a record to a simulator and compares the two.
#[pyfunction]
#[pyo3(signature = (record, simulator_name=None, register="auto", threads=None, amplitude_only=false))]
pub fn compare(
    py: Python<'_>,
    record: &Bound<'_, PythonRecord>,
    simulator_name: Option<&str>,
    register: &str,
    threads: Option<usize>,
    amplitude_only: bool,
) -> PyResult<PythonComparison> {
    let scan = Arc::clone(&record.get().scan);
    let simulator = simulator_name.map_or(Ok(scan.setup.simulator), simulator)?;
    let registering = registering(register)?;
    let compared = if amplitude_only { compare_by_amplitudes } else { compare_scan };
    let comparison = interruptible(py, threads, move || compared(&scan, simulator, registering))?
        .map_err(|error| incomparable(&error))?;
    Ok(PythonComparison { comparison })
}

/// A registration by its name on the command line.
fn registering(name: &str) -> PyResult<Registering> {
    Ok(match name {
        "auto" => Registering::Auto,
        "pose" => Registering::Pose,
        "shift" => Registering::Shift,
        "gain-and-shift" => Registering::GainAndShift,
        "gain" => Registering::GainOnly,
        "none" => Registering::None,
        other => {
            return Err(argument_error(format!(
                "there is no registration `{other}`; choose auto, pose, shift, gain-and-shift, gain or none"
            )));
        }
    })
}

/// A result as JSON, control characters of the files escaped.
pub fn json(result: &impl serde::Serialize) -> PyResult<String> {
    let json = serde_json::to_string(result).map_err(|error| other_error(&error))?;
    Ok(visible_json(&json).into_owned())
}
