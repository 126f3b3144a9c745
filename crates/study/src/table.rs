//! What a study found, as tables for programs.

use super::{Figure, Quantiles, Row, Study, StudyResult};

/// Columns behind those of the sweeps.
const COLUMNS: [&str; 16] = [
    "simulator",
    "elements",
    "z_mm",
    "focal_radius_mm",
    "peak",
    "peak_x_mm",
    "peak_y_mm",
    "sub_peaks",
    "largest_sub_peak",
    "cut_off",
    "peak_at_edge",
    "wavelength_mm",
    "pitch_mm",
    "critical_pitch_mm",
    "element_near_field_mm",
    "array_near_field_mm",
];

/// A row for each combination of values. Of arrays drawn at random it holds the medians, and the distributions behind them.
pub fn csv(study: &Study, result: &StudyResult) -> String {
    let drawn = result.rows.iter().any(|row| row.draws.len() > 1);
    let mut header: Vec<String> = study.sweeps.iter().map(|sweep| sweep.name()).collect();
    header.extend(COLUMNS.map(str::to_owned));
    if drawn {
        header.push("draws".to_owned());
        for name in ["focal_radius_mm", "peak", "sub_peaks"] {
            header.extend(SHARES.map(|share| format!("{name}_{share}")));
        }
    }
    let rows = result.rows.iter().map(|row| {
        let mut cells = labels(study, row);
        cells.extend(figures(row));
        if drawn {
            cells.push(row.draws.len().to_string());
            for figure in Figure::ALL {
                cells.extend(shares(row.figure(figure)));
            }
        }
        cells
    });
    written(std::iter::once(header).chain(rows))
}

/// A row for each array that was drawn at random.
pub fn draws_csv(study: &Study, result: &StudyResult) -> String {
    let mut header: Vec<String> = study.sweeps.iter().map(|sweep| sweep.name()).collect();
    header.extend(
        ["seed", "focal_radius_mm", "peak", "peak_x_mm", "peak_y_mm", "sub_peaks"]
            .map(str::to_owned),
    );
    let rows = result.rows.iter().flat_map(|row| {
        row.draws.iter().filter_map(|(seed, observed)| {
            let mut cells = labels(study, row);
            cells.push((*seed)?.to_string());
            cells.extend([
                observed.focal_radius_mm.map_or_else(String::new, |radius| format!("{radius:.4}")),
                format!("{:.6}", observed.peak),
                length(observed.peak_x_mm),
                length(observed.peak_y_mm),
                observed.sub_peaks.to_string(),
            ]);
            Some(cells)
        })
    });
    written(std::iter::once(header).chain(rows))
}

const SHARES: [&str; 5] = ["p05", "p25", "p75", "p95", "standard_deviation"];

fn shares(quantiles: Option<Quantiles>) -> [String; 5] {
    let of = |read: fn(&Quantiles) -> f64| {
        quantiles.as_ref().map_or_else(String::new, |found| format!("{:.4}", read(found)))
    };
    [of(|q| q.p05), of(|q| q.p25), of(|q| q.p75), of(|q| q.p95), of(|q| q.standard_deviation)]
}

fn labels(study: &Study, row: &Row) -> Vec<String> {
    study
        .sweeps
        .iter()
        .zip(&row.values)
        .map(|(sweep, &value)| sweep.values[value].label.clone())
        .collect()
}

fn figures(row: &Row) -> [String; 16] {
    let first = row.first();
    let lone = row.draws.len() == 1;
    let median = |figure: Figure, decimals: usize| {
        row.figure(figure).map_or_else(String::new, |found| format!("{:.decimals$}", found.median))
    };
    // Where a single map of many has its peak says nothing of the rest.
    let of_one = |text: String| if lone { text } else { String::new() };
    let optional =
        |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4}"));
    let limits = row.limits;
    [
        row.simulator.to_string(),
        row.elements.to_string(),
        length(row.z_mm),
        median(Figure::FocalRadius, 4),
        median(Figure::Peak, 6),
        of_one(length(first.peak_x_mm)),
        of_one(length(first.peak_y_mm)),
        median(Figure::SubPeaks, if lone { 0 } else { 1 }),
        of_one(optional(first.largest_sub_peak)),
        of_one(first.cut_off.clone()),
        of_one(first.peak_at_edge.to_string()),
        format!("{:.4}", limits.wavelength_mm),
        optional(limits.pitch_mm),
        optional(limits.critical_pitch_mm),
        format!("{:.4}", limits.element_near_field_mm),
        format!("{:.4}", limits.array_near_field_mm),
    ]
}

/// Millimetres without the rounding of their arithmetic.
fn length(millimetres: f64) -> String {
    // A zero from below is zero.
    format!("{}", (millimetres * 1e6).round() / 1e6 + 0.0)
}

fn written(rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.write_record(&row).expect("memory takes every row, and all rows are as long");
    }
    let bytes = writer.into_inner().expect("memory takes every row");
    String::from_utf8(bytes).expect("text went in")
}
