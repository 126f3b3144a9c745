//! What a fit leaves of readings that it did not see.
//!
//! Single readings, or small blocks, are held by their neighbours: the field between them follows from them, whatever the model. Blocks of some
//! wavelengths are not, so that they show what the model understands.

use serde::Serialize;

use super::dense::covariance;
use super::fit::{Fit, fit};
use super::model::PlaneModel;
use super::parameters::Layout;

/// Readings in blocks that a fit did not see.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct HeldOutBlocks {
    /// Points along each side of a block; every fifth block was held out.
    pub points: usize,
    /// Width of a block, mm.
    pub width_mm: f64,
    /// The same in wavelengths.
    pub wavelengths: f64,
    /// Readings that were held out.
    pub readings: usize,
    /// Rms of what the fit leaves of them, relative to their rms.
    pub residual: f64,
    /// What it should leave by its own errors and noise.
    pub expected: f64,
    /// What the array as it was thought to be leaves, in the registered pose.
    pub before: f64,
    /// What pose, backlash, lobe and floor leave, with elements alike but for a few percent.
    pub alike: f64,
}

/// Fits without every fifth block of `points` by `points`, and looks at these. `None` if there are too few blocks.
pub fn held_out(
    model: &PlaneModel<'_>,
    layout: &Layout,
    start: &[f64],
    points: usize,
) -> Option<HeldOutBlocks> {
    let held = model.grid().held_out(points);
    let (unseen, seen): (Vec<usize>, Vec<usize>) = model.keep.iter().partition(|&&n| held[n]);
    // A fit needs most of the readings, and a figure more than a few.
    if unseen.len() < 20 || seen.len() < 2 * unseen.len() {
        return None;
    }
    let found = fit(&model.of(seen), layout, start)?;
    let unseen = model.of(unseen);
    let width_m = points as f64 * model.grid().step_m;
    let values = unseen.values();
    let power: f64 = values.iter().map(|value| value * value).sum();
    let left = |layout: &Layout, x: &[f64]| {
        let levels = unseen.levels(layout, x);
        let squares = levels.iter().zip(&values).map(|(level, value)| (level - value).powi(2));
        (squares.sum::<f64>() / power).sqrt()
    };
    Some(HeldOutBlocks {
        points,
        width_mm: width_m * 1e3,
        wavelengths: width_m * model.wavenumber() / std::f64::consts::TAU,
        readings: values.len(),
        residual: left(&found.layout, &found.x),
        expected: (variance(&unseen, &found) / power).sqrt(),
        before: left(layout, start),
        alike: left(&found.layout, &found.alike),
    })
}

/// Sum of the variances of some readings about the levels that a fit gives them: the noise, and what the fit's errors do.
fn variance(unseen: &PlaneModel<'_>, found: &Fit) -> f64 {
    let levels = unseen.levels(&found.layout, &found.x);
    let noise: f64 = levels.iter().map(|&level| found.noise.at(level).powi(2)).sum();
    let one = vec![1.0; levels.len()];
    let by_parameters = unseen.normal(&found.layout, &found.x, &one).curvature;
    let all: Vec<usize> = (0..found.layout.len()).collect();
    noise + covariance(&found.inverse_factor, &all).dot(&by_parameters)
}
