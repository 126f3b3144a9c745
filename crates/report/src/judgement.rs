//! Whether scan and simulation agree at a height.

use fieldgap_comparison::{Comparison, FieldFigures, PlaneComparison};

/// Maps have the same shape from this correlation on.
const LEAST_CORRELATION: f64 = 0.9;
/// Scan and simulation agree up to this residual, relative to the scan's rms: an error of the level of 1.6 dB, about what a measurement
/// microphone and its position are good for at 40 kHz. Set by judgement.
pub(super) const MOST_RESIDUAL: f64 = 0.2;
/// Peaks coincide if they are at most this share of the focal radius apart.
pub(super) const SAME_PLACE_SHARE: f64 = 0.5;
/// A plane farther than this from the focus, metres, is not at the focal height, even if no other is nearer.
const FOCAL_HEIGHT_REACH_M: f64 = 5e-3;

/// How scan and simulation compare at a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Judgement {
    /// Peak, shape and level agree.
    Agrees,
    /// Peak and shape agree, the level does not.
    LevelDiffers,
    /// The peaks do not coincide.
    PeakApart,
    /// The shapes agree, but there are several maxima, and the largest is not the same one.
    OtherMaximum,
    /// The peaks coincide, the shapes differ.
    ShapeDiffers,
    /// There are too few readings.
    Unknown,
}

/// Judges a plane by the limits that the page states.
pub(super) fn judge(plane: &PlaneComparison) -> Judgement {
    let correlation = plane.agreement.correlation;
    if !correlation.is_finite() {
        return Judgement::Unknown;
    }
    let apart_m = plane.discrepancy.peak_distance_m.value;
    let radius_m = radius_m(&plane.scan).or_else(|| radius_m(&plane.simulation));
    let same_place = radius_m.is_none_or(|radius_m| apart_m <= SAME_PLACE_SHARE * radius_m);
    let several = [&plane.scan, &plane.simulation].iter().any(|f| f.sub_peaks.unwrap_or(0) > 0);
    let PlaneComparison { agreement, .. } = plane;
    match same_place {
        true if agreement.residual_rms_ratio <= MOST_RESIDUAL => Judgement::Agrees,
        true if agreement.residual_rms_ratio_own_gain <= MOST_RESIDUAL => Judgement::LevelDiffers,
        true => Judgement::ShapeDiffers,
        false if several && correlation >= LEAST_CORRELATION => Judgement::OtherMaximum,
        false => Judgement::PeakApart,
    }
}

fn radius_m(figures: &FieldFigures) -> Option<f64> {
    Some(figures.focal_radius.as_ref()?.radius_m?.value)
}

/// The drives of a comparison, by number.
pub(super) fn drives(comparison: &Comparison) -> Vec<usize> {
    let mut drives: Vec<usize> = comparison.planes.iter().map(|plane| plane.focus).collect();
    drives.sort_unstable();
    drives.dedup();
    drives
}

/// The height, metres, of the plane of a drive that lies at its focus, in the coordinates of the scan.
pub(super) fn focal_height_m(comparison: &Comparison, drive: usize) -> Option<f64> {
    let to_focus_m =
        |plane: &&PlaneComparison| Some(((plane.target_in_scan_m?.z - plane.z_m).abs(), plane.z_m));
    let planes = comparison.planes.iter().filter(|plane| plane.focus == drive);
    let nearest = planes.filter_map(|plane| to_focus_m(&plane)).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.filter(|&(to_focus_m, _)| to_focus_m <= FOCAL_HEIGHT_REACH_M).map(|(_, z_m)| z_m)
}
