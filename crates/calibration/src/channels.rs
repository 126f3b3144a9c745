//! Each channel's gain and phase with standard errors, and what it is: sound, weak, dead, reversed or swapped.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use crate::limits::{DEAD_GAIN, REVERSED_WITHIN_RAD, SURE, WEAK_GAIN};
use crate::readings::median;
use fieldgap_records::{CalibratedChannel, ChannelState};

/// The channels of complex weights, whose real parts and then imaginary parts lead the covariance.
///
/// Gains are relative to the median. Phases are relative to the mean of the channels that are neither dead nor reversed. The common gain
/// and phase of all are not in the errors, since no reading tells them.
pub fn channels(
    weights: &[Complex64],
    covariance: Option<&DMatrix<f64>>,
    wiring: &[usize],
) -> Vec<CalibratedChannel> {
    let n = weights.len();
    let gain = median(weights.iter().map(|w| w.norm()).collect()).max(f64::MIN_POSITIVE);
    let sum: Complex64 = weights.iter().map(|w| w / w.norm().max(f64::MIN_POSITIVE)).sum();
    let rough_rad = sum.arg();
    let turned = |w: &Complex64, by_rad: f64| (w * Complex64::from_polar(1.0, -by_rad)).arg();
    let is_upright = |w: &Complex64| {
        w.norm() > DEAD_GAIN * gain && turned(w, rough_rad).abs() < PI - REVERSED_WITHIN_RAD
    };
    let upright: Vec<usize> = (0..n).filter(|&k| is_upright(&weights[k])).collect();
    let phases = upright.iter().map(|&k| turned(&weights[k], rough_rad));
    let common_rad = rough_rad + phases.sum::<f64>() / upright.len().max(1) as f64;
    let errors = errors(weights, covariance, &upright);
    (0..n)
        .map(|k| {
            let [gain_error, phase_error_rad] = errors[k];
            let relative = weights[k].norm() / gain;
            let gain_error = gain_error / gain;
            let phase_rad = turned(&weights[k], common_rad);
            let is_below = |limit: f64| relative + SURE * gain_error < limit;
            // Half a turn off by far less than a quarter.
            let off_half_turn_rad = PI - phase_rad.abs();
            let state = if wiring[k] != k {
                ChannelState::Swapped
            } else if is_below(DEAD_GAIN) {
                ChannelState::Dead
            } else if off_half_turn_rad + SURE * phase_error_rad
                < REVERSED_WITHIN_RAD.max(2.0 * SURE * phase_error_rad).min(PI / 2.0)
            {
                ChannelState::Reversed
            } else if is_below(WEAK_GAIN) {
                ChannelState::Weak
            } else {
                ChannelState::Sound
            };
            let is_dead = state == ChannelState::Dead;
            CalibratedChannel {
                gain: relative,
                gain_error,
                phase_rad: if is_dead { 0.0 } else { phase_rad },
                phase_error_rad: if is_dead { PI } else { phase_error_rad.min(PI) },
                state,
                drives: wiring[k],
            }
        })
        .collect()
}

/// Standard errors of modulus and phase of each weight, without what all have in common.
fn errors(
    weights: &[Complex64],
    covariance: Option<&DMatrix<f64>>,
    upright: &[usize],
) -> Vec<[f64; 2]> {
    let n = weights.len();
    let Some(covariance) = covariance else { return vec![[f64::INFINITY, PI]; n] };
    let of_parts = covariance.view((0, 0), (2 * n, 2 * n));
    let unit = |k: usize| weights[k] / weights[k].norm().max(f64::MIN_POSITIVE);
    // Rows of the derivative of modulus and of phase by the parts, each with two entries.
    let modulus = |k: usize| [(k, unit(k).re), (n + k, unit(k).im)];
    let phase = |k: usize| {
        let size = weights[k].norm().max(f64::MIN_POSITIVE);
        [(k, -unit(k).im / size), (n + k, unit(k).re / size)]
    };
    let relative = |k: usize| {
        let size = weights[k].norm().max(f64::MIN_POSITIVE);
        modulus(k).map(|(at, slope)| (at, slope / size))
    };
    let common = |row: &dyn Fn(usize) -> [(usize, f64); 2]| {
        let mut mean = DVector::zeros(2 * n);
        for &k in upright {
            for (at, slope) in row(k) {
                mean[at] += slope / upright.len() as f64;
            }
        }
        let product = of_parts * &mean;
        (mean.dot(&product), product)
    };
    let (of_gain, gain_product) = common(&relative);
    let (of_phase, phase_product) = common(&phase);
    let variance = |row: [(usize, f64); 2], product: &DVector<f64>, share: f64, common: f64| {
        let mut sum = common * share * share;
        for (i, a) in row {
            sum -= 2.0 * share * a * product[i];
            for (j, b) in row {
                sum += a * b * of_parts[(i, j)];
            }
        }
        sum.max(0.0).sqrt()
    };
    (0..n)
        .map(|k| {
            let size = weights[k].norm();
            [
                variance(modulus(k), &gain_product, size, of_gain),
                variance(phase(k), &phase_product, 1.0, of_phase),
            ]
        })
        .collect()
}
