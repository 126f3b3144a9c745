//! From readings to a calibration.

use crate::channels::channels;
use crate::limits::{ORDINARY_PHASE_RAD, UNEXPLAINED};
use crate::model::{Model, Setting, Weights};
use crate::readings::{CodedReadings, ReadingNoise};
use crate::retrieval::{
    Retrieval, StartOutcome, from_several_starts, retrieve, retrieve_roughly, without_outliers,
};
use crate::warm_up::warm_since_s;
use crate::wiring::with_exchanges;
use fieldgap_acoustics::Simulation;
use fieldgap_records::{CalibratedChannel, ChannelState};

/// Why readings give no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// Drives for another number of channels.
    #[error("the readings are of {channels} channels, and the array has {elements} elements")]
    OtherArray {
        /// Channels of the readings.
        channels: usize,
        /// Elements of the array.
        elements: usize,
    },
    /// Too few readings.
    #[error("{readings} readings cannot tell {elements} elements: each has a gain and a phase, so at least {} are needed", 2 * elements)]
    TooFew {
        /// Readings that there are.
        readings: usize,
        /// Elements of the array.
        elements: usize,
    },
    /// All readings are zero.
    #[error("all readings are zero: was the array driven?")]
    Silent,
    /// The curvature of the fit is not positive.
    #[error("the readings do not determine the elements: are all of them at one place?")]
    Undetermined,
}

/// What each channel of an array emits.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// The channels, in the order of the controller's outputs.
    pub channels: Vec<CalibratedChannel>,
    /// The weights, where the array stands, and how its level changed.
    pub weights: Weights,
    /// The element that each channel drives.
    pub wiring: Vec<usize>,
    /// Noise of the readings.
    pub noise: ReadingNoise,
    /// Readings that were used.
    pub used: usize,
    /// Readings from before the array had warmed up.
    pub left_out: usize,
    /// Readings far off the fit.
    pub outliers: usize,
    /// Root mean square of the readings, in their unit.
    pub rms: f64,
    /// Rms of what the fit leaves, relative to the rms of the readings.
    pub residual: f64,
    /// Noise of the used readings, relative to the rms of the readings.
    pub relative_noise: f64,
    /// Squared residuals in units of the noise, per degree of freedom.
    pub chi_square: f64,
    /// Ends of further starts.
    pub starts: Vec<StartOutcome>,
    /// What the readings cannot tell, in sentences.
    pub ambiguities: Vec<String>,
}

/// How a calibration is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Further starts of the phase retrieval.
    pub more_starts: usize,
    /// Seed of these starts.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { more_starts: 2, seed: 1 }
    }
}

/// Calibrates the array of `simulation` by readings of it; the excitation of `simulation` has no part in this.
///
/// # Errors
/// [`CalibrationError`] if the readings do not fit the array or are too few.
pub fn calibrate(
    simulation: &Simulation,
    readings: &CodedReadings,
    options: Options,
) -> Result<Calibration, CalibrationError> {
    let (channels_of_readings, elements) = (readings.channels(), simulation.array.len());
    if channels_of_readings != elements {
        return Err(CalibrationError::OtherArray { channels: channels_of_readings, elements });
    }
    if readings.readings.len() < 2 * elements {
        let readings = readings.readings.len();
        return Err(CalibrationError::TooFew { readings, elements });
    }
    if readings.rms() <= 0.0 {
        return Err(CalibrationError::Silent);
    }
    let noise = readings.noise();
    let all = readings.readings.len();
    let warm = warm_since_s(readings, noise.relative)
        .map(|since_s| readings.clone().from_time(since_s))
        // A calibration of what is left would not be one.
        .filter(|warm| warm.readings.len() >= 2 * elements);
    let readings = warm.as_ref().unwrap_or(readings);
    let left_out = all - readings.readings.len();

    let model = Model::new(simulation, readings, noise);
    let first = retrieve_roughly(&model, &model.nominal());
    let (model, found) = with_exchanges(model, first);
    let found = retrieve(&model, &found.weights);
    let (model, found) = without_outliers(model, found);
    let outliers = found.outliers;
    let found = from_several_starts(&model, found, options.more_starts, options.seed);
    let channels = channels(&found.weights.weights, found.covariance.as_ref(), model.wiring());
    let predicted = model.predicted(&found.weights);
    let rows = model.rows().len();
    let mean = |sum: f64| (sum / rows as f64).sqrt();
    let rms = mean(model.rows().iter().map(|row| row.value.powi(2)).sum());
    let off = model.rows().iter().zip(&predicted).map(|(row, level)| (row.value - level).powi(2));
    let residual = mean(off.sum()) / rms;
    let relative_noise = mean(model.rows().iter().map(|row| model.sd(row).powi(2)).sum()) / rms;
    let ambiguities = ambiguities(readings, &channels, &found);
    Ok(Calibration {
        channels,
        wiring: model.wiring().to_vec(),
        noise,
        used: rows,
        left_out,
        outliers,
        rms,
        residual,
        relative_noise,
        chi_square: found.chi_square,
        starts: found.starts,
        weights: found.weights,
        ambiguities,
    })
}

