//! The field after the readings: the prior conditioned on them, linearised about the field itself until that no longer changes.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rayon::prelude::*;

use fieldgap_acoustics::least_squares::Factor;
use fieldgap_diagnosis::{FieldSamples, FoundField, PossibleReading};

use crate::diffuse::correlation;
use crate::estimate::{Estimate, FieldEstimate, Foretold};
use crate::prior::{Functionals, Prior, ReceiverCurve, Sizes};
use crate::sizes::{Parts, best_sizes};

/// Linearisations: the field then changes by less than a tenth of its standard error.
const LINEARISATIONS: usize = 4;

/// Amplitude in standard deviations below which the error across the field shows in the amplitude.
const WEAK: f64 = 6.0;

/// A prior conditioned on readings.
pub(crate) struct Posterior<'f> {
    field: &'f FoundField<'f>,
    prior: Prior,
    readings: FieldSamples,
    units: Vec<Complex64>,
    slopes: Vec<f64>,
    receiver: Vec<Vec<f64>>,
    sizes: Sizes,
    curve: ReceiverCurve,
    factor: Factor,
    /// The inverse covariance times the departures of the readings.
    weights: DVector<f64>,
    /// Mean of the parameters, in standard deviations, and of the elements' errors.
    parameters: DVector<f64>,
    elements: DVector<f64>,
    by_parameters: DMatrix<f64>,
    by_elements: DMatrix<f64>,
}

impl<'f> Posterior<'f> {
    /// Of the driven readings of the record that the field was fitted to, in their order. `None` if their covariance has no factor, which
    /// numbers that are not finite make.
    pub fn of(field: &'f FoundField<'f>, readings: &[f64]) -> Option<Self> {
        let samples = field.at_readings();
        let largest = readings.iter().copied().fold(0.0, f64::max);
        let mut sizes = Sizes { elements: 0.01, diffuse: 0.002 * largest, noise: 1.0 };
        let curve = ReceiverCurve { largest };
        let mut levels = samples.levels.clone();
        let mut across = vec![0.0; levels.len()];
        let mut prior = None;
        let mut posterior = None;
        for round in 0..LINEARISATIONS {
            let units: Vec<Complex64> = levels.iter().map(|&level| unit(level)).collect();
            let magnitudes: Vec<f64> = levels
                .iter()
                .zip(&across)
                .map(|(level, across)| (level.norm_sqr() + across).sqrt())
                .collect();
            let received: Vec<_> = magnitudes
                .iter()
                .enumerate()
                .map(|(index, &level)| field.received(&samples, index, level))
                .collect();
            let mut receiver = field.receiver_slopes(&samples, &magnitudes, true);
            let means: Vec<f64> = received.iter().map(|received| received.reading).collect();
            receiver.extend(curve.slopes(&means));
            // A level that is lost in the error across it hardly depends on the field along it.
            let slopes: Vec<f64> = received
                .iter()
                .zip(levels.iter().zip(&magnitudes))
                .map(|(received, (level, magnitude))| received.slope * level.norm() / magnitude)
                .collect();
            let functionals = Functionals { samples: &samples, units, slopes, receiver };
            let prior: &Prior = prior.get_or_insert_with(|| {
                let noise: Vec<f64> = received.iter().map(|received| received.variance).collect();
                let (departures, k) = (field.departures(), field.wavenumber_rad_m());
                Prior::new(departures, k, &functionals, &noise)
            });
            let by_parameters = prior.by_parameters(&functionals);
            let by_elements = prior.by_elements(&functionals);
            let by_diffuse = prior.by_diffuse(&functionals, &functionals);
            // What the readings depart from the expected, the present mean of the state added back.
            let departures: Vec<f64> = (0..readings.len())
                .map(|n| {
                    let moved = functionals.of(n, levels[n] - samples.levels[n]);
                    readings[n] - received[n].reading + moved
                })
                .collect();
            let mut departures = DVector::from_vec(departures);
            departures -= by_parameters.tr_mul(&prior.mean());
            let weak: Vec<f64> = (0..readings.len())
                .map(|n| 0.5 * (across[n] / magnitudes[n].max(f64::MIN_POSITIVE)).powi(2))
                .collect();
            let noise: Vec<f64> = received
                .iter()
                .zip(&weak)
                .map(|(received, weak)| received.variance + weak)
                .collect();
            let parts = Parts { by_parameters, by_elements, by_diffuse, noise, departures };
            if round < 2 {
                sizes = best_sizes(&parts, sizes, largest);
            }
            let factor = Factor::of(parts.covariance(sizes))?;
            let weights = factor.solve(&parts.departures);
            let Parts { by_parameters, by_elements, .. } = parts;
            let found = Self {
                parameters: prior.mean() + &by_parameters * &weights,
                elements: &by_elements * &weights * sizes.elements.powi(2),
                field,
                prior: prior.clone(),
                curve,
                units: functionals.units,
                slopes: functionals.slopes,
                receiver: functionals.receiver,
                readings: samples.clone(),
                sizes,
                factor,
                weights,
                by_parameters,
                by_elements,
            };
            levels = found.levels(&samples);
            if round + 1 < LINEARISATIONS {
                across = found.across_where_weak(&samples, &levels);
            }
            posterior = Some(found);
        }
        posterior
    }

