//! Where it all comes from: the set-up, the software, the input files.

use super::context::ReportContext;
use super::html::{Html, element, facts, link, paragraph, section, text};

/// The set-up as the caller describes it.
pub(super) fn set_up(context: &ReportContext, readings: Option<usize>) -> Html {
    let scan = readings.map(|readings| (text("Readings compared"), text(&readings.to_string())));
    let rows = context.set_up.iter().map(|(label, value)| (text(label), text(value)));
    section("set-up", "Set-up", [facts(rows.chain(scan))])
}

/// What the page was made with and from, so that it can be made again; `files` hold its figures.
pub(super) fn provenance(context: &ReportContext, files: &[&str]) -> Html {
    let code = |words: &str| element("code", &[], [text(words)]);
    let software = (text("Software"), text(&context.software));
    let files = files
        .iter()
        .enumerate()
        .flat_map(|(place, name)| [text(if place == 0 { "" } else { ", " }), link(name, name)]);
    let files = (text("The figures as files"), Html::all(files));
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
