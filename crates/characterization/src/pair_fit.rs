//! One law on the axis and one lobe, fitted to all readings at once.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Readings;
use super::axis_pose::{AxisCoordinates, AxisPose};
use super::laws::{AxisLaw, Constant, FreeParameter, Lobe, LobeLaw};
use fieldgap_acoustics::least_squares::{Linearisation, Parameter, Stopping, minimise};

/// Number of leading parameters: floor and amplitude.
const LEVELS: usize = 2;
/// Number of parameters of a free axis: foot and slope.
const AXIS_PARAMETERS: usize = 4;
/// Step of a finite difference over the parameter's scale.
const DIFFERENCE: f64 = 1e-3;
/// Initial floor, relative to the largest reading.
const INITIAL_FLOOR: f64 = 1e-3;
/// Smallest modelled reading, relative to the largest: avoids a division by zero in a scan without noise.
const MIN_READING: f64 = 1e-6;

/// The best fit of a law on the axis times a lobe.
#[derive(Debug, Clone, Serialize)]
pub struct PairFit {
    /// The law on the axis.
    pub axis_law: AxisLaw,
    /// The lobe.
    pub lobe_law: LobeLaw,
    /// The axis.
    pub axis: AxisPose,
    /// Standard errors of the foot, metres, and of the slope; NaN if the axis is from another fit.
    pub axis_errors: AxisPose,
    /// Reading without a signal, the readings' unit. It adds in quadrature, as noise does to a magnitude.
    pub floor: Constant,
    /// Factor of the laws, the readings' unit (times metres for laws in 1/r).
    pub amplitude: Constant,
    /// The constants of the law on the axis.
    pub axis_constants: Vec<Constant>,
    /// The constants of the lobe.
    pub lobe_constants: Vec<Constant>,
    /// Number of fitted parameters.
    pub parameters: usize,
    /// Share of the readings' variance that the pair explains.
    pub r_squared: f64,
    /// Root mean square of the residual, the readings' unit.
    pub residual_rms: f64,
    /// Akaike's information criterion.
    pub aic: f64,
    /// The Bayesian information criterion (Schwarz).
    pub bic: f64,
    /// Whether the fit converged.
    pub converged: bool,
    #[serde(skip)]
    pub(super) axis_free: Vec<f64>,
    #[serde(skip)]
    pub(super) lobe_free: Vec<f64>,
    #[serde(skip)]
    pub(super) lobe: Lobe,
}

/// The axis in a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum AxisFit {
    /// Fitted, starting here.
    Free(AxisPose),
    /// Fixed.
    Fixed(AxisPose),
}

/// The model of the readings for one pair of laws.
struct Model<'a> {
    readings: &'a Readings,
    axis: AxisLaw,
    lobe: Lobe,
    unit: f64,
    free: Vec<FreeParameter>,
    /// The coordinates under a fixed axis.
    fixed: Option<(AxisPose, Vec<AxisCoordinates>)>,
    axis_count: usize,
}

/// Factors of the model at each reading.
struct Factors {
    coordinates: Vec<AxisCoordinates>,
    thetas_rad: Vec<f64>,
    decay: Vec<f64>,
    directivity: Vec<f64>,
}

impl PairFit {
    /// Fits a pair; `None` if its parameters are not determined.
    pub(super) fn new(
        readings: &Readings,
        axis: AxisLaw,
        lobe: LobeLaw,
        start: AxisFit,
    ) -> Option<Self> {
        let model = Model::new(readings, axis, lobe, start)?;
        let minimum = minimise(
            &model.parameters()?,
            Stopping { iterations: 60, step: 1e-4, fall: 1e-10, carried: 0 },
            |free| model.residuals(free),
            |free| model.linearised(free),
        );
        model.into_fit(&minimum.parameters, minimum.converged)
    }

    /// Pressure on the axis at a height above the foot, the readings' unit, without the floor; NaN if the lobe is invalid.
    pub fn on_axis_at(&self, height_m: f64) -> f64 {
        let point = AxisCoordinates { distance_m: height_m, height_m, theta_rad: 0.0 };
        self.amplitude.value * self.axis_law.at(&self.axis_free, &point) * self.lobe_on_axis()
    }

    /// Directivity at an angle, relative to the axis.
    pub fn lobe_at(&self, theta_rad: f64) -> f64 {
        let at =
            |theta: f64| self.lobe.at(&self.lobe_free, &[theta]).map_or(f64::NAN, |found| found[0]);
        at(theta_rad) / at(0.0)
    }