    /// The sizes with the greatest evidence.
    pub fn sizes(&self) -> Sizes {
        self.sizes
    }

    fn functionals(&self) -> Functionals<'_> {
        Functionals {
            samples: &self.readings,
            units: self.units.clone(),
            slopes: self.slopes.clone(),
            receiver: self.receiver.clone(),
        }
    }

    /// The mean field at some samples.
    fn levels(&self, samples: &FieldSamples) -> Vec<Complex64> {
        let departures = &self.prior.departures;
        let k = self.prior.wavenumber_rad_m;
        let half = 0.5 * self.sizes.diffuse * self.sizes.diffuse;
        let weighted: Vec<Complex64> = (0..self.units.len())
            .map(|n| half * self.slopes[n] * self.weights[n] * self.units[n])
            .collect();
        let at = |place: usize| {
            let mut level = samples.levels[place];
            for (parameter, slopes) in samples.slopes.iter().enumerate() {
                level +=
                    departures[parameter].deviation * self.parameters[parameter] * slopes[place];
            }
            let count = samples.elements.len();
            for (n, element) in samples.elements.iter().enumerate() {
                let error = Complex64::new(self.elements[n], self.elements[count + n]);
                level += error * element[place];
            }
            let (at_m, focus) = (&samples.at_m[place], samples.foci[place]);
            let readings = self.readings.at_m.iter().zip(&self.readings.foci).zip(&weighted);
            for ((reading_m, reading_focus), weighted) in readings {
                if *reading_focus == focus {
                    level += correlation(k, at_m, reading_m) * weighted;
                }
            }
            level
        };
        (0..samples.levels.len()).into_par_iter().map(at).collect()
    }

    /// Covariance of the readings with some functionals: a row for each reading.
    fn with_readings(&self, functionals: &Functionals<'_>) -> DMatrix<f64> {
        let Sizes { elements, diffuse, .. } = self.sizes;
        let mut with = self.by_parameters.tr_mul(&self.prior.by_parameters(functionals));
        with += self.by_elements.tr_mul(&self.prior.by_elements(functionals)) * elements.powi(2);
        with += self.prior.by_diffuse(&self.functionals(), functionals) * diffuse.powi(2);
        with
    }

    /// Variance of functionals before and after the readings.
    fn variances(&self, functionals: &Functionals<'_>) -> Vec<f64> {
        let whitened = self.factor.whitened(&self.with_readings(functionals));
        let Sizes { elements, diffuse, .. } = self.sizes;
        let by_parameters = self.prior.by_parameters(functionals);
        let by_elements = self.prior.by_elements(functionals);
        (0..functionals.units.len())
            .map(|n| {
                let before = by_parameters.column(n).norm_squared()
                    + elements.powi(2) * by_elements.column(n).norm_squared()
                    + 0.5 * (diffuse * functionals.slopes[n]).powi(2);
                (before - whitened.column(n).norm_squared()).max(0.0)
            })
            .collect()
    }

    /// Variance across the field where it is weak; zero elsewhere.
    fn across_where_weak(&self, samples: &FieldSamples, levels: &[Complex64]) -> Vec<f64> {
        let mean = self.sizes.elements.powi(2);
        let spread = |place: usize| {
            let elements: f64 = samples.elements.iter().map(|e| e[place].norm_sqr()).sum();
            (mean * elements + 0.5 * self.sizes.diffuse.powi(2)).sqrt()
        };
        let weak: Vec<usize> = (0..levels.len())
            .filter(|&place| levels[place].norm() < WEAK * spread(place))
            .collect();
        let some = samples.only(&weak);
        let units: Vec<Complex64> = weak.iter().map(|&n| unit(levels[n])).collect();
        let slopes = vec![1.0; weak.len()];
        let along = Functionals { samples: &some, units, slopes, receiver: Vec::new() };
        let mut across = vec![0.0; levels.len()];
        for (place, variance) in weak.iter().zip(self.variances(&along.across())) {
            across[*place] = variance;
        }
        across
    }

    /// Functionals of what the receiver makes of a mean field, without noise or with it.
    fn read<'s>(&self, samples: &'s FieldSamples, levels: &[Complex64], noisy: bool) -> Read<'s> {
        let across = self.across_where_weak(samples, levels);
        let magnitudes: Vec<f64> =
            levels.iter().zip(&across).map(|(level, a)| (level.norm_sqr() + a).sqrt()).collect();
        let received: Vec<_> = (0..levels.len())
            .map(|n| match noisy {
                true => self.field.received(samples, n, magnitudes[n]),
                false => self.field.noiseless(samples, n, magnitudes[n]),
            })
            .collect();
        let mut receiver = self.field.receiver_slopes(samples, &magnitudes, noisy);
        let means: Vec<f64> = received.iter().map(|received| received.reading).collect();
        receiver.extend(self.curve.slopes(&means));
        let functionals = Functionals {
            samples,
            units: levels.iter().map(|&level| unit(level)).collect(),
            slopes: received
                .iter()
                .zip(levels.iter().zip(&magnitudes))
                .map(|(r, (level, magnitude))| {
                    r.slope * level.norm() / magnitude.max(f64::MIN_POSITIVE)
                })
                .collect(),
            receiver,
        };
        let weak = (0..levels.len())
            .map(|n| 0.5 * across[n].powi(2) / magnitudes[n].powi(2).max(f64::MIN_POSITIVE))
            .zip(&received)
            .map(|(variance, received)| variance * received.slope.powi(2))
            .collect();
        let readings = received
            .iter()
            .zip(self.prior.at_receiver(&functionals, &self.parameters))
            .map(|(received, change)| (received.reading + change).max(0.0));
        Read {
            readings: readings.collect(),
            noise: received.iter().map(|r| self.sizes.noise * r.variance.sqrt()).collect(),
            functionals,
            weak,
        }
    }

    /// Standard errors of what the receiver makes of the mean field.
    fn standard_errors(&self, read: &Read<'_>) -> Vec<f64> {
        let variances = self.variances(&read.functionals);
        variances.iter().zip(&read.weak).map(|(variance, weak)| (variance + weak).sqrt()).collect()
    }
}

