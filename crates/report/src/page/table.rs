//! The figures of each height, as tables.

use maud::{Markup, html};

use super::super::judgement::drives;
use super::super::plane_table::{PlaneRow, PlaneTable};
use fieldgap_comparison::{Comparison, FieldFigures, Noise, NoiseSource, PlaneComparison};
use fieldgap_text::{ABSENT, fixed, height_mm, millimetres, percent, significant, uncertain};

/// The tables of a comparison and their notes.
pub(super) fn tables(comparison: &Comparison) -> Markup {
    let unit = &comparison.reading_unit;
    let unit_name = if unit.is_empty() { "the receiver's unit" } else { unit };
    let figures = table(
        comparison,
        &format!(
            "Readings in {unit_name}, lengths in millimetres, \u{b1} one standard error. The simulation is multiplied by \
             the gain."
        ),
        &[("Peak", 3), ("Peak at (x, y)", 3), ("Focal radius", 3), ("Sub-peaks", 2)],
        &[
            "scan",
            "simulation",
            "ratio",
            "scan",
            "simulation",
            "distance",
            "scan",
            "simulation",
            "difference",
            "scan",
            "simulation",
        ],
        figure_cells,
    );
    let agreement = table(
        comparison,
        "Agreement of the readings at each height.",
        &[("Readings", 2), ("Fit", 2), ("Residual / rms of the scan", 2)],
        &[
            "number",
            &format!("rms ({unit_name})"),
            "correlation",
            "level",
            "at the common gain",
            "at the best gain",
        ],
        agreement_cells,
    );
    let level = "Level: the best gain for this height, divided by the common gain. Above 1, the scan is louder than the \
                 simulation predicts.";
    html! {
        (figures)
        div class="notes" { @for note in notes(comparison) { p { (note) } } }
        (agreement)
        div class="notes" { p { (level) } p { (noise(&comparison.noise, unit)) } }
    }
}

/// What the marks in the table of figures mean, of those that occur.
fn notes(comparison: &Comparison) -> impl Iterator<Item = &'static str> {
    let any = |has: fn(&FieldFigures) -> bool| {
        comparison.planes.iter().any(|plane| has(&plane.scan) || has(&plane.simulation))
    };
    let at_edge = any(|figures| figures.peak_at_edge)
        .then_some("* at the edge of the map; the true peak may lie outside.");
    let cut_off = any(has_cut_off).then_some(
        "\u{2020} without the sides that the edge of the map cuts off. The difference uses the sides that both have.",
    );
    at_edge.into_iter().chain(cut_off)
}

/// A table of one row for each plane. `groups` gives the headings above the columns and how many each spans.
fn table(
    comparison: &Comparison,
    caption: &str,
    groups: &[(&str, usize)],
    columns: &[&str],
    cells: fn(&PlaneComparison) -> Vec<String>,
) -> Markup {
    let several_drives = drives(comparison).len() > 1;
    let row = |plane: &PlaneComparison| PlaneRow {
        lead: several_drives.then(|| plane.focus.to_string()).into_iter().collect(),
        height: height_mm(plane.z_m),
        cells: cells(plane),
    };
    let lead: &[&str] = if several_drives { &["drive", "z (mm)"] } else { &["z (mm)"] };
    let rows = comparison.planes.iter().map(row).collect();
    PlaneTable { caption, lead, groups, columns, rows }.markup()
}

fn figure_cells(plane: &PlaneComparison) -> Vec<String> {
    let discrepancy = &plane.discrepancy;
    vec![
        peak(&plane.scan),
        peak(&plane.simulation),
        uncertain(discrepancy.peak_ratio),
        position(&plane.scan),
        position(&plane.simulation),
        millimetres(discrepancy.peak_distance_m),
        radius(&plane.scan),
        radius(&plane.simulation),
        discrepancy.focal_radius_m.map_or_else(absent, millimetres),
        count(plane.scan.sub_peaks),
        count(plane.simulation.sub_peaks),
    ]
}

fn agreement_cells(plane: &PlaneComparison) -> Vec<String> {
    let agreement = &plane.agreement;
    vec![
        plane.points.to_string(),
        significant(agreement.scan_rms, 4),
        fixed(agreement.correlation, 3),
        fixed(agreement.gain_ratio, 3),
        percent(agreement.residual_rms_ratio),
        percent(agreement.residual_rms_ratio_own_gain),
    ]
}

fn absent() -> String {
    ABSENT.to_owned()
}

fn peak(figures: &FieldFigures) -> String {
    let mark = if figures.peak_at_edge { "*" } else { "" };
    format!("{}{mark}", uncertain(figures.peak))
}

fn position(figures: &FieldFigures) -> String {
    let [x, y] = figures.peak_position_m.map(|along| along.value * 1e3);
    if x.is_finite() && y.is_finite() {
        format!("({}, {})", fixed(x, 1), fixed(y, 1))
    } else {
        absent()
    }
}

fn radius(figures: &FieldFigures) -> String {
    let mark = if has_cut_off(figures) { "\u{2020}" } else { "" };
    let radius_m = figures.focal_radius.as_ref().and_then(|radius| radius.radius_m);
    format!("{}{mark}", radius_m.map_or_else(absent, millimetres))
}

fn has_cut_off(figures: &FieldFigures) -> bool {
    figures.focal_radius.as_ref().is_some_and(|radius| radius.sides_m.iter().any(Option::is_none))
}

fn count(number: Option<usize>) -> String {
    number.map_or_else(absent, |number| number.to_string())
}

fn noise(noise: &Noise, unit: &str) -> String {
    let additive = significant(noise.additive, 3);
    let from = match noise.source {
        NoiseSource::Repeats => "from points measured several times",
        NoiseSource::SilentReadings => "from readings with the array silent",
        NoiseSource::Maps => "from what the maps hold beyond the wavenumber",
        NoiseSource::Residual => {
            "from the residual of the simulation, an upper bound because it includes the gap"
        }
    };
    let multiplicative = if noise.multiplicative > 0.0 {
        format!(", and {} of the level", percent(noise.multiplicative))
    } else {
        String::new()
    };
    format!("Noise of one reading, {from}: {additive} {unit}{multiplicative}.")
}
