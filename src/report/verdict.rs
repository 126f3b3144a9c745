//! What a comparison comes to, in plain words.

use super::numbers::{fixed, height_mm, listed, millimetres, percent, significant};
use super::peak_distance::peak_distance_m;
use crate::gap::{Agreement, Comparison, FieldFigures, PlaneComparison};

/// Maps that correlate at least this well have the same shape.
pub(super) const LEAST_CORRELATION: f64 = 0.9;
/// Peaks that are apart by at most this share of the focal radius stand at the same place.
pub(super) const SAME_PLACE_SHARE: f64 = 0.5;
/// A plane this near to the focus, metres, is at the focal height.
const FOCAL_HEIGHT_TOLERANCE_M: f64 = 1e-3;
/// Levels that differ from the simulation's by less than this are not worth a sentence.
const LEVEL_TOLERANCE: f64 = 0.1;

/// What a plane comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Judgement {
    /// Peak and shape agree.
    Agrees,
    /// The peaks stand apart.
    PeakApart,
    /// The shapes agree, but of several maxima another one is the largest.
    OtherMaximum,
    /// The peaks stand together, the shapes differ.
    ShapeDiffers,
    /// There is too little to judge by.
    Unknown,
}

/// Judges a plane, by the two limits that the page states.
pub(super) fn judge(plane: &PlaneComparison) -> Judgement {
    let correlation = plane.agreement.correlation;
    if !correlation.is_finite() {
        return Judgement::Unknown;
    }
    let apart_m = plane.discrepancy.peak_distance_m.value;
    let radius_m = radius_m(&plane.scan).or_else(|| radius_m(&plane.simulation));
    let same_place = radius_m.is_none_or(|radius_m| apart_m <= SAME_PLACE_SHARE * radius_m);
    let several = [&plane.scan, &plane.simulation].iter().any(|f| f.sub_peaks.unwrap_or(0) > 0);
    match (same_place, correlation >= LEAST_CORRELATION) {
        (true, true) => Judgement::Agrees,
        (true, false) => Judgement::ShapeDiffers,
        (false, true) if several => Judgement::OtherMaximum,
        (false, _) => Judgement::PeakApart,
    }
}

/// Whether a plane lies at the height of its focus.
pub(super) fn at_focal_height(plane: &PlaneComparison) -> bool {
    plane
        .target_in_scan_m
        .is_some_and(|target_m| (target_m.z - plane.z_m).abs() <= FOCAL_HEIGHT_TOLERANCE_M)
}

/// The drives of a comparison, by number.
pub(super) fn drives(comparison: &Comparison) -> Vec<usize> {
    let mut drives: Vec<usize> = comparison.planes.iter().map(|plane| plane.focus).collect();
    drives.sort_unstable();
    drives.dedup();
    drives
}

/// What a comparison comes to, sentence by sentence.
pub(super) fn sentences(comparison: &Comparison) -> Vec<String> {
    let drives = drives(comparison);
    let mut sentences = Vec::new();
    for &drive in &drives {
        let planes: Vec<&PlaneComparison> =
            comparison.planes.iter().filter(|plane| plane.focus == drive).collect();
        let about = if drives.len() > 1 { format!("Drive {drive}: ") } else { String::new() };
        let found = [
            agreeing(&planes),
            apart(&planes),
            other_maximum(&planes),
            shapes(&planes),
            unknown(&planes),
            wandering(&planes),
            focal_radius(&planes),
            levels(&planes),
        ];
        sentences.extend(found.into_iter().flatten().map(|sentence| format!("{about}{sentence}")));
    }
    sentences.push(overall(&comparison.overall));
    sentences
}

/// Which of several simulators comes closest; `None` for a single one.
pub(super) fn closest(comparisons: &[Comparison]) -> Option<String> {
    let mut ranked: Vec<&Comparison> =
        comparisons.iter().filter(|c| c.overall.residual_rms_ratio.is_finite()).collect();
    ranked.sort_by(|a, b| a.overall.residual_rms_ratio.total_cmp(&b.overall.residual_rms_ratio));
    let (best, others) = ranked.split_first()?;
    let left = |c: &Comparison| percent(c.overall.residual_rms_ratio);
    let others: Vec<String> =
        others.iter().map(|other| format!("{} {}", other.simulator, left(other))).collect();
    (!others.is_empty()).then(|| {
        format!(
            "Of the simulators, {} comes closest: it leaves {} of the scan's rms unexplained, {}.",
            best.simulator,
            left(best),
            listed(&others)
        )
    })
}

fn radius_m(figures: &FieldFigures) -> Option<f64> {
    Some(figures.focal_radius.as_ref()?.radius_m?.value)
}

fn judged<'a>(planes: &[&'a PlaneComparison], as_: Judgement) -> Vec<&'a PlaneComparison> {
    planes.iter().copied().filter(|plane| judge(plane) == as_).collect()
}

/// `At the focal height, 100 mm,` or `At 50, 100 (the focal height) and 150 mm`.
fn at(planes: &[&PlaneComparison]) -> String {
    if let [plane] = planes
        && at_focal_height(plane)
    {
        return format!("At the focal height, {} mm,", height_mm(plane.z_m));
    }
    let heights: Vec<String> = planes
        .iter()
        .map(|plane| {
            let height = height_mm(plane.z_m);
            if at_focal_height(plane) { format!("{height} (the focal height)") } else { height }
        })
        .collect();
    format!("At {} mm", listed(&heights))
}

