//! The figures of all comparisons as text, CSV and JSON.

use std::fmt::Write as _;

use fieldgap_comparison::Comparison;
use fieldgap_level::level_db;

/// Name of the text table.
pub(super) const TEXT_NAME: &str = "table.txt";
/// Name of the CSV table.
pub(super) const CSV_NAME: &str = "comparison.csv";
/// Name of the file with the complete comparisons.
pub(super) const JSON_NAME: &str = "comparison.json";

/// Name of the maps in pascals and decibels.
pub(super) const LEVELS_NAME: &str = "levels.csv";

/// The text tables of the comparisons, in their order.
pub(super) fn text(comparisons: &[Comparison]) -> String {
    let tables: Vec<String> = comparisons.iter().map(Comparison::to_wide_text).collect();
    tables.join("\n")
}

/// One CSV table of all comparisons: a row for each simulator, drive and height, with the simulator in the first column.
pub fn csv(comparisons: &[Comparison]) -> String {
    let mut csv = String::new();
    for comparison in comparisons {
        let table = comparison.to_csv();
        let mut lines = table.lines();
        let header = lines.next().unwrap_or_default();
        if csv.is_empty() {
            csv.push_str(&format!("simulator,{header}\n"));
        }
        for line in lines {
            csv.push_str(&format!("{},{line}\n", comparison.simulator));
        }
    }
    csv
}

/// The maps of all comparisons in pascals and decibels, a row for each point; `None` if no level is known. An empty field is a point that
/// was not measured, or a level of no sound. The last column is the expanded uncertainty (k = 2) of the peak of the scan at this height.
pub(super) fn levels_csv(comparisons: &[Comparison]) -> Option<String> {
    let mut csv = "simulator,focus,x_mm,y_mm,z_mm,scan_pa,scan_db,simulation_pa,simulation_db,peak_expanded_db\n"
        .to_owned();
    let mut known = false;
    for comparison in comparisons {
        let Some(levels) = &comparison.levels else { continue };
        known = true;
        for plane in &comparison.planes {
            let (Some(map), Some(of_plane)) = (&plane.map, levels.of_plane(plane)) else {
                continue;
            };
            let pa = levels.rms_pa_in(of_plane);
            let at = map.y_m.iter().flat_map(|y| map.x_m.iter().map(move |x| (x, y)));
            for ((x, y), (scan, simulation)) in at.zip(map.scan.iter().zip(&map.simulation)) {
                let [x, y, z] = [*x, *y, plane.z_m].map(|m| (m * 1e9).round() / 1e6);
                let _ = write!(csv, "{},{},{x},{y},{z}", comparison.simulator, plane.focus);
                for rms_pa in [scan * pa, simulation * pa] {
                    match rms_pa > 0.0 {
                        true => {
                            let _ = write!(csv, ",{rms_pa},{}", level_db(rms_pa));
                        }
                        false if rms_pa == 0.0 => csv.push_str(",0,"),
                        false => csv.push_str(",,"),
                    }
                }
                let _ = writeln!(csv, ",{}", of_plane.expanded_db);
            }
        }
    }
    known.then_some(csv)
}
