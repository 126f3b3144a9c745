//! Characterization by the script of the thesis (its Appendix A), errors included.
//!
//! The smallest reading is subtracted as noise. The axis is vertical, under the largest reading. Readings of equal height
//! and angle are averaged in pairs, each with the mean so far: the last has the weight of all before it. The angle of a
//! level is the last at which this mean rounds to 0.5, 0.2 or 0.1. The lobe is a Gaussian with a free centre, without the
//! heights below four steps. (The script also loses a few readings of the highest plane by counting rows; this is not
//! reproduced.)

use serde::Serialize;

use super::{CharacterizationError, Constant, LEVELS_DB};
use fieldgap_acoustics::least_squares::{Linearisation, Parameter, Stopping, minimise};
use fieldgap_records::{RecordedSample, RecordedScan, SAME_HEIGHT_MM, planes};

/// Height steps that the script excludes from the lobe.
const EXCLUDED_STEPS: f64 = 4.0;
/// Rounded relative pressures that the script uses for -6, -14 and -20 dB.
const ROUNDED_LEVELS: [f64; 3] = [0.5, 0.2, 0.1];

/// A fitted curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FittedCurve {
    /// Constants.
    pub constants: Vec<Constant>,
    /// Share of the variance explained.
    pub r_squared: f64,
}

/// Result of the script.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AppendixA {
    /// The smallest reading, subtracted from all.
    pub noise: f64,
    /// Position of the largest reading relative to the nominal transducer, mm.
    pub largest_at_mm: [f64; 3],
    /// `a exp(b z)`, z in centimetres, relative to the lowest height above the face.
    pub on_axis: FittedCurve,
    /// `a exp(-((θ - b)/c)²)`, degrees.
    pub lobe: FittedCurve,
    /// Height (mm), level (dB) and angle (degrees).
    pub angles: Vec<(f64, f64, f64)>,
}

/// Characterizes a transducer as the script does.
///
/// # Errors
/// [`CharacterizationError`] if there is too little to fit.
pub fn appendix_a(scan: &RecordedScan) -> Result<AppendixA, CharacterizationError> {
    let driven: Vec<RecordedSample> =
        scan.samples.iter().filter(|sample| sample.focus.is_some()).copied().collect();
    let noise = driven.iter().map(|sample| sample.reading).fold(f64::INFINITY, f64::min);
    let first_largest = driven.iter().reduce(|a, b| if b.reading > a.reading { b } else { a });
    let largest = first_largest.ok_or(CharacterizationError::NoSignal)?;
    if largest.reading <= noise {
        return Err(CharacterizationError::NoSignal);
    }
    let (x0, y0) = (largest.position_mm.x, largest.position_mm.y);
    let grouped = planes(&driven, SAME_HEIGHT_MM);
    let step_mm = grouped
        .windows(2)
        .map(|pair| pair[1].z_mm - pair[0].z_mm)
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    let too_few = CharacterizationError::TooFewHeights { heights: grouped.len(), from_mm: 0.0 };
    let (mut on_axis, mut lobe, mut angles) = (Vec::new(), Vec::new(), Vec::new());
    for plane in grouped.iter().filter(|plane| plane.z_mm > 0.0) {
        let above = plane.samples.iter().find(|sample| {
            (sample.position_mm.x - x0).hypot(sample.position_mm.y - y0) < SAME_HEIGHT_MM
        });
        let Some(above) =
            above.map(|sample| sample.reading - noise).filter(|&on_axis| on_axis > 0.0)
        else {
            continue;
        };
        on_axis.push((plane.z_mm / 10.0, above));
        if plane.z_mm < (EXCLUDED_STEPS - 0.5) * step_mm {
            continue;
        }
        let mut relative: Vec<(f64, f64)> = plane
            .samples
            .iter()
            .map(|sample| {
                let lateral_mm = (sample.position_mm.x - x0).hypot(sample.position_mm.y - y0);
                ((lateral_mm / plane.z_mm).atan().to_degrees(), (sample.reading - noise) / above)
            })
            .collect();
        relative.sort_by(|a, b| a.partial_cmp(b).expect("readings are finite"));
        let (means, found) = pairwise_means(&relative);
        lobe.extend(means);
        let levels = found.into_iter().zip(LEVELS_DB);
        angles.extend(levels.filter_map(|(angle, level)| Some((plane.z_mm, level, angle?))));
    }
    let Some(&(_, lowest)) = on_axis.first() else { return Err(too_few) };
    if on_axis.len() < 3 || lobe.len() < 4 {
        return Err(too_few);
    }
    on_axis.iter_mut().for_each(|(_, value)| *value /= lowest);
    Ok(AppendixA {
        noise,
        largest_at_mm: largest.position_mm.into(),
        on_axis: exponential(&on_axis),
        lobe: gaussian(&lobe),
        angles,
    })
}

