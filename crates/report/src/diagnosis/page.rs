//! The page of a diagnosis: one HTML file that needs nothing beside it.

use maud::{Markup, html};

use super::super::context::ReportContext;
use super::super::html::{document, facts, navigation, section};
use super::super::page::{STYLE, registration, warnings};
use super::super::provenance;
use super::super::words::{listed, sentence};
use super::figures::DiagnosisFigures;
use super::{JSON_NAME, TEXT_NAME, causes, guide, heights, outlook, remains};
use fieldgap_comparison::NoiseSource;
use fieldgap_diagnosis::{Diagnosis, EffectId, Verdict, joined};
use fieldgap_text::{ABSENT, percent, significant};

/// What this page has beyond the others.
const OWN_STYLE: &str = include_str!("style.css");

/// The page of a diagnosis, with the pictures drawn of it.
pub(super) fn page(
    context: &ReportContext,
    diagnosis: &Diagnosis,
    figures: &DiagnosisFigures,
) -> String {
    let sections = [
        ("verdict", "Verdict", Some(verdict(diagnosis))),
        ("causes", "Causes", Some(causes::in_question(diagnosis, figures))),
        ("waterfall", "What explains how much", remains::waterfall(figures)),
        ("heights", "Before and after", Some(heights::heights(diagnosis, figures))),
        ("where", "Where the gap lies", Some(remains::whereabouts(diagnosis))),
        ("left", "What is left", remains::structure(diagnosis)),
        ("ruled-out", "What is ruled out", causes::ruled_out(diagnosis)),
        ("open", "What these data cannot tell", outlook::open(diagnosis)),
        ("next", "The next measurement", outlook::next(diagnosis)),
        ("guide", "How to read this page", Some(guide::guide())),
        ("registration", "How the scan was laid on the simulation", Some(laid(diagnosis))),
    ];
    let present: Vec<(&str, &str, Markup)> = sections
        .into_iter()
        .filter_map(|(id, heading, content)| Some((id, heading, content?)))
        .collect();
    let ends = [("set-up", "Set-up"), ("provenance", "Provenance")];
    let entries = present.iter().map(|(id, heading, _)| (*id, *heading)).chain(ends);
    let body = html! {
        (header(diagnosis))
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
            h1 { (diagnosis.sentence) }
            p class="subtitle" {
                "Why " (scans) " from the " (diagnosis.simulator.to_string()) " simulation: diagnosed from "
                (diagnosis.points) " readings"
            }
        }
    }
}

/// The verdict and the numbers that it rests on.
fn verdict(diagnosis: &Diagnosis) -> Markup {
    let sets = |sets: &[Vec<EffectId>]| {
        let sets: Vec<String> = sets.iter().map(|set| joined(set, " + ")).collect();
        sets.join(", or ")
    };
    let words = match diagnosis.verdict {
        Verdict::Explained => format!(
            "Explained by {}: this explains the gap, and its rivals do not.",
            joined(&diagnosis.effects, " + ")
        ),
        Verdict::Ambiguous => format!(
            "Ambiguous: {} explain these readings equally well.",
            sets(&diagnosis.alternatives)
        ),
        Verdict::Unexplained => {
            "Unexplained: there is a gap, and no effect of the catalogue explains it.".to_owned()
        }
        Verdict::None => "None: there is no gap beyond noise.".to_owned(),
    };
    let best = diagnosis.best().filter(|best| !best.effects.is_empty());
    let with = best.map_or("corrected".to_owned(), |best| format!("with {}", best.name()));
    let tiles = [
        (percent(diagnosis.gap_before_held_out), "gap of the simulation as believed".to_owned()),
        (
            best.map_or(ABSENT.to_owned(), |best| percent(best.gap_after_held_out)),
            format!("gap {with}"),
        ),
        (percent(diagnosis.noise_floor), "what noise alone leaves".to_owned()),
        (
            percent(diagnosis.explained_fraction),
            "of the squared gap beyond noise explained".to_owned(),
        ),
    ];
    html! {
        div class="verdict" { p { (words) } }
        dl class="tiles" {
            @for (number, words) in tiles { div { dt { (words) } dd { (number) } } }
        }
        div class="notes" {
            p {
                "Gaps are the rms of scan less simulation over the rms of the scan, over readings that were kept out of \
                 every fit."
            }
        }
    }
}

/// How the scan was brought to the simulation's coordinates, and what its noise is.
fn laid(diagnosis: &Diagnosis) -> Markup {
    let noise = &diagnosis.noise;
    let source = match noise.source {
        NoiseSource::Repeats => "points that were measured several times",
        NoiseSource::SilentReadings => "readings with the array silent",
        NoiseSource::Residual => "what the simulation leaves, so that it is an upper bound",
    };
    let level = format!("{} {}", significant(noise.additive, 3), diagnosis.reading_unit);
    html! {
        (registration::registration(&diagnosis.registration, &diagnosis.reading_unit))
        h3 { "Noise of one reading" }
        (facts([
            ("At every level", html! { (level.trim_end()) }),
            ("In proportion to the level", html! { (percent(noise.multiplicative)) }),
            ("Known from", html! { (sentence(source)) }),
        ]))
    }
}
