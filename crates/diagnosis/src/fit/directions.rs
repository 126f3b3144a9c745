//! How residuals change along one direction, by the pressures of their readings.
//!
//! Each residual, then each variance term, follows its own pressure: a change dp changes it by the real part of its slope times dp.

use num_complex::Complex64;

use crate::model::forward_model::Pressures;
use crate::model::pressure::Pressure;

/// The pressures after one element's amplitude and phase changed: the sum is linear in the elements.
pub(super) fn turned(
    base: &Pressures,
    contributions: &[Vec<Vec<Complex64>>],
    element: usize,
    change: Complex64,
) -> Pressures {
    let mut turned = base.clone();
    let drives = turned.iter_mut().flat_map(|scan| scan.iter_mut());
    for (drive, parts) in drives.zip(contributions) {
        for (pressure, part) in drive.iter_mut().zip(&parts[element]) {
            pressure.coherent += change * part;
        }
    }
    turned
}

/// How many readings the pressures of a scan are for. (Where slopes by pressures are taken, there is one pressure for each reading.)
pub(super) fn count_of(pressures: &[Vec<Pressure>]) -> usize {
    pressures.iter().map(Vec::len).sum()
}

/// Derivative of the residuals by the amplitude of one element.
pub(super) fn along_element(
    slopes: &[Complex64],
    contributions: &[Vec<Vec<Complex64>>],
    element: usize,
    change: Complex64,
) -> Vec<f64> {
    let parts = contributions.iter().flat_map(|drive| &drive[element]).cycle();
    slopes.iter().zip(parts).map(|(slope, part)| (slope * part * change).re).collect()
}

/// Difference quotient of the residuals through the pressures, for one step of a parameter.
pub(super) fn along_pressures(
    slopes: &[Complex64],
    before: &Pressures,
    moved: &Pressures,
    step: f64,
) -> Vec<f64> {
    let moved = moved.iter().flatten().flatten();
    let before = before.iter().flatten().flatten();
    let changes = moved.zip(before).map(|(moved, before)| moved.coherent - before.coherent);
    slopes.iter().zip(changes.cycle()).map(|(slope, change)| (slope * change).re / step).collect()
}

/// Derivative of the residuals by the logarithm of one scan's gain.
pub(super) fn along_gain(slopes: &[Complex64], pressures: &Pressures, scan: usize) -> Vec<f64> {
    let of_scans = pressures.iter().enumerate();
    let pressures = of_scans.flat_map(|(n, drives)| drives.iter().flatten().map(move |p| (n, p)));
    slopes
        .iter()
        .zip(pressures.cycle())
        .map(|(slope, (n, pressure))| if n == scan { (slope * pressure.coherent).re } else { 0.0 })
        .collect()
}