/// Means over equal angles, and for each level the last angle at which the running mean rounds to it.
fn pairwise_means(sorted: &[(f64, f64)]) -> (Vec<(f64, f64)>, [Option<f64>; 3]) {
    let mut means: Vec<(f64, f64)> = Vec::new();
    let mut found = [None; 3];
    for (index, &(angle, value)) in sorted.iter().enumerate().skip(1) {
        if (angle - sorted[index - 1].0).abs() > 1e-9 || means.is_empty() {
            means.push((angle, value));
            continue;
        }
        let last = means.len() - 1;
        means[last].1 = f64::midpoint(means[last].1, value);
        let rounded = (means[last].1 * 10.0).round() / 10.0;
        for (level, found) in ROUNDED_LEVELS.into_iter().zip(&mut found) {
            if rounded == level {
                *found = Some(means[last].0);
            }
        }
    }
    (means, found)
}

fn exponential(points: &[(f64, f64)]) -> FittedCurve {
    let (first, last) = (points[0], points[points.len() - 1]);
    let decay = (last.1 / first.1).ln() / (last.0 - first.0);
    fit_curve(points, [("a", "", 1.0), ("b", "1/cm", decay)], |free, z| {
        let e = (free[1] * z).exp();
        (free[0] * e, [e, free[0] * z * e])
    })
}

fn gaussian(points: &[(f64, f64)]) -> FittedCurve {
    fit_curve(points, [("a", "", 1.0), ("b", "°", -2.0), ("c", "°", 35.0)], |free, angle| {
        let u = (angle - free[1]) / free[2];
        let e = (-u * u).exp();
        (free[0] * e, [e, free[0] * e * 2.0 * u / free[2], free[0] * e * 2.0 * u * u / free[2]])
    })
}

/// Unweighted least squares; standard errors for uniform noise.
fn fit_curve<const N: usize>(
    points: &[(f64, f64)],
    starts: [(&str, &'static str, f64); N],
    curve: impl Fn(&[f64], f64) -> (f64, [f64; N]),
) -> FittedCurve {
    let parameters = starts.map(|(_, _, start)| Parameter {
        start,
        scale: 0.01 * start.abs().max(1e-3),
        prior: None,
        range: None,
    });
    let residuals =
        |free: &[f64]| -> Vec<f64> { points.iter().map(|&(x, y)| curve(free, x).0 - y).collect() };
    let minimum = minimise(
        &parameters,
        Stopping { iterations: 100, ..Stopping::default() },
        residuals,
        |free| {
            let derivatives: Vec<[f64; N]> =
                points.iter().map(|&(x, _)| curve(free, x).1).collect();
            Linearisation {
                residuals: residuals(free),
                columns: (0..N)
                    .map(|n| derivatives.iter().map(|derivative| derivative[n]).collect())
                    .collect(),
            }
        },
    );
    let mean = points.iter().map(|(_, y)| y).sum::<f64>() / points.len() as f64;
    let spread: f64 = points.iter().map(|(_, y)| (y - mean).powi(2)).sum();
    let variance = minimum.cost / (points.len() - N).max(1) as f64;
    let constants = starts
        .iter()
        .enumerate()
        .map(|(index, (name, unit, _))| Constant {
            name: (*name).to_owned(),
            unit,
            value: minimum.parameters[index],
            standard_error: minimum
                .covariance
                .as_ref()
                .map_or(f64::NAN, |covariance| (covariance[(index, index)] * variance).sqrt()),
        })
        .collect();
    FittedCurve { constants, r_squared: 1.0 - minimum.cost / spread }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_reading_of_an_angle_has_the_largest_weight() {
        let sorted = [(0.0, 1.0), (5.0, 1.0), (5.0, 0.5), (5.0, 0.25), (9.0, 0.2)];
        let (means, found) = pairwise_means(&sorted);
        assert_eq!(means, [(5.0, 0.5), (9.0, 0.2)]);
        // A single reading forms no mean, as in the script.
        assert_eq!(found, [Some(5.0), None, None]);
    }

    #[test]
    fn known_curves_are_recovered() {
        let points: Vec<(f64, f64)> = (1..=20)
            .map(|step| f64::from(step) * 2.5)
            .map(|z| (z, 1.115436 * (-0.052927 * z).exp()))
            .collect();
        let found = exponential(&points);
        assert!((found.constants[0].value - 1.115436).abs() < 1e-6, "{found:?}");
        assert!((found.constants[1].value + 0.052927).abs() < 1e-8 && found.r_squared > 0.999_999);
        let points: Vec<(f64, f64)> = (0..=80)
            .map(f64::from)
            .map(|t: f64| (t, 1.071272 * (-((t + 4.108851) / 35.458904).powi(2)).exp()))
            .collect();
        let found = gaussian(&points);
        for (constant, known) in found.constants.iter().zip([1.071272, -4.108851, 35.458904]) {
            assert!((constant.value - known).abs() < 1e-4, "{found:?}");
        }
    }
}
