//! A laboratory that scans 12 cells again and again: its array and air, its scans, and the figures of their comparison.

use std::path::Path;

use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_comparison::{Comparison, Registering, Uncertain, compare, simulated_readings};
use fieldgap_input::TomlSource;
use fieldgap_monitoring::Run;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_readings};
use jiff::Timestamp;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Cells of a round, and rounds of a day.
pub const CELLS: usize = 12;
pub const ROUNDS_A_DAY: usize = 4;

/// Time between two runs, s.
const RUN_S: f64 = 86_400.0 / (CELLS * ROUNDS_A_DAY) as f64;

/// Noise of a reading: 1 % of it, and 0.3 % of full scale.
const PROPORTIONAL_NOISE: f64 = 0.01;
const ADDITIVE_NOISE: f64 = 0.003;

/// Homing repeats to this, and each reading is this far off its place, mm, standard deviation along each axis.
const HOMING_MM: f64 = 0.05;
const JITTER_MM: f64 = 0.03;

/// Distance of readings, mm.
const STEP_MM: f64 = 3.0;

/// The air: mean temperature, swing of day and night from end to end, and scatter from run to run, °C.
const AIR_C: f64 = 22.0;
const SWING_C: f64 = 2.0;
const AIR_SCATTER_C: f64 = 0.1;
/// Error of the thermometer, °C.
const THERMOMETER_C: f64 = 0.05;

/// The level walks by this from run to run, and stays within this of where it began.
const LEVEL_STEP: f64 = 0.001;
pub const LEVEL_WITHIN: f64 = 0.01;

/// An effect that nobody modelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// Amplitudes of elements spread.
    Gain,
    /// Phases of elements spread.
    Phase,
    /// A plane above the array reflects.
    Reflection,
}

/// What is not modelled: sizes of the causes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unmodelled {
    pub gain: f64,
    pub phase_rad: f64,
    pub reflection: f64,
}

impl Unmodelled {
    pub fn scaled(self, by: f64) -> Self {
        Self {
            gain: by * self.gain,
            phase_rad: by * self.phase_rad,
            reflection: by * self.reflection,
        }
    }

    pub fn with(self, cause: Cause, by: f64) -> Self {
        match cause {
            Cause::Gain => Self { gain: self.gain * by, ..self },
            Cause::Phase => Self { phase_rad: self.phase_rad * by, ..self },
            Cause::Reflection => Self { reflection: self.reflection * by, ..self },
        }
    }
}

/// A laboratory with its array.
pub struct Laboratory {
    setups: Vec<ScanSetup>,
    grid_mm: Vec<Vec3>,
    /// Of 81 points over the same area, for sizes of causes.
    coarse_grid_mm: Vec<Vec3>,
    array: u64,
    /// Volts for 1/m.
    gain_v_m: f64,
    draws: ChaCha8Rng,
    level: f64,
}

/// Position and height of the cell's focus, and height of its plane, mm.
fn cell_mm(cell: usize) -> (f64, f64, f64) {
    let focus_z = [80.0, 100.0, 120.0][cell % 3];
    let focus_x = [0.0, 12.0][cell / 3 % 2];
    (focus_x, focus_z, focus_z + [0.0, 15.0][cell / 6])
}

fn speed_m_s(air_c: f64) -> f64 {
    331.3 * (1.0 + air_c / 273.15).sqrt()
}

fn grid_mm(side: usize, step_mm: f64) -> Vec<Vec3> {
    let at = |i: usize| step_mm * (i as f64 - 0.5 * (side as f64 - 1.0));
    (0..side * side).map(|n| Vec3::new(at(n % side), at(n / side), 0.0)).collect()
}