fn agreeing(planes: &[&PlaneComparison]) -> Option<String> {
    let planes = judged(planes, Judgement::Agrees);
    let correlation = planes.iter().map(|p| p.agreement.correlation).reduce(f64::min)?;
    let figures = match planes.as_slice() {
        [plane] => format!(
            "their peaks stand {} mm apart and their maps correlate at {}",
            millimetres(plane.discrepancy.peak_distance_m),
            fixed(correlation, 3)
        ),
        _ => {
            let apart_mm = planes
                .iter()
                .map(|p| p.discrepancy.peak_distance_m.value * 1e3)
                .filter(|apart| apart.is_finite())
                .reduce(f64::max)?;
            format!(
                "their peaks stand at most {} mm apart and their maps correlate at {} or better",
                significant(apart_mm, 2),
                fixed(correlation, 3)
            )
        }
    };
    Some(format!("{} scan and simulation agree: {figures}.", at(&planes)))
}

fn apart(planes: &[&PlaneComparison]) -> Option<String> {
    let planes = judged(planes, Judgement::PeakApart);
    let (first, others) = planes.split_first()?;
    let distance = |p: &PlaneComparison| millimetres(p.discrepancy.peak_distance_m);
    let others: Vec<String> =
        others.iter().map(|p| format!("at {} mm {} mm", height_mm(p.z_m), distance(p))).collect();
    let others = if others.is_empty() { String::new() } else { format!(", {}", listed(&others)) };
    Some(format!(
        "{} the scanned peak lies {} mm from the simulated one{others}.",
        at(&[*first]),
        distance(first)
    ))
}

fn other_maximum(planes: &[&PlaneComparison]) -> Option<String> {
    let planes = judged(planes, Judgement::OtherMaximum);
    let correlation = planes.iter().map(|p| p.agreement.correlation).reduce(f64::min)?;
    Some(format!(
        "{} the maps agree in shape (correlation {}{}), yet of several maxima of similar height another one is the \
         largest in the scan than in the simulation.",
        at(&planes),
        fixed(correlation, 3),
        if planes.len() > 1 { " or better" } else { "" }
    ))
}

fn shapes(planes: &[&PlaneComparison]) -> Option<String> {
    let planes = judged(planes, Judgement::ShapeDiffers);
    if planes.is_empty() {
        return None;
    }
    let correlations: Vec<String> =
        planes.iter().map(|p| fixed(p.agreement.correlation, 2)).collect();
    Some(format!(
        "{} the peaks stand at the same place, but the fields differ in shape: correlation {}.",
        at(&planes),
        listed(&correlations)
    ))
}

fn unknown(planes: &[&PlaneComparison]) -> Option<String> {
    let planes = judged(planes, Judgement::Unknown);
    (!planes.is_empty())
        .then(|| format!("{} there are too few readings to compare the fields.", at(&planes)))
}

/// Where the peaks go with the height, against the axis through the focus.
fn wandering(planes: &[&PlaneComparison]) -> Option<String> {
    let distances_mm = |figures: fn(&PlaneComparison) -> &FieldFigures| -> Option<(f64, f64)> {
        let far = |plane: &&PlaneComparison| {
            let target_m = plane.target_in_scan_m?;
            let peak_m = figures(plane).peak_position_m;
            let far_mm = peak_distance_m(peak_m, (target_m.x, target_m.y)).value * 1e3;
            far_mm.is_finite().then_some(far_mm)
        };
        let all: Vec<f64> = planes.iter().filter_map(far).collect();
        (all.len() > 1).then(|| {
            (
                all.iter().copied().fold(f64::INFINITY, f64::min),
                all.iter().copied().fold(0.0, f64::max),
            )
        })
    };
    let between =
        |(least, most): (f64, f64)| format!("{} to {} mm", fixed(least, 1), fixed(most, 1));
    Some(format!(
        "From height to height the scanned peak stands {} from the axis through the focus, the simulated one {}.",
        between(distances_mm(|plane| &plane.scan)?),
        between(distances_mm(|plane| &plane.simulation)?)
    ))
}

fn focal_radius(planes: &[&PlaneComparison]) -> Option<String> {
    let plane = planes.iter().find(|plane| at_focal_height(plane))?;
    let radius =
        |figures: &FieldFigures| Some(millimetres(figures.focal_radius.as_ref()?.radius_m?));
    Some(format!(
        "At the focal height the focal radius is {} mm in the scan and {} mm in the simulation.",
        radius(&plane.scan)?,
        radius(&plane.simulation)?
    ))
}

/// Where the scan is louder or quieter than the simulation, at the one gain of the registration.
fn levels(planes: &[&PlaneComparison]) -> Option<String> {
    let known: Vec<&&PlaneComparison> =
        planes.iter().filter(|plane| plane.agreement.gain_ratio.is_finite()).collect();
    let ratio = |plane: &PlaneComparison| plane.agreement.gain_ratio;
    let loudest = known.iter().max_by(|a, b| ratio(a).total_cmp(&ratio(b)))?;
    let quietest = known.iter().min_by(|a, b| ratio(a).total_cmp(&ratio(b)))?;
    if known.len() < 2 || ratio(loudest) / ratio(quietest) < 1.0 + LEVEL_TOLERANCE {
        return None;
    }
    let level = |plane: &PlaneComparison| {
        format!("{} times the simulation's at {} mm", fixed(ratio(plane), 2), height_mm(plane.z_m))
    };
    Some(format!(
        "With one gain for all heights, the scan's level runs from {} to {}.",
        level(quietest),
        level(loudest)
    ))
}

fn overall(agreement: &Agreement) -> String {
    format!(
        "Over all {} readings the correlation is {}; the simulation leaves {} of the scan's rms unexplained.",
        agreement.points,
        fixed(agreement.correlation, 3),
        percent(agreement.residual_rms_ratio)
    )
}
