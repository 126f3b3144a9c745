//! The figures height by height, as a table.

use super::super::numbers::{ABSENT, fixed, height_mm, millimetres, percent, uncertain};
use super::super::verdict::drives;
use super::html::{Html, element, paragraph, text};
use crate::gap::{Comparison, FieldFigures, Noise, NoiseSource, PlaneComparison, Uncertain};

/// The table of a comparison and what has to be said with it.
pub(super) fn table(comparison: &Comparison) -> Vec<Html> {
    let several_drives = drives(comparison).len() > 1;
    let unit = &comparison.reading_unit;
    let caption = format!(
        "Readings in {}, lengths in millimetres, \u{b1} one standard error. The simulation is multiplied by the gain.",
        if unit.is_empty() { "the receiver's unit" } else { unit }
    );
    let rows = comparison.planes.iter().map(|plane| row(plane, several_drives));
    let table = element(
        "table",
        &[],
        [
            element("caption", &[], [text(&caption)]),
            head(several_drives),
            element("tbody", &[], rows),
        ],
    );
    let cut_off = comparison
        .planes
        .iter()
        .any(|plane| has_cut_off(&plane.scan) || has_cut_off(&plane.simulation));
    let at_edge = comparison
        .planes
        .iter()
        .any(|plane| plane.scan.peak_at_edge || plane.simulation.peak_at_edge);
    let mut content = vec![element("div", &[("class", "wide")], [table])];
    let mut notes = Vec::new();
    if at_edge {
        notes.push("* on the map's edge; the true peak may lie outside.".to_owned());
    }
    if cut_off {
        notes.push(
            "\u{2020} without the sides that the map's edge cuts off; the difference is over the sides that both have."
                .to_owned(),
        );
    }
    notes.push(
        "Level: how much louder the scan is at that height than the simulation says, at the gain that suits it best. \
         Residual: rms of scan less simulation over rms of the scan, at the common gain and at that best one."
            .to_owned(),
    );
    notes.push(noise(&comparison.noise, unit));
    content.push(element("div", &[("class", "notes")], notes.iter().map(|note| paragraph(note))));
    content
}

fn head(several_drives: bool) -> Html {
    let group = |words: &str, columns: &str| {
        element("th", &[("colspan", columns), ("scope", "colgroup")], [text(words)])
    };
    let column = |words: &str| element("th", &[("scope", "col")], [text(words)]);
    let lead = if several_drives { "2" } else { "1" };
    let groups = [
        group("", lead),
        group("Peak", "3"),
        group("Peak at (x, y)", "3"),
        group("Focal radius", "3"),
        group("Sub-peaks", "2"),
        group("Agreement", "4"),
    ];
    let mut columns = vec![column("z")];
    if several_drives {
        columns.insert(0, column("drive"));
    }
    for words in [
        "scan",
        "simulation",
        "ratio",
        "scan",
        "simulation",
        "apart",
        "scan",
        "simulation",
        "difference",
        "scan",
        "sim.",
        "correlation",
        "level",
        "residual",
        "at best level",
    ] {
        columns.push(column(words));
    }
    element("thead", &[], [element("tr", &[], groups), element("tr", &[], columns)])
}

fn row(plane: &PlaneComparison, several_drives: bool) -> Html {
    let cell = |words: String| element("td", &[], [text(&words)]);
    let height = element("th", &[("scope", "row")], [text(&height_mm(plane.z_m))]);
    let mut cells = vec![height];
    if several_drives {
        cells.insert(0, cell(plane.focus.to_string()));
    }
    let discrepancy = &plane.discrepancy;
    cells.extend(
        [
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
            fixed(plane.agreement.correlation, 3),
            fixed(plane.agreement.gain_ratio, 3),
            percent(plane.agreement.residual_rms_ratio),
            percent(plane.agreement.residual_rms_ratio_own_gain),
        ]
        .map(cell),
    );
    element("tr", &[], cells)
}

fn absent() -> String {
    ABSENT.to_owned()
}

fn peak(figures: &FieldFigures) -> String {
    let mark = if figures.peak_at_edge { "*" } else { "" };
    format!("{}{mark}", uncertain(figures.peak))
}

fn position(figures: &FieldFigures) -> String {
    let [x, y] = figures.peak_position_m;
    let along = |at: Uncertain| fixed(at.value * 1e3, 1);
    format!("({}, {})", along(x), along(y))
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
    let plain = |value| uncertain(Uncertain { value, standard_error: f64::NAN });
    let from = match noise.source {
        NoiseSource::Repeats => "from points that were measured several times",
        NoiseSource::SilentReadings => "from readings with the array silent",
        NoiseSource::Residual => {
            "from what the simulation leaves unexplained: an upper bound, as it holds the gap too"
        }
    };
    format!(
        "Noise of one reading, {from}: {} {unit}, and {} of the level.",
        plain(noise.additive),
        percent(noise.multiplicative)
    )
}
