//! The page of a closed loop: one HTML file that needs nothing beside it.

use maud::{Markup, html};

use super::super::context::ReportContext;
use super::super::html::{document, facts, glossary, navigation, section};
use super::super::page::{STYLE, pages, warnings};
use super::super::provenance;
use super::LoopOfRounds;
use super::figures::{RoundsFigures, verifications};
use super::set::in_words;
use super::tables;
use fieldgap_closed_loop::{End, ROUNDS_FILE, Round};
use fieldgap_diagnosis::Verdict;
use fieldgap_text::fixed;

/// The page, with its pictures.
pub(super) fn page(
    context: &ReportContext,
    of: &LoopOfRounds<'_>,
    figures: &RoundsFigures,
) -> String {
    let with_table =
        |figure: &Option<super::super::figure::Figure>, caption: &str, table: Markup| {
            let picture = figure.as_ref()?.markup(&html! { p { (caption) } });
            Some(html! { (picture) (table) })
        };
    let sections = [
        ("end", "How it ended", Some(end(of))),
        ("places", "Where it measured", Some(places(of, figures))),
        (
            "probabilities",
            "How the probabilities moved",
            with_table(&figures.probabilities, PROBABILITIES, tables::probabilities(of)),
        ),
        (
            "information",
            "Expected and obtained information",
            with_table(&figures.information, INFORMATION, tables::bits(of)),
        ),
        ("reasons", "Why it went on", Some(reasons(of))),
        ("verification", "Verification on fresh readings", verification(of, figures)),
        ("guide", "How to read this page", Some(guide())),
    ];
    let present: Vec<(&str, &str, Markup)> = sections
        .into_iter()
        .filter_map(|(id, heading, content)| Some((id, heading, content?)))
        .collect();
    let ends = [("set-up", "Set-up"), ("provenance", "Provenance")];
    let entries = present.iter().map(|(id, heading, _)| (*id, *heading)).chain(ends);
    let body = html! {
        header {
            h1 { (headline(of)) }
            p class="subtitle" {
                "Rounds of " (of.record.setup.name) ": the rig chose its readings by what they would tell."
            }
        }
        (pages(context))
        (navigation(entries))
        (warnings(context))
        main {
            @for (id, heading, content) in &present { (section(id, heading, content)) }
            (provenance::set_up(context, Some(of.record.samples.len())))
            (provenance::provenance(context, &[ROUNDS_FILE]))
        }
    };
    document(&format!("{}: rounds", context.title), &[STYLE], &body)
}

const PROBABILITIES: &str = "Each column stands for the readings so far. Rivals share it. Black is the part of causes outside the \
     catalogue: 2 % in general, all of it where no set explains the gap.";

const INFORMATION: &str = "Expected: what the readings of a round would tell about which set holds, on average over what they may \
     read. Obtained: how far they moved the probabilities.";

const PLACES: &str = "A round of fresh readings has triangles. They are drawn at random, and nothing is fitted to them.";

const FLOWN: &str = "Diamonds: read in motion.";

const GAPS: &str = "Error bars: one standard error. Nothing of this was fitted to these readings.";

/// What was found, by which effort.
fn headline(of: &LoopOfRounds<'_>) -> String {
    let effort = format!(
        "{} readings in {} minutes",
        of.record.samples.len(),
        fixed(of.duration_s() / 60.0, 1)
    );
    let last = of.rounds.last();
    let named = last.map_or_else(Vec::new, |last| last.named.clone());
    let sets: Vec<String> = named.iter().map(|set| in_words(set)).collect();
    match last.and_then(|last| last.end) {
        None => format!("Not yet ended after {effort}"),
        Some(End::Verified) => {
            capital(&format!("{}, verified on fresh readings, after {effort}", sets.join(", ")))
        }
        Some(End::Explained) => capital(&format!("{}, after {effort}", sets.join(", "))),
        Some(End::NoGap) => format!("No gap beyond noise, after {effort}"),
        Some(End::Inseparable) => {
            capital(&format!("{}: not told apart after {effort}", sets.join(" or ")))
        }
        Some(End::Unexplained) => format!("Unexplained after {effort}"),
        Some(End::Readings | End::Time | End::Sounding) => {
            format!("Ended by the budget of the plan, after {effort}")
        }
    }
}

