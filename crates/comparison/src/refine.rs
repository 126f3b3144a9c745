//! The pose refined: least squares of readings less gain times simulation, over any of the pose's parameters.
//!
//! The gain is linear and is solved for at each pose, so that only the pose is searched (variable projection in
//! Kaufman's approximation, BIT 15, 49, 1975). All five derivatives follow from the gradient of the simulated field
//! by the chain rule: four evaluations of the field a step, whatever is free.
//!
//! Where readings have phases, the amplitudes alone are fitted first, since a pose half a wavelength off has phases without meaning. From there both
//! are fitted ([`PhaseResiduals`]), and the noise of a phase is judged anew after each round.

use nalgebra::DMatrix;

use super::agreement::{best_gain, correlation, rms};
use super::phase_fit::{FittedPhases, PhaseResiduals, Scatter};
use super::pose::Pose;
use super::readings::{Readings, Simulated, SimulatedGradient, Slope};
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
    /// Rms of the residual of the amplitudes over that of the readings.
    pub residual_ratio: f64,
    /// The phases, where they are used.
    pub phases: Option<FittedPhases>,
}

/// Below this the residual, over the readings, is numerical noise, and priors need not weigh against it.
const SMALLEST_RATIO: f64 = 1e-3;

/// Rounds in which amplitudes and phases are fitted, and most linearisations of each.
const ROUNDS_WITH_PHASES: usize = 3;
const ITERATIONS_WITH_PHASES: usize = 5;

impl Fit {
    /// The best gain at a pose.
    pub fn at(readings: &Readings, pose: Pose) -> Self {
        let values = readings.values();
        let simulated = readings.simulate(&pose);
        let gain = best_gain(&simulated.magnitudes, &values);
        let sigma = |fit: &Self| fit.sigma(&values);
        let fit = Self::with_gain(pose, gain, simulated.magnitudes.clone(), &values);
        Self { phases: FittedPhases::of(readings, &simulated, sigma(&fit)), ..fit }
    }

    /// A given gain at a pose, without regard to phases.
    pub fn with_gain(pose: Pose, gain: f64, simulated: Vec<f64>, readings: &[f64]) -> Self {
        let residual = residual(&simulated, readings, gain);
        let ratio = rms(residual.iter().copied()) / rms(readings.iter().copied());
        let correlation = correlation(&simulated, readings);
        Self { pose, gain, simulated, correlation, residual_ratio: ratio, phases: None }
    }

    /// Standard deviation of the residual, in the reading's unit.
    pub(super) fn sigma(&self, values: &[f64]) -> f64 {
        self.residual_ratio.max(SMALLEST_RATIO) * rms(values.iter().copied())
    }

    /// What the better of two fits to the same readings has less of: rms of the residual over that of the readings, of complex ones where there are phases.
    pub fn misfit(&self) -> f64 {
        match &self.phases {
            Some(phases) => self.residual_ratio.hypot(phases.squared_ratio.sqrt()),
            None => self.residual_ratio,
        }
    }
}

/// Refines a pose. Priors weigh against the data as if each block of readings told one independent thing (see
/// [`Blocks`]), since what is left of a field is never independent from point to point.
pub fn refine(readings: &Readings, start: Pose, search: &Search) -> Fit {
    let mut fit = refined(readings, Fit::at(readings, start), search, false);
    if readings.reference().is_some() {
        let iterations = search.iterations.min(ITERATIONS_WITH_PHASES);
        let search = Search { iterations, ..search.clone() };
        for _ in 0..ROUNDS_WITH_PHASES {
            fit = refined(readings, fit, &search, true);
        }
    }
    fit
}

/// One round, by the noise that a fit leaves.
fn refined(readings: &Readings, before: Fit, search: &Search, with_phases: bool) -> Fit {
    let values = readings.values();
    let blocks = Blocks::of(readings);
    let start = before.pose;
    let factor = (values.len() as f64 / blocks.count() as f64).sqrt();
    let scatter = before.phases.as_ref().filter(|_| with_phases).map(|phases| Scatter {
        sigma: before.sigma(&values),
        noise_rad: phases.noise_rad,
        factor,
    });
    let sigma = before.sigma(&values) * factor;
    let phases = |simulated: &Simulated| PhaseResiduals::of(readings, simulated, scatter?);
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
    let weighted = |simulated: &Simulated| -> Vec<f64> {
        let gain = best_gain(&simulated.magnitudes, &values);
        let of_amplitudes = residual(&simulated.magnitudes, &values, gain);
        let of_phases = phases(simulated).map(|phases| phases.scaled).unwrap_or_default();
        of_amplitudes.into_iter().map(|r| r / sigma).chain(of_phases).collect()
    };
    let minimum = minimise(
        &parameters,
        Stopping { iterations: search.iterations, step: 1e-4, fall: 1e-7, ..Stopping::default() },
        |x| weighted(&readings.simulate(&pose_at(x))),
        |x| {
            let pose = pose_at(x);
            let gradient = readings.simulate_gradient(&pose);
            let free: Vec<PoseParameter> = search.free.iter().map(|(p, _)| *p).collect();
            let magnitudes = &gradient.at.magnitudes;
            let scale = -best_gain(magnitudes, &values) / sigma;
            let phases = phases(&gradient.at);
            let column = |slope: Slope| {
                let Slope { magnitudes: mut column, phases: of_phases } = slope;
                project_out(magnitudes, &mut column);
                column.iter_mut().for_each(|entry| *entry *= scale);
                column.extend(phases.iter().flat_map(|phases| phases.derivatives(&of_phases)));
                column
            };
            let columns = derivatives(readings, &pose, &gradient, &free).into_iter().map(column);
            Linearisation { residuals: weighted(&gradient.at), columns: columns.collect() }
        },
    );
    let mut pose = pose_at(&minimum.parameters);
    pose.turn_rad = wrapped(pose.turn_rad);
    Fit::at(readings, pose)
}

/// Derivative of the simulated field by each parameter of the pose.
pub fn derivatives(
    readings: &Readings,
    pose: &Pose,
    gradient: &SimulatedGradient,
    parameters: &[PoseParameter],
) -> Vec<Slope> {
    let from_shift: Vec<_> =
        readings.positions_m().iter().map(|scan_m| pose.to_array(scan_m) - pose.shift_m).collect();
    let column = |parameter: &PoseParameter, part: fn(&Slope) -> &Vec<f64>| -> Vec<f64> {
        let [per_x, per_y, per_z] = gradient.per_m.each_ref().map(part);
        (0..per_x.len())
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
    let slope = |parameter: &PoseParameter| Slope {
        magnitudes: column(parameter, |slope| &slope.magnitudes),
        phases: column(parameter, |slope| &slope.phases),
    };
    parameters.iter().map(slope).collect()
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
