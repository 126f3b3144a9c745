//! A row scanned at constant speed: the position of each sample, and the lag of the receiver.
//!
//! A straight move accelerates and decelerates symmetrically. Half-way in time it is therefore half-way in space, whatever the
//! acceleration. From there the constant speed gives the position of every sample. Cables, buffers and the receiver's own
//! filter delay all samples by one lag, the same for all rows. A row scanned in both directions shows this lag with opposite
//! signs.

use nalgebra::{Matrix3, Vector3};

use fieldgap_rig::{Recording, TimedSample};

/// Fewest samples of a reading.
pub(super) const LEAST_SAMPLES: usize = 5;

/// Range of lags that is searched, s.
const LAGS_S: (f64, f64) = (-0.05, 0.15);

/// Squared relative difference below which two readings are equal.
const ROUNDING: f64 = 1e-20;

/// Share of the points of a row that must have readings in both directions.
const LEAST_COMPARABLE: f64 = 0.75;

/// The points of a row and the speed over them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowTiming {
    /// Number of points; two or more.
    pub points: usize,
    /// Distance from point to point, m, above zero.
    pub step_m: f64,
    /// Speed over them, m/s, above zero.
    pub speed_m_s: f64,
    /// Half width of the window of samples about a point, m, above zero.
    pub half_width_m: f64,
}

/// The reading at one point of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placed {
    /// Time on the receiver's clock, s.
    pub t_s: f64,
    /// The reading at the point, in the receiver's unit.
    pub value: f64,
    /// Slope of the reading in time, per second.
    slope_per_s: f64,
    /// Standard deviation of the samples about the curve through them.
    pub std: f64,
    /// Equivalent number of averaged samples.
    pub count: u32,
    /// Whether the converter was at its limit in any sample.
    pub clipped: bool,
    /// Missing samples.
    pub lost: u32,
}

/// Lag of the samples behind the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lag {
    /// The lag, s.
    pub lag_s: f64,
    /// Its standard error, s.
    pub standard_error_s: f64,
}

impl RowTiming {
    /// Samples per point at a sampling rate.
    pub fn samples_at(&self, rate_hz: f64) -> f64 {
        2.0 * self.half_width_m / self.speed_m_s * rate_hz
    }

    /// The reading at each point; `None` where there are too few samples.
    ///
    /// A parabola is fitted to the samples about a point, because a mean would lower peaks.
    pub fn place(&self, recording: &Recording, lag_s: f64) -> Vec<Option<Placed>> {
        let middle_s = 0.5 * (recording.began_s + recording.ended_s) + lag_s;
        let half_s = self.half_width_m / self.speed_m_s;
        let samples = &recording.samples;
        let period_s = period_s(samples);
        (0..self.points)
            .map(|point| {
                let along = point as f64 - 0.5 * (self.points - 1) as f64;
                let t_s = middle_s + along * self.step_m / self.speed_m_s;
                let from = samples.partition_point(|sample| sample.t_s < t_s - half_s);
                let to = samples.partition_point(|sample| sample.t_s <= t_s + half_s);
                let near = &samples[from..to];
                let due = (2.0 * half_s / period_s).floor() as usize;
                let placed = parabola(near, t_s, half_s)?;
                Some(Placed { lost: due.saturating_sub(near.len()) as u32, ..placed })
            })
            .collect()
    }

    /// The lag from a row scanned in both directions; `None` if the level varies too little along it.
    pub fn lag(&self, there: &Recording, back: &Recording) -> Option<Lag> {
        let step_s = 0.5 * self.half_width_m / self.speed_m_s;
        let steps = ((LAGS_S.1 - LAGS_S.0) / step_s).ceil() as usize;
        let tried = (0..=steps).filter_map(|step| {
            let lag_s = LAGS_S.0 + step as f64 * step_s;
            Some((self.apart(there, back, lag_s)?.mean_square(), lag_s))
        });
        let (_, mut lag_s) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut last = self.apart(there, back, lag_s)?;
        for _ in 0..8 {
            lag_s += last.correction_s()?.clamp(-step_s, step_s);
            last = self.apart(there, back, lag_s)?;
        }
        Some(Lag { lag_s, standard_error_s: last.standard_error_s()? })
    }

