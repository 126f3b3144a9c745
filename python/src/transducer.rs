//! Transducer models, as Python describes them.

use std::path::PathBuf;
use std::sync::Arc;

use fieldgap_acoustics::Simulator;
use fieldgap_acoustics::transducer::{DescribedTransducer, Directivity, MeasuredTable, OnAxis};
use fieldgap_records::TransducerFile;
use pyo3::prelude::*;

use crate::argument::{Numbers, numbers, simulator};
use crate::error::{argument_error, file_error};

/// A model of one transducer: its decay on the axis times its directivity.
///
/// Make one by the constructors below. On the axis the amplitude falls as distance**-exponent, 1 being spherical. An amplitude of 1 is then
/// 1 Pa at 1 m on the axis, if the drive is in pascals at 1 m.
#[pyclass(frozen, module = "fieldgap", name = "Transducer")]
pub struct PythonTransducer {
    pub transducer: Arc<DescribedTransducer>,
    name: String,
}

fn described(name: &str, directivity: Directivity, exponent: f64) -> PyResult<PythonTransducer> {
    if !(0.0..=4.0).contains(&exponent) {
        return Err(argument_error(format!(
            "exponent is {exponent}; 0 (no decay) to 4 is possible, 1 is spherical"
        )));
    }
    let on_axis = if exponent == 1.0 { OnAxis::Spherical } else { OnAxis::Power { exponent } };
    let transducer = Arc::new(DescribedTransducer { on_axis, directivity });
    Ok(PythonTransducer { transducer, name: name.to_owned() })
}

#[pymethods]
impl PythonTransducer {
    /// A point source: the same amplitude in all directions of the half-space in front.
    #[staticmethod]
    #[pyo3(signature = (*, exponent=1.0))]
    fn monopole(exponent: f64) -> PyResult<Self> {
        described("monopole", Directivity::Even, exponent)
    }

    /// The far field of a vibrating disc, 2 J1(ka sin t)/(ka sin t), with the face radius of each element.
    #[staticmethod]
    #[pyo3(signature = (*, exponent=1.0))]
    fn piston(exponent: f64) -> PyResult<Self> {
        described("piston", Directivity::Piston, exponent)
    }

    /// The same as a sum of ten Gaussians.
    #[staticmethod]
    #[pyo3(signature = (*, exponent=1.0))]
    fn multi_gaussian(exponent: f64) -> PyResult<Self> {
        described("multi_gaussian", Directivity::MultiGaussian, exponent)
    }

    /// The integral over a vibrating disc, to 1e-4 from two face radii on; about fifty times slower than the others.
    #[staticmethod]
    fn rayleigh() -> PyResult<Self> {
        described("rayleigh", Directivity::Rayleigh, 1.0)
    }

    /// A Gaussian lobe exp(-((t - centre)/width)**2) in the angle t from the axis; `width` and `centre` in radians.
    #[staticmethod]
    #[pyo3(signature = (width, *, centre=0.0, exponent=1.0))]
    fn gaussian(width: f64, centre: f64, exponent: f64) -> PyResult<Self> {
        if !(1e-3..=100.0).contains(&width) || !(0.0..=1.5).contains(&centre) {
            return Err(argument_error(format!(
                "width is {width} and centre {centre}; a width from 1e-3 to 100 and a centre from 0 to 1.5 are needed, in radians"
            )));
        }
        let directivity = Directivity::Gaussian { centre_rad: centre, width_rad: width };
        described("gaussian", directivity, exponent)
    }

    /// A measured directivity: angles from the axis, radians, ascending from 0 to pi/2, shape (N,), and the relative pressures, shape (N,).
    #[staticmethod]
    #[pyo3(signature = (angles, pressures, *, exponent=1.0))]
    fn table(angles: Numbers<'_>, pressures: Numbers<'_>, exponent: f64) -> PyResult<Self> {
        let count = angles.as_array().len();
        // The table is in degrees; a right angle in radians is rounded to just above 90 degrees.
        let angles_deg: Vec<f64> = numbers("angles", &angles, count)?
            .into_iter()
            .map(|angle| (angle.to_degrees() * 1e9).round() / 1e9)
            .collect();
        let pressures = numbers("pressures", &pressures, pressures.as_array().len())?;
        let table = MeasuredTable::new(&angles_deg, &pressures)
            .map_err(|error| argument_error(error.to_string()))?;
        described("table", Directivity::Table(table), exponent)
    }

    /// The transducer that a file describes, such as those in rigs/transducers.
    #[staticmethod]
    fn open(path: PathBuf) -> PyResult<Self> {
        let file = TransducerFile::read(&path).map_err(|fault| file_error(&fault))?;
        let transducer = Arc::clone(file.transducer());
        Ok(Self { transducer, name: file.name().to_owned() })
    }

    fn __repr__(&self) -> String {
        format!("<Transducer {}>", self.name)
    }
}

/// A transducer model as an argument: a name, or a `Transducer`.
#[derive(FromPyObject)]
pub enum ModelArgument<'py> {
    Named(String),
    Own(Bound<'py, PythonTransducer>),
}

/// What computes the field of each element.
pub struct Model {
    pub simulator: Simulator,
    /// The transducer of [`Simulator::Transducer`], if it is not that of the array's file.
    pub transducer: Option<Arc<DescribedTransducer>>,
}

impl Model {
    pub fn of(argument: Option<ModelArgument<'_>>) -> PyResult<Self> {
        let named = |simulator| Self { simulator, transducer: None };
        match argument {
            None => Ok(named(Simulator::Piston)),
            Some(ModelArgument::Named(name)) if name == "monopole" => {
                Ok(Self::own(&PythonTransducer::monopole(1.0)?))
            }
            Some(ModelArgument::Named(name)) => simulator(&name).map(named),
            Some(ModelArgument::Own(own)) => Ok(Self::own(own.get())),
        }
    }

    fn own(own: &PythonTransducer) -> Self {
        let transducer = Some(Arc::clone(&own.transducer));
        Self { simulator: Simulator::Transducer, transducer }
    }

    /// Whether each element is summed patch by patch.
    pub fn has_patches(&self) -> bool {
        self.simulator == Simulator::Rayleigh
            || self.transducer.as_ref().is_some_and(|own| own.directivity == Directivity::Rayleigh)
    }
}
