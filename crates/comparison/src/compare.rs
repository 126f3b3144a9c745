//! Scan against simulation, height by height.

use super::comparison::{
    Agreement, ComparedMap, Comparison, Discrepancy, FieldFigures, Noise, NoiseSource,
    PlaneComparison,
};
use super::levels::levels_of;
use super::noise::Roughness;
use super::plane_phase::{compare_phases, complex_map};
use super::pose::Pose;
use super::readings::Readings;
use super::receiver_face::simulation_with_receiver_face;
use super::register::{Registered, register};
use super::registration::{Registering, Registration};
use fieldgap_acoustics::metrics::PlaneMap;
use fieldgap_acoustics::{Simulation, Simulator, Vec3};
use num_complex::Complex64;

use fieldgap_records::{OFF_LINE_MM, Plane, RecordedScan, SAME_HEIGHT_MM, plane_map};

/// Fewest readings: one more than the parameters of a gain and a shift.
const FEWEST: usize = 5;

/// Readings below this show nothing, whatever their unit: their squares would be lost beside any other number.
const LEAST_READING: f64 = 1e-12;

/// Largest extent of places and elements, in wavelengths: nine metres at 40 kHz. Searches over a finer field take minutes and gigabytes.
const MOST_WAVELENGTHS: f64 = 1000.0;

/// Why a scan cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Incomparable {
    /// Every row has focus -1, or there is none.
    #[error(
        "the scan `{0}` has no reading taken with the array driven; at least one row of samples.csv needs a focus of 0 or above"
    )]
    NothingDriven(String),
    /// There are too few readings.
    #[error(
        "the scan `{name}` has {readings} readings taken with the array driven; a comparison needs at least {FEWEST}"
    )]
    TooFew {
        /// Name of the scan.
        name: String,
        /// Number of driven readings.
        readings: usize,
    },
    /// All driven readings are zero, or too small to be a reading.
    #[error(
        "every driven reading of the scan `{0}` is zero or below 1e-12: was the receiver connected?"
    )]
    AllZero(String),
    /// All driven readings are one number.
    #[error(
        "every driven reading of the scan `{name}` is {value}: the receiver seems stuck, disconnected or saturated, so there is no field \
         to compare"
    )]
    Stuck {
        /// Name of the scan.
        name: String,
        /// The reading.
        value: f64,
    },
    /// All readings were taken at too few places.
    #[error(
        "the scan `{name}` has {different} different pairs of drive and place; a comparison needs at least {FEWEST}"
    )]
    OnePlace {
        /// Name of the scan.
        name: String,
        /// Different pairs of drive and place.
        different: usize,
    },
    /// The places extend over too many wavelengths.
    #[error(
        "the places of the scan `{name}` and the array extend over {wavelengths:.0} wavelengths; fields are compared over at most \
         {MOST_WAVELENGTHS}: is `frequency_hz` right?"
    )]
    TooFine {
        /// Name of the scan.
        name: String,
        /// The extent, in wavelengths.
        wavelengths: f64,
    },
    /// The simulated field is zero at every reading.
    #[error(
        "the simulated field is zero at every reading of the scan `{0}`: are all heights above the array \
         (z_mm above 0), and do the elements face them?"
    )]
    NothingSimulated(String),
    /// There is no scan.
    #[error("there is no scan to diagnose; at least one is needed")]
    NoScan,
    /// The scans are not from one rig.
    #[error(
        "the scans `{one}` and `{other}` were made with different arrays; only scans of one rig can be diagnosed together"
    )]
    OtherArray {
        /// The first scan.
        one: String,
        /// The one that differs.
        other: String,
    },
    /// The scans do not state the uncertainty of one set-up.
    #[error(
        "the scans `{one}` and `{other}` state different uncertainties of their set-up; scans that are diagnosed together have one set-up, \
         so give the scan.toml of each the same [uncertainty] section, or none"
    )]
    OtherUncertainty {
        /// The first scan.
        one: String,
        /// The one that differs.
        other: String,
    },
}

/// Registers a scan to a simulator and compares the two. The same scan gives the same bits. Phases are registered with the amplitudes, where a scan has them.
///
/// # Errors
/// [`Incomparable`] if there is nothing to compare.
pub fn compare(
    scan: &RecordedScan,
    simulator: Simulator,
    registering: Registering,
) -> Result<Comparison, Incomparable> {
    compared(scan, simulator, registering, true)
}

/// As [`compare`], with the amplitudes registered alone.
///
/// # Errors
/// [`Incomparable`] if there is nothing to compare.
pub fn compare_by_amplitudes(
    scan: &RecordedScan,
    simulator: Simulator,
    registering: Registering,
) -> Result<Comparison, Incomparable> {
    compared(scan, simulator, registering, false)
}