fn capital(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().into_iter().flat_map(char::to_uppercase).chain(letters).collect()
}

fn end(of: &LoopOfRounds<'_>) -> Markup {
    let samples = &of.record.samples;
    let reason = of.rounds.last().map_or("", |last| last.reason.as_str());
    let limit = |longest_s: Option<f64>| match longest_s {
        Some(longest_s) => format!(" of {} allowed", tables::minutes(longest_s)),
        None => ", no limit".to_owned(),
    };
    let settings = of.settings;
    let minutes = tables::minutes(of.duration_s());
    let sounding = tables::minutes(tables::sounding_s(samples));
    html! {
        div class="verdict" { p { (reason) } }
        (facts([
            ("Rounds with readings", html! { (of.measured().count()) }),
            ("Readings", html! { (samples.len()) " of " (settings.most_readings) " allowed" }),
            ("Minutes on the robot's clock", html! { (minutes) (limit(settings.longest_s)) }),
            ("Minutes with the array driven", html! { (sounding) (limit(settings.longest_sounding_s)) }),
        ]))
    }
}

fn places(of: &LoopOfRounds<'_>, figures: &RoundsFigures) -> Markup {
    html! {
        (figures.places.markup(&html! { p { (PLACES) @if of.flies() { " " (FLOWN) } } }))
        (tables::rounds(of))
        (tables::drives(of))
    }
}

/// The decisions as they were logged.
fn reasons(of: &LoopOfRounds<'_>) -> Markup {
    let verdict = |round: &Round| match round.verdict {
        None => "",
        Some(Verdict::Explained) => " One set explains the readings.",
        Some(Verdict::MostlyExplained) => " One set explains most of the gap.",
        Some(Verdict::Ambiguous) => " Several sets explain the readings alike.",
        Some(Verdict::Unexplained) => " No set explains the readings.",
        Some(Verdict::None) => " Nothing differs beyond noise.",
    };
    let sets = |round: &Round| -> String {
        let sets: Vec<String> = round.named.iter().map(|set| in_words(set)).collect();
        if sets.is_empty() { String::new() } else { format!(" Named: {}.", sets.join("; ")) }
    };
    html! {
        ol start="0" {
            @for round in of.rounds {
                li {
                    strong { (capital(tables::purpose(round.purpose))) ". " }
                    (round.reason) (verdict(round)) (sets(round))
                }
            }
        }
    }
}

fn verification(of: &LoopOfRounds<'_>, figures: &RoundsFigures) -> Option<Markup> {
    let picture = figures.verification.as_ref()?;
    Some(html! {
        (picture.markup(&html! { p { (GAPS) } }))
        (tables::gaps(of))
        @for (round, _) in verifications(of) {
            @if let Some(cure) = &round.cure {
                h3 { "Before round " (round.round) }
                (tables::cure(cure))
            }
        }
    })
}

fn guide() -> Markup {
    glossary([
        (
            "Corrected set-up",
            "The set-up files of the scan, corrected by the named cause before the fresh readings were taken. Their simulation has the \
             gain, the near field and the small shift of the earlier readings.",
        ),
        (
            "Cause as fitted",
            "The simulation as believed with the effects added, all their numbers as fitted to the earlier readings.",
        ),
        (
            "Residual / noise",
            "Root mean square of the residual in standard deviations of a reading. A cause holds up to 1.2, or two standard errors above \
             one where the readings are few.",
        ),
        (
            "File from fit",
            "How far the simulations with the corrected set-up and with the cause as fitted lie apart, in standard deviations of a reading. \
             Up to 0.5 they are one.",
        ),
        (
            "Obtained information",
            "Kullback-Leibler divergence of the probabilities after a round from those before, of which a fifth is dealt out evenly.",
        ),
    ])
}
