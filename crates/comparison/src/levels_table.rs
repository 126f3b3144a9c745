//! The absolute levels of a comparison as a table: text for a terminal, columns of the CSV.

use super::comparison::{Levels, PlaneLevels};
use fieldgap_text::{fixed, paragraph, significant, table};

/// Name of a column, and what stands in it.
type Column = (&'static str, fn(&PlaneLevels) -> f64);

/// The columns that the CSV has beside those of every comparison, with their units in the names.
pub const COLUMNS: [Column; 9] = [
    ("scan_peak_pa", |plane| plane.scan.rms_pa),
    ("scan_peak_db", |plane| plane.scan.level_db),
    ("scan_peak_expanded_db", |plane| plane.expanded_db),
    ("simulation_peak_pa", |plane| plane.simulation.rms_pa),
    ("simulation_peak_db", |plane| plane.simulation.level_db),
    ("gap_db", |plane| plane.gap_db.value),
    ("gap_db_error", |plane| plane.gap_db.standard_error),
    ("residual_rms_pa", |plane| plane.residual_rms_pa),
    ("reception_db", |plane| plane.reception_db),
];

impl Levels {
    /// Levels height by height, the budget of the loudest peak, and what is taken for granted, in at most 80 columns.
    pub fn to_text(&self) -> String {
        let mut text = paragraph(
            "Levels of the carrier, dB re 20 µPa, from pressures in Pa rms. U: expanded uncertainty (k = 2) of the \
             scan's peak. Gap: level of the scan over the simulation, which does not depend on the sensitivity.",
            0,
            2,
        );
        let heading = ["drive, height", "scan", "", "U", "simulation", "", "gap", "residual"];
        let units = ["mm", "Pa", "dB", "dB", "Pa", "dB", "dB", "Pa"];
        let rows: Vec<[String; 8]> = [heading, units]
            .map(|row| row.map(str::to_owned))
            .into_iter()
            .chain(self.planes.iter().map(row))
            .collect();
        text += &table(&rows);
        if let Some(loudest) = self.loudest() {
            text += &format!(
                "\nuncertainty of the loudest peak: drive {}, {:.1} mm\n",
                loudest.focus,
                loudest.z_m * 1e3
            );
            text += &loudest.budget.to_text();
        }
        for note in &self.notes {
            text += &paragraph(note, 0, 2);
        }
        text
    }
}

fn row(plane: &PlaneLevels) -> [String; 8] {
    [
        format!("{}, {:.1}", plane.focus, plane.z_m * 1e3),
        significant(plane.scan.rms_pa, 4),
        fixed(plane.scan.level_db, 1),
        format!("±{}", fixed(plane.expanded_db, 1)),
        significant(plane.simulation.rms_pa, 4),
        fixed(plane.simulation.level_db, 1),
        format!("{:+.2}", plane.gap_db.value).replace('-', "\u{2212}"),
        significant(plane.residual_rms_pa, 3),
    ]
}
