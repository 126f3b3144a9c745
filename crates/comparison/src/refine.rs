//! The pose refined: least squares of readings less gain times simulation, over any of the pose's parameters.
//!
//! The gain is linear and is solved for at each pose, so that only the pose is searched (variable projection in
//! Kaufman's approximation, BIT 15, 49, 1975). All five derivatives follow from the gradient of the simulated field
//! by the chain rule: four evaluations of the field a step, whatever is free.

use nalgebra::DMatrix;

use super::agreement::{best_gain, correlation, rms};
use super::pose::Pose;
use super::readings::{Readings, SimulatedGradient};
use super::standard_errors::Blocks;
use fieldgap_acoustics::least_squares::dot;
use fieldgap_acoustics::least_squares::{Linearisation, Parameter, Stopping, minimise};

/// A parameter of the pose that can be estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseParameter {
    /// Shift along the array's x.
    ShiftX,
    /// Shift along the array's y.
    ShiftY,
    /// Shift along the array's z.
    ShiftZ,
    /// Turn about z.
    Turn,
    /// Step ratio.
    Step,
}

impl PoseParameter {
    /// All five.
    pub const ALL: [Self; 5] = [Self::ShiftX, Self::ShiftY, Self::ShiftZ, Self::Turn, Self::Step];
    /// The shift only.
    pub const SHIFT: [Self; 3] = [Self::ShiftX, Self::ShiftY, Self::ShiftZ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::ShiftX => "shift_x",
            Self::ShiftY => "shift_y",
            Self::ShiftZ => "shift_z",
            Self::Turn => "turn",
            Self::Step => "step_ratio",
        }
    }

    /// Its value in a pose.
    pub fn of(self, pose: &Pose) -> f64 {
        match self {
            Self::ShiftX => pose.shift_m.x,
            Self::ShiftY => pose.shift_m.y,
            Self::ShiftZ => pose.shift_m.z,
            Self::Turn => pose.turn_rad,
            Self::Step => pose.step_ratio,
        }
    }

    fn set(self, pose: &mut Pose, value: f64) {
        match self {
            Self::ShiftX => pose.shift_m.x = value,
            Self::ShiftY => pose.shift_m.y = value,
            Self::ShiftZ => pose.shift_m.z = value,
            Self::Turn => pose.turn_rad = value,
            Self::Step => pose.step_ratio = value,
        }
    }

    /// A change of it that matters: about what moves the edge of a map of 70 mm by half a millimetre.
    fn scale(self) -> f64 {
        match self {
            Self::ShiftX | Self::ShiftY => 0.5e-3,
            Self::ShiftZ => 2e-3,
            Self::Turn | Self::Step => 0.01,
        }
    }
}

/// What is searched for, and how thoroughly.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// The parameters that are free, each with what is known of it beforehand (mean and standard deviation).
    pub free: Vec<(PoseParameter, Option<(f64, f64)>)>,
    /// Most linearisations.
    pub iterations: usize,
}

/// A pose and how well it does.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The pose.
    pub pose: Pose,
    /// Reading per unit of the simulation.
    pub gain: f64,
    /// The simulation at each reading, in its own unit.
    pub simulated: Vec<f64>,
    /// Pearson's correlation with the readings.
    pub correlation: f64,
    /// Rms of the residual over that of the readings.
    pub residual_ratio: f64,
}

impl Fit {
    /// The best gain at a pose.
    pub fn at(readings: &Readings, pose: Pose) -> Self {
        let values = readings.values();
        let simulated = readings.simulate(&pose);
        let gain = best_gain(&simulated, &values);
        Self::with_gain(pose, gain, simulated, &values)
    }

    /// A given gain at a pose.
    pub fn with_gain(pose: Pose, gain: f64, simulated: Vec<f64>, readings: &[f64]) -> Self {
        let residual = residual(&simulated, readings, gain);
        let ratio = rms(residual.iter().copied()) / rms(readings.iter().copied());
        let correlation = correlation(&simulated, readings);
        Self { pose, gain, simulated, correlation, residual_ratio: ratio }
    }
}

