//! One law on the axis and one lobe, fitted to all readings at once.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Readings;
use super::axis_pose::{AxisPose, Place};
use super::laws::{AxisLaw, Constant, Free, Lobe, LobeLaw};
use fieldgap_acoustics::least_squares::{Linearisation, Parameter, Stopping, minimise};

/// Parameters that come first: floor and amplitude.
const LEVELS: usize = 2;
/// Those that follow where the axis is free: its foot and its lean.
const OF_AXIS: usize = 4;
/// Derivatives are differences over this share of a parameter's scale.
const DIFFERENCE: f64 = 1e-3;
/// The floor's start, relative to the largest reading.
const FLOOR: f64 = 1e-3;
/// The least that is read, relative to the largest reading: divides nothing by zero in a scan without noise.
const LEAST: f64 = 1e-6;

/// A law on the axis times a lobe, as they fit the readings best.
#[derive(Debug, Clone, Serialize)]
pub struct PairFit {
    /// The law on the axis.
    pub axis_law: AxisLaw,
    /// The lobe.
    pub lobe_law: LobeLaw,
    /// The axis.
    pub axis: AxisPose,
    /// Standard errors of the foot, metres, and of the lean; not-a-number where the axis was taken from another fit.
    pub axis_errors: AxisPose,
    /// What is read where nothing arrives, the readings' unit; it adds in quadrature, as noise does to a magnitude.
    pub floor: Constant,
    /// Factor before the laws, the readings' unit (times metres for laws in 1/r).
    pub amplitude: Constant,
    /// The constants of the law on the axis.
    pub axis_constants: Vec<Constant>,
    /// The constants of the lobe.
    pub lobe_constants: Vec<Constant>,
    /// Parameters that were fitted.
    pub parameters: usize,
    /// Share of the readings' variance that the pair explains.
    pub r_squared: f64,
    /// Root mean square of what it leaves, the readings' unit.
    pub residual_rms: f64,
    /// Akaike's information criterion.
    pub aic: f64,
    /// The Bayesian information criterion (Schwarz).
    pub bic: f64,
    /// Whether the fit came to rest.
    pub converged: bool,
    #[serde(skip)]
    pub(super) axis_free: Vec<f64>,
    #[serde(skip)]
    pub(super) lobe_free: Vec<f64>,
    #[serde(skip)]
    pub(super) lobe: Lobe,
}

/// Where a fit takes the axis from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Axis {
    /// Fitted with the rest, from here.
    From(AxisPose),
    /// As it is.
    Held(AxisPose),
}

/// The readings under one pair of laws.
struct Model<'a> {
    readings: &'a Readings,
    axis: AxisLaw,
    lobe: Lobe,
    unit: f64,
    free: Vec<Free>,
    /// The places under an axis that is held.
    held: Option<(AxisPose, Vec<Place>)>,
    axis_count: usize,
}

/// What the laws give at each reading under some parameters.
struct Parts {
    places: Vec<Place>,
    thetas_rad: Vec<f64>,
    along: Vec<f64>,
    about: Vec<f64>,
}

impl PairFit {
    /// Fits a pair, beginning at an axis; `None` where its parameters cannot be told apart.
    pub(super) fn new(
        readings: &Readings,
        axis: AxisLaw,
        lobe: LobeLaw,
        start: Axis,
    ) -> Option<Self> {
        let model = Model::new(readings, axis, lobe, start)?;
        let minimum = minimise(
            &model.parameters()?,
            Stopping { iterations: 60, step: 1e-4, fall: 1e-10 },
            |free| model.residuals(free),
            |free| model.linearised(free),
        );
        model.described(&minimum.parameters, minimum.converged)
    }

    /// Pressure by the law on the axis at a height over the foot, the readings' unit, floor aside; `None` of a law that makes
    /// no sense there.
    pub fn on_axis_at(&self, height_m: f64) -> f64 {
        let place = Place { distance_m: height_m, height_m, theta_rad: 0.0 };
        self.amplitude.value * self.axis_law.at(&self.axis_free, &place) * self.lobe_on_axis()
    }

    /// The lobe at an angle, relative to the axis.
    pub fn lobe_at(&self, theta_rad: f64) -> f64 {
        let at =
            |theta: f64| self.lobe.at(&self.lobe_free, &[theta]).map_or(f64::NAN, |found| found[0]);
        at(theta_rad) / at(0.0)
    }

    fn lobe_on_axis(&self) -> f64 {
        self.lobe.at(&self.lobe_free, &[0.0]).map_or(f64::NAN, |found| found[0])
    }

