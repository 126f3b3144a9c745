//! Whether what a fit leaves is noise: tests for structure, each as a z-score.

use std::collections::HashMap;
use std::f64::consts::PI;

use super::observations::{Observations, ObservedDrive, Visit};

/// Residuals laid out by drive, in the order of the observations, with where they stand.
struct Laid<'o> {
    drive: &'o ObservedDrive,
    residuals: &'o [f64],
}

/// Names and z-scores of all tests.
pub(super) fn z_scores(observations: &Observations, residuals: &[f64]) -> Vec<(&'static str, f64)> {
    let laid = laid(observations, residuals);
    // Structure is judged against the residual's own size, so that a noise judged a little wrong is none.
    let n = residuals.len() as f64;
    let power = residuals.iter().map(|r| r * r).sum::<f64>() / n;
    vec![
        ("more scatter than the noise", scatter(power, n, observations)),
        ("neighbours alike", neighbours(&laid, power)),
        ("slow patterns across a plane", slow_patterns(&laid, power)),
        ("repeats alike", repeats(&laid, power)),
        ("planes off as a whole", planes(&laid, power)),
    ]
}

fn laid<'o>(observations: &'o Observations, residuals: &'o [f64]) -> Vec<Laid<'o>> {
    let mut rest = residuals;
    let drives = observations.scans.iter().flat_map(|scan| &scan.drives);
    drives
        .map(|drive| {
            let (residuals, after) = rest.split_at(drive.visits.len());
            rest = after;
            Laid { drive, residuals }
        })
        .collect()
}

/// The mean square against one, in units of what it scatters by; the noise itself is known only to some percent.
fn scatter(power: f64, n: f64, observations: &Observations) -> f64 {
    let known: usize = observations.scans.iter().map(|scan| scan.scatter.pairs.len()).sum();
    let silent: usize = observations.scans.iter().map(|scan| scan.silent.len()).sum();
    let known = (known.min(4 * silent).max(8)) as f64;
    (power - 1.0) / (2.0 / n + 2.0 / known).sqrt()
}

