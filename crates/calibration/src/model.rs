//! The level that a set of complex weights gives at each place under each drive, and its derivatives.
//!
//! With the drive d of channel n, the transfer T from the element that it drives to a place, and its weight w, a reading is
//!
//! a = √( |g(t) Σ d T w|² + b² )
//!
//! g is a slow change of level and b the level with the array silent. T depends on where the array stands and on the speed of sound:
//! both are fitted with the weights, since at one place they are phases of the elements.

use num_complex::Complex64;
use rayon::prelude::*;

use crate::limits::{DRIFT_SD, KNOT_S, OFFSET_SD_M, SPEED_SD, WEIGHT_SD};
use crate::readings::{CodedReadings, Reading, ReadingNoise};
use fieldgap_acoustics::least_squares::{Linearisation, Parameter};
use fieldgap_acoustics::{Array, FieldKernel, PathLengths, Simulation, Vec3};

/// Where the array stands, relative to where it is thought to, and the speed of sound.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Setting {
    /// Offset of the true places from the reported ones, m.
    pub offset_m: Vec3,
    /// Relative excess of the speed of sound.
    pub speed: f64,
}

/// Parameters of a setting.
const SETTINGS: usize = 4;

/// Step of the numeric derivative by a length, m, and by the relative speed of sound: 1/400 of a wavelength at 40 kHz over 0.2 m.
const STEP_M: f64 = 2e-5;
const STEP_SPEED: f64 = 1e-4;

/// Readings, and the array and wiring that are thought to have made them.
#[derive(Clone)]
pub struct Model<'a> {
    simulation: &'a Simulation,
    array: Array,
    readings: &'a CodedReadings,
    /// Readings that are used.
    rows: Vec<&'a Reading>,
    noise: ReadingNoise,
    /// Level of a simulated field of 1, in the unit of the readings.
    scale: f64,
    /// Times of the knots of the slow change, s; the first has none.
    knots_s: Vec<f64>,
    wiring: Vec<usize>,
    weight_sd: f64,
}

/// The parameters in words.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// The weight of each channel.
    pub weights: Vec<Complex64>,
    /// Where the array stands.
    pub setting: Setting,
    /// Natural logarithm of the level at the knots after the first.
    pub drift: Vec<f64>,
}

impl<'a> Model<'a> {
    /// The model of readings of the array of `simulation`, whose excitation has no part in this. The scale makes the weights one on
    /// average.
    pub fn new(
        simulation: &'a Simulation,
        readings: &'a CodedReadings,
        noise: ReadingNoise,
    ) -> Self {
        let rows: Vec<&Reading> = readings.readings.iter().collect();
        let first_s = rows.first().map_or(0.0, |row| row.time_s);
        let last_s = rows.last().map_or(0.0, |row| row.time_s);
        let knots =
            if readings.is_coded() { ((last_s - first_s) / KNOT_S).round() as usize } else { 0 };
        let knot_s = |n: usize| first_s + (last_s - first_s) * n as f64 / knots.max(1) as f64;
        let channels = simulation.array.len();
        let mut model = Self {
            simulation,
            array: Array::from_elements(
                simulation
                    .array
                    .elements()
                    .iter()
                    .map(|&element| fieldgap_acoustics::Element {
                        amplitude: 1.0,
                        phase_rad: 0.0,
                        ..element
                    })
                    .collect(),
            )
            .expect("as many elements as before"),
            readings,
            rows,
            noise,
            scale: 1.0,
            knots_s: (0..=knots).map(knot_s).collect(),
            wiring: (0..channels).collect(),
            weight_sd: WEIGHT_SD,
        };
        if let Some(transducer) = simulation.array.shared_transducer() {
            model.array = model.array.with_transducer(transducer);
        }
        // Random drives add in power, whatever the phases: the rms gives the scale.
        let transfer = model.transfer(Setting::default());
        let (mut power, mut measured) = (0.0, 0.0);
        for row in &model.rows {
            power += (0..channels).map(|n| transfer[n][row.place].norm_sqr()).sum::<f64>();
            measured += row.value * row.value;
        }
        model.scale = (measured / power.max(f64::MIN_POSITIVE)).sqrt();
        if !readings.is_coded() {
            // Elements that are driven alike add in amplitude.
            let nominal = model.predicted(&model.nominal());
            let product: f64 = nominal.iter().zip(&model.rows).map(|(a, row)| a * row.value).sum();
            let square: f64 = nominal.iter().map(|a| a * a).sum();
            model.scale *= product / square.max(f64::MIN_POSITIVE);
        }
        model
    }