    fn apart(&self, there: &Recording, back: &Recording, lag_s: f64) -> Option<Apart> {
        let there = self.place(there, lag_s);
        let back = self.place(back, lag_s);
        // Slopes in time: on the way back the position runs against time.
        let pairs: Vec<(f64, f64)> = there
            .iter()
            .zip(back.iter().rev())
            .filter_map(|(there, back)| {
                let (there, back) = ((*there)?, (*back)?);
                let slope_per_s = 0.5 * (there.slope_per_s - back.slope_per_s);
                Some((there.value - back.value, slope_per_s))
            })
            .collect();
        let level = there.iter().flatten().map(|placed| placed.value.abs()).fold(0.0, f64::max);
        (pairs.len() as f64 >= LEAST_COMPARABLE * self.points as f64)
            .then_some(Apart { pairs, level })
    }
}

/// Differences between the two directions, with the slope in time at each point.
struct Apart {
    pairs: Vec<(f64, f64)>,
    /// The largest reading.
    level: f64,
}

impl Apart {
    fn mean_square(&self) -> f64 {
        self.pairs.iter().map(|(apart, _)| apart * apart).sum::<f64>() / self.pairs.len() as f64
    }

    /// A lag too small by δ reads F(x - vδ) there and F(x + vδ) back: 2δ slopes apart.
    fn correction_s(&self) -> Option<f64> {
        let products: f64 = self.pairs.iter().map(|(apart, slope)| apart * slope).sum();
        let squares = self.squares();
        (squares > 0.0).then(|| -products / (2.0 * squares))
    }

    fn standard_error_s(&self) -> Option<f64> {
        let squares = self.squares();
        // Readings that agree to the last digit agree by rounding.
        let mean_square = self.mean_square().max(ROUNDING * self.level * self.level);
        (squares > 0.0).then(|| (mean_square / squares).sqrt() / 2.0)
    }

    fn squares(&self) -> f64 {
        self.pairs.iter().map(|(_, slope)| slope * slope).sum()
    }
}

/// Median time between two samples, s.
fn period_s(samples: &[TimedSample]) -> f64 {
    let mut between: Vec<f64> = samples.windows(2).map(|pair| pair[1].t_s - pair[0].t_s).collect();
    between.sort_by(f64::total_cmp);
    between.get(between.len() / 2).copied().unwrap_or(f64::INFINITY)
}

