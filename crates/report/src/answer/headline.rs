//! The headline of a record: the largest difference with its error, and its cause, in at most fifteen words.

use crate::judgement::{Judgement, drives, judge};
use crate::worst_plane::worst_plane;
use fieldgap_comparison::{Comparison, PlaneComparison};
use fieldgap_diagnosis::{Diagnosis, EffectId, Verdict};
use fieldgap_text::{fixed, height_mm, millimetres, percent};

/// The headline of a comparison and of its diagnosis, where there is one: one sentence without a full stop, of at most fifteen words beside
/// figures and units.
pub fn headline(comparison: &Comparison, diagnosis: Option<&Diagnosis>) -> String {
    let difference = match worst_plane(comparison) {
        None => overall(comparison),
        Some((_, plane)) => at_height(comparison, plane),
    };
    match diagnosis.map(cause) {
        Some(cause) => format!("{difference}: {cause}"),
        None => difference,
    }
}

fn overall(comparison: &Comparison) -> String {
    let residual = percent(comparison.overall.residual_rms_ratio);
    format!("Scan and simulation differ by {residual}")
}

fn at_height(comparison: &Comparison, plane: &PlaneComparison) -> String {
    let several = drives(comparison).len() > 1;
    let drive = if several { format!(", drive {}", plane.focus) } else { String::new() };
    let height = format!("{} mm{drive}", height_mm(plane.z_m));
    let residual = percent(plane.agreement.residual_rms_ratio);
    match judge(plane) {
        Judgement::Agrees => {
            format!("Scan and simulation agree to {residual} at {height}")
        }
        Judgement::LevelDiffers => {
            let ratio = fixed(plane.agreement.gain_ratio, 2);
            format!("The scan is {ratio} times the simulation at {height}")
        }
        Judgement::PeakApart => {
            let apart = millimetres(plane.discrepancy.peak_distance_m);
            format!("The simulation misses the peak by {apart} mm at {height}")
        }
        Judgement::OtherMaximum | Judgement::ShapeDiffers | Judgement::Unknown => {
            format!("Scan and simulation differ by {residual} at {height}")
        }
    }
}

/// The headline of a diagnosis alone: how far the gap shrinks, and its cause; as short as [`headline`].
pub fn headline_of_diagnosis(diagnosis: &Diagnosis) -> String {
    let gap = percent(diagnosis.gap_before);
    let cause = cause(diagnosis);
    match (diagnosis.verdict, diagnosis.best()) {
        (Verdict::Explained | Verdict::MostlyExplained, Some(best)) => {
            format!("The gap of {gap} shrinks to {}: {cause}", percent(best.gap_after))
        }
        _ => format!("The gap is {gap}: {cause}"),
    }
}

/// The cause: of several effects, the one that explains most of the gap.
fn cause(diagnosis: &Diagnosis) -> String {
    match diagnosis.verdict {
        Verdict::None if diagnosis.uncertainty.is_some() => {
            "the stated uncertainty of the set-up explains it".to_owned()
        }
        Verdict::None => "only noise is left".to_owned(),
        Verdict::Unexplained => "no known effect explains it".to_owned(),
        Verdict::Ambiguous => {
            format!("{} causes explain it equally well", diagnosis.alternatives.len())
        }
        Verdict::Explained | Verdict::MostlyExplained => {
            let cause = largest(diagnosis).map_or("several causes", EffectId::as_cause);
            match diagnosis.effects.len() {
                0 | 1 => cause.to_owned(),
                several => format!("{cause} + {} more", several - 1),
            }
        }
    }
}

/// The named effect with the largest share of the gap.
fn largest(diagnosis: &Diagnosis) -> Option<EffectId> {
    let steps = diagnosis.waterfall.iter().filter_map(|step| Some((step.effect?, step.share)));
    let named = steps.filter(|(effect, _)| diagnosis.effects.contains(effect));
    let largest = named.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(effect, _)| effect);
    largest.or(diagnosis.effects.first().copied())
}