    /// The same with channels that drive other elements.
    pub fn wired(self, wiring: Vec<usize>) -> Self {
        Self { wiring, ..self }
    }

    /// The same with the readings that `keep` takes, by their index.
    pub fn keeping(mut self, keep: impl Fn(usize) -> bool) -> Self {
        let mut index = 0;
        self.rows.retain(|_| {
            index += 1;
            keep(index - 1)
        });
        self
    }

    /// The readings that are used.
    pub fn rows(&self) -> &[&'a Reading] {
        &self.rows
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.wiring.len()
    }

    /// Which element each channel drives.
    pub fn wiring(&self) -> &[usize] {
        &self.wiring
    }

    /// Standard deviation of the reading of a row.
    pub fn sd(&self, row: &Reading) -> f64 {
        self.noise.at(row.value)
    }

    /// Elements as they are thought to be.
    pub fn nominal(&self) -> Weights {
        Weights {
            weights: vec![Complex64::ONE; self.channels()],
            setting: Setting::default(),
            drift: vec![0.0; self.knots_s.len() - 1],
        }
    }

    /// The parameters of a fit that starts at some weights.
    pub fn parameters(&self, start: &Weights) -> Vec<Parameter> {
        let weight = |start: f64, mean: f64| Parameter {
            start,
            scale: 1.0,
            prior: Some((mean, self.weight_sd)),
            range: None,
        };
        let about_zero = |start: f64, sd: f64| Parameter {
            start,
            scale: sd,
            prior: Some((0.0, sd)),
            range: None,
        };
        let Weights { weights, setting, drift } = start;
        let real = weights.iter().map(|w| weight(w.re, 1.0));
        let imaginary = weights.iter().map(|w| weight(w.im, 0.0));
        let offset =
            setting.offset_m.iter().map(|&m| about_zero(m, OFFSET_SD_M)).collect::<Vec<_>>();
        let speed = [about_zero(setting.speed, SPEED_SD)];
        let drift = drift.iter().map(|&level| about_zero(level, DRIFT_SD));
        real.chain(imaginary).chain(offset).chain(speed).chain(drift).collect()
    }

    /// The weights of some parameters.
    pub fn weights(&self, parameters: &[f64]) -> Weights {
        let n = self.channels();
        let weights = (0..n).map(|k| Complex64::new(parameters[k], parameters[n + k])).collect();
        let rest = &parameters[2 * n..];
        Weights {
            weights,
            setting: Setting { offset_m: Vec3::new(rest[0], rest[1], rest[2]), speed: rest[3] },
            drift: rest[SETTINGS..].to_vec(),
        }
    }

    /// The level at each row.
    pub fn predicted(&self, weights: &Weights) -> Vec<f64> {
        let transfer = self.transfer(weights.setting);
        let fields = self.fields(&transfer, &weights.weights);
        let floor = self.floor();
        let levels = self.rows.par_iter().zip(fields);
        levels.map(|(row, field)| (self.level(row, weights) * field).norm().hypot(floor)).collect()
    }

    /// The residuals in units of the noise.
    pub fn residuals(&self, parameters: &[f64]) -> Vec<f64> {
        let predicted = self.predicted(&self.weights(parameters));
        let rows = self.rows.iter().zip(predicted);
        rows.map(|(row, predicted)| (predicted - row.value) / self.sd(row)).collect()
    }

    /// Residuals and derivatives.
    pub fn linearise(&self, parameters: &[f64]) -> Linearisation {
        let weights = self.weights(parameters);
        let transfer = self.transfer(weights.setting);
        let fields = self.fields(&transfer, &weights.weights);
        let floor = self.floor();
        let along = self.along(&weights, &fields);
        let rows = self.rows.iter().zip(&fields);
        let residuals = rows
            .map(|(row, field)| {
                let level = (self.level(row, &weights) * field).norm().hypot(floor);
                (level - row.value) / self.sd(row)
            })
            .collect();
        let n = self.channels();
        let by_channel: Vec<[Vec<f64>; 2]> = (0..n)
            .into_par_iter()
            .map(|channel| {
                let transfer = &transfer[self.wiring[channel]];
                self.columns_of(&weights, channel, transfer, &along)
            })
            .collect();
        let mut columns = Vec::with_capacity(parameters.len());
        let mut imaginary = Vec::with_capacity(n);
        for [re, im] in by_channel {
            columns.push(re);
            imaginary.push(im);
        }
        columns.append(&mut imaginary);
        for which in 0..SETTINGS {
            let step = if which < 3 { STEP_M } else { STEP_SPEED };
            let [less, more] = [-step, step].map(|by| {
                let moved = moved(weights.setting, which, by);
                self.fields(&self.transfer(moved), &weights.weights)
            });
            let column = self.rows.iter().enumerate().map(|(index, row)| {
                let slope = (more[index] - less[index]) / (2.0 * step);
                (along[index] * self.level(row, &weights) * slope).re
            });
            columns.push(column.collect());
        }
        for knot in 1..self.knots_s.len() {
            let column = self.rows.iter().zip(&fields).zip(&along).map(|((row, field), along)| {
                (along * self.level(row, &weights) * field).re * self.share(row, knot)
            });
            columns.push(column.collect());
        }
        Linearisation { residuals, columns }
    }

