//! The page of interactive maps: zoom, values under the cursor, heights, cross-sections. It needs no network.
//!
//! Plotly draws it (MIT licence). The page holds the part of its script for maps and curves, 0.6 MB packed, with which it opens, and the whole
//! script, 1.9 MB packed, which is unpacked when something is to be drawn in three dimensions. A map takes 12 bytes a point, and is unpacked
//! when it is first needed.

mod data;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};

use self::data::{Maps, stride};
use super::context::ReportContext;
use super::html::document;
use super::page::{STYLE, pages};
use super::simulated_map::SimulatedMap;
use fieldgap_acoustics::Simulator;
use fieldgap_comparison::Comparison;

/// Name of the page.
pub(super) const EXPLORE_NAME: &str = "explore.html";

const OWN_STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("explore.js");

/// The part of Plotly's script that draws maps and curves, gzip: plotly.js-cartesian-dist-min 3.0.1. It runs three times as fast as the whole, so
/// that the page opens with it.
const PLOTLY_FLAT: &[u8] = include_bytes!("plotly-cartesian.min.js.gz");

/// The whole script of Plotly, gzip, for what is drawn in three dimensions.
const PLOTLY: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/plotly.js.gz"));

/// The page of a record; `None` if no height has a map.
pub(super) fn page(
    context: &ReportContext,
    comparisons: &[Comparison],
) -> Result<Option<String>, serde_json::Error> {
    let Some(maps) = Maps::of(comparisons) else { return Ok(None) };
    let mut context = context.clone();
    context.pages.insert(0, ("Report".to_owned(), "index.html".to_owned()));
    let with_phase = comparisons
        .iter()
        .flat_map(|comparison| &comparison.planes)
        .all(|plane| plane.map.as_ref().is_none_or(|map| map.phase_rad.is_some()));
    let shown = ["scan", "simulation", "difference", "phase"];
    let shown = &shown[..if with_phase { 4 } else { 3 }];
    let words = Words {
        title: &context.title,
        sections: "Points: scan, with one standard error. Line: simulation.",
        thinned: None,
    };
    document_of(&words, &pages(&context), shown, &maps).map(Some)
}

/// The page of simulated planes; `None` if there is none.
pub(super) fn page_of_simulation(
    title: &str,
    simulator: Simulator,
    planes: &[SimulatedMap],
) -> Result<Option<String>, serde_json::Error> {
    let Some(maps) = Maps::of_simulation(simulator, planes) else { return Ok(None) };
    let stride = stride(planes.iter().map(|plane| plane.amplitude.len()).sum());
    let words = Words {
        title,
        sections: "The simulated amplitude along lines through the chosen point.",
        thinned: (stride > 1).then_some(stride),
    };
    document_of(&words, &html! {}, &["simulation", "phase"], &maps).map(Some)
}

/// What differs between pages.
struct Words<'a> {
    title: &'a str,
    /// What the cross-sections show.
    sections: &'a str,
    /// One of so many columns and rows is in the page.
    thinned: Option<usize>,
}

fn document_of(
    words: &Words,
    links: &Markup,
    shown: &[&str],
    maps: &Maps,
) -> Result<String, serde_json::Error> {
    // No element can end inside the data.
    let data = serde_json::to_string(maps)?.replace('<', "\\u003c");
    let measured = shown.contains(&"scan");
    let body = html! {
        header {
            h1 { "Maps: " (words.title) }
            p class="subtitle" {
                "Click on a map to move the cross-sections. Drag to zoom; double-click to return."
                @if let Some(stride) = words.thinned {
                    " One of " (stride) " columns and rows is shown, so that the page opens quickly."
                }
            }
        }
        (links)
        main {
            (controls(measured, maps.has_levels()))
            p id="values" role="status" aria-live="polite" { "Unpacking…" }
            div id="fields" class="maps" { @for name in shown { div id=(name) {} } }
            @if shown.contains(&"phase") {
                p class="subtitle" {
                    "Phase is left out where the amplitude is below 5\u{a0}% of the largest at that height."
                }
            }
            h2 { "Cross-sections" }
            p class="subtitle" { (words.sections) }
            div class="maps" { div id="along-x" {} div id="along-y" {} div id="along-z" {} }
            details id="volume-fold" hidden {
                summary { "View in three dimensions" }
                div id="volume" {}
            }
        }
        script id="maps" type="application/json" { (PreEscaped(data)) }
        script id="plotly" type="application/octet-stream" { (STANDARD.encode(PLOTLY_FLAT)) }
        script id="plotly-3d" type="application/octet-stream" { (STANDARD.encode(PLOTLY)) }
        script { (PreEscaped(SCRIPT)) }
    };
    let title = format!("Maps: {}", words.title);
    Ok(document(&title, &[STYLE, OWN_STYLE], &body))
}

/// The form; the difference is asked for only where something was `measured`, and pascals only where a level is known.
fn controls(measured: bool, levels: bool) -> Markup {
    html! {
        form class="controls" {
            label id="simulators" { "Simulation " select name="comparison" {} }
            label id="drives" { "Drive " select name="drive" {} }
            label {
                "Height "
                input name="height" type="range" min="0" value="0" step="1";
                output name="height-mm" {}
            }
            label {
                "Scale "
                select name="scale" {
                    option value="linear" { "linear" }
                    option value="decibel" { "dB" }
                    @if levels {
                        option value="pascal" { "Pa rms" }
                        option value="level" { "dB re 20\u{a0}\u{b5}Pa" }
                    }
                }
            }
            label {
                "Colours of "
                select name="range" {
                    option value="one" { "this height" }
                    option value="all" { "all heights" }
                }
            }
            label hidden[!measured] {
                "Difference in "
                select name="difference" {
                    option value="unit" { "the reading's unit" @if levels { " or Pa" } }
                    option value="errors" { "standard errors" }
                }
            }
            label {
                "View "
                select name="view" {
                    option value="heatmap" { "map" }
                    option value="surface" { "surface" }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use flate2::read::GzDecoder;

    use super::*;

    #[test]
    fn both_scripts_are_of_the_same_version() {
        let version = |packed: &[u8]| {
            let mut head = [0; 200];
            GzDecoder::new(packed).read_exact(&mut head).expect("gzip");
            let head = String::from_utf8_lossy(&head).into_owned();
            let from = head.find(" v").expect("a version") + 2;
            head[from..].lines().next().expect("a line").trim().to_owned()
        };
        assert_eq!(version(PLOTLY_FLAT), version(PLOTLY));
    }

    #[test]
    fn the_page_opens_with_the_small_script() {
        assert!(3 * PLOTLY_FLAT.len() < PLOTLY.len());
    }
}
