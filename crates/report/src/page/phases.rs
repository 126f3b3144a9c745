//! The phases: their differences plane by plane, and what the elements emit.

use maud::{Markup, html};

use super::super::figures::{Figures, PhaseFigure};
use super::super::judgement::drives;
use super::super::plane_table::{PlaneRow, PlaneTable};
use super::html::section;
use fieldgap_comparison::{Comparison, Hologram, PlaneComparison};
use fieldgap_text::{fixed, height_mm};

/// Elements that are listed.
const MOST_LISTED: usize = 8;

/// The section; `None` where no plane has phases.
pub(super) fn phases(comparisons: &[Comparison], figures: &Figures) -> Option<Markup> {
    if figures.phases.is_empty() {
        return None;
    }
    let content = html! {
        p {
            "The phase of the scan less that of the simulation, within half a turn. The constant phase of the reference is taken out: it \
             is one for all heights, so that a wrong speed of sound shows as a mean that changes with the height. A drift of the \
             reference is not taken out."
        }
        @for comparison in comparisons { (table(comparison)) }
        @for figure in &figures.phases { (plane(comparisons, figure)) }
    };
    Some(section("phases", "Phases", &content))
}

fn table(comparison: &Comparison) -> Markup {
    let several_drives = drives(comparison).len() > 1;
    let row = |plane: &PlaneComparison| {
        let phase = plane.phase.as_ref()?;
        let degrees = |rad: f64| fixed(rad.to_degrees(), 1);
        Some(PlaneRow {
            lead: several_drives.then(|| plane.focus.to_string()).into_iter().collect(),
            height: height_mm(plane.z_m),
            cells: vec![
                phase.points.to_string(),
                degrees(phase.mean_rad),
                degrees(phase.rms_rad),
                degrees(phase.rms_about_mean_rad),
            ],
        })
    };
    let rows: Vec<PlaneRow> = comparison.planes.iter().filter_map(row).collect();
    let lead: &[&str] = if several_drives { &["drive", "z (mm)"] } else { &["z (mm)"] };
    let caption = format!(
        "Phase of the scan less that of the {} simulation, degrees. Each point counts by its power.",
        comparison.simulator
    );
    let groups = [("Phase", 4)];
    let columns = ["points", "mean", "rms", "rms about the mean"];
    PlaneTable { caption: &caption, lead, groups: &groups, columns: &columns, rows }.markup()
}

fn plane(comparisons: &[Comparison], figure: &PhaseFigure) -> Markup {
    let comparison = &comparisons[figure.comparison];
    let plane = &comparison.planes[figure.plane];
    let several = drives(comparison).len() > 1;
    let drive = if several { format!("Drive {}, ", plane.focus) } else { String::new() };
    let words =
        format!("{drive}z = {} mm, {} simulation.", height_mm(plane.z_m), comparison.simulator);
    let hologram = plane.phase.as_ref().and_then(|phase| phase.hologram.as_ref());
    html! {
        (figure.map.markup(&html! { p { (words) } }))
        @if let (Some(maps), Some(hologram)) = (&figure.hologram, hologram) {
            (maps.markup(&html! { p { (words) " " (emitted(hologram)) } }))
        }
    }
}

/// What the plane brought back to the elements says.
fn emitted(hologram: &Hologram) -> String {
    let how = format!(
        "Brought back by {} mm to the plane of the elements, with a resolution of {} mm; the simulation in the same way.",
        fixed(hologram.height_m * 1e3, 0),
        fixed(hologram.resolution_m * 1e3, 1)
    );
    let outstanding = hologram.outstanding();
    let listed: Vec<String> = outstanding
        .iter()
        .take(MOST_LISTED)
        .map(|one| {
            let degrees = fixed(one.phase_rad.to_degrees(), 0);
            format!(
                "{} ({} times the simulated amplitude, {degrees}\u{b0})",
                one.element,
                fixed(one.ratio, 2)
            )
        })
        .collect();
    let found = match (listed.is_empty(), outstanding.len().saturating_sub(MOST_LISTED)) {
        (true, _) => "No element stands out.".to_owned(),
        (false, 0) => format!("Elements that stand out: {}.", listed.join(", ")),
        (false, more) => format!("Elements that stand out: {} and {more} more.", listed.join(", ")),
    };
    format!("{how} {found}")
}