impl Laboratory {
    /// With an array and draws of its own; scans of `side`² readings 3 mm apart.
    pub fn new(seed: u64, side: usize) -> Self {
        let setup = |cell| {
            let (x, z, _) = cell_mm(cell);
            let text = format!(
                "format = 1\nname = \"cell-{cell}\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
                 [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\n\
                 element_diameter_mm = 10.5\nspacing_mm = 0.0\n[medium]\nspeed_of_sound_m_s = {}\n\
                 [simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = {x:.1}\ny_mm = 0.0\nz_mm = {z:.1}\n",
                speed_m_s(AIR_C)
            );
            ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), &text)).expect("a set-up")
        };
        Self {
            setups: (0..CELLS).map(setup).collect(),
            grid_mm: grid_mm(side, STEP_MM),
            coarse_grid_mm: grid_mm(9, STEP_MM * (side - 1) as f64 / 8.0),
            array: seed,
            gain_v_m: 0.01,
            draws: ChaCha8Rng::seed_from_u64(seed),
            level: 0.0,
        }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.draws)
    }

    pub fn draw_below(&mut self, number: usize) -> usize {
        self.draws.random_range(0..number)
    }

    pub fn draw_between(&mut self, low: f64, high: f64) -> f64 {
        self.draws.random_range(low..high)
    }

    /// Places of a cell's readings, and the readings without noise, each place `off` from where it is believed to be.
    fn readings(
        &self,
        cell: usize,
        grid_mm: &[Vec3],
        (unmodelled, air_c): (Unmodelled, f64),
        mut off_mm: impl FnMut() -> Vec3,
    ) -> Vec<(Vec3, f64)> {
        let (x, _, z) = cell_mm(cell);
        let places: Vec<Vec3> =
            grid_mm.iter().map(|at| (at + Vec3::new(x, 0.0, z)) * 1e-3).collect();
        let visits: Vec<Visit> = places
            .iter()
            .map(|at| Visit {
                position_m: at + off_mm() * 1e-3,
                velocity_m_s: Vec3::zeros(),
                time_s: 0.0,
            })
            .collect();
        let Unmodelled { gain, phase_rad, reflection } = unmodelled;
        let speed = speed_m_s(air_c);
        let effects = toml::toml! {
            sound-speed = { c_m_s = speed }
            element-gain = { spread = gain }
            element-phase = { spread_rad = phase_rad }
            reflection = { height_mm = 250.0, coefficient = [reflection, 0.0] }
        };
        let simulation = self.setups[cell].simulation(Simulator::Piston, 0).expect("a focus");
        let read = noise_free_readings(&simulation, &effects, self.gain_v_m, &visits, self.array);
        places.into_iter().zip(read.expect("the effects fit")).collect()
    }

    fn scan(&self, cell: usize, readings: &[(Vec3, f64)]) -> RecordedScan {
        let sample = |(at, reading): &(Vec3, f64)| {
            RecordedSample::measured(0.0, Some(0), *at, *reading, None)
        };
        RecordedScan {
            setup: self.setups[cell].clone(),
            samples: readings.iter().map(sample).collect(),
        }
    }

    /// Mean gap of the cells without noise.
    pub fn mean_gap(&self, unmodelled: Unmodelled) -> f64 {
        let gap = |cell| {
            let readings =
                self.readings(cell, &self.coarse_grid_mm, (unmodelled, AIR_C), Vec3::zeros);
            let comparison = compared(&self.scan(cell, &readings));
            comparison.overall.residual_rms_ratio
        };
        (0..CELLS).map(gap).sum::<f64>() / CELLS as f64
    }

    /// The next run of the week, with the figures that a campaign charts.
    pub fn run(&mut self, number: usize, unmodelled: Unmodelled) -> Run {
        let cell = number % CELLS;
        let seconds = number as f64 * RUN_S;
        let of_day = (std::f64::consts::TAU * seconds / 86_400.0).sin();
        let air_c = AIR_C + 0.5 * SWING_C * of_day + AIR_SCATTER_C * self.normal();
        let thermometer_c = air_c + THERMOMETER_C * self.normal();
        let level = self.level + LEVEL_STEP * self.normal();
        self.level = level.clamp(-LEVEL_WITHIN, LEVEL_WITHIN);

        let mut draws = ChaCha8Rng::from_rng(&mut self.draws);
        let mut vector_mm = |deviation: f64| {
            let mut one = || -> f64 { StandardNormal.sample(&mut draws) };
            Vec3::new(one(), one(), one()) * deviation
        };
        let homing_mm = vector_mm(HOMING_MM);
        let off_mm = || homing_mm + vector_mm(JITTER_MM);
        let mut readings = self.readings(cell, &self.grid_mm, (unmodelled, air_c), off_mm);
        let full_scale = readings.iter().map(|(_, reading)| *reading).fold(0.0, f64::max);
        for (_, reading) in &mut readings {
            let noise = PROPORTIONAL_NOISE * *reading * self.normal()
                + ADDITIVE_NOISE * full_scale * self.normal();
            *reading = (*reading * (1.0 + self.level) + noise).abs();
        }
        let scan = self.scan(cell, &readings);
        Run {
            cell: self.setups[cell].name.clone(),
            at: Timestamp::from_second(1_795_000_000 + seconds as i64).expect("in range"),
            temperature_c: Some(Uncertain { value: thermometer_c, standard_error: THERMOMETER_C }),
            figures: figures(&scan, &compared(&scan)),
        }
    }
}

