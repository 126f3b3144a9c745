//! The figures and maps of each height, before and after the correction.

use maud::{Markup, html};

use super::super::peak_distance::peak_distance_m;
use super::super::picture::{LEAST_SIGNED_SIGMA, REACH_SIGMA, rms};
use super::super::plane_table::{PlaneRow, PlaneTable};
use super::figures::DiagnosisFigures;
use fieldgap_comparison::{FieldFigures, Uncertain};
use fieldgap_diagnosis::{DiagnosedPlane, Diagnosis, PlaneShare};
use fieldgap_text::{ABSENT, fixed, height_mm, millimetres, percent, uncertain};

/// Marks a value that a peak at the edge of the map makes doubtful.
const AT_EDGE: &str = "*";
/// Marks a focal radius of which a side is cut off.
const CUT_OFF: &str = "\u{2020}";

/// The table and the maps.
pub(super) fn heights(diagnosis: &Diagnosis, figures: &DiagnosisFigures) -> Markup {
    html! {
        (table(diagnosis))
        div class="notes" {
            @for note in notes(diagnosis) { p { (note) } }
            p {
                "The maps show the scan and the residuals of the nominal and the corrected simulation. White is no difference. The \
                 colours are linear near zero and logarithmic beyond, up to \u{b1}" (REACH_SIGMA) " standard deviations of the noise at all heights. + and \u{2212} mark \
                 residuals of more than " (LEAST_SIGNED_SIGMA) "."
            }
        }
        @for (plane, figure) in diagnosis.planes.iter().zip(&figures.planes) {
            h3 { (place(diagnosis, plane)) }
            @match figure {
                Some(figure) => (figure.markup(&html! { p { (caption(plane)) } })),
                None => div { p { "No map: the points at this height do not form a grid." } p { (caption(plane)) } },
            }
        }
    }
}

/// What the marks of the table mean, of those that occur.
fn notes(diagnosis: &Diagnosis) -> Vec<String> {
    let any = |has: fn(&FieldFigures) -> bool| {
        diagnosis.planes.iter().flat_map(|plane| plane.figures.iter().flatten()).any(has)
    };
    let mut notes = Vec::new();
    if any(|figures| figures.peak_at_edge) {
        notes.push(format!(
            "{AT_EDGE} a peak is at the edge of the map; the true peak may lie outside."
        ));
    }
    if any(has_cut_off) {
        notes.push(format!("{CUT_OFF} without the sides that the edge of the map cuts off."));
    }
    notes
}

fn has_cut_off(figures: &FieldFigures) -> bool {
    figures.focal_radius.as_ref().is_some_and(|radius| radius.sides_m.iter().any(Option::is_none))
}

/// The scan, drive and height of a plane.
fn place(diagnosis: &Diagnosis, plane: &DiagnosedPlane) -> String {
    let mut place = String::new();
    if diagnosis.scans.len() > 1 {
        let name = diagnosis.scans.get(plane.scan).map_or("", String::as_str);
        place += &format!("Scan {name}, ");
    }
    if several_drives(diagnosis) {
        place += &format!("Drive {}, ", plane.focus);
    }
    format!("{place}z = {} mm", height_mm(plane.z_mm * 1e-3))
}

fn several_drives(diagnosis: &Diagnosis) -> bool {
    diagnosis.planes.windows(2).any(|pair| pair[0].focus != pair[1].focus)
}

fn caption(plane: &DiagnosedPlane) -> String {
    let residual = |values: &[f64]| rms(values).map_or(ABSENT.to_owned(), |rms| fixed(rms, 2));
    let mut caption = format!(
        "Residual rms in standard deviations of the noise: {} for the nominal simulation, {} for the corrected one. Noise \
         alone gives 1.",
        residual(&plane.residual_before),
        residual(&plane.residual_after)
    );
    let missing = plane.measured.iter().filter(|reading| !reading.is_finite()).count();
    if missing > 0 {
        caption += &format!(" {missing} of {} points were not measured.", plane.measured.len());
    }
    caption
}