    /// Derivatives of all residuals by both parts of the weight that a channel would have at the place of `element`, beside all others as
    /// they are.
    pub fn parts(&self, weights: &Weights, channel: usize, element: usize) -> [Vec<f64>; 2] {
        let transfer = self.transfer(weights.setting);
        let fields = self.fields(&transfer, &weights.weights);
        let along = self.along(weights, &fields);
        self.columns_of(weights, channel, &transfer[element], &along)
    }

    /// The level with the array silent.
    pub fn floor(&self) -> f64 {
        self.readings.silent.unwrap_or(0.0)
    }

    /// The direction of the field at each row, in units of the noise: what a change of the field does to a residual is its part along it.
    fn along(&self, weights: &Weights, fields: &[Complex64]) -> Vec<Complex64> {
        let floor = self.floor();
        let rows = self.rows.iter().zip(fields);
        rows.map(|(row, field)| {
            let field = self.level(row, weights) * field;
            let level = field.norm().hypot(floor);
            field.conj() / (level.max(f64::MIN_POSITIVE) * self.sd(row))
        })
        .collect()
    }

    fn columns_of(
        &self,
        weights: &Weights,
        channel: usize,
        transfer: &[Complex64],
        along: &[Complex64],
    ) -> [Vec<f64>; 2] {
        let mut columns =
            [Vec::with_capacity(self.rows.len()), Vec::with_capacity(self.rows.len())];
        for (row, along) in self.rows.iter().zip(along) {
            let change = along
                * self.level(row, weights)
                * self.readings.drives[row.drive][channel]
                * transfer[row.place];
            columns[0].push(change.re);
            columns[1].push(-change.im);
        }
        columns
    }

    /// Element by element, the field of each at each place, in the unit of the readings.
    fn transfer(&self, setting: Setting) -> Vec<Vec<Complex64>> {
        let Setting { offset_m, speed } = setting;
        let wavenumber = self.simulation.medium.wavenumber_rad_m(self.simulation.frequency_hz);
        let transducer = self.simulation.simulator.transducer(&self.array);
        let phases_rad = vec![0.0; self.array.len()];
        let kernel = FieldKernel::new(
            &self.array,
            &phases_rad,
            transducer,
            wavenumber / (1.0 + speed),
            PathLengths::Observed,
        );
        let places_m: Vec<Vec3> = self.readings.places_m.iter().map(|at| at + offset_m).collect();
        let mut transfer = kernel.contributions_at(&places_m);
        transfer.iter_mut().flatten().for_each(|field| *field *= self.scale);
        transfer
    }

    fn fields(&self, transfer: &[Vec<Complex64>], weights: &[Complex64]) -> Vec<Complex64> {
        let elements: Vec<&[Complex64]> =
            self.wiring.iter().map(|&element| &transfer[element][..]).collect();
        let field = |row: &&Reading| -> Complex64 {
            let drive = &self.readings.drives[row.drive];
            let terms = drive.iter().zip(weights).zip(&elements);
            terms.map(|((drive, weight), element)| drive * weight * element[row.place]).sum()
        };
        self.rows.par_iter().map(field).collect()
    }

    /// The slow change of level at a row.
    fn level(&self, row: &Reading, weights: &Weights) -> f64 {
        let parts = weights.drift.iter().enumerate();
        parts.map(|(n, level)| level * self.share(row, n + 1)).sum::<f64>().exp()
    }

    /// The share of a knot in the level at a row: linear interpolation.
    fn share(&self, row: &Reading, knot: usize) -> f64 {
        let apart_s = self.knots_s[1] - self.knots_s[0];
        (1.0 - (row.time_s - self.knots_s[knot]).abs() / apart_s).max(0.0)
    }
}

fn moved(setting: Setting, which: usize, by: f64) -> Setting {
    let mut moved = setting;
    match which {
        3 => moved.speed += by,
        axis => moved.offset_m[axis] += by,
    }
    moved
}
