//! The drive that makes a calibrated array emit what an ideal one would.
//!
//! The phase of each channel is taken from its drive; the levels are lowered to a common one, where the controller has levels. What is
//! left is the rounding of the controller: with N steps a period, phases that are uniform within half a step, π / (N √3) rms.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use fieldgap_records::{CalibratedChannel, ChannelState};

/// The drive of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelDrive {
    /// Phase, rad, 0 to 2π.
    pub phase_rad: f64,
    /// Level, 0 to 1 of the whole carrier.
    pub level: f64,
}

/// Steps of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Steps {
    /// Delays in a period.
    pub phase: u32,
    /// Levels above silence; 1 where a channel is on or off.
    pub level: u32,
}

/// The drives for the phases that the emission of each channel is to have, rad. Phases are those of the places that the channels drive:
/// a swapped channel is given the phase of its true place.
///
/// With more than one level, every channel emits as the weakest sound one: an even aperture with lower side lobes and a lower peak.
pub fn compensated(
    channels: &[CalibratedChannel],
    phases_rad: &[f64],
    steps: Steps,
) -> Vec<ChannelDrive> {
    let sounding = |channel: &&CalibratedChannel| {
        !matches!(channel.state, ChannelState::Dead | ChannelState::Weak)
    };
    let weakest = channels.iter().filter(sounding).map(|c| c.gain).fold(f64::INFINITY, f64::min);
    let drive = |(channel, &phase_rad): (&CalibratedChannel, &f64)| {
        let step = TAU / f64::from(steps.phase);
        let phase_rad = ((phase_rad - channel.phase_rad) / step).round() * step;
        let level = match channel.state {
            ChannelState::Dead => 0.0,
            _ if steps.level == 1 => 1.0,
            _ => (weakest / channel.gain).min(1.0),
        };
        let levels = f64::from(steps.level);
        ChannelDrive {
            phase_rad: phase_rad.rem_euclid(TAU),
            level: (level * levels).round() / levels,
        }
    };
    channels.iter().zip(phases_rad).map(drive).collect()
}

/// Rms of what the compensated channels emit beyond a common factor, relative: what rounding and missing levels leave. Dead channels are
/// left out.
pub fn left_over(
    channels: &[CalibratedChannel],
    phases_rad: &[f64],
    drives: &[ChannelDrive],
) -> f64 {
    let emitted: Vec<Complex64> = channels
        .iter()
        .zip(phases_rad)
        .zip(drives)
        .filter(|((channel, _), _)| channel.state != ChannelState::Dead)
        .map(|((channel, wanted), drive)| {
            Complex64::from_polar(
                channel.gain * drive.level,
                drive.phase_rad + channel.phase_rad - wanted,
            )
        })
        .collect();
    let mean = emitted.iter().sum::<Complex64>() / emitted.len().max(1) as f64;
    let squares: f64 = emitted.iter().map(|emitted| (emitted / mean - 1.0).norm_sqr()).sum();
    (squares / emitted.len().max(1) as f64).sqrt()
}

/// Rms phase that rounding to `steps` a period leaves, rad.
pub fn rounding_rad(steps: u32) -> f64 {
    PI / (f64::from(steps) * 3f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn spread(count: usize) -> (Vec<CalibratedChannel>, Vec<f64>) {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut uniform = |half: f64| half * (2.0 * random.random::<f64>() - 1.0);
        let channels = (0..count)
            .map(|n| CalibratedChannel {
                gain: 1.0 + uniform(0.2),
                gain_error: 0.01,
                phase_rad: uniform(0.4),
                phase_error_rad: 0.01,
                state: if n == 3 { ChannelState::Dead } else { ChannelState::Sound },
                drives: n,
            })
            .collect();
        (channels, (0..count).map(|_| uniform(PI)).collect())
    }

    #[test]
    fn phases_and_levels_are_corrected_to_the_rounding_of_the_controller() {
        let (channels, phases) = spread(4000);
        let fine = Steps { phase: 256, level: 255 };
        let left = left_over(&channels, &phases, &compensated(&channels, &phases, fine));
        // Phases and levels of 8 bits: uniform within half a step each.
        let levels = 0.5 / (255.0 * 0.8 * 3f64.sqrt());
        let expected = rounding_rad(256).hypot(levels);
        assert!((left / expected - 1.0).abs() < 0.15, "{left} {expected}");
        let ten = Steps { phase: 10, level: 1 };
        let drives = compensated(&channels, &phases, ten);
        let left = left_over(&channels, &phases, &drives);
        // Gains uniform within 20 % stay.
        let expected = rounding_rad(10).hypot(0.2 / 3f64.sqrt());
        assert!((left / expected - 1.0).abs() < 0.1, "{left} {expected}");
        assert_eq!(drives[3].level, 0.0);
    }
}