    fn lobe_on_axis(&self) -> f64 {
        self.lobe.at(&self.lobe_free, &[0.0]).map_or(f64::NAN, |found| found[0])
    }

    /// The fitted model at each reading, the readings' unit.
    pub fn predicted(&self, readings: &Readings) -> Vec<f64> {
        let coordinates = self.axis.coordinates(&readings.at_m);
        let thetas: Vec<f64> = coordinates.iter().map(|point| point.theta_rad).collect();
        let directivity = self.lobe.at(&self.lobe_free, &thetas).unwrap_or_default();
        coordinates
            .iter()
            .zip(directivity)
            .map(|(point, directivity)| {
                let decay = self.axis_law.at(&self.axis_free, point);
                self.floor.value.hypot(self.amplitude.value * decay * directivity)
            })
            .collect()
    }
}

/// Modelled readings, relative to the largest: floor and pressure in quadrature.
fn modelled<'p>(free: &'p [f64], factors: &'p Factors) -> impl Iterator<Item = f64> + 'p {
    let pressures = factors
        .decay
        .iter()
        .zip(&factors.directivity)
        .map(|(decay, directivity)| free[1] * decay * directivity);
    let floor = free[0].exp() + MIN_READING * MIN_READING;
    pressures.map(move |pressure| (floor + pressure * pressure).sqrt())
}

impl<'a> Model<'a> {
    fn new(readings: &'a Readings, axis: AxisLaw, lobe: LobeLaw, start: AxisFit) -> Option<Self> {
        let (AxisFit::Free(pose) | AxisFit::Fixed(pose)) = start;
        let coordinates = pose.coordinates(&readings.at_m);
        let thetas: Vec<f64> = coordinates.iter().map(|point| point.theta_rad).collect();
        let lobe = Lobe::new(lobe, &thetas, readings.wavenumber_rad_m);
        let unit = readings.largest();
        let (axis_free, lobe_free) = (axis.free(), lobe.free());
        let axis_count = axis_free.len();
        let plain = |name: &str, start: f64, scale: f64| FreeParameter {
            name: name.to_owned(),
            unit: "",
            factor: 1.0,
            start,
            scale,
        };
        // The parameter is the logarithm of the squared floor, so that the floor stays positive.
        let mut free =
            vec![plain("floor", 2.0 * INITIAL_FLOOR.ln(), 0.1), plain("amplitude", 1.0, 1e-2)];
        let mut fixed = None;
        if let AxisFit::Fixed(_) = start {
            fixed = Some((pose, coordinates));
        } else {
            free.extend([
                plain("x", pose.foot_m[0], 1e-4),
                plain("y", pose.foot_m[1], 1e-4),
                plain("lean x", pose.lean[0], 1e-3),
                plain("lean y", pose.lean[1], 1e-3),
            ]);
        }
        free.extend(axis_free);
        free.extend(lobe_free);
        let mut model = Self { readings, axis, lobe, unit, free, fixed, axis_count };
        // The best amplitude for the initial parameters.
        let factors = model.factors(&model.starts())?;
        let (mut cross, mut square) = (0.0, 0.0);
        for ((decay, directivity), value) in
            factors.decay.iter().zip(&factors.directivity).zip(&readings.values)
        {
            cross += decay * directivity * value / unit;
            square += (decay * directivity).powi(2);
        }
        let amplitude = cross / square;
        if amplitude <= 0.0 || !amplitude.is_finite() {
            return None;
        }
        model.free[1].start = amplitude;
        model.free[1].scale = 1e-2 * amplitude;
        Some(model)
    }

    fn starts(&self) -> Vec<f64> {
        self.free.iter().map(|free| free.start).collect()
    }

    /// The parameters, each scaled to change the readings by as much as the initial residual.
    fn parameters(&self) -> Option<Vec<Parameter>> {
        let linear = self.linearised(&self.starts());
        let length = |column: &[f64]| column.iter().map(|value| value * value).sum::<f64>().sqrt();
        let initial_rms = length(&linear.residuals) / (linear.residuals.len() as f64).sqrt();
        self.free
            .iter()
            .zip(&linear.columns)
            .map(|(free, column)| {
                let scale = initial_rms / length(column);
                let determined = scale.is_finite() && scale > 0.0;
                determined.then_some(Parameter {
                    start: free.start,
                    scale,
                    prior: None,
                    range: None,
                })
            })
            .collect()
    }

