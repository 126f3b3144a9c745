//! What a calibration gains, on readings that its fit never saw: the gap of the simulation, and the figures of a focus.

use serde::Serialize;

use crate::Calibration;
use crate::readings::CodedReadings;
use fieldgap_acoustics::Simulation;

/// The gap of simulation and readings that the fit never saw, before and after.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gap {
    /// Readings.
    pub readings: usize,
    /// Rms difference with the array as it was thought to be, relative to the rms of the readings, with the best common gain.
    pub before: f64,
    /// The same with the calibrated array.
    pub after: f64,
    /// Noise of the readings, relative to their rms.
    pub noise: f64,
}

/// The gap on other readings of a calibrated array.
pub fn gap(calibration: &Calibration, simulation: &Simulation, readings: &CodedReadings) -> Gap {
    let [after, before] = calibration.predict(simulation, readings);
    let rows = &readings.readings;
    let mean_square =
        |sum: f64| (sum / rows.len().max(1) as f64).sqrt() / readings.rms().max(f64::MIN_POSITIVE);
    let of = |levels: &[f64]| {
        mean_square(rows.iter().zip(levels).map(|(row, level)| (row.value - level).powi(2)).sum())
    };
    let noise = rows.iter().map(|row| calibration.noise.at(row.value).powi(2)).sum();
    Gap { readings: rows.len(), before: of(&before), after: of(&after), noise: mean_square(noise) }
}

/// Figures of a focus on a line across it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FocusFigures {
    /// The largest reading.
    pub peak: f64,
    /// Half the width at which the level is half the peak, m; `None` if the line ends before.
    pub radius_m: Option<f64>,
    /// The largest level beyond the first minimum on either side, relative to the peak; `None` without a minimum.
    pub side_lobe: Option<f64>,
}

/// The figures of readings along a line: the place of each along it, m, ascending, and its level. `None` for fewer than three.
pub fn focus_figures(along_m: &[f64], levels: &[f64]) -> Option<FocusFigures> {
    if levels.len() < 3 || along_m.len() != levels.len() {
        return None;
    }
    let top = (0..levels.len()).max_by(|&a, &b| levels[a].total_cmp(&levels[b]))?;
    let peak = levels[top];
    let half = |mut steps: Box<dyn Iterator<Item = usize>>| {
        let mut last = top;
        steps.find_map(|next| {
            if levels[next] < 0.5 * peak {
                let share = (levels[last] - 0.5 * peak) / (levels[last] - levels[next]);
                return Some(
                    (along_m[last] + share * (along_m[next] - along_m[last]) - along_m[top]).abs(),
                );
            }
            last = next;
            None
        })
    };
    let right = half(Box::new(top + 1..levels.len()));
    let left = half(Box::new((0..top).rev()));
    let radius_m = right.zip(left).map(|(right, left)| 0.5 * (right + left));
    // A first minimum below half the peak: above it noise makes minima.
    let beyond = |side: &[f64]| {
        let first = (1..side.len().saturating_sub(1))
            .find(|&k| side[k] < 0.5 * peak && side[k] <= side[k - 1] && side[k] <= side[k + 1])?;
        side[first..].iter().copied().reduce(f64::max)
    };
    let mirrored: Vec<f64> = levels[..=top].iter().rev().copied().collect();
    let lobes = [beyond(&levels[top..]), beyond(&mirrored)];
    let side_lobe = lobes.into_iter().flatten().reduce(f64::max).map(|level| level / peak);
    Some(FocusFigures { peak, radius_m, side_lobe })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_figures_of_a_sinc_are_those_of_the_tables() {
        let along: Vec<f64> = (-300..=300).map(|n| 0.01 * f64::from(n)).collect();
        let sinc = |x: f64| if x == 0.0 { 1.0 } else { ((3.0 * x).sin() / (3.0 * x)).abs() };
        let levels: Vec<f64> = along.iter().map(|&x| 2.0 * sinc(x)).collect();
        let found = focus_figures(&along, &levels).expect("a focus");
        assert_eq!(found.peak, 2.0);
        // sin u / u is a half at u = 1.8955, and its first side lobe is 0.2172.
        assert!((found.radius_m.expect("inside") - 1.8955 / 3.0).abs() < 1e-3);
        assert!((found.side_lobe.expect("inside") - 0.2172).abs() < 1e-3);
    }

    #[test]
    fn a_line_that_ends_early_has_no_radius() {
        let found = focus_figures(&[0.0, 1.0, 2.0], &[0.9, 1.0, 0.8]).expect("three readings");
        assert_eq!((found.radius_m, found.side_lobe), (None, None));
        assert!(focus_figures(&[0.0], &[1.0]).is_none());
    }
}
