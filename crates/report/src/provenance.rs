//! The set-up, the software and the input files.

use maud::{Markup, html};

use super::context::ReportContext;
use super::html::{facts, section};

/// The set-up as the caller describes it, and how many readings were used.
pub(super) fn set_up(context: &ReportContext, readings: Option<usize>) -> Markup {
    let described = context.set_up.iter().map(|(label, value)| (label.as_str(), html! { (value) }));
    let readings = readings.map(|readings| ("Readings compared", html! { (readings) }));
    section("set-up", "Set-up", &facts(described.chain(readings)))
}

/// The software, the data files and the input files, so that the page can be made again.
pub(super) fn provenance(context: &ReportContext, files: &[&str]) -> Markup {
    let software = ("Software", html! { (context.software) });
    let files = html! {
        @for (place, name) in files.iter().enumerate() {
            @if place > 0 { ", " }
            a href=(name) { (name) }
        }
    };
    let files = ("Data files", files);
    let inputs =
        context.inputs.iter().map(|file| (file.name.as_str(), html! { code { (file.sha256) } }));
    let content = html! {
        p {
            "The same files and the same software reproduce this page byte for byte. The SHA-256 digests of the input \
             files are given."
        }
        (facts([software, files].into_iter().chain(inputs)))
    };
    section("provenance", "Provenance", &content)
}
