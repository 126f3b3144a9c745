//! Readings of one place that were taken again.

use std::collections::HashMap;

use fieldgap_comparison::USUAL_PROPORTIONAL_NOISE;

use crate::limits::{FEWEST_REPEATS, READINGS_AT_FULL_SCALE};
use crate::model::observations::{ObservedScan, Visit};
use crate::statistics::reading_pairs::{Detector, Level, Pair};

/// Way along x after which play is taken up, m: that of belts and screws is below two millimetres.
const TAKEN_UP_M: f64 = 2.5e-3;

/// Standard errors by which the side from which repeats were approached must show in their differences: normal numbers differ by so much once in 16,000.
pub(crate) const SHOWN: f64 = 4.0;

/// Two visits of one point in succession, under one drive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Repeat {
    /// Number of the drive among those of its scan.
    pub drive: usize,
    /// The earlier visit and the later one, among those of the drive.
    pub visits: [usize; 2],
    /// Whether the robot came to both from the same side along x, far enough that any play was taken up.
    pub is_alike: bool,
}

/// Points that were visited again, less those whose readings are at full scale.
pub(crate) fn repeats(scan: &ObservedScan) -> Vec<Repeat> {
    /// Nanometres within which two visits are of one point.
    const SAME_NM: f64 = 1e4;
    let full_scale = full_scale(scan);
    let mut repeats = Vec::new();
    for (number, drive) in scan.drives.iter().enumerate() {
        let mut seen = HashMap::new();
        for (index, visit) in drive.visits.iter().enumerate() {
            let cell: [i64; 3] = visit.at_m.map(|m| (m * 1e9 / SAME_NM).round() as i64).into();
            let Some(before) = seen.insert(cell, index) else { continue };
            if drive.readings[index].max(drive.readings[before]) < full_scale {
                let is_alike = are_approached_alike(&drive.visits[before], visit);
                repeats.push(Repeat { drive: number, visits: [before, index], is_alike });
            }
        }
    }
    repeats
}

/// Repeated visits of a point, with the mean of both readings as their level, since the expected reading may still be far off.
///
/// Where the robot came from different sides its play makes them differ, and that is no noise: if these differ clearly more than those that were
/// approached alike, they are left out.
pub(crate) fn pairs_beside(
    scan: &ObservedScan,
    levels: &[Vec<Level>],
    detector: Detector,
) -> Vec<Pair> {
    let (mut alike, mut otherwise) = (Vec::new(), Vec::new());
    let mut pairs = Vec::new();
    for Repeat { drive, visits: [before, index], is_alike } in repeats(scan) {
        let (drive, levels) = (&scan.drives[drive], &levels[drive]);
        let beyond = |i: usize| drive.readings[i] - levels[i].reading;
        let reading = 0.5 * (drive.readings[index] + drive.readings[before]);
        let level = Level { reading, ..levels[index] };
        let variance = 0.5 * (drive.visits[index].variance + drive.visits[before].variance);
        let difference = (beyond(index) - beyond(before)) / variance.sqrt();
        let of = if is_alike { &mut alike } else { &mut otherwise };
        of.push((pairs.len(), (difference / usual_noise(scan, reading)).powi(2)));
        pairs.push(Pair::new(level, scan.averaged, detector, difference));
    }
    if alike.len() < FEWEST_REPEATS || otherwise.len() < FEWEST_REPEATS {
        return pairs;
    }
    let mean_square =
        |of: &[(usize, f64)]| of.iter().map(|(_, square)| square).sum::<f64>() / of.len() as f64;
    // A variance of n normal numbers has a relative variance of 2/n.
    let error = (2.0 / alike.len() as f64 + 2.0 / otherwise.len() as f64).sqrt();
    match (mean_square(&otherwise) / mean_square(&alike)).ln() > SHOWN * error {
        true => alike.into_iter().map(|(number, _)| pairs[number]).collect(),
        false => pairs,
    }
}

/// What a reading usually scatters by, so that repeats of high and low levels count alike.
pub(crate) fn usual_noise(scan: &ObservedScan, reading: f64) -> f64 {
    (USUAL_PROPORTIONAL_NOISE * reading + scan.scatter.additive).max(f64::MIN_POSITIVE)
}

/// Whether the robot came to both visits from the same side along x, far enough that any play was taken up.
fn are_approached_alike(one: &Visit, other: &Visit) -> bool {
    let [one, other] = [one, other].map(|visit| visit.otherwise.unwrap_or(visit.motion));
    one.x_direction == other.x_direction && one.x_since_m.min(other.x_since_m) > TAKEN_UP_M
}

/// The full scale of the converter, if several readings equal it: their scatter is not visible. Infinite otherwise.
pub(crate) fn full_scale(scan: &ObservedScan) -> f64 {
    let readings = || scan.drives.iter().flat_map(|drive| &drive.readings);
    let largest = readings().copied().fold(0.0, f64::max);
    match readings().filter(|&&reading| reading == largest).count() >= READINGS_AT_FULL_SCALE {
        true => largest,
        false => f64::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::Vec3;

    use super::*;
    use crate::effects::testing::Bench;
    use crate::model::motion::Motion;
    use crate::statistics::reading_pairs::Compression;

    /// Sixty places, each visited twice, every other from the same side; those from different sides differ by so much.
    fn pairs(by_side: f64) -> usize {
        let bench = Bench::new();
        let places: Vec<Vec3> =
            (0..120).map(|n| Vec3::new(1e-4 * f64::from(n % 60), 0.0, 0.1)).collect();
        let mut observations = bench.observations(&[(bench.believed().excitation.clone(), places)]);
        let scan = &mut observations.scans[0];
        let drive = &mut scan.drives[0];
        for (n, visit) in drive.visits.iter_mut().enumerate() {
            let side = if n >= 60 && n % 2 == 0 { -1.0 } else { 1.0 };
            visit.motion = Motion::steady(Vec3::zeros(), side);
            visit.otherwise = None;
            drive.readings[n] *= 1.0 + 0.02 * (7.0 * n as f64).sin() + by_side * (side - 1.0);
        }
        let level = |reading: &f64| Level {
            reading: *reading,
            by_turbulence: [0.0; 2],
            by_jitter: [0.0; 2],
            compression: Compression::NONE,
        };
        let even = vec![level(&1.0); 120];
        pairs_beside(scan, &[even], Detector::default()).len()
    }

    #[test]
    fn repeats_from_different_sides_tell_the_noise_unless_play_makes_them_differ() {
        assert_eq!(pairs(0.0), 60);
        assert_eq!(pairs(0.1), 30);
    }
}