impl Calibration {
    /// The levels that the calibrated array gives for other readings of it, and those that the array as it was thought to be gives, with
    /// the one gain that fits these readings best. The slow change of level is not carried over.
    pub fn predict(&self, simulation: &Simulation, readings: &CodedReadings) -> [Vec<f64>; 2] {
        let model = Model::new(simulation, readings, self.noise);
        let nominal = model.nominal();
        let calibrated = Weights {
            weights: self.weights.weights.clone(),
            setting: self.weights.setting,
            drift: nominal.drift.clone(),
        };
        let wired = model.clone().wired(self.wiring.clone());
        [wired.predicted(&calibrated), model.predicted(&nominal)].map(|levels| {
            let product: f64 =
                levels.iter().zip(&readings.readings).map(|(level, row)| level * row.value).sum();
            let square: f64 = levels.iter().map(|level| level * level).sum();
            let gain = product / square.max(f64::MIN_POSITIVE);
            levels.into_iter().map(|level| level * gain).collect()
        })
    }

    /// Where the array stands, relative to where it is thought to.
    pub fn setting(&self) -> Setting {
        self.weights.setting
    }

    /// The channels that are not sound.
    pub fn faults(&self) -> impl Iterator<Item = (usize, &CalibratedChannel)> {
        self.channels.iter().enumerate().filter(|(_, c)| c.state != ChannelState::Sound)
    }
}

/// What the readings cannot tell.
fn ambiguities(
    readings: &CodedReadings,
    channels: &[CalibratedChannel],
    found: &Retrieval,
) -> Vec<String> {
    let mut texts = vec![
        "Amplitudes tell neither the common phase nor the common gain of all channels: gains are relative to their median, phases to their mean."
            .to_owned(),
    ];
    if readings.places_m.len() == 1 {
        texts.push(
            "All readings are from one place. There an offset of the array and the speed of sound are phases of its elements, and two exchanged \
             channels are two odd phases: neither is told apart. A focus at this place is right all the same; elsewhere it may not be."
                .to_owned(),
        );
    }
    let is_real = |drive: &Vec<num_complex::Complex64>| {
        drive.iter().all(|phasor| (phasor * drive[0].conj()).im.abs() < 1e-9)
    };
    if readings.places_m.len() == 1 && readings.drives.iter().all(is_real) {
        texts.push(
            "All drives are in phase or in opposition: with every weight mirrored about the array's mean phase they would read the same."
                .to_owned(),
        );
    }
    let others = found.starts.iter().filter(|start| !start.is_same).count();
    if others > 0 {
        let starts = found.starts.len();
        let nearest = found.starts.iter().filter(|start| !start.is_same);
        let chi = nearest.map(|start| start.chi_square).fold(f64::INFINITY, f64::min);
        let wording = if chi < 1.1 * found.chi_square {
            "which explains the readings as well: the weights are not unique"
        } else {
            "which explains the readings worse"
        };
        texts.push(format!(
            "{others} of {starts} further starts ended at another solution, {wording}."
        ));
    }
    let left = found.chi_square.sqrt();
    if left > UNEXPLAINED {
        texts.push(format!(
            "The fit leaves {left:.1} times the noise. Something in the readings is not in its model, and the state of any channel may be wrong: look for a \
             wrong order of channels, an object near the array, or a receiver that was moved."
        ));
    }
    let unsure = channels.iter().filter(|channel| {
        channel.state != ChannelState::Dead && channel.phase_error_rad > ORDINARY_PHASE_RAD
    });
    let unsure = unsure.count();
    if unsure > 0 {
        texts.push(format!(
            "The phase of {unsure} channels is known to no better than 10°, the spread of ordinary elements: measure more drives or places."
        ));
    }
    texts
}
