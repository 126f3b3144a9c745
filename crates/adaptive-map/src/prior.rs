//! What is believed of the field before the readings, as functionals of a normal state.
//!
//! The state has the departures of the set's parameters, an error of the complex weight of each element, and a diffuse field. Its covariances
//! are those of `lib.rs`.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use fieldgap_acoustics::Vec3;
use fieldgap_diagnosis::{Departure, FieldSamples};

use crate::diffuse::correlation;

/// The sizes of what the simulation misses, and of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sizes {
    /// Standard deviation of real and imaginary part of the relative error of an element's weight.
    pub elements: f64,
    /// Root mean square of the diffuse field, in the unit of the readings.
    pub diffuse: f64,
    /// Standard deviation of the noise over that of the scan's scatter.
    pub noise: f64,
}

/// Real functionals of the field at some places: slope · Re(conj(unit) p), and how a parameter changes what the receiver makes of it.
pub(crate) struct Functionals<'s> {
    pub samples: &'s FieldSamples,
    /// A complex number of magnitude one for each place.
    pub units: Vec<Complex64>,
    pub slopes: Vec<f64>,
    /// What the receiver makes of the parameters: by parameter, then by place; last the [`ReceiverCurve`]. Empty for functionals of
    /// the field alone.
    pub receiver: Vec<Vec<f64>>,
}

/// How the receiver's curve may differ from what is believed, whatever the field: compression bends it by a share of a reading r that grows as
/// (r / largest)², to lowest order; a floor or noise power other than believed, f², raises readings by f² / 2√(r² + f²).
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReceiverCurve {
    /// The largest reading.
    pub largest: f64,
}

impl ReceiverCurve {
    /// Standard deviations of the bend at the largest reading, and of the power of the floor over that of [`Self::FLOOR`]. Set by judgement:
    /// some per cent of compression, or a floor of that size, are common, and no error of the field explains them.
    const DEVIATIONS: [f64; 2] = [0.03, 0.5];

    /// A usual floor, as a share of the largest reading.
    const FLOOR: f64 = 0.02;

    /// What each adds to some readings.
    pub fn slopes(self, readings: &[f64]) -> [Vec<f64>; 2] {
        let floor = Self::FLOOR * self.largest;
        let bend = |reading: &f64| reading * (reading / self.largest).powi(2);
        let raised = |reading: &f64| 0.5 * floor * floor / reading.hypot(floor);
        [readings.iter().map(bend).collect(), readings.iter().map(raised).collect()]
    }
}

/// What the functionals of a set of effects have in common.
#[derive(Clone)]
pub(crate) struct Prior {
    pub departures: Vec<Departure>,
    pub wavenumber_rad_m: f64,
}

impl Functionals<'_> {
    fn len(&self) -> usize {
        self.units.len()
    }

    /// The functional of a pressure at a place.
    pub fn of(&self, place: usize, pressure: Complex64) -> f64 {
        self.slopes[place] * (self.units[place].conj() * pressure).re
    }

    /// The same functionals, across the field instead of along it; the receiver is no part of them.
    pub fn across(&self) -> Self {
        Self {
            units: self.units.iter().map(|unit| Complex64::I * unit).collect(),
            slopes: self.slopes.clone(),
            receiver: Vec::new(),
            samples: self.samples,
        }
    }
}

impl Prior {
    /// The prior of a set whose parameters may depart so, and of the receiver's curve after all other parameters. `readings` are those of the
    /// amplitude at the readings, `noise` the variance of each.
    ///
    /// What the set does not hold goes undetected where it changes the readings, all together, by about one standard deviation:
    /// Σ (change / noise)² = 1. More would have been named, or would show in what is left.
    pub fn new(
        mut departures: Vec<Departure>,
        wavenumber_rad_m: f64,
        readings: &Functionals<'_>,
        noise: &[f64],
    ) -> Self {
        let named = departures.len();
        for (number, slopes) in readings.samples.slopes.iter().enumerate().skip(named) {
            let receiver = readings.receiver.get(number);
            let change = |place: usize| {
                let at_receiver = receiver.map_or(0.0, |slopes| slopes[place]);
                readings.of(place, slopes[place]) + at_receiver
            };
            let squares: f64 = (0..noise.len()).map(|n| change(n).powi(2) / noise[n]).sum();
            let deviation = if squares > 0.0 { squares.sqrt().recip() } else { 0.0 };
            departures.push(Departure { mean: 0.0, deviation });
        }
        let curve = ReceiverCurve::DEVIATIONS;
        departures.extend(curve.map(|deviation| Departure { mean: 0.0, deviation }));
        Self { departures, wavenumber_rad_m }
    }

    /// What parameters that depart by so many standard deviations make of the receiver's readings, the field held.
    pub fn at_receiver(
        &self,
        functionals: &Functionals<'_>,
        parameters: &DVector<f64>,
    ) -> Vec<f64> {
        let mut change = vec![0.0; functionals.len()];
        for (parameter, slopes) in functionals.receiver.iter().enumerate() {
            let departure = self.departures[parameter].deviation * parameters[parameter];
            change.iter_mut().zip(slopes).for_each(|(change, slope)| *change += departure * slope);
        }
        change
    }

    /// Derivatives of the functionals by the parameters, each times its standard deviation: a row for each parameter.
    pub fn by_parameters(&self, functionals: &Functionals<'_>) -> DMatrix<f64> {
        let slopes = &functionals.samples.slopes;
        DMatrix::from_fn(self.departures.len(), functionals.len(), |parameter, place| {
            let receiver = functionals.receiver.get(parameter).map_or(0.0, |slopes| slopes[place]);
            let along =
                slopes.get(parameter).map_or(0.0, |slopes| functionals.of(place, slopes[place]));
            self.departures[parameter].deviation * (along + receiver)
        })
    }

    /// Derivatives of the functionals by the relative errors of the elements' weights, real parts first: a row for each.
    pub fn by_elements(&self, functionals: &Functionals<'_>) -> DMatrix<f64> {
        let elements = &functionals.samples.elements;
        let count = elements.len();
        DMatrix::from_fn(2 * count, functionals.len(), |row, place| {
            let part = elements[row % count][place];
            functionals.of(place, if row < count { part } else { Complex64::I * part })
        })
    }

    /// Covariance of functionals by a diffuse field whose mean square is one: half of it is along any unit.
    pub fn by_diffuse(&self, rows: &Functionals<'_>, columns: &Functionals<'_>) -> DMatrix<f64> {
        let k = self.wavenumber_rad_m;
        let column = |place: usize| -> Vec<f64> {
            let at_m: &Vec3 = &columns.samples.at_m[place];
            let (focus, slope) = (columns.samples.foci[place], columns.slopes[place]);
            let turned = columns.units[place];
            (0..rows.len())
                .map(|row| {
                    if rows.samples.foci[row] != focus {
                        return 0.0;
                    }
                    let alike = (rows.units[row].conj() * turned).re;
                    0.5 * slope
                        * rows.slopes[row]
                        * alike
                        * correlation(k, &rows.samples.at_m[row], at_m)
                })
                .collect()
        };
        let values: Vec<f64> = (0..columns.len()).into_par_iter().flat_map_iter(column).collect();
        DMatrix::from_vec(rows.len(), columns.len(), values)
    }

    /// The mean of the parameters' departures, in standard deviations.
    pub fn mean(&self) -> DVector<f64> {
        let mean = |one: &Departure| if one.mean == 0.0 { 0.0 } else { one.mean / one.deviation };
        let means = self.departures.iter().map(mean);
        DVector::from_iterator(self.departures.len(), means)
    }
}