fn compared(
    scan: &RecordedScan,
    simulator: Simulator,
    registering: Registering,
    use_phases: bool,
) -> Result<Comparison, Incomparable> {
    let readings = Readings::of(scan, simulator, use_phases);
    comparable(scan, &readings)?;
    let name = || scan.setup.name.clone();
    let Registered { registration, fit } = register(&readings, registering);
    let values = readings.values();
    let mut comparison = Comparison {
        scan_name: name(),
        reading_unit: scan.setup.unit.clone(),
        simulator,
        points: readings.len(),
        noise: Noise { additive: f64::NAN, multiplicative: 0.0, source: NoiseSource::Residual },
        registration,
        planes: Vec::new(),
        overall: Agreement::of(&fit.simulated, &values, fit.gain),
        levels: None,
    };
    let planes: Vec<SimulatedPlane<'_>> = scan
        .planes(SAME_HEIGHT_MM)
        .into_iter()
        .filter_map(|plane| {
            let simulation = scan.setup.simulation(simulator, plane.focus)?;
            let simulation = match comparison.registration.receiver_face_m {
                Some(face) => simulation_with_receiver_face(&simulation, face.value),
                None => simulation,
            };
            Some(SimulatedPlane::of(&simulation, plane, &fit.pose, fit.gain))
        })
        .collect();
    let mut roughness = Roughness::default();
    for map in planes.iter().filter_map(|plane| plane.map.as_ref().ok()) {
        roughness.add(&map.scan, &map.simulation, map.x_m.len());
    }
    let of_residual = roughness.noise().unwrap_or(Noise {
        additive: comparison.overall.residual_rms,
        multiplicative: 0.0,
        source: NoiseSource::Residual,
    });
    comparison.noise = Noise::of(scan, of_residual);
    let phases: Vec<_> = planes.iter().map(|plane| plane.complex_map(scan)).collect();
    comparison.planes = planes.into_iter().map(|plane| plane.compared(&comparison)).collect();
    let simulation = |focus| scan.setup.simulation(simulator, focus);
    compare_phases(scan, &mut comparison.planes, &phases, &fit.pose, simulation);
    comparison.levels = levels_of(scan, &comparison);
    Ok(comparison)
}

/// Registers a scan to a simulator without comparing the two. The same scan gives the same bits. Phases are registered with the amplitudes, where a scan
/// has them.
///
/// # Errors
/// [`Incomparable`] if the scan has too few driven readings, or readings or simulation are zero everywhere.
pub fn register_scan(
    scan: &RecordedScan,
    simulator: Simulator,
    registering: Registering,
) -> Result<Registration, Incomparable> {
    registered(scan, simulator, registering, true)
}

/// As [`register_scan`], by the amplitudes alone.
///
/// # Errors
/// [`Incomparable`] if the scan has too few driven readings, or readings or simulation are zero everywhere.
pub fn register_scan_by_amplitudes(
    scan: &RecordedScan,
    simulator: Simulator,
    registering: Registering,
) -> Result<Registration, Incomparable> {
    registered(scan, simulator, registering, false)
}

fn registered(
    scan: &RecordedScan,
    simulator: Simulator,
    registering: Registering,
    use_phases: bool,
) -> Result<Registration, Incomparable> {
    let readings = Readings::of(scan, simulator, use_phases);
    comparable(scan, &readings)?;
    Ok(register(&readings, registering).registration)
}

/// The largest extent of places and elements along an axis, m.
fn extent_m(readings: &Readings) -> f64 {
    let drives = readings.drives();
    let places = || drives.iter().flat_map(|drive| drive.positions_m.iter().copied());
    let elements =
        || drives.iter().flat_map(|drive| drive.simulation.array.elements()).map(|e| e.centre_m);
    let extent_m = |axis: usize| {
        let ends = places().chain(elements()).map(|at| at[axis]);
        let (least, most) =
            ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), m| (a.min(m), b.max(m)));
        most - least
    };
    (0..3).map(extent_m).fold(0.0, f64::max)
}

/// Whether there is anything to compare.
fn comparable(scan: &RecordedScan, readings: &Readings) -> Result<(), Incomparable> {
    let name = || scan.setup.name.clone();
    if readings.is_empty() {
        return Err(Incomparable::NothingDriven(name()));
    }
    if readings.len() < FEWEST {
        return Err(Incomparable::TooFew { name: name(), readings: readings.len() });
    }
    let values = readings.values();
    if values.iter().all(|reading| *reading < LEAST_READING) {
        return Err(Incomparable::AllZero(name()));
    }
    if values.iter().all(|reading| *reading == values[0]) {
        return Err(Incomparable::Stuck { name: name(), value: values[0] });
    }
    let different = readings.different();
    if different < FEWEST {
        return Err(Incomparable::OnePlace { name: name(), different });
    }
    let wavelengths = extent_m(readings) / readings.wavelength_m();
    if wavelengths > MOST_WAVELENGTHS {
        return Err(Incomparable::TooFine { name: name(), wavelengths });
    }
    if readings.simulate(&Pose::default()).magnitudes.iter().all(|magnitude| *magnitude == 0.0) {
        return Err(Incomparable::NothingSimulated(name()));
    }
    Ok(())
}

