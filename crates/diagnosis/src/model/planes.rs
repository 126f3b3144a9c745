//! Readings of one height, and the step between neighbours.

use std::collections::BTreeMap;

use fieldgap_records::{LAYER_MM, are_scattered};

use super::observations::{ObservedDrive, Visit};

/// Median step along x or y from one visit of a drive to the next, m; `None` if it has none.
pub(crate) fn step_m(drive: &ObservedDrive) -> Option<f64> {
    /// Largest share of a step that goes across: places are off by some percent of it.
    const ACROSS: f64 = 0.05;
    let along_an_axis = |pair: &[Visit]| {
        let moved_m = (pair[1].at_m - pair[0].at_m).abs();
        let (step_m, across_m) = (moved_m.xy().max(), moved_m.xy().min().max(moved_m.z));
        let is_next = pair[1].number == pair[0].number + 1;
        (is_next && step_m > 0.0 && across_m < ACROSS * step_m).then_some(step_m)
    };
    let mut steps: Vec<f64> = drive.visits.windows(2).filter_map(along_an_axis).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied()
}

/// The readings of a drive at each height, as indices, the lowest height first; in layers where they are scattered.
pub(crate) fn by_height(drive: &ObservedDrive) -> Vec<Vec<usize>> {
    let mut planes: Vec<(i64, Vec<usize>)> = Vec::new();
    for (index, visit) in drive.visits.iter().enumerate() {
        let height = (visit.at_m.z * 1e4).round() as i64;
        match planes.iter_mut().find(|(known, _)| (*known - height).abs() <= 1) {
            Some((_, indices)) => indices.push(index),
            None => planes.push((height, vec![index])),
        }
    }
    if are_scattered(planes.len(), drive.visits.len()) {
        return in_layers(drive);
    }
    planes.sort_by_key(|(height, _)| *height);
    planes.into_iter().map(|(_, indices)| indices).collect()
}

fn in_layers(drive: &ObservedDrive) -> Vec<Vec<usize>> {
    let mut layers: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    for (index, visit) in drive.visits.iter().enumerate() {
        layers.entry((1e3 * visit.at_m.z / LAYER_MM).floor() as i64).or_default().push(index);
    }
    layers.into_values().collect()
}

/// Whether some readings of a drive lie at one height.
pub(crate) fn is_flat(drive: &ObservedDrive, indices: &[usize]) -> bool {
    /// Heights of one plane differ by less, m, as they are rounded.
    const SAME_M: f64 = 3e-4;
    let first_m = drive.visits[indices[0]].at_m.z;
    indices.iter().all(|&index| (drive.visits[index].at_m.z - first_m).abs() < SAME_M)
}
