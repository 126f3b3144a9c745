//! The measured profile: the pressure on the axis, the lobe, and its angles at given levels.

use serde::Serialize;

use super::{PairFit, Readings};

/// The levels at which angles are determined, dB relative to the axis: a half, a fifth and a tenth of its pressure.
pub const LEVELS_DB: [f64; 3] = [-6.0, -14.0, -20.0];

/// Smallest directivity of the readings that determine the pressure on the axis.
const CORE: f64 = 0.5;
/// Fewest such readings at a height.
const MIN_IN_CORE: usize = 3;
/// Width of the bins over which a lobe is averaged, degrees.
const BIN_DEG: f64 = 2.5;

/// The pressure on the axis at a height, from the readings near it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OnAxisPoint {
    /// Height, metres.
    pub height_m: f64,
    /// Pressure, the readings' unit, without the floor.
    pub value: f64,
    /// Standard error.
    pub standard_error: f64,
}

/// The mean lobe in a bin of angles, relative to the axis at the same distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LobeBin {
    /// Mean angle, rad.
    pub theta_rad: f64,
    /// Mean relative pressure.
    pub value: f64,
    /// Standard error.
    pub standard_error: f64,
    /// Number of readings.
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
    /// Standard error, rad.
    pub standard_error_rad: f64,
}

/// The measured profile.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Profile {
    /// On the axis, height by height; heights without readings near the axis are left out.
    pub on_axis: Vec<OnAxisPoint>,
    /// The lobe over all heights.
    pub lobe: Vec<LobeBin>,
    /// Angles of the levels, height by height, where the lobe reaches them.
    pub angles: Vec<LevelAngle>,
    /// Angle (rad) of each reading and its squared relative pressure, which may be negative after subtraction of the floor;
    /// for the heights with a value on the axis.
    #[serde(skip)]
    pub(super) relative: Vec<(f64, f64)>,
}

impl Profile {
    /// Determines the profile, with the axis and the floor of a fit.
    pub(super) fn of(readings: &Readings, fit: &PairFit) -> Self {
        let coordinates = fit.axis.coordinates(&readings.at_m);
        let floor = fit.floor.value;
        let square = |reading: &f64| reading * reading - floor * floor;
        let values: Vec<f64> =
            readings.values.iter().map(|value| signed_root(square(value))).collect();
        let predicted: Vec<f64> =
            fit.predicted(readings).iter().map(|value| signed_root(square(value))).collect();
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
            // The height along the tilted axis.
            let axis_height_m = height_m / fit.axis.direction().z;
            let modelled = fit.on_axis_at(axis_height_m);
            let core: Vec<usize> = own
                .iter()
                .copied()
                .filter(|&index| fit.lobe_at(coordinates[index].theta_rad) >= CORE)
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
                    let theta = coordinates[index].theta_rad;
                    let isotropic = predicted[index] / fit.lobe_at(theta) * scale;
                    (theta, square(&readings.values[index]) / (isotropic * isotropic))
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

    /// Share of the on-axis variance that a fit's law explains, at its best amplitude.
    pub(super) fn on_axis_r_squared(&self, fit: &PairFit) -> f64 {
        r_squared(self.on_axis.iter().map(|point| (point.value, fit.on_axis_at(point.height_m))))
    }

    /// Share of the variance of the relative pressures that a fit's lobe explains, at its best amplitude.
    pub(super) fn lobe_r_squared(&self, fit: &PairFit) -> f64 {
        let thetas: Vec<f64> = self.relative.iter().map(|(theta, _)| *theta).collect();
        let lobe = fit.lobe.at(&fit.lobe_free, &thetas).unwrap_or_default();
        r_squared(self.relative.iter().map(|(_, square)| signed_root(*square)).zip(lobe))
    }
}

/// The factor by which the prediction fits some readings best, and its standard error.
fn scale(core: &[usize], values: &[f64], predicted: &[f64]) -> Option<(f64, f64)> {
    if core.len() < MIN_IN_CORE {
        return None;
    }
    let pairs = || core.iter().map(|&index| (values[index], predicted[index]));
    let square: f64 = pairs().map(|(_, p)| p * p).sum();
    let scale = pairs().map(|(v, p)| v * p).sum::<f64>() / square;
    let residual: f64 = pairs().map(|(v, p)| (v - scale * p).powi(2)).sum();
    let variance = residual / (core.len() - 1) as f64;
    (square > 0.0 && scale > 0.0).then(|| (scale, (variance / square).sqrt()))
}

/// The square root with the sign of the square, which noise may make negative.
fn signed_root(square: f64) -> f64 {
    square.abs().sqrt().copysign(square)
}

/// Angular bins of angles and squared pressures. Squares are averaged, because the floor adds in squares.
fn bins(relative: &[(f64, f64)]) -> Vec<LobeBin> {
    let count = (90.0 / BIN_DEG) as usize + 1;
    let mut sums = vec![(0_usize, 0.0, 0.0, 0.0); count];
    for &(theta, square) in relative {
        // The first bin, on the axis, is half as wide.
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
            let value = signed_root(mean);
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

/// The first angle at which the lobe falls below a level, and its standard error; `None` if it does not.
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
    let residual: f64 = pairs.iter().map(|(v, m)| (v - scale * m).powi(2)).sum();
    1.0 - residual / pairs.iter().map(|(v, _)| (v - mean).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_angles_are_interpolated_between_bins() {
        let relative: Vec<(f64, f64)> = (0..900)
            .map(|step| f64::from(step) / 10.0)
            .map(|degrees: f64| (degrees.to_radians(), (1.0 - degrees / 50.0).max(0.0).powi(2)))
            .collect();
        let (angle, error) = crossing(&bins(&relative), 0.2).expect("it falls that far");
        assert!((angle.to_degrees() - 40.0).abs() < 0.05 && error > 0.0, "{}", angle.to_degrees());
        assert_eq!(crossing(&bins(&relative), -3.0), None);
        assert_eq!(signed_root(-4.0), -2.0);
    }
}