fn compared(scan: &RecordedScan) -> Comparison {
    compare(scan, Simulator::Piston, Registering::GainAndShift).expect("comparable")
}

/// The figures of a run, with the errors that noise gives them.
fn figures(
    scan: &RecordedScan,
    comparison: &Comparison,
) -> std::collections::BTreeMap<String, Uncertain> {
    let readings: Vec<f64> = scan.samples.iter().map(|sample| sample.reading).collect();
    let simulated = simulated_readings(scan, comparison);
    let errors: Vec<f64> = readings.iter().map(|reading| comparison.noise.at(*reading)).collect();
    let plane = &comparison.planes[0];
    let radius = plane.scan.focal_radius.as_ref().and_then(|figure| figure.radius_m);
    let mm = |of: Uncertain| Uncertain {
        value: 1e3 * of.value,
        standard_error: 1e3 * of.standard_error,
    };
    let mut figures = vec![
        ("gap", gap(&readings, &simulated, &errors)),
        (
            "correlation",
            correlation(comparison.overall.correlation, &readings, &simulated, &errors),
        ),
        ("level", plane.scan.peak),
        ("peak_x_mm", mm(plane.scan.peak_position_m[0])),
        ("peak_y_mm", mm(plane.scan.peak_position_m[1])),
    ];
    figures.extend(radius.map(|radius| ("focal_radius_mm", mm(radius))));
    figures.into_iter().map(|(name, figure)| (name.to_owned(), figure)).collect()
}

/// Gap = √(Σ(r - s)²/Σr²), with the error by its derivative to each reading r.
fn gap(readings: &[f64], simulated: &[f64], errors: &[f64]) -> Uncertain {
    let power: f64 = readings.iter().map(|r| r * r).sum();
    let residual: f64 = readings.iter().zip(simulated).map(|(r, s)| (r - s).powi(2)).sum();
    let value = (residual / power).sqrt();
    let by_reading = |n: usize| {
        let (r, s) = (readings[n], simulated[n]);
        ((r - s) - value * value * r) / (value * power)
    };
    let variance: f64 = (0..readings.len()).map(|n| (by_reading(n) * errors[n]).powi(2)).sum();
    Uncertain { value, standard_error: variance.sqrt() }
}

/// Pearson's correlation ρ, with the error by its derivative to each reading.
fn correlation(value: f64, readings: &[f64], simulated: &[f64], errors: &[f64]) -> Uncertain {
    let standardised = |values: &[f64]| {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
        (values.iter().map(|v| (v - mean) / deviation).collect::<Vec<f64>>(), deviation)
    };
    let (r, deviation) = standardised(readings);
    let (s, _) = standardised(simulated);
    let count = readings.len() as f64;
    let variance: f64 = (0..readings.len())
        .map(|n| ((s[n] - value * r[n]) / (count * deviation) * errors[n]).powi(2))
        .sum();
    Uncertain { value, standard_error: variance.sqrt() }
}