/// Moran's I: products of residuals of points one step apart along x or y.
fn neighbours(laid: &[Laid<'_>], power: f64) -> f64 {
    let (mut products, mut count) = (0.0, 0.0);
    for Laid { drive, residuals } in laid {
        let Some(step_m) = step_m(drive) else { continue };
        let cell = |visit: &Visit, dx: i64, dy: i64| {
            let along = |m: f64| (m / step_m).round() as i64;
            (
                along(visit.at_m.x) + dx,
                along(visit.at_m.y) + dy,
                (visit.at_m.z * 1e4).round() as i64,
            )
        };
        let mut at: HashMap<_, usize> = HashMap::new();
        for (index, visit) in drive.visits.iter().enumerate() {
            at.entry(cell(visit, 0, 0)).or_insert(index);
        }
        for (index, visit) in drive.visits.iter().enumerate() {
            for beside in [cell(visit, 1, 0), cell(visit, 0, 1)] {
                if let Some(&other) = at.get(&beside) {
                    products += residuals[index] * residuals[other];
                    count += 1.0;
                }
            }
        }
    }
    if count > 0.0 { products / (power * f64::sqrt(count)) } else { 0.0 }
}

/// Median step of a drive's even visits; `None` if it has none.
pub(super) fn step_m(drive: &ObservedDrive) -> Option<f64> {
    let mut steps: Vec<f64> = drive
        .visits
        .windows(2)
        .filter(|pair| pair[1].even && pair[1].number == pair[0].number + 1)
        .map(|pair| (pair[1].at_m - pair[0].at_m).norm())
        .collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied()
}

/// The readings of a drive at one height: their indices.
pub(super) fn by_height(drive: &ObservedDrive) -> Vec<Vec<usize>> {
    let mut planes: Vec<(i64, Vec<usize>)> = Vec::new();
    for (index, visit) in drive.visits.iter().enumerate() {
        let height = (visit.at_m.z * 1e4).round() as i64;
        match planes.iter_mut().find(|(known, _)| (*known - height).abs() <= 1) {
            Some((_, indices)) => indices.push(index),
            None => planes.push((height, vec![index])),
        }
    }
    planes.sort_by_key(|(height, _)| *height);
    planes.into_iter().map(|(_, indices)| indices).collect()
}

/// Chi-square that slow patterns across the planes hold beyond what noise does.
pub(super) fn in_slow_patterns(observations: &Observations, residuals: &[f64]) -> f64 {
    let (energy, count) = energy_of_slow_patterns(&laid(observations, residuals));
    (energy - count).max(0.0)
}

/// Power in the lowest cosines across each plane.
fn slow_patterns(laid: &[Laid<'_>], power: f64) -> f64 {
    let (energy, count) = energy_of_slow_patterns(laid);
    z_of_sum_of_squares(energy / power, count)
}

/// Sum of squares of the lowest cosines' amplitudes across each plane, each of variance one in noise, and how many there are.
fn energy_of_slow_patterns(laid: &[Laid<'_>]) -> (f64, f64) {
    /// Cosines along each axis.
    const ORDERS: usize = 7;
    let (mut energy, mut count) = (0.0, 0.0);
    for Laid { drive, residuals } in laid {
        for plane in by_height(drive) {
            if plane.len() < 4 * ORDERS * ORDERS {
                continue;
            }
            let range = |axis: usize| {
                let values = plane.iter().map(|&i| drive.visits[i].at_m[axis]);
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
            };
            let ((x0, x1), (y0, y1)) = (range(0), range(1));
            let cosines = |at: f64, from: f64, to: f64| -> [f64; ORDERS] {
                let share = if to > from { (at - from) / (to - from) } else { 0.0 };
                std::array::from_fn(|order| (PI * order as f64 * share).cos())
            };
            let mut sums = [[(0.0, 0.0); ORDERS]; ORDERS];
            for &i in &plane {
                let at_m = drive.visits[i].at_m;
                let (along_x, along_y) = (cosines(at_m.x, x0, x1), cosines(at_m.y, y0, y1));
                for (row, cx) in sums.iter_mut().zip(along_x) {
                    for (sum, cy) in row.iter_mut().zip(along_y) {
                        sum.0 += residuals[i] * cx * cy;
                        sum.1 += (cx * cy) * (cx * cy);
                    }
                }
            }
            for (product, norm) in sums.iter().flatten().skip(1) {
                energy += product * product / norm;
                count += 1.0;
            }
        }
    }
    (energy, count)
}

/// Products of residuals of points that were visited again.
fn repeats(laid: &[Laid<'_>], power: f64) -> f64 {
    let (mut products, mut count) = (0.0, 0.0);
    for Laid { drive, residuals } in laid {
        let mut seen: HashMap<[i64; 3], usize> = HashMap::new();
        for (index, visit) in drive.visits.iter().enumerate() {
            let cell: [i64; 3] = visit.at_m.map(|m| (m * 1e5).round() as i64).into();
            if let Some(before) = seen.insert(cell, index) {
                products += residuals[index] * residuals[before];
                count += 1.0;
            }
        }
    }
    if count > 0.0 { products / (power * f64::sqrt(count)) } else { 0.0 }
}

/// Means of whole planes.
fn planes(laid: &[Laid<'_>], power: f64) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for Laid { drive, residuals } in laid {
        for plane in by_height(drive) {
            let sum: f64 = plane.iter().map(|&i| residuals[i]).sum();
            squares += sum * sum / (plane.len() as f64 * power);
            count += 1.0;
        }
    }
    z_of_sum_of_squares(squares, count)
}

/// The normal deviate that is as rare as a sum of squares of so many normal numbers (E. B. Wilson and M. M. Hilferty, PNAS 17, 684,
/// 1931): the sum of a few is far from normal, and its own standard deviations would cry wolf.
fn z_of_sum_of_squares(sum: f64, count: f64) -> f64 {
    if count == 0.0 {
        return 0.0;
    }
    let variance = 2.0 / (9.0 * count);
    ((sum / count).cbrt() - (1.0 - variance)) / variance.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chi-square that one in a thousand exceeds, by the tables; a normal number exceeds 3.09 as seldom.
    #[test]
    fn sums_of_few_squares_and_of_many_are_as_rare_as_their_deviate_says() {
        for (count, sum) in [(1.0, 10.828), (4.0, 18.467), (30.0, 59.703), (100.0, 149.449)] {
            let z = z_of_sum_of_squares(sum, count);
            assert!((z - 3.09).abs() < 0.06, "{count}: {z}");
        }
    }
}