/// Refines a pose. Priors weigh against the data as if each block of readings told one independent thing (see
/// [`Blocks`]), since what is left of a field is never independent from point to point.
pub fn refine(readings: &Readings, start: Pose, search: &Search) -> Fit {
    let values = readings.values();
    let before = Fit::at(readings, start);
    let blocks = Blocks::of(readings);
    /// Below this the residual is numerical noise, and priors need not weigh against it.
    const SMALLEST_RATIO: f64 = 1e-3;
    let sigma = before.residual_ratio.max(SMALLEST_RATIO)
        * rms(values.iter().copied())
        * (values.len() as f64 / blocks.count() as f64).sqrt();
    let parameters: Vec<Parameter> = search
        .free
        .iter()
        .map(|(parameter, prior)| Parameter {
            start: parameter.of(&start),
            scale: parameter.scale(),
            prior: *prior,
            range: None,
        })
        .collect();
    let pose_at = |x: &[f64]| {
        let mut pose = start;
        for ((parameter, _), value) in search.free.iter().zip(x) {
            parameter.set(&mut pose, *value);
        }
        pose
    };
    let weighted = |simulated: &[f64]| -> Vec<f64> {
        let gain = best_gain(simulated, &values);
        residual(simulated, &values, gain).into_iter().map(|r| r / sigma).collect()
    };
    let minimum = minimise(
        &parameters,
        Stopping { iterations: search.iterations, step: 1e-4, fall: 1e-7, ..Stopping::default() },
        |x| weighted(&readings.simulate(&pose_at(x))),
        |x| {
            let pose = pose_at(x);
            let gradient = readings.simulate_gradient(&pose);
            let free: Vec<PoseParameter> = search.free.iter().map(|(p, _)| *p).collect();
            let scale = -best_gain(&gradient.magnitudes, &values) / sigma;
            let mut columns = derivatives(readings, &pose, &gradient, &free);
            for column in &mut columns {
                project_out(&gradient.magnitudes, column);
                column.iter_mut().for_each(|entry| *entry *= scale);
            }
            Linearisation { residuals: weighted(&gradient.magnitudes), columns }
        },
    );
    let mut pose = pose_at(&minimum.parameters);
    pose.turn_rad = wrapped(pose.turn_rad);
    Fit::at(readings, pose)
}

/// Derivative of the simulated magnitudes by each parameter of the pose: one column a parameter.
pub fn derivatives(
    readings: &Readings,
    pose: &Pose,
    gradient: &SimulatedGradient,
    parameters: &[PoseParameter],
) -> Vec<Vec<f64>> {
    let [per_x, per_y, per_z] = &gradient.per_m;
    let from_shift: Vec<_> =
        readings.positions_m().iter().map(|scan_m| pose.to_array(scan_m) - pose.shift_m).collect();
    let column = |parameter: &PoseParameter| -> Vec<f64> {
        (0..from_shift.len())
            .map(|i| {
                let (x, y) = (from_shift[i].x, from_shift[i].y);
                match parameter {
                    PoseParameter::ShiftX => per_x[i],
                    PoseParameter::ShiftY => per_y[i],
                    PoseParameter::ShiftZ => per_z[i],
                    PoseParameter::Turn => x * per_y[i] - y * per_x[i],
                    PoseParameter::Step => (x * per_x[i] + y * per_y[i]) / pose.step_ratio,
                }
            })
            .collect()
    };
    parameters.iter().map(column).collect()
}

/// Takes out of a column what a change of the gain would do as well.
pub(super) fn project_out(simulated: &[f64], column: &mut [f64]) {
    let share = dot(simulated, column) / dot(simulated, simulated).max(f64::MIN_POSITIVE);
    for (entry, s) in column.iter_mut().zip(simulated) {
        *entry -= share * s;
    }
}

/// Readings less gain times simulation.
pub(super) fn residual(simulated: &[f64], readings: &[f64], gain: f64) -> Vec<f64> {
    readings.iter().zip(simulated).map(|(r, s)| r - gain * s).collect()
}

/// An angle between -π and π.
fn wrapped(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// Columns as a matrix.
pub(super) fn matrix(columns: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(columns[0].len(), columns.len(), |row, column| columns[column][row])
}
