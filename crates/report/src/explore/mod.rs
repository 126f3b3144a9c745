//! The page of interactive maps: zoom, values under the cursor, heights, cross-sections. It needs no network.
//!
//! Plotly draws it (MIT licence). Its script is 4.7 MB and is held as 1.4 MB of gzip, 1.9 MB in the page; the browser unpacks it. A map
//! takes 11 bytes a point.

mod data;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};

use self::data::Maps;
use super::context::ReportContext;
use super::html::document;
use super::page::{STYLE, pages};
use fieldgap_comparison::Comparison;

/// Name of the page.
pub(super) const EXPLORE_NAME: &str = "explore.html";

const OWN_STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("explore.js");

/// The script of Plotly, gzip.
const PLOTLY: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/plotly.js.gz"));

/// The page; `None` if no height has a map.
pub(super) fn page(
    context: &ReportContext,
    comparisons: &[Comparison],
) -> Result<Option<String>, serde_json::Error> {
    let Some(maps) = Maps::of(comparisons) else { return Ok(None) };
    // No element can end inside the data.
    let data = serde_json::to_string(&maps)?.replace('<', "\\u003c");
    let mut context = context.clone();
    context.pages.insert(0, ("Report".to_owned(), "index.html".to_owned()));
    let body = html! {
        header {
            h1 { "Maps: " (context.title) }
            p class="subtitle" { "Click on a map to move the cross-sections. Drag to zoom; double-click to return." }
        }
        (pages(&context))
        main {
            (controls())
            p id="values" role="status" aria-live="polite" { "Unpacking…" }
            div class="maps" { div id="scan" {} div id="simulation" {} div id="difference" {} }
            h2 { "Cross-sections" }
            p class="subtitle" { "Points: scan, with one standard error. Line: simulation." }
            div class="maps" { div id="along-x" {} div id="along-y" {} div id="along-z" {} }
        }
        script id="maps" type="application/json" { (PreEscaped(data)) }
        script id="plotly" type="application/octet-stream" { (STANDARD.encode(PLOTLY)) }
        script { (PreEscaped(SCRIPT)) }
    };
    let title = format!("Maps: {}", context.title);
    Ok(Some(document(&title, &[STYLE, OWN_STYLE], &body)))
}

fn controls() -> Markup {
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
                }
            }
            label {
                "Colours of "
                select name="range" {
                    option value="one" { "this height" }
                    option value="all" { "all heights" }
                }
            }
            label {
                "Difference in "
                select name="difference" {
                    option value="unit" { "the reading's unit" }
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