    /// Index of the first parameter of the law on the axis.
    fn first_law_parameter(&self) -> usize {
        if self.fixed.is_some() { LEVELS } else { LEVELS + AXIS_PARAMETERS }
    }

    fn pose(&self, free: &[f64]) -> AxisPose {
        match self.fixed {
            Some((pose, _)) => pose,
            None => AxisPose { foot_m: [free[2], free[3]], lean: [free[4], free[5]] },
        }
    }

    fn factors(&self, free: &[f64]) -> Option<Factors> {
        let coordinates = match &self.fixed {
            Some((_, coordinates)) => coordinates.clone(),
            None => self.pose(free).coordinates(&self.readings.at_m),
        };
        let thetas_rad: Vec<f64> = coordinates.iter().map(|point| point.theta_rad).collect();
        let decay = self.decay(free, &coordinates);
        let directivity = self.lobe.at(self.lobe_parameters(free), &thetas_rad)?;
        Some(Factors { coordinates, thetas_rad, decay, directivity })
    }

    fn decay(&self, free: &[f64], coordinates: &[AxisCoordinates]) -> Vec<f64> {
        let from = self.first_law_parameter();
        let axis_parameters = &free[from..from + self.axis_count];
        coordinates.iter().map(|point| self.axis.at(axis_parameters, point)).collect()
    }

