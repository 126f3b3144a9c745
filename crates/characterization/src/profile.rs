//! What the readings themselves show, model by model's side: on the axis, about it, and the angles of the lobe.

use serde::Serialize;

use super::{PairFit, Readings};

/// The levels whose angles are read off, decibels below the axis: a half, a fifth and a tenth of its pressure.
pub const LEVELS_DB: [f64; 3] = [-6.0, -14.0, -20.0];

/// Readings this far down the lobe still tell what stands on the axis.
const CORE: f64 = 0.5;
/// Fewest of them.
const LEAST_IN_CORE: usize = 3;
/// Width of the bins over which a lobe is averaged, degrees.
const BIN_DEG: f64 = 2.5;

/// The pressure on the axis at a height, out of the readings about it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OnAxisPoint {
    /// Height, metres.
    pub height_m: f64,
    /// Pressure, the readings' unit, floor aside.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// The lobe about an angle, relative to the axis at the same distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LobeBin {
    /// Mean angle, rad.
    pub theta_rad: f64,
    /// Mean relative pressure.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Readings behind it.
    pub readings: usize,
}

/// The angle at which the lobe has fallen to a level, at one height.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LevelAngle {
    /// Height, metres.
    pub height_m: f64,
    /// The level, decibels.
    pub level_db: f64,
    /// The angle, rad.
    pub angle_rad: f64,
    /// Its standard error, rad.
    pub standard_error_rad: f64,
}

/// What the readings show.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Profile {
    /// On the axis, height by height; heights without readings near the axis are left out.
    pub on_axis: Vec<OnAxisPoint>,
    /// The lobe over all heights.
    pub lobe: Vec<LobeBin>,
    /// Angles of the levels, height by height; those that a height does not reach are left out.
    pub angles: Vec<LevelAngle>,
    /// Angle (rad) of each reading and the square of its relative pressure, which the floor may take below zero; of the
    /// heights that have a value on the axis.
    #[serde(skip)]
    pub(super) relative: Vec<(f64, f64)>,
}

impl Profile {
    /// Reads off the profile, the axis and the floor as a fit has them.
    pub(super) fn of(readings: &Readings, fit: &PairFit) -> Self {
        let places = fit.axis.places(&readings.at_m);
        let floor = fit.floor.value;
        let square = |reading: &f64| reading * reading - floor * floor;
        let values: Vec<f64> = readings.values.iter().map(|value| root(square(value))).collect();
        let predicted: Vec<f64> =
            fit.predicted(readings).iter().map(|value| root(square(value))).collect();
        let mut profile = Self {
            on_axis: Vec::new(),
            lobe: Vec::new(),
            angles: Vec::new(),
            relative: Vec::new(),
        };
        for (height, &height_m) in readings.heights_m.iter().enumerate() {
            let own: Vec<usize> = (0..readings.values.len())
                .filter(|&index| readings.height_of[index] == height)
                .collect();
            // The axis leans: its own height above the plane is a little more.
            let axis_height_m = height_m / fit.axis.direction().z;
            let modelled = fit.on_axis_at(axis_height_m);
            let core: Vec<usize> = own
                .iter()
                .copied()
                .filter(|&index| fit.lobe_at(places[index].theta_rad) >= CORE)
                .collect();
            let Some((scale, error)) = scale(&core, &values, &predicted) else {
                continue;
            };
            profile.on_axis.push(OnAxisPoint {
                height_m: axis_height_m,
                value: scale * modelled,
                standard_error: error * modelled,
            });
            let relative: Vec<(f64, f64)> = own
                .iter()
                .map(|&index| {
                    let theta = places[index].theta_rad;
                    let even = predicted[index] / fit.lobe_at(theta) * scale;
                    (theta, square(&readings.values[index]) / (even * even))
                })
                .filter(|(_, value)| value.is_finite())
                .collect();
            let bins = bins(&relative);
            profile.angles.extend(LEVELS_DB.into_iter().filter_map(|level_db| {
                let (angle_rad, standard_error_rad) = crossing(&bins, 10f64.powf(level_db / 20.0))?;
                Some(LevelAngle {
                    height_m: axis_height_m,
                    level_db,
                    angle_rad,
                    standard_error_rad,
                })
            }));
            profile.relative.extend(relative);
        }
        profile.lobe = bins(&profile.relative);
        profile
    }

    /// Share of the on-axis variance that a fit's law explains, at its own best level.
    pub(super) fn on_axis_r_squared(&self, fit: &PairFit) -> f64 {
        r_squared(self.on_axis.iter().map(|point| (point.value, fit.on_axis_at(point.height_m))))
    }

