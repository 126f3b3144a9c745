//! The page: one HTML file that needs nothing beside it.

mod guide;
mod pictures;
pub(super) mod registration;
mod table;

use super::context::ReportContext;
use super::figures::Figures;
use super::html::{self, Html, element, link, paragraph, section, text};
use super::provenance;
use super::tables::{CSV_NAME, JSON_NAME, TEXT_NAME};
use super::verdict;
use super::words::listed;
use fieldgap_comparison::Comparison;

/// The style sheet of all pages.
pub(super) const STYLE: &str = include_str!("style.css");

/// The page of some comparisons, of which there is at least one, with the pictures drawn of them.
pub(super) fn page(
    context: &ReportContext,
    comparisons: &[Comparison],
    figures: &Figures,
) -> String {
    let curves = pictures::curves(figures);
    let mut main = vec![findings(comparisons), guide::guide()];
    main.push(pictures::heights(comparisons, figures));
    main.extend(curves.clone());
    main.extend(comparisons.iter().map(|comparison| simulator(comparison, comparisons)));
    main.push(provenance::set_up(context, comparisons.first().map(|comparison| comparison.points)));
    main.push(provenance::provenance(context, &[TEXT_NAME, CSV_NAME, JSON_NAME]));
    let body = Html::all([
        header(context, comparisons),
        navigation(comparisons, curves.is_some()),
        warnings(context),
        element("main", &[], main),
    ]);
    Html::document(&context.title, &[STYLE], body)
}

/// Anchor of what belongs to a simulator.
fn anchor(comparison: &Comparison) -> String {
    format!("simulator-{}", comparison.simulator)
}

fn header(context: &ReportContext, comparisons: &[Comparison]) -> Html {
    let simulators: Vec<String> =
        comparisons.iter().map(|comparison| comparison.simulator.to_string()).collect();
    let scan = comparisons.first();
    let subtitle = format!(
        "Scan {} against its simulation ({}), {} readings",
        scan.map_or("", |comparison| comparison.scan_name.as_str()),
        listed(&simulators),
        scan.map_or(0, |comparison| comparison.points),
    );
    element(
        "header",
        &[],
        [
            element("h1", &[], [text(&context.title)]),
            element("p", &[("class", "subtitle")], [text(&subtitle)]),
        ],
    )
}

fn navigation(comparisons: &[Comparison], curves: bool) -> Html {
    let mut entries = vec![
        link("#findings", "Findings"),
        link("#guide", "How to read this page"),
        link("#heights", "Height by height"),
    ];
    if curves {
        entries.push(link("#curves", "Against height"));
    }
    entries.extend(comparisons.iter().map(|comparison| {
        link(&format!("#{}", anchor(comparison)), &format!("Figures: {}", comparison.simulator))
    }));
    entries.push(link("#set-up", "Set-up"));
    entries.push(link("#provenance", "Provenance"));
    let items = entries.into_iter().map(|entry| element("li", &[], [entry]));
    element("nav", &[("aria-label", "Sections")], [element("ul", &[], items)])
}

/// What a reader has to know first.
pub(super) fn warnings(context: &ReportContext) -> Html {
    if context.warnings.is_empty() {
        return Html::default();
    }
    let paragraphs = context.warnings.iter().map(|warning| paragraph(warning));
    element("div", &[("class", "warnings"), ("role", "note")], paragraphs)
}

fn findings(comparisons: &[Comparison]) -> Html {
    let mut content = Vec::new();
    content.extend(verdict::closest(comparisons).map(|sentence| paragraph(&sentence)));
    for comparison in comparisons {
        let heading = format!("Against the {} simulation", comparison.simulator);
        content.push(element("h3", &[], [text(&heading)]));
        content.extend(verdict::sentences(comparison).iter().map(|sentence| paragraph(sentence)));
    }
    section("findings", "Findings", [element("div", &[("class", "verdict")], content)])
}

/// Table and registration of one simulator, with the way to the others.
fn simulator(comparison: &Comparison, all: &[Comparison]) -> Html {
    let mut content = table::tables(comparison);
    content.extend(registration::registration(&comparison.registration, &comparison.reading_unit));
    let others: Vec<&Comparison> =
        all.iter().filter(|other| other.simulator != comparison.simulator).collect();
    if !others.is_empty() {
        let links = others.iter().flat_map(|other| {
            [text(" "), link(&format!("#{}", anchor(other)), &other.simulator.to_string())]
        });
        let words = std::iter::once(text("The same scan against other simulations:")).chain(links);
        content.push(element("p", &[], words));
    }
    let heading = format!("Figures against the {} simulation", comparison.simulator);
    section(&anchor(comparison), &heading, content)
}