/// What the receiver makes of a mean field at some places.
struct Read<'s> {
    functionals: Functionals<'s>,
    readings: Vec<f64>,
    /// Standard deviation of a reading's noise.
    noise: Vec<f64>,
    /// What errors across a weak field add to the variance.
    weak: Vec<f64>,
}

impl FieldEstimate for Posterior<'_> {
    fn map(&self, places: &[PossibleReading]) -> Vec<Estimate> {
        let samples = self.field.at(places);
        let levels = self.levels(&samples);
        let read = self.read(&samples, &levels, false);
        let errors = self.standard_errors(&read);
        let both = read.readings.into_iter().zip(errors);
        both.map(|(amplitude, standard_error)| Estimate { amplitude, standard_error }).collect()
    }

    fn foretold(&self, places: &[PossibleReading], moment: f64) -> Vec<Foretold> {
        let samples = self.field.at_moment(places, moment);
        let levels = self.levels(&samples);
        let read = self.read(&samples, &levels, true);
        let errors = self.standard_errors(&read);
        let all = read.readings.into_iter().zip(errors).zip(read.noise);
        all.map(|((reading, standard_error), noise)| Foretold { reading, standard_error, noise })
            .collect()
    }

    fn covariance(
        &self,
        targets: &[PossibleReading],
        possible: &[PossibleReading],
    ) -> DMatrix<f64> {
        let [targets, possible] = [targets, possible].map(|places| self.field.at(places));
        let functionals = |samples| {
            let levels = self.levels(samples);
            self.read(samples, &levels, false).functionals
        };
        let (targets, possible) = (functionals(&targets), functionals(&possible));
        let Sizes { elements, diffuse, .. } = self.sizes;
        let mut between =
            self.prior.by_parameters(&targets).tr_mul(&self.prior.by_parameters(&possible));
        between += self.prior.by_elements(&targets).tr_mul(&self.prior.by_elements(&possible))
            * elements.powi(2);
        between += self.prior.by_diffuse(&targets, &possible) * diffuse.powi(2);
        let [targets, possible] = [&targets, &possible]
            .map(|functionals| self.factor.whitened(&self.with_readings(functionals)));
        between - targets.tr_mul(&possible)
    }
}

/// The direction of a complex number.
fn unit(level: Complex64) -> Complex64 {
    let magnitude = level.norm();
    if magnitude > 0.0 { level / magnitude } else { Complex64::ONE }
}
