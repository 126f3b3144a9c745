//! The page: one HTML file that needs nothing beside it.

mod guide;
mod levels;
mod phases;
mod pictures;
pub(super) mod registration;
mod table;

use maud::{Markup, html};

use super::answer::{Cause, answer, headline};
use super::context::ReportContext;
use super::figures::Figures;
use super::html::{self, navigation, section};
use super::provenance;
use super::tables::{CSV_NAME, JSON_NAME, LEVELS_NAME, TEXT_NAME};
use super::verdict;
use super::words::listed;
use fieldgap_comparison::Comparison;

/// The style sheet of all pages.
pub(super) const STYLE: &str = include_str!("style.css");

/// The page of some comparisons, of which there is at least one, with the pictures drawn of them.
pub(super) fn page(
    context: &ReportContext,
    comparisons: &[Comparison],
    cause: Option<Cause<'_>>,
    figures: &Figures,
) -> String {
    let curves = pictures::curves(figures);
    let phases = phases::phases(comparisons, figures);
    let readings = comparisons.first().map(|comparison| comparison.points);
    let body = html! {
        (header(comparisons, cause))
        (pages(context))
        (warnings(context))
        main {
            @if let Some(first) = comparisons.first() { (answer(first, cause, figures)) }
            (sections(comparisons, phases.is_some(), curves.is_some()))
            (findings(comparisons))
            (pictures::heights(comparisons, figures))
            @if let Some(phases) = phases { (phases) }
            @if let Some(curves) = curves { (curves) }
            @for comparison in comparisons { (simulator(comparison, comparisons)) }
            (guide::guide())
            (provenance::set_up(context, readings))
            (provenance::provenance(context, &data_files(comparisons)))
        }
    };
    html::document(&context.title, &[STYLE], &body)
}

/// The names of the data files.
fn data_files(comparisons: &[Comparison]) -> Vec<&'static str> {
    let has_levels = comparisons.iter().any(|comparison| comparison.levels.is_some());
    let levels = has_levels.then_some(LEVELS_NAME);
    [TEXT_NAME, CSV_NAME, JSON_NAME].into_iter().chain(levels).collect()
}

/// Anchor of the section of a simulator.
fn anchor(comparison: &Comparison) -> String {
    format!("simulator-{}", comparison.simulator)
}

fn header(comparisons: &[Comparison], cause: Option<Cause<'_>>) -> Markup {
    let diagnosis = cause.map(|cause| cause.diagnosis);
    let simulators: Vec<String> =
        comparisons.iter().map(|comparison| comparison.simulator.to_string()).collect();
    let scan = comparisons.first();
    html! {
        header {
            @if let Some(first) = scan { h1 { (headline(first, diagnosis)) } }
            p class="subtitle" {
                "Scan " (scan.map_or("", |comparison| comparison.scan_name.as_str()))
                " compared with its simulation (" (listed(&simulators)) "), "
                (scan.map_or(0, |comparison| comparison.points)) " readings"
            }
        }
    }
}

fn sections(comparisons: &[Comparison], phases: bool, curves: bool) -> Markup {
    let simulators: Vec<(String, String)> = comparisons
        .iter()
        .map(|comparison| (anchor(comparison), format!("Tables: {}", comparison.simulator)))
        .collect();
    let pictures = [("findings", "Findings"), ("heights", "Maps at each height")];
    let phases = phases.then_some(("phases", "Phases"));
    let curves = curves.then_some(("curves", "Curves over height"));
    let figures = simulators.iter().map(|(id, heading)| (id.as_str(), heading.as_str()));
    let ends =
        [("guide", "How to read this page"), ("set-up", "Set-up"), ("provenance", "Provenance")];
    navigation(pictures.into_iter().chain(phases).chain(curves).chain(figures).chain(ends))
}

/// The other pages of the record.
pub(super) fn pages(context: &ReportContext) -> Markup {
    html! {
        @if !context.pages.is_empty() {
            nav class="pages" aria-label="Pages" {
                ul { @for (title, address) in &context.pages { li { a href=(address) { (title) } } } }
            }
        }
    }
}

/// What a reader has to know before the findings.
pub(super) fn warnings(context: &ReportContext) -> Markup {
    html! {
        @if !context.warnings.is_empty() {
            div class="warnings" role="note" { @for warning in &context.warnings { p { (warning) } } }
        }
    }
}

fn findings(comparisons: &[Comparison]) -> Markup {
    let content = html! {
        div class="verdict" {
            @if let Some(sentence) = verdict::best_simulator(comparisons) { p { (sentence) } }
            @for comparison in comparisons {
                h3 { "Compared with the " (comparison.simulator.to_string()) " simulation" }
                @for sentence in verdict::sentences(comparison) { p { (sentence) } }
            }
        }
    };
    section("findings", "Findings", &content)
}

/// Table and registration of one simulator, with links to the others.
fn simulator(comparison: &Comparison, all: &[Comparison]) -> Markup {
    let others: Vec<&Comparison> =
        all.iter().filter(|other| other.simulator != comparison.simulator).collect();
    let content = html! {
        (table::tables(comparison))
        (levels::levels(comparison))
        (registration::registration(&comparison.registration, &comparison.reading_unit))
        @if !others.is_empty() {
            p {
                "The same scan compared with other simulations:"
                @for other in others {
                    " " a href={ "#" (anchor(other)) } { (other.simulator.to_string()) }
                }
            }
        }
    };
    let heading = format!("Tables: scan and {} simulation", comparison.simulator);
    section(&anchor(comparison), &heading, &content)
}