    /// What the pair gives at each reading, its unit.
    pub fn predicted(&self, readings: &Readings) -> Vec<f64> {
        let places = self.axis.places(&readings.at_m);
        let thetas: Vec<f64> = places.iter().map(|place| place.theta_rad).collect();
        let about = self.lobe.at(&self.lobe_free, &thetas).unwrap_or_default();
        places
            .iter()
            .zip(about)
            .map(|(place, about)| {
                let along = self.axis_law.at(&self.axis_free, place);
                self.floor.value.hypot(self.amplitude.value * along * about)
            })
            .collect()
    }
}

/// What is read under some parameters, relative: floor and pressure in quadrature.
fn read<'p>(free: &'p [f64], parts: &'p Parts) -> impl Iterator<Item = f64> + 'p {
    let pressures =
        parts.along.iter().zip(&parts.about).map(|(along, about)| free[1] * along * about);
    let floor = free[0].exp() + LEAST * LEAST;
    pressures.map(move |pressure| (floor + pressure * pressure).sqrt())
}

impl<'a> Model<'a> {
    fn new(readings: &'a Readings, axis: AxisLaw, lobe: LobeLaw, start: Axis) -> Option<Self> {
        let (Axis::From(pose) | Axis::Held(pose)) = start;
        let places = pose.places(&readings.at_m);
        let thetas: Vec<f64> = places.iter().map(|place| place.theta_rad).collect();
        let lobe = Lobe::new(lobe, &thetas, readings.wavenumber_rad_m);
        let unit = readings.largest();
        let (axis_free, lobe_free) = (axis.free(), lobe.free());
        let axis_count = axis_free.len();
        let own = |name: &str, start: f64, scale: f64| Free {
            name: name.to_owned(),
            unit: "",
            factor: 1.0,
            start,
            scale,
        };
        // The logarithm of the floor's square is what is free: a floor is never below zero.
        let mut free = vec![own("floor", 2.0 * FLOOR.ln(), 0.1), own("amplitude", 1.0, 1e-2)];
        let mut held = None;
        if let Axis::Held(_) = start {
            held = Some((pose, places));
        } else {
            free.extend([
                own("x", pose.foot_m[0], 1e-4),
                own("y", pose.foot_m[1], 1e-4),
                own("lean x", pose.lean[0], 1e-3),
                own("lean y", pose.lean[1], 1e-3),
            ]);
        }
        free.extend(axis_free);
        free.extend(lobe_free);
        let mut model = Self { readings, axis, lobe, unit, free, held, axis_count };
        // The amplitude that fits the start best.
        let parts = model.parts(&model.starts())?;
        let (mut cross, mut square) = (0.0, 0.0);
        for ((along, about), value) in parts.along.iter().zip(&parts.about).zip(&readings.values) {
            cross += along * about * value / unit;
            square += (along * about).powi(2);
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

    /// Each parameter in units of what it takes to change the readings by as much as the start misses them.
    fn parameters(&self) -> Option<Vec<Parameter>> {
        let linear = self.linearised(&self.starts());
        let length = |column: &[f64]| column.iter().map(|value| value * value).sum::<f64>().sqrt();
        let missed = length(&linear.residuals) / (linear.residuals.len() as f64).sqrt();
        self.free
            .iter()
            .zip(&linear.columns)
            .map(|(free, column)| {
                let scale = missed / length(column);
                let told = scale.is_finite() && scale > 0.0;
                told.then_some(Parameter { start: free.start, scale, prior: None })
            })
            .collect()
    }

    /// Where the parameters of the law on the axis begin.
    fn laws_from(&self) -> usize {
        if self.held.is_some() { LEVELS } else { LEVELS + OF_AXIS }
    }

    fn pose(&self, free: &[f64]) -> AxisPose {
        match self.held {
            Some((pose, _)) => pose,
            None => AxisPose { foot_m: [free[2], free[3]], lean: [free[4], free[5]] },
        }
    }

    fn parts(&self, free: &[f64]) -> Option<Parts> {
        let places = match &self.held {
            Some((_, places)) => places.clone(),
            None => self.pose(free).places(&self.readings.at_m),
        };
        let thetas_rad: Vec<f64> = places.iter().map(|place| place.theta_rad).collect();
        let along = self.along(free, &places);
        let about = self.lobe.at(self.of_lobe(free), &thetas_rad)?;
        Some(Parts { places, thetas_rad, along, about })
    }

    fn along(&self, free: &[f64], places: &[Place]) -> Vec<f64> {
        let from = self.laws_from();
        let of_axis = &free[from..from + self.axis_count];
        places.iter().map(|place| self.axis.at(of_axis, place)).collect()
    }

    fn of_lobe<'f>(&self, free: &'f [f64]) -> &'f [f64] {
        &free[self.laws_from() + self.axis_count..]
    }

