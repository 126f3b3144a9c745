//! Tests for patterns in the residuals, each as a z-score.

use std::collections::HashMap;
use std::f64::consts::PI;

use crate::model::observations::{Observations, ObservedDrive, Visit};
use crate::model::planes::{by_height, step_m};
use crate::statistics::significance::z_of_sum_of_squares;

/// Readings of one place with the same error: no noise of a reading makes them.
pub(crate) const REPEATS_ALIKE: &str = "repeats alike";

/// Products of residuals at one distance below which they say nothing: of as many the sum has an excess kurtosis of 6/30.
const FEWEST_PRODUCTS: f64 = 30.0;

/// Residuals laid out by drive, in the order of the observations, with where they stand.
struct DriveResiduals<'o> {
    drive: &'o ObservedDrive,
    residuals: &'o [f64],
}

/// Names and z-scores of the tests for patterns.
pub(crate) fn z_scores(observations: &Observations, residuals: &[f64]) -> Vec<(&'static str, f64)> {
    let by_drive = by_drive(observations, residuals);
    // Normalised by the mean square of the residuals, so that a slightly misjudged noise is not a pattern.
    let power = mean_square(residuals);
    vec![
        ("neighbours alike", neighbours(&by_drive, power)),
        ("ripples across a plane", ripples(&by_drive, power)),
        ("slow patterns across a plane", slow_patterns(&by_drive, power)),
        (REPEATS_ALIKE, repeats(&by_drive)),
        ("planes off as a whole", planes(&by_drive, power)),
    ]
}

/// The residuals' mean square.
pub(crate) fn mean_square(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64
}

fn by_drive<'o>(observations: &'o Observations, residuals: &'o [f64]) -> Vec<DriveResiduals<'o>> {
    let mut rest = residuals;
    let drives = observations.scans.iter().flat_map(|scan| &scan.drives);
    drives
        .map(|drive| {
            let (residuals, after) = rest.split_at(drive.visits.len());
            rest = after;
            DriveResiduals { drive, residuals }
        })
        .collect()
}

/// The mean square minus one, in its standard deviations; the noise itself is known only to some percent.
pub(crate) fn scatter(observations: &Observations, residuals: &[f64]) -> f64 {
    let known: usize = observations.scans.iter().map(|scan| scan.scatter.pairs.len()).sum();
    let dark: usize = observations.scans.iter().map(|scan| scan.dark.len()).sum();
    let known = (known.min(4 * dark).max(8)) as f64;
    let n = residuals.len() as f64;
    (mean_square(residuals) - 1.0) / (2.0 / n + 2.0 / known).sqrt()
}