/// A plane with the simulation beside each of its readings, and on its grid.
struct SimulatedPlane<'s> {
    plane: Plane<'s>,
    target_m: Option<Vec3>,
    target_in_scan_m: Option<Vec3>,
    positions_m: Vec<Vec3>,
    readings: Vec<f64>,
    /// In the simulator's unit.
    simulated: Vec<f64>,
    gain: f64,
    map: Result<ComparedMap, String>,
}

impl<'s> SimulatedPlane<'s> {
    fn of(simulation: &Simulation, plane: Plane<'s>, pose: &Pose, gain: f64) -> Self {
        let field = |positions_m: &[Vec3]| {
            let points_m: Vec<Vec3> = positions_m.iter().map(|at| pose.to_array(at)).collect();
            simulation.field(&points_m)
        };
        let rms = simulation.rms();
        let positions_m: Vec<Vec3> = plane.samples.iter().map(|s| s.position_m()).collect();
        let map = plane_map(&plane, OFF_LINE_MM).map_err(|why| why.to_string()).map(|mapped| {
            let (x_m, y_m) = (mapped.map.x_m().to_vec(), mapped.map.y_m().to_vec());
            let grid: Vec<Vec3> = y_m
                .iter()
                .flat_map(|y| x_m.iter().map(|x| Vec3::new(*x, *y, plane.z_mm * 1e-3)))
                .collect();
            let field = field(&grid);
            let simulation = field.iter().map(|pressure| gain * rms(*pressure)).collect();
            let phase_rad = Some(field.iter().map(|pressure| pressure.arg()).collect());
            ComparedMap { scan: mapped.map.values().to_vec(), simulation, phase_rad, x_m, y_m }
        });
        let target_m = simulation.excitation.focus_m();
        Self {
            target_m,
            target_in_scan_m: target_m.map(|target| pose.to_scan(&target)),
            simulated: field(&positions_m).into_iter().map(rms).collect(),
            readings: plane.samples.iter().map(|sample| sample.reading).collect(),
            positions_m,
            gain,
            map,
            plane,
        }
    }

    fn complex_map(&self, scan: &RecordedScan) -> Option<Vec<Option<Complex64>>> {
        complex_map(scan, &self.plane, self.map.as_ref().ok()?)
    }

    fn compared(self, comparison: &Comparison) -> PlaneComparison {
        let figures = self.map.as_ref().ok().and_then(|map| {
            let scan = FieldFigures::of_scan(&map.scan_map(), &comparison.noise)?;
            let simulation =
                FieldFigures::of_simulation(&map.simulation_map(), &comparison.registration)?;
            Some((scan, simulation))
        });
        let (scan, simulation) = figures.unwrap_or_else(|| {
            let scaled: Vec<f64> = self.simulated.iter().map(|m| self.gain * m).collect();
            let gain = comparison.registration.gain;
            let of_gain = |value: f64| value * gain.standard_error / gain.value.abs();
            let at = &self.positions_m;
            let of_noise = |value: f64| comparison.noise.at(value);
            (
                FieldFigures::of_scattered(at, &self.readings, of_noise),
                FieldFigures::of_scattered(at, &scaled, of_gain),
            )
        });
        let (map, why_no_map) = match self.map {
            Ok(map) => (Some(map), None),
            Err(why) => (None, Some(why)),
        };
        PlaneComparison {
            focus: self.plane.focus,
            z_m: self.plane.z_mm * 1e-3,
            target_m: self.target_m,
            target_in_scan_m: self.target_in_scan_m,
            map,
            why_no_map,
            discrepancy: Discrepancy::between(&scan, &simulation),
            scan,
            simulation,
            agreement: Agreement::of(&self.simulated, &self.readings, self.gain),
            points: self.readings.len(),
            phase: None,
        }
    }
}

impl ComparedMap {
    /// The scan as a map.
    pub fn scan_map(&self) -> PlaneMap {
        self.map_of(self.scan.clone())
    }

    /// The simulation as a map, where the scan was measured: the same figures from the same points.
    pub fn simulation_map(&self) -> PlaneMap {
        let seen =
            |(scan, simulation): (&f64, &f64)| if scan.is_nan() { f64::NAN } else { *simulation };
        self.map_of(self.scan.iter().zip(&self.simulation).map(seen).collect())
    }

    fn map_of(&self, values: Vec<f64>) -> PlaneMap {
        PlaneMap::new(self.x_m.clone(), self.y_m.clone(), values)
            .expect("columns and rows of a map rise, and there is a value for each point")
    }
}
