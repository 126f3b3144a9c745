//! The page of a diagnosis: one HTML file that needs nothing beside it.

use maud::{Markup, html};

use super::super::answer::headline_of_diagnosis;
use super::super::context::ReportContext;
use super::super::html::{document, facts, navigation, section};
use super::super::page::{STYLE, pages, registration, warnings};
use super::super::provenance;
use super::super::words::{listed, sentence};
use super::figures::DiagnosisFigures;
use super::{
    JSON_NAME, TEXT_NAME, causes, gap_budget, guide, heights, open_questions, residual_structure,
};
use fieldgap_comparison::NoiseSource;
use fieldgap_diagnosis::{Diagnosis, EffectId, ElementsAccount, StatedFinding, Verdict, joined};
use fieldgap_text::{ABSENT, percent, significant};

/// The styles of this page alone.
const OWN_STYLE: &str = include_str!("style.css");

/// The page of a diagnosis, with the pictures drawn of it.
pub(super) fn page(
    context: &ReportContext,
    diagnosis: &Diagnosis,
    figures: &DiagnosisFigures,
) -> String {
    let sections = [
        ("verdict", "Verdict", Some(verdict(diagnosis))),
        ("causes", "Causes", Some(causes::possible(diagnosis))),
        ("elements", "What the elements explain", diagnosis.elements.as_ref().map(elements)),
        ("waterfall", "Gap budget", gap_budget::waterfall(figures)),
        ("heights", "Before and after", Some(heights::heights(diagnosis, figures))),
        ("where", "Where the gap lies", Some(gap_budget::shares(diagnosis))),
        ("structure", "Structure in the residual", residual_structure::tests(diagnosis)),
        ("ruled-out", "Causes ruled out", causes::ruled_out(diagnosis)),
        ("open", "What these data do not determine", open_questions::undetermined(diagnosis)),
        ("next", "Next measurement", open_questions::next_measurement(diagnosis)),
        ("guide", "How to read this page", Some(guide::guide())),
        ("registration", "Registration and noise", Some(registration_and_noise(diagnosis))),
    ];
    let present: Vec<(&str, &str, Markup)> = sections
        .into_iter()
        .filter_map(|(id, heading, content)| Some((id, heading, content?)))
        .collect();
    let ends = [("set-up", "Set-up"), ("provenance", "Provenance")];
    let entries = present.iter().map(|(id, heading, _)| (*id, *heading)).chain(ends);
    let body = html! {
        (header(diagnosis))
        (pages(context))
        (navigation(entries))
        (warnings(context))
        main {
            @for (id, heading, content) in &present { (section(id, heading, content)) }
            (provenance::set_up(context, Some(diagnosis.points)))
            (provenance::provenance(context, &[TEXT_NAME, JSON_NAME]))
        }
    };
    document(&format!("{}: diagnosis", context.title), &[STYLE, OWN_STYLE], &body)
}

fn header(diagnosis: &Diagnosis) -> Markup {
    let scans = match diagnosis.scans.len() {
        0 | 1 => format!("scan {} differs", diagnosis.scan),
        _ => format!("scans {} differ", listed(&diagnosis.scans)),
    };
    html! {
        header class="diagnosis" {
            h1 { (headline_of_diagnosis(diagnosis)) }
            p class="subtitle" {
                "Why " (scans) " from the " (diagnosis.simulator.to_string()) " simulation. Diagnosed from "
                (diagnosis.points) " readings."
            }
        }
    }
}