    fn lobe_parameters<'f>(&self, free: &'f [f64]) -> &'f [f64] {
        &free[self.first_law_parameter() + self.axis_count..]
    }

    fn residuals_of(&self, free: &[f64], factors: &Factors) -> Vec<f64> {
        let values = self.readings.values.iter();
        values
            .zip(modelled(free, factors))
            .map(|(value, modelled)| modelled - value / self.unit)
            .collect()
    }

    fn residuals(&self, free: &[f64]) -> Vec<f64> {
        match self.factors(free) {
            Some(factors) => self.residuals_of(free, &factors),
            None => vec![f64::NAN; self.readings.values.len()],
        }
    }

    fn linearised(&self, free: &[f64]) -> Linearisation {
        let undefined = || vec![f64::NAN; self.readings.values.len()];
        let Some(factors) = self.factors(free) else {
            return Linearisation {
                residuals: undefined(),
                columns: vec![undefined(); self.free.len()],
            };
        };
        let readings: Vec<f64> = modelled(free, &factors).collect();
        let product = |decay: &[f64], directivity: &[f64]| {
            decay.iter().zip(directivity).map(|(a, b)| a * b).collect::<Vec<f64>>()
        };
        let columns = (0..free.len())
            .map(|index| {
                let step = DIFFERENCE * self.free[index].scale;
                let moved = |by: f64| {
                    let mut moved = free.to_vec();
                    moved[index] += by;
                    moved
                };
                // Product of both laws with one parameter shifted; only what depends on it is recomputed.
                let shifted = |by: f64| -> Option<Vec<f64>> {
                    let moved = moved(by);
                    if index < self.first_law_parameter() {
                        let factors = self.factors(&moved)?;
                        Some(product(&factors.decay, &factors.directivity))
                    } else if index < self.first_law_parameter() + self.axis_count {
                        Some(product(
                            &self.decay(&moved, &factors.coordinates),
                            &factors.directivity,
                        ))
                    } else {
                        let directivity =
                            self.lobe.at(self.lobe_parameters(&moved), &factors.thetas_rad)?;
                        Some(product(&factors.decay, &directivity))
                    }
                };
                // Change of the reading for a change of the pressure: the floor adds in quadrature.
                let reading_change = |pressures: Vec<f64>| {
                    let own = factors.decay.iter().zip(&factors.directivity).zip(&readings);
                    own.zip(pressures)
                        .map(|(((decay, directivity), reading), change)| {
                            free[1] * decay * directivity / reading * change
                        })
                        .collect()
                };
                match index {
                    0 => readings.iter().map(|reading| 0.5 * free[0].exp() / reading).collect(),
                    1 => reading_change(product(&factors.decay, &factors.directivity)),
                    _ => match (shifted(step), shifted(-step)) {
                        (Some(up), Some(down)) => reading_change(
                            up.iter()
                                .zip(&down)
                                .map(|(up, down)| free[1] * (up - down) / (2.0 * step))
                                .collect(),
                        ),
                        _ => undefined(),
                    },
                }
            })
            .collect();
        Linearisation { residuals: self.residuals_of(free, &factors), columns }
    }

    fn into_fit(self, fitted: &[f64], converged: bool) -> Option<PairFit> {
        let linear = self.linearised(fitted);
        let errors = self.standard_errors(&linear)?;
        let count = linear.residuals.len() as f64;
        let squares: f64 = linear.residuals.iter().map(|r| r * r).sum();
        let mean = self.readings.values.iter().sum::<f64>() / count / self.unit;
        let total: f64 = self.readings.values.iter().map(|v| (v / self.unit - mean).powi(2)).sum();
        // A fixed axis was fitted too, once for all pairs.
        let parameters =
            (LEVELS + AXIS_PARAMETERS + fitted.len() - self.first_law_parameter()) as f64;
        let likelihood = count * (squares / count).ln();
        if !likelihood.is_finite() {
            return None;
        }
        let constant = |index: usize, factor: f64, unit: &'static str| Constant {
            name: self.free[index].name.clone(),
            unit,
            value: fitted[index] * factor,
            standard_error: errors[index] * factor,
        };
        let constants = |range: std::ops::Range<usize>| -> Vec<Constant> {
            range
                .map(|index| constant(index, self.free[index].factor, self.free[index].unit))
                .collect()
        };
        let (axis_from, lobe_from) =
            (self.first_law_parameter(), self.first_law_parameter() + self.axis_count);
        let axis_errors = match self.fixed {
            Some(_) => AxisPose { foot_m: [f64::NAN; 2], lean: [f64::NAN; 2] },
            None => self.pose(&errors),
        };
        Some(PairFit {
            axis_law: self.axis,
            lobe_law: self.lobe.law,
            axis: self.pose(fitted),
            axis_errors,
            floor: self.floor(fitted[0], errors[0]),
            amplitude: constant(1, self.unit, ""),
            axis_constants: constants(axis_from..lobe_from),
            lobe_constants: constants(lobe_from..fitted.len()),
            parameters: parameters as usize,
            r_squared: 1.0 - squares / total,
            residual_rms: (squares / count).sqrt() * self.unit,
            aic: likelihood + 2.0 * parameters,
            bic: likelihood + parameters * count.ln(),
            converged,
            axis_free: fitted[axis_from..lobe_from].to_vec(),
            lobe_free: fitted[lobe_from..].to_vec(),
            lobe: self.lobe,
        })
    }

    /// The floor, from the logarithm of its square.
    fn floor(&self, logarithm: f64, error: f64) -> Constant {
        let value = (0.5 * logarithm).exp() * self.unit;
        let standard_error = 0.5 * error * value;
        Constant { name: "floor".to_owned(), unit: "", value, standard_error }
    }

    /// White's standard errors, valid for noise that differs between readings, with the small-sample factor n/(n - p).
    fn standard_errors(&self, linear: &Linearisation) -> Option<Vec<f64>> {
        let (count, free) = (linear.residuals.len(), linear.columns.len());
        // Columns of unit length; a column of zeros (no floor) is decoupled from the others.
        let scales = DVector::from_iterator(
            free,
            linear.columns.iter().map(|column| {
                let length = column.iter().map(|value| value * value).sum::<f64>().sqrt();
                if length > 0.0 { 1.0 / length } else { 0.0 }
            }),
        );
        let (mut bread, mut meat) = (DMatrix::zeros(free, free), DMatrix::zeros(free, free));
        for i in 0..free {
            for j in 0..=i {
                let (a, b) = (&linear.columns[i], &linear.columns[j]);
                let (mut plain, mut weighted) = (0.0, 0.0);
                for ((a, b), residual) in a.iter().zip(b).zip(&linear.residuals) {
                    plain += a * b;
                    weighted += a * b * residual * residual;
                }
                let scale = scales[i] * scales[j];
                (bread[(i, j)], bread[(j, i)]) = (plain * scale, plain * scale);
                (meat[(i, j)], meat[(j, i)]) = (weighted * scale, weighted * scale);
            }
        }
        for i in (0..free).filter(|&i| scales[i] == 0.0) {
            bread[(i, i)] = 1.0;
        }
        let inverse: DMatrix<f64> = bread.cholesky()?.inverse();
        let small = count as f64 / (count as f64 - free as f64).max(1.0);
        let covariance = &inverse * meat * &inverse * small;
        Some((0..free).map(|i| covariance[(i, i)].sqrt() * scales[i]).collect())
    }
}