/// Moran's I: products of residuals of points one step apart along x or y.
fn neighbours(by_drive: &[DriveResiduals<'_>], power: f64) -> f64 {
    let (products, count) = products_apart(by_drive, [(1, 0), (0, 1)])
        .into_iter()
        .fold((0.0, 0.0), |(products, count), apart| (products + apart.0, count + apart.1));
    if count > 0.0 { products / (power * f64::sqrt(count)) } else { 0.0 }
}

/// Products of residuals at every distance up to some steps: fringes finer than a focus give positive correlation at one
/// distance and negative at another. (Of a series of residuals the test of G. M. Ljung and G. E. P. Box, Biometrika 65, 297, 1978.)
fn ripples(by_drive: &[DriveResiduals<'_>], power: f64) -> f64 {
    /// Steps, along x and along y.
    const FARTHEST: i64 = 3;
    let side = 2 * FARTHEST + 1;
    // One of each pair of opposite distances.
    let apart = (1..=side * side / 2).map(|n| {
        let middle = n + side * side / 2;
        (middle / side - FARTHEST, middle % side - FARTHEST)
    });
    let (mut squares, mut distances) = (0.0, 0.0);
    for (products, count) in products_apart(by_drive, apart) {
        squares += products * products / (power * power * count);
        distances += 1.0;
    }
    z_of_sum_of_squares(squares, distances)
}

/// Sum and number of the products of residuals at each of these distances, in steps along x and y, where there are enough for a normal sum: one product of two
/// normal numbers is beyond five once in 150.
fn products_apart(
    by_drive: &[DriveResiduals<'_>],
    apart: impl IntoIterator<Item = (i64, i64)>,
) -> Vec<(f64, f64)> {
    let mut sums: Vec<((i64, i64), (f64, f64))> =
        apart.into_iter().map(|apart| (apart, (0.0, 0.0))).collect();
    for DriveResiduals { drive, residuals } in by_drive {
        let Some(step_m) = step_m(drive) else { continue };
        let cell = |visit: &Visit| {
            let along = |m: f64| (m / step_m).round() as i64;
            (along(visit.at_m.x), along(visit.at_m.y), (visit.at_m.z * 1e4).round() as i64)
        };
        let mut at: HashMap<_, usize> = HashMap::new();
        for (index, visit) in drive.visits.iter().enumerate() {
            at.entry(cell(visit)).or_insert(index);
        }
        for (index, visit) in drive.visits.iter().enumerate() {
            let (x, y, z) = cell(visit);
            for ((dx, dy), (products, count)) in &mut sums {
                if let Some(&other) = at.get(&(x + *dx, y + *dy, z)) {
                    *products += residuals[index] * residuals[other];
                    *count += 1.0;
                }
            }
        }
    }
    let enough = |sums: &(f64, f64)| sums.1 >= FEWEST_PRODUCTS;
    sums.into_iter().map(|(_, sums)| sums).filter(enough).collect()
}

/// Chi-square of slow patterns across the planes beyond that of noise.
pub(crate) fn in_slow_patterns(observations: &Observations, residuals: &[f64]) -> f64 {
    let (energy, count) = energy_of_slow_patterns(&by_drive(observations, residuals));
    (energy - count).max(0.0)
}

/// Power in the lowest cosines across each plane.
fn slow_patterns(by_drive: &[DriveResiduals<'_>], power: f64) -> f64 {
    let (energy, count) = energy_of_slow_patterns(by_drive);
    z_of_sum_of_squares(energy / power, count)
}

/// Sum of squares of the lowest cosines' amplitudes across each plane, each of variance one for noise, and their number.
fn energy_of_slow_patterns(by_drive: &[DriveResiduals<'_>]) -> (f64, f64) {
    /// Cosines along each axis.
    const ORDERS: usize = 7;
    let (mut energy, mut count) = (0.0, 0.0);
    for DriveResiduals { drive, residuals } in by_drive {
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

/// Power in the lowest cosines over the time of each scan, of the residuals and of what they ask for along each axis: `shifts` are their derivatives by
/// the place, of which the first stand in the order of the residuals.
pub(crate) fn slow_changes(
    observations: &Observations,
    residuals: &[f64],
    shifts: &[Vec<f64>],
) -> f64 {
    /// Cosines beside the constant: eight contain 95 % of the power of a step.
    const ORDERS: usize = 8;
    let level = vec![1.0; residuals.len()];
    let (mut energy, mut count) = (0.0, 0.0);
    let mut from = 0;
    for scan in &observations.scans {
        let of_scan = from..from + scan.len();
        from = of_scan.end;
        let visits = || scan.drives.iter().flat_map(|drive| &drive.visits);
        for (order, slopes) in
            (1..=ORDERS).flat_map(|order| shifts.iter().chain([&level]).map(move |s| (order, s)))
        {
            let cosines = visits().map(|visit| (PI * order as f64 * visit.progress).cos());
            let along = cosines.zip(&slopes[of_scan.clone()]).map(|(cosine, slope)| cosine * slope);
            let (product, norm) = along
                .zip(&residuals[of_scan.clone()])
                .fold((0.0, 0.0), |(p, n), (along, r)| (p + r * along, n + along * along));
            if norm > 0.0 {
                energy += product * product / norm;
                count += 1.0;
            }
        }
    }
    z_of_sum_of_squares(energy / mean_square(residuals), count)
}

/// Correlation of the residuals of points that were visited again, by R. A. Fisher's transform (*Metron* 1, 3, 1921), which is normal of few pairs
/// too.
fn repeats(by_drive: &[DriveResiduals<'_>]) -> f64 {
    /// A correlation of one is no number of standard deviations.
    const MOST: f64 = 0.999;
    let (mut products, mut squares, mut count) = (0.0, 0.0, 0.0);
    for DriveResiduals { drive, residuals } in by_drive {
        let mut seen: HashMap<[i64; 3], usize> = HashMap::new();
        for (index, visit) in drive.visits.iter().enumerate() {
            let cell: [i64; 3] = visit.at_m.map(|m| (m * 1e5).round() as i64).into();
            if let Some(before) = seen.insert(cell, index) {
                let [one, other] = [residuals[index], residuals[before]];
                products += one * other;
                squares += 0.5 * (one * one + other * other);
                count += 1.0;
            }
        }
    }
    let correlation = (products / f64::max(squares, f64::MIN_POSITIVE)).clamp(-MOST, MOST);
    correlation.atanh() * f64::max(count - 1.5, 0.0).sqrt()
}

/// Means of whole planes.
fn planes(by_drive: &[DriveResiduals<'_>], power: f64) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for DriveResiduals { drive, residuals } in by_drive {
        for plane in by_height(drive) {
            let sum: f64 = plane.iter().map(|&i| residuals[i]).sum();
            squares += sum * sum / (plane.len() as f64 * power);
            count += 1.0;
        }
    }
    z_of_sum_of_squares(squares, count)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::motion::Motion;
    use fieldgap_acoustics::{Array, Excitation, Medium, Simulation, Simulator, Vec3};

    /// Four planes of 36 x 36 points, two millimetres apart.
    fn planes_of_points() -> ObservedDrive {
        let mut visits = Vec::new();
        for number in 0..4 * 36 * 36 {
            let (plane, row, column) = (number / 1296, number / 36 % 36, number % 36);
            let steps = Vec3::new(f64::from(column), f64::from(row), f64::from(25 * plane));
            let (at_m, motion) = (2e-3 * steps, Motion::steady(Vec3::x(), 1.0));
            let number = number as usize;
            visits.push(Visit {
                number,
                at_m,
                motion,
                otherwise: None,
                begins: false,
                time_s: 0.0,
                progress: 0.0,
                variance: 1.0,
            });
        }
        let believed = Simulation {
            simulator: Simulator::Piston,
            array: Array::square(2, 2, 10e-3).expect("not empty"),
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
            excitation: Excitation::Uniform,
        };
        let (readings, stabilised) = (Vec::new(), Vec::new());
        ObservedDrive {
            focus: 0,
            number: 0,
            believed,
            visits,
            readings,
            stabilised,
            expected: Vec::new(),
            phases_rad: Vec::new(),
            believed_rad: Vec::new(),
        }
    }

    /// Sound reflected by a wall beside the field makes fringes of half a wavelength, here 2.1 steps: neighbours are not correlated, and slow
    /// patterns do not show them.
    #[test]
    fn fringes_far_below_the_noise_are_ripples_and_noise_is_none() {
        let drive = planes_of_points();
        let mut draws = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut normal = || (0..12).map(|_| draws.random_range(-0.5..0.5)).sum::<f64>();
        let noise: Vec<f64> = drive.visits.iter().map(|_| normal()).collect();
        let fringe = |visit: &Visit| 0.3 * (2.0 * PI * visit.at_m.x / 4.2e-3).cos();
        let fringes: Vec<f64> =
            drive.visits.iter().zip(&noise).map(|(visit, noise)| noise + fringe(visit)).collect();
        let z = |test: fn(&[DriveResiduals<'_>], f64) -> f64, residuals: &[f64]| {
            test(&[DriveResiduals { drive: &drive, residuals }], 1.0)
        };
        assert!(z(ripples, &noise).abs() < 3.0, "{}", z(ripples, &noise));
        assert!(z(ripples, &fringes) > 6.0, "{}", z(ripples, &fringes));
        assert!(z(neighbours, &fringes) < 3.0 && z(slow_patterns, &fringes) < 3.0);
    }

    /// Two lines that cross have one or two pairs of readings at most distances.
    #[test]
    fn noise_along_two_lines_that_cross_is_no_ripple() {
        let whole = planes_of_points();
        let line = |along: Vec3| {
            let at_m = move |n: usize| 2e-3 * f64::from(n as u32) * along;
            let visits = whole.visits[..60].iter().enumerate();
            visits.map(move |(n, visit)| Visit { at_m: at_m(n), ..*visit })
        };
        let visits = line(Vec3::x()).chain(line(Vec3::y())).collect();
        let drive = ObservedDrive { visits, ..whole.clone() };
        let mut draws = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let mut normal = || (0..12).map(|_| draws.random_range(-0.5..0.5)).sum::<f64>();
        let mut z = || {
            let residuals: Vec<f64> = (0..120).map(|_| normal()).collect();
            ripples(&[DriveResiduals { drive: &drive, residuals: &residuals }], 1.0)
        };
        assert!((0..300).all(|_| z() < 4.0));
    }

    /// A step of the level and one of the place along x after two thirds of a scan, of half the noise and of all of it, and noise alone.
    #[test]
    fn steps_in_a_scan_are_slow_changes_and_noise_is_none() {
        let bench = Bench::new();
        let places = (0..900).map(|n| Vec3::new(1e-3 * f64::from(n % 30), 0.0, 0.1)).collect();
        let mut observations = bench.observations(&[(Excitation::Uniform, places)]);
        let visits = &mut observations.scans[0].drives[0].visits;
        visits.iter_mut().for_each(|visit| visit.progress = visit.number as f64 / 900.0);
        let mut draws = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut normal = || (0..12).map(|_| draws.random_range(-0.5..0.5)).sum::<f64>();
        let by_place: Vec<f64> = (0..900).map(|n| (0.7 * f64::from(n)).sin()).collect();
        let shifts = [by_place.clone(), vec![0.0; 900], vec![0.0; 900]];
        let mut z = |of_level: f64, of_place: f64| {
            let after = |n: usize| if n < 600 { 0.0 } else { 1.0 };
            let residuals: Vec<f64> = (0..900)
                .map(|n| normal() + after(n) * (of_level + of_place * by_place[n]))
                .collect();
            slow_changes(&observations, &residuals, &shifts)
        };
        for _ in 0..20 {
            assert!(z(0.0, 0.0) < 4.0);
        }
        assert!(z(0.5, 0.0) > 4.0 && z(0.0, 1.0) > 4.0);
    }

    /// Few pairs of noise pass 3.3 deviations no more often than many do; pairs that share half of their variance pass it.
    #[test]
    fn repeats_that_share_an_error_are_told_from_noise_by_few_pairs_and_by_many() {
        let whole = planes_of_points();
        let mut draws = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let mut normal = || (0..12).map(|_| draws.random_range(-0.5..0.5)).sum::<f64>();
        for (pairs, scans) in [(8, 2000), (300, 200)] {
            let visits = whole.visits[..pairs].iter().flat_map(|visit| [*visit; 2]).collect();
            let drive = ObservedDrive { visits, ..whole.clone() };
            let mut z = |shared: f64| {
                let residuals: Vec<f64> = (0..pairs)
                    .flat_map(|_| {
                        let both = shared.sqrt() * normal();
                        [(); 2].map(|()| both + (1.0 - shared).sqrt() * normal())
                    })
                    .collect();
                repeats(&[DriveResiduals { drive: &drive, residuals: &residuals }])
            };
            let loud = (0..scans).filter(|_| z(0.0) > 3.3).count();
            assert!(loud <= 4, "{loud} of {scans} with {pairs} pairs");
            if pairs > 8 {
                assert!(z(0.5) > 6.0);
            }
        }
    }
}
