//! Readings of one place that were taken again.

use std::collections::HashMap;

use crate::limits::READINGS_AT_FULL_SCALE;
use crate::model::observations::ObservedScan;
use crate::statistics::reading_pairs::{Level, Pair};

/// Repeated visits of a point, with the mean of both readings as their level, since the expected reading may still be far off.
pub(crate) fn pairs_beside(scan: &ObservedScan, levels: &[Vec<Level>], floor: f64) -> Vec<Pair> {
    /// Nanometres within which two visits are of one point.
    const SAME_NM: f64 = 1e4;
    let full_scale = full_scale(scan);
    let mut pairs = Vec::new();
    for (drive, levels) in scan.drives.iter().zip(levels) {
        let mut seen = HashMap::new();
        for (index, visit) in drive.visits.iter().enumerate() {
            let cell: [i64; 3] = visit.at_m.map(|m| (m * 1e9 / SAME_NM).round() as i64).into();
            if let Some(before) = seen.insert(cell, index) {
                if drive.readings[index].max(drive.readings[before]) >= full_scale {
                    continue;
                }
                let beyond = |i: usize| drive.readings[i] - levels[i].reading;
                let reading = 0.5 * (drive.readings[index] + drive.readings[before]);
                let level = Level { reading, ..levels[index] };
                let variance = 0.5 * (visit.variance + drive.visits[before].variance);
                let difference = (beyond(index) - beyond(before)) / variance.sqrt();
                pairs.push(Pair::new(level, scan.averaged, floor, difference));
            }
        }
    }
    pairs
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