    /// Share of the relative pressures' variance that a fit's lobe explains, at its own best level.
    pub(super) fn lobe_r_squared(&self, fit: &PairFit) -> f64 {
        let thetas: Vec<f64> = self.relative.iter().map(|(theta, _)| *theta).collect();
        let lobe = fit.lobe.at(&fit.lobe_free, &thetas).unwrap_or_default();
        r_squared(self.relative.iter().map(|(_, square)| root(*square)).zip(lobe))
    }
}

/// By how much the prediction has to be taken to meet some readings, and the standard error of that.
fn scale(core: &[usize], values: &[f64], predicted: &[f64]) -> Option<(f64, f64)> {
    if core.len() < LEAST_IN_CORE {
        return None;
    }
    let pairs = || core.iter().map(|&index| (values[index], predicted[index]));
    let square: f64 = pairs().map(|(_, p)| p * p).sum();
    let scale = pairs().map(|(v, p)| v * p).sum::<f64>() / square;
    let left: f64 = pairs().map(|(v, p)| (v - scale * p).powi(2)).sum();
    let variance = left / (core.len() - 1) as f64;
    (square > 0.0 && scale > 0.0).then(|| (scale, (variance / square).sqrt()))
}

/// The root of a square that noise may have taken below zero, with its sign.
fn root(square: f64) -> f64 {
    square.abs().sqrt().copysign(square)
}

/// Bins of angles, out of angles and squares: squares are averaged, since their floor is even.
fn bins(relative: &[(f64, f64)]) -> Vec<LobeBin> {
    let count = (90.0 / BIN_DEG) as usize + 1;
    let mut sums = vec![(0_usize, 0.0, 0.0, 0.0); count];
    for &(theta, square) in relative {
        // The first bin is half as wide, about the axis.
        let sum = &mut sums[((theta.to_degrees() / BIN_DEG).round() as usize).min(count - 1)];
        *sum = (sum.0 + 1, sum.1 + theta, sum.2 + square, sum.3 + square * square);
    }
    sums.into_iter()
        .filter(|sum| sum.0 > 0)
        .map(|(readings, thetas, squares, fourths)| {
            let number = readings as f64;
            let mean = squares / number;
            let variance = (fourths / number - mean * mean).max(0.0);
            let error = (variance / (number - 1.0).max(1.0)).sqrt();
            let value = root(mean);
            LobeBin {
                theta_rad: thetas / number,
                value,
                standard_error: error
                    / (2.0 * value.abs()).max(error.sqrt()).max(f64::MIN_POSITIVE),
                readings,
            }
        })
        .collect()
}

/// The first angle at which the bins fall below a level, and its standard error; `None` if they never do.
fn crossing(bins: &[LobeBin], level: f64) -> Option<(f64, f64)> {
    let below = bins.iter().position(|bin| bin.value < level)?;
    let (inside, outside) = (bins.get(below.checked_sub(1)?)?, &bins[below]);
    let slope = (outside.value - inside.value) / (outside.theta_rad - inside.theta_rad);
    let share = (inside.value - level) / (inside.value - outside.value);
    let error = ((1.0 - share) * inside.standard_error).hypot(share * outside.standard_error);
    Some((inside.theta_rad + (level - inside.value) / slope, (error / slope).abs()))
}

fn r_squared(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let pairs: Vec<(f64, f64)> = pairs.collect();
    let scale = pairs.iter().map(|(v, m)| v * m).sum::<f64>()
        / pairs.iter().map(|(_, m)| m * m).sum::<f64>();
    let mean = pairs.iter().map(|(v, _)| v).sum::<f64>() / pairs.len() as f64;
    let left: f64 = pairs.iter().map(|(v, m)| (v - scale * m).powi(2)).sum();
    1.0 - left / pairs.iter().map(|(v, _)| (v - mean).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_falling_lobe_is_crossed_between_its_bins() {
        let relative: Vec<(f64, f64)> = (0..900)
            .map(|step| f64::from(step) / 10.0)
            .map(|degrees: f64| (degrees.to_radians(), (1.0 - degrees / 50.0).max(0.0).powi(2)))
            .collect();
        let (angle, error) = crossing(&bins(&relative), 0.2).expect("it falls that far");
        assert!((angle.to_degrees() - 40.0).abs() < 0.05 && error > 0.0, "{}", angle.to_degrees());
        assert_eq!(crossing(&bins(&relative), -3.0), None);
        assert_eq!(root(-4.0), -2.0);
    }
}
