//! How two calibrations of one array differ.

use std::f64::consts::{PI, TAU};

use fieldgap_records::{CalibratedChannel, CalibrationFile, ChannelState};
use serde::Serialize;

/// A channel that changed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ChangedChannel {
    /// Its number.
    pub channel: usize,
    /// Ratio of the later gain to the earlier one.
    pub gain_ratio: f64,
    /// Later phase minus the earlier one, -π to π rad.
    pub phase_rad: f64,
    /// The larger of both changes in units of its standard error.
    pub sigma: f64,
    /// What it was before and after.
    pub states: [ChannelState; 2],
}

/// The difference of a later calibration from an earlier one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Days between them.
    pub days: f64,
    /// Rms change of gain of the channels that sound in both, relative.
    pub gain_rms: f64,
    /// Rms change that the standard errors explain.
    pub gain_expected: f64,
    /// Rms change of phase, rad.
    pub phase_rms_rad: f64,
    /// Rms change that the standard errors explain, rad.
    pub phase_expected_rad: f64,
    /// Channels that changed their state, or by more than five standard errors, the largest change first.
    pub changed: Vec<ChangedChannel>,
}

/// Standard errors from which on a change is listed: one in 256 channels with two numbers each exceeds five once in 3,000 comparisons.
const LISTED_SIGMA: f64 = 5.0;

/// The difference of two calibrations; `None` for different numbers of channels.
pub fn difference(before: &CalibrationFile, after: &CalibrationFile) -> Option<Difference> {
    let pairs: Vec<_> = before.channels().iter().zip(after.channels()).collect();
    if before.channels().len() != after.channels().len() {
        return None;
    }
    let days = after.conditions().measured.duration_since(before.conditions().measured);
    let dead = |channel: &CalibratedChannel| channel.state == ChannelState::Dead;
    let mut sums = [0.0; 5];
    let mut changed = Vec::new();
    for (channel, (a, b)) in pairs.into_iter().enumerate() {
        let states = [a.state, b.state];
        let error = |a: f64, b: f64| a.hypot(b).max(1e-9);
        let gain = b.gain - a.gain;
        let gain_error = error(a.gain_error, b.gain_error);
        let mut sigma = (gain / gain_error).abs();
        let mut phase_rad = 0.0;
        if !dead(a) && !dead(b) {
            phase_rad = (b.phase_rad - a.phase_rad + PI).rem_euclid(TAU) - PI;
            let phase_error_rad = error(a.phase_error_rad, b.phase_error_rad);
            sigma = sigma.max((phase_rad / phase_error_rad).abs());
            let squares =
                [gain, gain_error, phase_rad, phase_error_rad, 1.0].map(|value| value * value);
            sums.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
        }
        if sigma > LISTED_SIGMA || a.state != b.state || a.drives != b.drives {
            let gain_ratio = b.gain / a.gain.max(1e-9);
            changed.push(ChangedChannel { channel, gain_ratio, phase_rad, sigma, states });
        }
    }
    changed.sort_by(|a, b| b.sigma.total_cmp(&a.sigma));
    let rms = |k: usize| (sums[k] / sums[4].max(1.0)).sqrt();
    Some(Difference {
        days: days.as_secs_f64() / 86_400.0,
        gain_rms: rms(0),
        gain_expected: rms(1),
        phase_rms_rad: rms(2),
        phase_expected_rad: rms(3),
        changed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_records::CalibrationConditions;

    fn file(day: &str, channels: &[(f64, f64, ChannelState)]) -> CalibrationFile {
        let conditions = CalibrationConditions {
            array: "a".to_owned(),
            measured: format!("2026-11-{day}T00:00:00Z").parse().expect("a date"),
            setup_sha256: "0".to_owned(),
            speed_of_sound_m_s: 343.0,
            readings: 10,
            noise: 0.01,
            residual: 0.01,
        };
        let channel = |(drives, &(gain, degrees, state)): (usize, &(f64, f64, ChannelState))| {
            CalibratedChannel {
                gain,
                gain_error: 0.01,
                phase_rad: degrees.to_radians(),
                phase_error_rad: f64::to_radians(1.0),
                state,
                drives,
            }
        };
        CalibrationFile::new(conditions, channels.iter().enumerate().map(channel).collect())
    }

    #[test]
    fn changes_beyond_their_errors_are_listed() {
        use ChannelState::{Dead, Sound};
        let before = file("01", &[(1.0, 179.0, Sound), (1.0, 0.0, Sound), (0.9, 5.0, Sound)]);
        let after = file("03", &[(1.01, -179.0, Sound), (1.2, 0.0, Sound), (0.01, 0.0, Dead)]);
        let found = difference(&before, &after).expect("three channels");
        assert_eq!(found.days, 2.0);
        assert_eq!(found.changed.iter().map(|c| c.channel).collect::<Vec<_>>(), [2, 1]);
        assert!((found.changed[1].sigma - 0.2 / 0.01 / 2f64.sqrt()).abs() < 1e-6);
        // Across the half turn, 2° and not 358°.
        assert!((found.phase_rms_rad - (2f64.to_radians().powi(2) / 2.0).sqrt()).abs() < 1e-6);
        assert!(difference(&before, &file("02", &[(1.0, 0.0, Sound)])).is_none());
    }
}
