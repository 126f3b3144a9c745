//! Absolute levels height by height, and their uncertainty budget.

use maud::{Markup, html};

use super::super::judgement::drives;
use super::super::plane_table::{PlaneRow, PlaneTable};
use super::super::tables::LEVELS_NAME;
use fieldgap_comparison::{Comparison, Levels, PlaneLevels};
use fieldgap_text::{fixed, height_mm, significant, with_minus_signs};

/// The tables of the levels of a comparison, where they are known.
pub(super) fn levels(comparison: &Comparison) -> Markup {
    let Some(levels) = &comparison.levels else { return html! {} };
    let several = drives(comparison).len() > 1;
    let row = |plane: &PlaneLevels| PlaneRow {
        lead: several.then(|| plane.focus.to_string()).into_iter().collect(),
        height: height_mm(plane.z_m),
        cells: cells(plane),
    };
    let table = PlaneTable {
        caption: "Levels of the carrier, dB re 20 \u{b5}Pa rms. U: expanded uncertainty, k = 2. The gap is the level of \
                  the scan over the simulation; it does not depend on the sensitivity.",
        lead: if several { &["drive", "z (mm)"] } else { &["z (mm)"] },
        groups: &[("Peak of the scan", 3), ("Peak of the simulation", 2), ("Difference", 2)],
        columns: &["Pa rms", "dB", "U (dB)", "Pa rms", "dB", "gap (dB)", "residual (Pa rms)"],
        rows: levels.planes.iter().map(row).collect(),
    };
    html! {
        (table.markup())
        (budget(levels))
        div class="notes" {
            @for note in &levels.notes { p { (note) } }
            p { "Maps in pascals and decibels: " a href=(LEVELS_NAME) { (LEVELS_NAME) } "." }
        }
    }
}

fn cells(plane: &PlaneLevels) -> Vec<String> {
    vec![
        significant(plane.scan.rms_pa, 4),
        fixed(plane.scan.level_db, 1),
        fixed(plane.expanded_db, 1),
        significant(plane.simulation.rms_pa, 4),
        fixed(plane.simulation.level_db, 1),
        with_minus_signs(&format!("{:+.2}", plane.gap_db.value)),
        significant(plane.residual_rms_pa, 3),
    ]
}

/// The budget of the loudest peak.
fn budget(levels: &Levels) -> Markup {
    let Some(loudest) = levels.loudest() else { return html! {} };
    let budget = &loudest.budget;
    html! {
        div class="wide" {
            table {
                caption {
                    "Uncertainty budget of the loudest peak (drive " (loudest.focus) ", " (height_mm(loudest.z_m))
                    "\u{a0}mm), by JCGM 100: combined " (fixed(budget.combined_db, 2)) "\u{a0}dB, expanded (k = 2) "
                    (fixed(budget.expanded_db(), 2)) "\u{a0}dB."
                }
                thead {
                    tr {
                        @for words in ["source", "type", "standard uncertainty", "dB per unit", "contribution (dB)"] {
                            th scope="col" { (words) }
                        }
                    }
                }
                tbody {
                    @for line in &budget.lines {
                        @let [source, kind, uncertainty, unit, sensitivity, contribution] = line.cells();
                        tr {
                            th scope="row" { (source) }
                            td { (kind) }
                            td { (uncertainty) "\u{a0}" (unit) }
                            td { (sensitivity) }
                            td { (contribution) }
                        }
                    }
                }
            }
        }
        div class="notes" { @for note in budget.notes() { p { (note) } } }
    }
}