/// One row for each plane: its gap, and how peak and focal radius differ, before and after.
fn table(diagnosis: &Diagnosis) -> Markup {
    let several_scans = diagnosis.scans.len() > 1;
    let several_drives = several_drives(diagnosis);
    let scan_name = |plane: &DiagnosedPlane| diagnosis.scans.get(plane.scan).cloned();
    let lead = [several_scans.then_some("scan"), several_drives.then_some("drive"), Some("z (mm)")];
    let row = |plane: &DiagnosedPlane| PlaneRow {
        lead: [
            several_scans.then(|| scan_name(plane).unwrap_or_default()),
            several_drives.then(|| plane.focus.to_string()),
        ]
        .into_iter()
        .flatten()
        .collect(),
        height: height_mm(plane.z_mm * 1e-3),
        cells: figures(diagnosis, plane),
    };
    PlaneTable {
        caption: "Before: the nominal simulation. After: with the best candidate added. \u{b1} one standard error.",
        lead: &lead.into_iter().flatten().collect::<Vec<_>>(),
        groups: &[
            ("Gap", 2),
            ("Peak ratio, scan / simulation", 2),
            ("Distance of the peaks (mm)", 2),
            ("Focal radius (mm)", 3),
        ],
        columns: &[
            "before",
            "after",
            "before",
            "after",
            "before",
            "after",
            "scan",
            "scan \u{2212} before",
            "scan \u{2212} after",
        ],
        rows: diagnosis.planes.iter().map(row).collect(),
    }
    .markup()
}

/// The cells of a plane.
fn figures(diagnosis: &Diagnosis, plane: &DiagnosedPlane) -> Vec<String> {
    let here = |share: &&PlaneShare| {
        (share.scan, share.focus) == (plane.scan, plane.focus)
            && (share.z_mm - plane.z_mm).abs() < 1e-6
    };
    let share = diagnosis.r#where.planes.iter().find(here);
    let gap =
        |of: fn(&PlaneShare) -> f64| share.map_or(ABSENT.to_owned(), |share| percent(of(share)));
    let mut cells = vec![gap(|share| share.gap), gap(|share| share.gap_after)];
    let Some([scan, before, after]) = &plane.figures else {
        cells.extend((0..7).map(|_| ABSENT.to_owned()));
        return cells;
    };
    let marked = |number: String, mark: bool, with: &str| number + if mark { with } else { "" };
    let ratio = |simulation: &FieldFigures| {
        let ratio = Uncertain {
            value: scan.peak.value / simulation.peak.value,
            standard_error: scan.peak.standard_error / simulation.peak.value,
        };
        marked(uncertain(ratio), scan.peak_at_edge || simulation.peak_at_edge, AT_EDGE)
    };
    let distance = |simulation: &FieldFigures| {
        let [x, y] = simulation.peak_position_m;
        let distance = millimetres(peak_distance_m(scan.peak_position_m, (x.value, y.value)));
        marked(distance, scan.peak_at_edge || simulation.peak_at_edge, AT_EDGE)
    };
    let radius = |figures: &FieldFigures| figures.focal_radius.as_ref()?.radius_m;
    let wider = |simulation: &FieldFigures| {
        let wider = radius(scan).zip(radius(simulation)).map(|(scan, simulation)| Uncertain {
            value: scan.value - simulation.value,
            standard_error: scan.standard_error,
        });
        let cut_off = has_cut_off(scan) || has_cut_off(simulation);
        marked(wider.map_or(ABSENT.to_owned(), millimetres), cut_off, CUT_OFF)
    };
    cells.extend([ratio(before), ratio(after), distance(before), distance(after)]);
    let of_scan = radius(scan).map_or(ABSENT.to_owned(), millimetres);
    cells.push(marked(of_scan, has_cut_off(scan), CUT_OFF));
    cells.extend([wider(before), wider(after)]);
    cells
}
