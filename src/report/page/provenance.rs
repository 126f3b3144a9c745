//! Where it all comes from: the set-up, the software, the input files.

use super::super::context::ReportContext;
use super::super::tables::{CSV_NAME, JSON_NAME, TEXT_NAME};
use super::html::{Html, element, facts, link, paragraph, section, text};
use crate::gap::Comparison;

/// The set-up as the caller describes it.
pub(super) fn set_up(context: &ReportContext, comparisons: &[Comparison]) -> Html {
    let scan = comparisons
        .iter()
        .take(1)
        .map(|comparison| (text("Readings compared"), text(&comparison.points.to_string())));
    let rows = context.set_up.iter().map(|(label, value)| (text(label), text(value)));
    section("set-up", "Set-up", [facts(rows.chain(scan))])
}

/// What the page was made with and from, so that it can be made again.
pub(super) fn provenance(context: &ReportContext) -> Html {
    let code = |words: &str| element("code", &[], [text(words)]);
    let software = (text("Software"), text(&context.software));
    let [table, csv, json] = [TEXT_NAME, CSV_NAME, JSON_NAME].map(|name| link(name, name));
    let files =
        (text("The figures as files"), Html::all([table, text(", "), csv, text(", "), json]));
    let inputs = context.inputs.iter().map(|file| (text(&file.name), code(&file.sha256)));
    section(
        "provenance",
        "Provenance",
        [
            paragraph(
                "The same files and the same software give this page again, byte for byte. Of the files that the figures come from, the SHA-256:",
            ),
            facts([software, files].into_iter().chain(inputs)),
        ],
    )
}
