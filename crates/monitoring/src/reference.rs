//! What is known of one figure in one cell: its mean, and how it changes with temperature.

use fieldgap_text::Uncertain;
use serde::{Deserialize, Serialize};

use crate::environment::Slope;

/// One figure of one run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The figure.
    pub value: f64,
    /// Its stated variance.
    pub variance: f64,
    /// Temperature of the air, °C.
    pub temperature_c: Option<f64>,
    /// Variance of that, K².
    pub temperature_variance: f64,
}

impl Reading {
    /// Of a figure and the temperature; `None` if the figure is not a finite number. Without a stated error every run weighs the
    /// same: its variance is then 1, and the scatter between runs gives the scale.
    pub fn of(figure: Uncertain, temperature_c: Option<Uncertain>) -> Option<Self> {
        let stated = |error: f64| (error.is_finite() && error > 0.0).then_some(error * error);
        let air = temperature_c.filter(|air| air.value.is_finite());
        figure.value.is_finite().then(|| Self {
            value: figure.value,
            variance: stated(figure.standard_error).unwrap_or(1.0),
            temperature_c: air.map(|air| air.value),
            temperature_variance: air.and_then(|air| stated(air.standard_error)).unwrap_or(0.0),
        })
    }
}

/// A straight line in temperature through the readings so far, weighted by their stated variances: their number, weighted means, and
/// weighted sums about the means. These are all that later predictions need.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Reference {
    runs: u32,
    weight: f64,
    mean: f64,
    mean_temperature_c: Option<f64>,
    temperature_squares: f64,
    temperature_products: f64,
}

/// What a reading was expected to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Expected figure at the reading's temperature.
    pub value: f64,
    /// Variance of the difference of reading and expectation, in units in which stated variances count as they are.
    pub variance: f64,
    /// What temperature adds to the figure: to be taken away from the reading to correct it.
    pub of_temperature: f64,
    /// Variance of that.
    pub temperature_variance: f64,
}

impl Reference {
    /// Number of runs.
    pub fn runs(&self) -> u32 {
        self.runs
    }

    /// Weighted mean, at the mean temperature.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Variance of the mean by stated errors alone.
    pub fn variance(&self) -> f64 {
        1.0 / self.weight
    }

    /// Weighted mean of the temperatures, °C.
    pub fn temperature_c(&self) -> Option<f64> {
        self.mean_temperature_c
    }

    /// Change of the figure for each kelvin; `None` if it is not corrected for or not determined yet. `scatter` is the ratio of
    /// the scatter between runs to stated errors.
    pub fn per_k(&self, slope: Slope, scatter: f64) -> Option<Uncertain> {
        let (value, information) = match slope {
            Slope::Uncorrected => return None,
            Slope::Fitted => (self.temperature_products, self.temperature_squares),
            Slope::Predicted(known) if known.standard_error > 0.0 => {
                // Its variance does not grow with scatter, as those of the readings do.
                let prior = (scatter / known.standard_error).powi(2);
                (self.temperature_products + prior * known.value, self.temperature_squares + prior)
            }
            Slope::Predicted(known) => {
                return Some(Uncertain { standard_error: 0.0, ..known });
            }
        };
        (information > 0.0).then(|| Uncertain {
            value: value / information,
            standard_error: scatter / information.sqrt(),
        })
    }

    /// What a reading is expected to be; `None` if that is not determined: nothing was read before, or the temperature is another one
    /// and its influence unknown.
    pub fn predict(&self, reading: &Reading, slope: Slope, scatter: f64) -> Option<Prediction> {
        if self.runs == 0 {
            return None;
        }
        let warmer_k = match (reading.temperature_c, self.mean_temperature_c, slope) {
            (_, _, Slope::Uncorrected) => 0.0,
            (Some(now), Some(before), _) => now - before,
            _ => 0.0,
        };
        let per_k = self.per_k(slope, scatter);
        if per_k.is_none() && warmer_k != 0.0 {
            return None;
        }
        let per_k = per_k.unwrap_or(Uncertain { value: 0.0, standard_error: 0.0 });
        let of_slope = (warmer_k * per_k.standard_error / scatter).powi(2);
        let of_thermometer = (per_k.value / scatter).powi(2) * reading.temperature_variance;
        let of_temperature = per_k.value * warmer_k;
        Some(Prediction {
            value: self.mean + of_temperature,
            variance: reading.variance + self.variance() + of_slope + of_thermometer,
            of_temperature,
            temperature_variance: of_slope + of_thermometer,
        })
    }

    /// Adds a reading. One without temperature counts as read at the mean temperature.
    pub fn add(&mut self, reading: &Reading) {
        let weight = 1.0 / reading.variance;
        let total = self.weight + weight;
        let temperature = reading.temperature_c.or(self.mean_temperature_c);
        let warmer_k = match (temperature, self.mean_temperature_c) {
            (Some(now), Some(before)) => now - before,
            _ => 0.0,
        };
        let larger = reading.value - self.mean;
        let share = weight / total;
        self.temperature_squares += self.weight * share * warmer_k * warmer_k;
        self.temperature_products += self.weight * share * warmer_k * larger;
        self.mean += share * larger;
        let mean = |before: f64| before + share * warmer_k;
        self.mean_temperature_c = self.mean_temperature_c.map(mean).or(temperature);
        self.weight = total;
        self.runs += 1;
    }
}

/// Scatter between runs against their stated errors, pooled over the cells: the sum of squared standardised differences of runs from what
/// the runs before let expect.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Scatter {
    degrees_of_freedom: u32,
    squares: f64,
}

impl Scatter {
    /// How many differences it is known from.
    pub fn degrees_of_freedom(&self) -> u32 {
        self.degrees_of_freedom
    }

    /// Ratio of the scatter to stated errors: 1 if stated errors account for all of it; `None` while it is unknown. Its error
    /// is that of a standard deviation.
    pub fn ratio(&self) -> Option<Uncertain> {
        let freedom = f64::from(self.degrees_of_freedom);
        let value = (self.squares / freedom).sqrt();
        (self.degrees_of_freedom > 0 && value > 0.0)
            .then(|| Uncertain { value, standard_error: value / (2.0 * freedom).sqrt() })
    }

    /// The scatter without a part of its differences.
    pub(crate) fn without(&self, part: Self) -> Self {
        Self {
            degrees_of_freedom: self.degrees_of_freedom - part.degrees_of_freedom,
            squares: (self.squares - part.squares).max(0.0),
        }
    }

    /// Sum of the squared differences.
    pub(crate) fn squares(&self) -> f64 {
        self.squares
    }

    /// Adds a standardised difference.
    pub fn add(&mut self, difference: f64) {
        self.degrees_of_freedom += 1;
        self.squares += difference * difference;
    }
}
