//! What the diagnoses of sealed rigs cost, and whether the causes held on fresh readings.

use super::judged::Judged;
use super::rate::{Figure, Rate, Target};
use crate::parsed_diagnosis::ParsedMeasurement;

/// Readings of a full scan, and its time, min; a loop should do with a fifth of both.
const FULL_SCAN: (f64, f64) = (5424.0, 14.0);
const SHARE: f64 = 0.2;

fn measured<'a>(judged: &'a [Judged<'_>]) -> impl Iterator<Item = &'a ParsedMeasurement> {
    judged.iter().filter_map(|one| one.diagnosis.measurement.as_ref())
}

/// The medians of readings and minutes; nothing for a set of scans.
pub(super) fn medians(judged: &[Judged<'_>]) -> Vec<Figure> {
    let median = |of: fn(&ParsedMeasurement) -> f64| {
        let mut all: Vec<f64> = measured(judged).map(of).collect();
        all.sort_by(f64::total_cmp);
        let count = all.len();
        (count > 0).then(|| (0.5 * (all[(count - 1) / 2] + all[count / 2]), count))
    };
    let figure = |what, of, full: f64| {
        let (median, count) = median(of)?;
        Some(Figure::new(what, Some(median), count, Target::AtMost(SHARE * full)))
    };
    let (readings, minutes) = FULL_SCAN;
    [
        figure("median readings of a rig", |one| one.readings as f64, readings),
        figure("median minutes on the rig's clock", |one| one.seconds / 60.0, minutes),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// How often a named cause held on fresh readings; nothing for a set of scans.
pub(super) fn proven(judged: &[Judged<'_>]) -> Option<Rate> {
    measured(judged).next()?;
    let explained = judged.iter().filter(|one| one.is_explained());
    let holds = |one: &&Judged<'_>| {
        let measurement = one.diagnosis.measurement.as_ref();
        measurement.and_then(|one| one.verification).is_some_and(|test| test.holds)
    };
    let what = "where explained: the cause holds on fresh readings";
    Some(Rate::of(what, explained, holds).with(Target::AtLeast(0.95)))
}

/// How often rivals that are left cannot be told apart by the readings; nothing for a set of scans.
pub(super) fn inseparable(judged: &[Judged<'_>]) -> Option<Rate> {
    measured(judged).next()?;
    let told =
        |one: &Judged<'_>| one.diagnosis.measurement.as_ref().and_then(|one| one.rivals_alike);
    let left = judged.iter().filter(|one| told(one).is_some());
    let what = "where rivals are left: the readings cannot tell them apart";
    Some(Rate::of(what, left, |one| told(one) == Some(true)).with(Target::AtLeast(1.0)))
}
