//! The cause and how certain it is, as a card.

use maud::{Markup, html};

use fieldgap_diagnosis::{Diagnosis, EffectId, Verdict, WaterfallPart};
use fieldgap_text::{fixed, percent};

/// Smallest share of the squared gap that is listed for what is no effect. Set by judgement.
const LEAST_SHARE: f64 = 0.01;

/// The cause of the gap, its probability, and the gap before and after.
pub(super) fn card(diagnosis: &Diagnosis) -> Markup {
    html! {
        div class="card" {
            h2 { "Cause" }
            p { strong { (verdict(diagnosis)) } }
            @if diagnosis.verdict.names_a_cause() {
                ul {
                    @for effect in &diagnosis.effects { li { (share(diagnosis, *effect)) } }
                    @if let Some(alignment) = share_of(diagnosis, WaterfallPart::Alignment) {
                        li { "alignment within a set-up's tolerance: " (percent(alignment)) }
                    }
                    @if let Some(stated) = share_of(diagnosis, WaterfallPart::StatedUncertainty) {
                        li { "the set-up within its stated uncertainty: " (percent(stated)) }
                    }
                }
            } @else if diagnosis.verdict == Verdict::Ambiguous {
                ul { @for set in &diagnosis.alternatives { li { (alternative(diagnosis, set)) } } }
            }
            p class="notes" { (gaps(diagnosis)) }
        }
    }
}

fn verdict(diagnosis: &Diagnosis) -> String {
    let probability = diagnosis.best().map(|best| probability(best.probability));
    match diagnosis.verdict {
        Verdict::Explained => {
            format!("Explained, with a probability of {}.", probability.unwrap_or_default())
        }
        Verdict::MostlyExplained => {
            let rest = diagnosis.remainder.as_ref().map(|rest| percent(rest.gap));
            format!(
                "Mostly explained, with a probability of {}. A gap of {} is left that is not noise.",
                probability.unwrap_or_default(),
                rest.unwrap_or_default()
            )
        }
        Verdict::Ambiguous => "Ambiguous: the readings do not distinguish these causes.".to_owned(),
        Verdict::Unexplained => "Not explained by any effect of the catalogue.".to_owned(),
        Verdict::None => {
            format!("Scan and simulation differ by {} only.", diagnosis.nothing_but())
        }
    }
}

/// A probability in percent, without a certainty that no data give.
fn probability(probability: f64) -> String {
    match probability {
        above if above > 0.999 => "more than 99.9\u{a0}%".to_owned(),
        _ => format!("{}\u{a0}%", fixed(100.0 * probability, 1)),
    }
}

/// An effect in words, and its share of the gap.
fn share(diagnosis: &Diagnosis, effect: EffectId) -> Markup {
    let step = diagnosis.waterfall.iter().find(|step| step.effect == Some(effect));
    html! {
        (effect.as_cause())
        @if let Some(step) = step { ": " (percent(step.share)) " of the squared gap" }
    }
}

/// The share of a part that is no effect, where it is worth a line.
fn share_of(diagnosis: &Diagnosis, part: WaterfallPart) -> Option<f64> {
    let step = diagnosis.waterfall.iter().find(|step| step.part == part)?;
    (step.share >= LEAST_SHARE).then_some(step.share)
}

fn alternative(diagnosis: &Diagnosis, set: &[EffectId]) -> String {
    let causes: Vec<&str> = set.iter().map(|effect| effect.as_cause()).collect();
    let causes = causes.join(" and ");
    match diagnosis.ranked.iter().find(|candidate| candidate.effects == set) {
        Some(candidate) => format!("{causes}: {}", probability(candidate.probability)),
        None => causes,
    }
}

fn gaps(diagnosis: &Diagnosis) -> String {
    let before = percent(diagnosis.gap_before);
    let noise = percent(diagnosis.noise_floor);
    match diagnosis.best().filter(|best| !best.effects.is_empty()) {
        Some(best) if diagnosis.verdict != Verdict::None => format!(
            "The gap falls from {before} to {} of the scan's rms; noise alone leaves {noise}.",
            percent(best.gap_after)
        ),
        _ => format!("The gap is {before} of the scan's rms; noise alone leaves {noise}."),
    }
}