/// The verdict and the numbers that support it.
fn verdict(diagnosis: &Diagnosis) -> Markup {
    let sets = |sets: &[Vec<EffectId>]| {
        let sets: Vec<String> = sets.iter().map(|set| joined(set, " + ")).collect();
        sets.join(", or ")
    };
    let words = match diagnosis.verdict {
        Verdict::Explained => format!(
            "Explained by {}. The alternatives do not explain the gap.",
            joined(&diagnosis.effects, " + ")
        ),
        Verdict::MostlyExplained => format!(
            "Mostly explained by {}. The alternatives do not explain the gap. A small part of it is left that is not noise.",
            joined(&diagnosis.effects, " + ")
        ),
        Verdict::Ambiguous => format!(
            "Ambiguous. These causes explain the readings equally well: {}.",
            sets(&diagnosis.alternatives)
        ),
        Verdict::Unexplained => {
            "Unexplained. There is a gap, and no effect in the catalogue explains it.".to_owned()
        }
        Verdict::None => format!("No gap beyond {}.", diagnosis.nothing_but()),
    };
    let best = diagnosis.best().filter(|best| !best.effects.is_empty());
    let with = best.map_or("after correction".to_owned(), |best| format!("with {}", best.name()));
    let tiles = [
        (percent(diagnosis.gap_before), "gap of the nominal simulation".to_owned()),
        (best.map_or(ABSENT.to_owned(), |best| percent(best.gap_after)), format!("gap {with}")),
        (percent(diagnosis.noise_floor), "gap from noise alone".to_owned()),
    ];
    html! {
        div class="verdict" { p { (words) } }
        p { (diagnosis.sentence) }
        dl class="tiles" {
            @for (number, words) in tiles { div { dt { (words) } dd { (number) } } }
        }
        div class="notes" {
            p {
                "A gap is the rms of scan minus simulation, divided by the rms of the scan, over all readings. "
                (held_out(diagnosis))
            }
            @if let Some(within) = &diagnosis.uncertainty {
                p {
                    "Within its stated uncertainty the set-up departs so, beside the best candidate (without any candidate the gap would be "
                    (percent(within.gap)) "):"
                }
                ul {
                    @for StatedFinding { sentence, in_uncertainties, .. } in &within.departures {
                        li { (sentence) " (" (significant(*in_uncertainties, 2)) " of the standard uncertainty)" }
                    }
                }
            }
            @if let Some(rest) = &diagnosis.remainder {
                p {
                    "Left beyond noise: " (percent(rest.gap)) ", which is " (percent(rest.share))
                    " of the squared gap beyond noise."
                    @if !rest.looks_like.is_empty() {
                        " It has structure: " (rest.looks_like.join("; ")) "."
                    }
                }
            }
        }
    }
}

/// What each element emits explains, where no effect does.
fn elements(account: &ElementsAccount) -> Markup {
    html! {
        p { "Rms difference relative to the rms of the readings, " (account.of_what()) "." }
        (facts(account.steps().map(|(name, gap)| (name, html! { (percent(gap)) }))))
        @for words in account.sentences() { p { (words) } }
        ul { @for words in &account.undetermined { li { (words) } } }
    }
}

/// The check on readings that no fit used.
fn held_out(diagnosis: &Diagnosis) -> String {
    let before = percent(diagnosis.gap_before_held_out);
    let of_what = diagnosis.held_out_of_what();
    let Some(best) = diagnosis.best().filter(|best| !best.effects.is_empty()) else {
        return format!("Over a fifth of the {of_what}, kept out of every fit, it is {before}.");
    };
    format!(
        "Check: over a fifth of the {of_what}, kept out of the fit, it falls from {before} to {}, which explains {} of its square \
         beyond noise.",
        percent(best.gap_after_held_out),
        percent(diagnosis.explained_fraction)
    )
}

/// How the scan was registered to the simulation, and its noise.
fn registration_and_noise(diagnosis: &Diagnosis) -> Markup {
    let noise = &diagnosis.noise;
    let source = match noise.source {
        NoiseSource::Repeats => "points measured several times",
        NoiseSource::SilentReadings => "readings with the array silent",
        NoiseSource::Maps => "what the maps hold beyond the wavenumber, as nothing was read twice",
        NoiseSource::Residual => "the residual of the simulation, an upper bound",
    };
    let level = format!("{} {}", significant(noise.additive, 3), diagnosis.reading_unit);
    html! {
        (registration::registration(&diagnosis.registration, &diagnosis.reading_unit))
        h3 { "Noise of one reading" }
        (facts([
            ("Constant part", html! { (level.trim_end()) }),
            ("Part proportional to the level", html! { (percent(noise.multiplicative)) }),
            ("Estimated from", html! { (sentence(source)) }),
        ]))
    }
}
