//! The pictures with their captions.

use super::super::figures::{Figures, PlaneFigure};
use super::super::judgement::{drives, focal_height_m};
use super::super::words::{listed, sentence};
use super::html::{Html, element, link, paragraph, section, text};
use fieldgap_acoustics::metrics::Side;
use fieldgap_comparison::{Comparison, FieldFigures, PlaneComparison};
use fieldgap_text::{fixed, height_mm, millimetres, percent, uncertain};

/// Height by height, each against every simulator.
pub(super) fn heights(comparisons: &[Comparison], figures: &Figures) -> Html {
    let mut content = Vec::new();
    let mut last = None;
    for figure in &figures.planes {
        let comparison = &comparisons[figure.comparison];
        let plane = &comparison.planes[figure.plane];
        let here = (plane.focus, plane.z_m.to_bits());
        if last != Some(here) {
            content.push(element("h3", &[], [text(&heading(comparison, plane))]));
            last = Some(here);
        }
        content.push(plane_figure(comparison, plane, figure));
    }
    section("heights", "Height by height", content)
}

/// The curves against height; `None` where there are none.
pub(super) fn curves(figures: &Figures) -> Option<Html> {
    if figures.curves.is_empty() {
        return None;
    }
    let note = "Bars are one standard error. An open mark comes with a reservation: the peak stands on the map's \
                edge, or the edge cuts off a side of the focal radius.";
    let content = figures.curves.iter().map(|figure| {
        element(
            "figure",
            &[],
            [figure.image(), element("figcaption", &[], [paragraph(note), figure.files()])],
        )
    });
    Some(section("curves", "Against height", content))
}

fn heading(comparison: &Comparison, plane: &PlaneComparison) -> String {
    let several = drives(comparison).len() > 1;
    let drive = if several { format!("Drive {}, ", plane.focus) } else { String::new() };
    let focal = focal_height_m(comparison, plane.focus) == Some(plane.z_m);
    let focal = if focal { ", the focal height" } else { "" };
    format!("{drive}z = {} mm{focal}", height_mm(plane.z_m))
}

fn plane_figure(comparison: &Comparison, plane: &PlaneComparison, figure: &PlaneFigure) -> Html {
    let words = caption(plane);
    let Some(picture) = &figure.picture else {
        let why = plane.why_no_map.as_deref().unwrap_or("the grid has no point to draw");
        return element(
            "div",
            &[],
            [
                paragraph(&sentence(&format!("Against {}: no map, {why}", comparison.simulator))),
                paragraph(&words),
            ],
        );
    };
    element(
        "figure",
        &[],
        [
            picture.image(),
            element(
                "figcaption",
                &[],
                [
                    element(
                        "p",
                        &[],
                        [
                            element(
                                "strong",
                                &[],
                                [link(
                                    &format!("#{}", super::anchor(comparison)),
                                    &format!("Against {}.", comparison.simulator),
                                )],
                            ),
                            text(&format!(" {words}")),
                        ],
                    ),
                    picture.files(),
                ],
            ),
        ],
    )
}

fn caption(plane: &PlaneComparison) -> String {
    let mut sentences = vec![format!(
        "The peaks lie {} mm apart; the scanned one is {} times as high as the simulated one.",
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
    for (whose, figures) in [("scanned", &plane.scan), ("simulated", &plane.simulation)] {
        if figures.peak_at_edge {
            sentences.push(format!(
                "The {whose} peak stands on the map's edge; the true one may lie outside."
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

/// A focal radius with the sides that it lacks.
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
            format!("{} mm ({} cut off by the map's edge)", millimetres(radius_m), listed(&cut_off))
        }
    })
}
