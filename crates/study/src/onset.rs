//! Values of a sweep at which sub-peaks appear or vanish.

use serde::Serialize;

use super::run::sub_peaks_at;
use super::{Study, StudyResult};

/// Most changes that are refined.
const MAX_ONSETS: usize = 8;
/// Final width of an interval over the step of the sweep.
const RELATIVE_WIDTH: f64 = 1e-3;

/// Two values of a sweep between which sub-peaks appear or vanish.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Onset {
    /// The lower value.
    pub from: f64,
    /// The upper value.
    pub to: f64,
    /// Whether they appear as the value rises.
    pub appear: bool,
}

/// Where sub-peaks appear or vanish along the only sweep of a study with ascending numbers.
///
/// Values whose peak is outside the map say nothing. The interval between two values is bisected to a thousandth of the step, if the parameter takes numbers in between.
pub fn onsets(study: &Study, result: &StudyResult) -> Vec<Onset> {
    let [sweep] = &study.sweeps[..] else { return Vec::new() };
    let Some(numbers) = sweep.ascending_numbers() else { return Vec::new() };
    if result.rows.iter().any(|row| row.draws.len() > 1) {
        return Vec::new();
    }
    let present: Vec<Option<bool>> =
        result.rows.iter().map(|row| Some(row.first().figures()?.sub_peaks > 0)).collect();
    (1..present.len())
        .filter_map(|index| Some((index, present[index - 1]?, present[index]?)))
        .filter(|(_, before, after)| before != after)
        .take(MAX_ONSETS)
        .map(|(index, _, appear)| bisected(study, numbers[index - 1], numbers[index], appear))
        .collect()
}

fn bisected(study: &Study, from: f64, to: f64, appear: bool) -> Onset {
    let (mut low, mut high) = (from, to);
    while high - low > RELATIVE_WIDTH * (to - from) {
        let middle = 0.5 * (low + high);
        match sub_peaks_at(study, middle) {
            None => break,
            Some(count) if (count > 0) == appear => high = middle,
            Some(_) => low = middle,
        }
    }
    Onset { from: low, to: high, appear }
}
