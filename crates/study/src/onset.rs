//! Where sub-peaks appear and vanish between the values of a sweep.

use serde::Serialize;

use super::run::sub_peaks_at;
use super::{Study, StudyResult};

/// Changes that are followed, at most.
const MOST: usize = 8;
/// A step between two values is narrowed down to this share of itself.
const NARROW: f64 = 1e-3;

/// Two values of a sweep between which the sub-peaks appear or vanish.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Onset {
    /// Below it they are not there yet, or still.
    pub from: f64,
    /// From here on they are there, or gone.
    pub to: f64,
    /// Whether they appear.
    pub appear: bool,
}

/// Where sub-peaks appear or vanish along the only sweep of a study, if its values are rising numbers: between
/// neighbouring values, narrowed down to a thousandth of the step where the parameter takes numbers in between.
pub fn onsets(study: &Study, result: &StudyResult) -> Vec<Onset> {
    let [sweep] = &study.sweeps[..] else { return Vec::new() };
    let Some(numbers) = sweep.rising_numbers() else { return Vec::new() };
    if result.rows.iter().any(|row| row.draws.len() > 1) {
        return Vec::new();
    }
    let there: Vec<bool> = result.rows.iter().map(|row| row.first().sub_peaks > 0).collect();
    (1..there.len())
        .filter(|&index| there[index - 1] != there[index])
        .take(MOST)
        .map(|index| narrowed(study, numbers[index - 1], numbers[index], there[index]))
        .collect()
}

fn narrowed(study: &Study, from: f64, to: f64, appear: bool) -> Onset {
    let (mut low, mut high) = (from, to);
    while high - low > NARROW * (to - from) {
        let middle = 0.5 * (low + high);
        match sub_peaks_at(study, middle) {
            None => break,
            Some(count) if (count > 0) == appear => high = middle,
            Some(_) => low = middle,
        }
    }
    Onset { from: low, to: high, appear }
}
