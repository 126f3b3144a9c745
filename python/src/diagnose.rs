//! Diagnoses of recorded scans.

use std::sync::Arc;

use fieldgap_diagnosis::{DiagnosedPlane, Diagnosis, Options, diagnose_with};
use fieldgap_input::visible;
use fieldgap_records::RecordedScan;
use numpy::{PyArray1, PyArray2, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;

use crate::argument::simulator;
use crate::compare::json;
use crate::error::incomparable;
use crate::record::PythonRecord;
use crate::threads::interruptible;

/// A diagnosis.
#[pyclass(frozen, module = "fieldgap._native", name = "Diagnosis")]
pub struct PythonDiagnosis {
    diagnosis: Diagnosis,
}

/// Columns and rows, and the maps: measured, before, after, and the residuals before and after in standard deviations.
type MapArrays<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Vec<Bound<'py, PyArray2<f64>>>);

#[pymethods]
impl PythonDiagnosis {
    /// The JSON of `fieldgap diagnose --json`.
    fn to_json(&self) -> PyResult<String> {
        json(&self.diagnosis)
    }

    /// The text of `fieldgap diagnose`.
    fn to_text(&self) -> String {
        visible(&self.diagnosis.to_text()).into_owned()
    }

    /// The maps of each plane; None where its points lie on no grid.
    fn maps<'py>(&self, py: Python<'py>) -> PyResult<Vec<Option<MapArrays<'py>>>> {
        let map = |plane: &DiagnosedPlane| {
            let shape = [plane.y_m.len(), plane.x_m.len()];
            if shape[0] * shape[1] == 0 {
                return Ok(None);
            }
            let values = [
                &plane.measured,
                &plane.before,
                &plane.after,
                &plane.residual_before,
                &plane.residual_after,
            ];
            let values: PyResult<Vec<_>> =
                values.into_iter().map(|values| values.to_pyarray(py).reshape(shape)).collect();
            Ok(Some((plane.x_m.to_pyarray(py), plane.y_m.to_pyarray(py), values?)))
        };
        self.diagnosis.planes.iter().map(map).collect()
    }
}

/// Diagnoses one record, or several of one rig together.
#[pyfunction]
#[pyo3(signature = (records, simulator_name=None, threads=None, amplitude_only=false))]
pub fn diagnose(
    py: Python<'_>,
    records: Vec<Bound<'_, PythonRecord>>,
    simulator_name: Option<&str>,
    threads: Option<usize>,
    amplitude_only: bool,
) -> PyResult<PythonDiagnosis> {
    let simulator = simulator_name.map(simulator).transpose()?;
    let scans: Vec<Arc<RecordedScan>> =
        records.iter().map(|record| Arc::clone(&record.get().scan)).collect();
    let work = move || {
        let scans: Vec<RecordedScan> = scans.iter().map(|scan| (**scan).clone()).collect();
        diagnose_with(&scans, &Options { simulator, amplitude_only, ..Options::default() })
    };
    let diagnosis = interruptible(py, threads, work)?.map_err(|error| incomparable(&error))?;
    Ok(PythonDiagnosis { diagnosis })
}
