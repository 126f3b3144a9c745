//! Where it all comes from: the set-up, the software, the input files.

use maud::{Markup, html};

use super::context::ReportContext;
use super::html::{facts, section};

/// The set-up as the caller describes it, and how many readings were used.
pub(super) fn set_up(context: &ReportContext, readings: Option<usize>) -> Markup {
    let described = context.set_up.iter().map(|(label, value)| (label.as_str(), html! { (value) }));
    let readings = readings.map(|readings| ("Readings compared", html! { (readings) }));
    section("set-up", "Set-up", &facts(described.chain(readings)))
}

/// What the page was made with and from, so that it can be made again; `files` hold its figures.
pub(super) fn provenance(context: &ReportContext, files: &[&str]) -> Markup {
    let software = ("Software", html! { (context.software) });
    let files = html! {
        @for (place, name) in files.iter().enumerate() {
            @if place > 0 { ", " }
            a href=(name) { (name) }
        }
    };
    let files = ("The figures as files", files);
    let inputs =
        context.inputs.iter().map(|file| (file.name.as_str(), html! { code { (file.sha256) } }));
    let content = html! {
        p {
            "The same files and the same software give this page again, byte for byte. Of the files that the figures \
             come from, the SHA-256:"
        }
        (facts([software, files].into_iter().chain(inputs)))
    };
    section("provenance", "Provenance", &content)
}