    fn residuals_of(&self, free: &[f64], parts: &Parts) -> Vec<f64> {
        let values = self.readings.values.iter();
        values.zip(read(free, parts)).map(|(value, read)| read - value / self.unit).collect()
    }

    fn residuals(&self, free: &[f64]) -> Vec<f64> {
        match self.parts(free) {
            Some(parts) => self.residuals_of(free, &parts),
            None => vec![f64::NAN; self.readings.values.len()],
        }
    }

    fn linearised(&self, free: &[f64]) -> Linearisation {
        let nowhere = || vec![f64::NAN; self.readings.values.len()];
        let Some(parts) = self.parts(free) else {
            return Linearisation {
                residuals: nowhere(),
                columns: vec![nowhere(); self.free.len()],
            };
        };
        let reads: Vec<f64> = read(free, &parts).collect();
        let product = |along: &[f64], about: &[f64]| {
            along.iter().zip(about).map(|(a, b)| a * b).collect::<Vec<f64>>()
        };
        let columns = (0..free.len())
            .map(|index| {
                let step = DIFFERENCE * self.free[index].scale;
                let moved = |by: f64| {
                    let mut moved = free.to_vec();
                    moved[index] += by;
                    moved
                };
                // The product of both laws, a little farther along one parameter: only what depends on it is computed again.
                let shifted = |by: f64| -> Option<Vec<f64>> {
                    let moved = moved(by);
                    if index < self.laws_from() {
                        let parts = self.parts(&moved)?;
                        Some(product(&parts.along, &parts.about))
                    } else if index < self.laws_from() + self.axis_count {
                        Some(product(&self.along(&moved, &parts.places), &parts.about))
                    } else {
                        let about = self.lobe.at(self.of_lobe(&moved), &parts.thetas_rad)?;
                        Some(product(&parts.along, &about))
                    }
                };
                // How much of the pressure's change is read, beside the floor.
                let heard = |pressures: Vec<f64>| {
                    let own = parts.along.iter().zip(&parts.about).zip(&reads);
                    own.zip(pressures)
                        .map(|(((along, about), read), change)| {
                            free[1] * along * about / read * change
                        })
                        .collect()
                };
                match index {
                    0 => reads.iter().map(|read| 0.5 * free[0].exp() / read).collect(),
                    1 => heard(product(&parts.along, &parts.about)),
                    _ => match (shifted(step), shifted(-step)) {
                        (Some(up), Some(down)) => heard(
                            up.iter()
                                .zip(&down)
                                .map(|(up, down)| free[1] * (up - down) / (2.0 * step))
                                .collect(),
                        ),
                        _ => nowhere(),
                    },
                }
            })
            .collect();
        Linearisation { residuals: self.residuals_of(free, &parts), columns }
    }

    fn described(self, fitted: &[f64], converged: bool) -> Option<PairFit> {
        let linear = self.linearised(fitted);
        let errors = self.standard_errors(&linear)?;
        let count = linear.residuals.len() as f64;
        let squares: f64 = linear.residuals.iter().map(|r| r * r).sum();
        let mean = self.readings.values.iter().sum::<f64>() / count / self.unit;
        let spread: f64 = self.readings.values.iter().map(|v| (v / self.unit - mean).powi(2)).sum();
        // An axis that is held was fitted once for all.
        let parameters = (LEVELS + OF_AXIS + fitted.len() - self.laws_from()) as f64;
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
        let (axis_from, lobe_from) = (self.laws_from(), self.laws_from() + self.axis_count);
        let axis_errors = match self.held {
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
            r_squared: 1.0 - squares / spread,
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

    /// Standard errors that hold whatever the size of each reading's own noise: White's, with the small-sample factor
    /// n/(n - p).
    fn standard_errors(&self, linear: &Linearisation) -> Option<Vec<f64>> {
        let (count, free) = (linear.residuals.len(), linear.columns.len());
        // Columns of unit length; one of nothing, a floor that is not there, tells of no other.
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
                let (mut plain, mut weighed) = (0.0, 0.0);
                for ((a, b), residual) in a.iter().zip(b).zip(&linear.residuals) {
                    plain += a * b;
                    weighed += a * b * residual * residual;
                }
                let scale = scales[i] * scales[j];
                (bread[(i, j)], bread[(j, i)]) = (plain * scale, plain * scale);
                (meat[(i, j)], meat[(j, i)]) = (weighed * scale, weighed * scale);
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
