//! The pictures with their captions.

use maud::{Markup, html};

use super::super::figures::{Figures, PlaneFigure};
use super::super::judgement::{drives, focal_height_m};
use super::super::words::{listed, sentence};
use super::html::section;
use fieldgap_acoustics::metrics::Side;
use fieldgap_comparison::{Comparison, FieldFigures, PlaneComparison};
use fieldgap_text::{fixed, height_mm, millimetres, percent, uncertain};

/// The maps of each height, with every simulator.
pub(super) fn heights(comparisons: &[Comparison], figures: &Figures) -> Markup {
    // Figures of one drive and height follow one another.
    let same_height = |a: &PlaneFigure, b: &PlaneFigure| {
        let place = |figure: &PlaneFigure| {
            let plane = &comparisons[figure.comparison].planes[figure.plane];
            (plane.focus, plane.z_m.to_bits())
        };
        place(a) == place(b)
    };
    let content = html! {
        @for group in figures.planes.chunk_by(same_height) {
            @for (place, figure) in group.iter().enumerate() {
                @let comparison = &comparisons[figure.comparison];
                @let plane = &comparison.planes[figure.plane];
                @if place == 0 { h3 { (heading(comparison, plane)) } }
                (plane_figure(comparison, plane, figure))
            }
        }
    };
    section("heights", "Maps at each height", &content)
}

/// The curves against height; `None` where there are none.
pub(super) fn curves(figures: &Figures) -> Option<Markup> {
    if figures.curves.is_empty() {
        return None;
    }
    let note = html! {
        p {
            "Error bars: one standard error. An open mark means that the peak is at the edge of the map, or that the \
             edge cuts off a side of the focal radius."
        }
    };
    let content = html! { @for figure in &figures.curves { (figure.markup(&note)) } };
    Some(section("curves", "Curves over height", &content))
}

fn heading(comparison: &Comparison, plane: &PlaneComparison) -> String {
    let several = drives(comparison).len() > 1;
    let drive = if several { format!("Drive {}, ", plane.focus) } else { String::new() };
    let focal = focal_height_m(comparison, plane.focus) == Some(plane.z_m);
    let focal = if focal { ", the focal height" } else { "" };
    format!("{drive}z = {} mm{focal}", height_mm(plane.z_m))
}

fn plane_figure(comparison: &Comparison, plane: &PlaneComparison, figure: &PlaneFigure) -> Markup {
    let words = caption(plane);
    let Some(picture) = &figure.picture else {
        let why = plane.why_no_map.as_deref().unwrap_or("the grid has no point to draw");
        let no_map = sentence(&format!("No map for {}: {why}", comparison.simulator));
        return html! { div { p { (no_map) } p { (words) } } };
    };
    picture.markup(&html! {
        p {
            strong {
                a href={ "#" (super::anchor(comparison)) } {
                    "Scan and " (comparison.simulator.to_string()) " simulation."
                }
            }
            " " (words)
        }
    })
}

fn caption(plane: &PlaneComparison) -> String {
    let mut sentences = vec![format!(
        "The peaks are {} mm apart. The peak of the scan is {} times that of the simulation.",
        millimetres(plane.discrepancy.peak_distance_m),
        uncertain(plane.discrepancy.peak_ratio)
    )];
    if let (Some(scan), Some(simulation)) = (radius(&plane.scan), radius(&plane.simulation)) {
        sentences.push(format!("Focal radius: scan {scan}, simulation {simulation}."));
    }
    if let (Some(scan), Some(simulation)) = (plane.scan.sub_peaks, plane.simulation.sub_peaks)
        && scan + simulation > 0
    {
        sentences.push(format!("Sub-peaks: scan {scan}, simulation {simulation}."));
    }
    sentences.push(format!(
        "Correlation {}; residual {} of the scan's rms at this height.",
        fixed(plane.agreement.correlation, 3),
        percent(plane.agreement.residual_rms_ratio)
    ));
    for (field, figures) in [("scan", &plane.scan), ("simulation", &plane.simulation)] {
        if figures.peak_at_edge {
            sentences.push(format!(
                "The peak of the {field} is at the edge of the map; the true peak may lie outside."
            ));
        }
    }
    if let Some(map) = &plane.map
        && map.scan.iter().any(|value| !value.is_finite())
    {
        let missing = map.scan.iter().filter(|value| !value.is_finite()).count();
        sentences.push(format!("{missing} of {} points were not measured.", map.scan.len()));
    }
    if let (Some(target_m), Some(map)) = (plane.target_in_scan_m, &plane.map)
        && !(covers(&map.x_m, target_m.x) && covers(&map.y_m, target_m.y))
    {
        sentences.push(format!(
            "The focus, at ({}, {}) mm, lies outside the map.",
            fixed(target_m.x * 1e3, 1),
            fixed(target_m.y * 1e3, 1)
        ));
    }
    if plane.map.is_none() {
        sentences.push(format!("{} readings.", plane.points));
    }
    sentences.join(" ")
}

fn covers(along_m: &[f64], at_m: f64) -> bool {
    along_m.first().is_some_and(|&first| first <= at_m)
        && along_m.last().is_some_and(|&last| at_m <= last)
}

/// A focal radius, and the sides that the edge of the map cuts off.
fn radius(figures: &FieldFigures) -> Option<String> {
    let radius = figures.focal_radius.as_ref()?;
    let cut_off: Vec<String> = Side::ALL
        .iter()
        .zip(radius.sides_m)
        .filter(|(_, side_m)| side_m.is_none())
        .map(|(side, _)| side.to_string().replace('-', "\u{2212}"))
        .collect();
    Some(match radius.radius_m {
        None => "wider than the map".to_owned(),
        Some(radius_m) if cut_off.is_empty() => format!("{} mm", millimetres(radius_m)),
        Some(radius_m) => {
            format!(
                "{} mm ({} cut off by the edge of the map)",
                millimetres(radius_m),
                listed(&cut_off)
            )
        }
    })
}