/// Least-squares parabola: its value and slope at `t_s`.
fn parabola(samples: &[TimedSample], t_s: f64, half_s: f64) -> Option<Placed> {
    if samples.len() < LEAST_SAMPLES {
        return None;
    }
    let row = |sample: &TimedSample| {
        let x = (sample.t_s - t_s) / half_s;
        Vector3::new(1.0, x, x * x)
    };
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for sample in samples {
        let row = row(sample);
        normal += row * row.transpose();
        right += row * sample.value;
    }
    let inverse = normal.try_inverse()?;
    let curve = inverse * right;
    let squares: f64 =
        samples.iter().map(|sample| (sample.value - curve.dot(&row(sample))).powi(2)).sum();
    Some(Placed {
        t_s,
        value: curve.x,
        slope_per_s: curve.y / half_s,
        std: (squares / (samples.len() - 3) as f64).sqrt(),
        count: (1.0 / inverse[(0, 0)]).round().max(1.0) as u32,
        clipped: samples.iter().any(|sample| sample.clipped),
        lost: 0,
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TIMING: RowTiming =
        RowTiming { points: 36, step_m: 2e-3, speed_m_s: 0.15, half_width_m: 1.07e-3 };

    /// A field with structure of the scale of a focus along a row.
    fn field(x_m: f64) -> f64 {
        (-(x_m / 9e-3).powi(2)).exp() + 0.3 * (x_m / 4e-3).cos().powi(2)
    }

    /// A pass over the row with leads, at this acceleration, with each sample `late_s` late; `sign` is the direction.
    fn flown(
        sign: f64,
        acceleration_m_s2: f64,
        late_s: f64,
        noise: impl Fn(usize) -> f64,
    ) -> Recording {
        let lead_m = 0.012;
        let length_m = TIMING.step_m * 35.0 + 2.0 * lead_m;
        let v = TIMING.speed_m_s;
        let ramp_s = v / acceleration_m_s2;
        let lasts_s = length_m / v + ramp_s;
        let travelled_m = |t_s: f64| {
            let t_s = t_s.clamp(0.0, lasts_s);
            if t_s < ramp_s {
                0.5 * acceleration_m_s2 * t_s * t_s
            } else if t_s < lasts_s - ramp_s {
                v * (t_s - 0.5 * ramp_s)
            } else {
                length_m - 0.5 * acceleration_m_s2 * (lasts_s - t_s).powi(2)
            }
        };
        let began_s = 7.0;
        let samples = (1..=(lasts_s * 1e3) as usize)
            .map(|n| {
                let t_s = n as f64 * 1e-3;
                let x_m = sign * (travelled_m(t_s - late_s) - 0.5 * length_m);
                TimedSample { t_s: began_s + t_s, value: field(x_m) + noise(n), clipped: false }
            })
            .collect();
        Recording { began_s, ended_s: began_s + lasts_s, samples }
    }

    #[test]
    fn positions_do_not_depend_on_the_acceleration() {
        for acceleration in [1.0, 2.0, 5.0] {
            let placed = TIMING.place(&flown(1.0, acceleration, 0.0, |_| 0.0), 0.0);
            for (n, placed) in placed.into_iter().enumerate() {
                let placed = placed.expect("samples");
                let x_m = (n as f64 - 17.5) * TIMING.step_m;
                assert!((placed.value - field(x_m)).abs() < 2e-3, "{acceleration} {n}");
                assert_eq!(placed.lost, 0);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_lag_is_found_from_both_directions(late_s in 0.0..0.06f64, seed in 0usize..1000) {
            // Any generator of uncorrelated noise will do.
            let noise = |way: usize| move |n: usize| {
                let mixed = (n * 2_654_435_761 + (seed * 2 + way) * 40_503) as u32;
                0.02 * (f64::from(mixed.wrapping_mul(2_246_822_519) >> 8) / f64::from(1u32 << 24) - 0.5)
            };
            let lag = TIMING
                .lag(&flown(1.0, 2.0, late_s, noise(0)), &flown(-1.0, 2.0, late_s, noise(1)))
                .expect("a focus shows it");
            prop_assert!(lag.standard_error_s < 3e-4, "{lag:?}");
            prop_assert!((lag.lag_s - late_s).abs() < 5.0 * lag.standard_error_s, "{lag:?} for {late_s}");
        }
    }

    #[test]
    fn a_constant_row_shows_no_lag() {
        let even = Recording {
            began_s: 0.0,
            ended_s: 1.0,
            samples: (0..1000)
                .map(|n| TimedSample { t_s: f64::from(n) * 1e-3, value: 1.0, clipped: false })
                .collect(),
        };
        let found = TIMING.lag(&even, &even);
        assert!(
            found
                .is_none_or(|lag| !lag.standard_error_s.is_finite() || lag.standard_error_s > 1e-3),
            "{found:?}"
        );
    }

    #[test]
    fn missing_samples_are_counted_and_too_few_give_no_reading() {
        let mut recording = flown(1.0, 2.0, 0.0, |_| 0.0);
        let whole = TIMING.place(&recording, 0.0)[10].expect("samples");
        recording.samples.retain(|sample| (sample.t_s - whole.t_s).abs() > 2.5e-3);
        let thin = TIMING.place(&recording, 0.0)[10].expect("nine of fourteen");
        assert!(thin.lost >= 4 && thin.count < whole.count);
        recording.samples.retain(|sample| (sample.t_s - whole.t_s).abs() > 6e-3);
        assert_eq!(TIMING.place(&recording, 0.0)[10], None);
    }
}
