//! The result of a study as CSV.

use super::observation::OUTSIDE;
use super::{Figure, MapFigures, Quantiles, Row, Study, StudyResult};

/// Columns after those of the sweeps.
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
    "peak_position",
    "wavelength_mm",
    "pitch_mm",
    "critical_pitch_mm",
    "element_near_field_mm",
    "array_near_field_mm",
];

/// One row per combination of values. For random arrays it has the medians and the distributions.
pub fn csv(study: &Study, result: &StudyResult) -> String {
    let random = result.rows.iter().any(|row| row.draws.len() > 1);
    let mut header: Vec<String> = study.sweeps.iter().map(|sweep| sweep.name()).collect();
    header.extend(COLUMNS.map(str::to_owned));
    if random {
        header.push("draws".to_owned());
        for name in ["focal_radius_mm", "peak", "sub_peaks"] {
            header.extend(STATISTICS.map(|statistic| format!("{name}_{statistic}")));
        }
    }
    let rows = result.rows.iter().map(|row| {
        let mut cells = labels(study, row);
        cells.extend(figures(row));
        if random {
            cells.push(row.draws.len().to_string());
            for figure in Figure::ALL {
                cells.extend(statistics(row.figure(figure)));
            }
        }
        cells
    });
    csv_text(std::iter::once(header).chain(rows))
}

/// One row per random array.
pub fn draws_csv(study: &Study, result: &StudyResult) -> String {
    let mut header: Vec<String> = study.sweeps.iter().map(|sweep| sweep.name()).collect();
    header.extend(
        ["seed", "focal_radius_mm", "peak", "peak_x_mm", "peak_y_mm", "sub_peaks", "peak_position"]
            .map(str::to_owned),
    );
    let rows = result.rows.iter().flat_map(|row| {
        row.draws.iter().filter_map(|(seed, observed)| {
            let mut cells = labels(study, row);
            cells.push((*seed)?.to_string());
            let figures = observed.figures();
            let cell = |of: fn(&MapFigures) -> String| figures.map_or_else(String::new, of);
            cells.extend([
                cell(|of| optional(of.focal_radius_mm)),
                cell(|of| format!("{:.6}", of.peak)),
                cell(|of| length(of.peak_x_mm)),
                cell(|of| length(of.peak_y_mm)),
                cell(|of| of.sub_peaks.to_string()),
                if figures.is_some() { ON_MAP } else { OUTSIDE }.to_owned(),
            ]);
            Some(cells)
        })
    });
    csv_text(std::iter::once(header).chain(rows))
}

/// How tables say that a peak is on the map.
const ON_MAP: &str = "on the map";

const STATISTICS: [&str; 5] = ["p05", "p25", "p75", "p95", "standard_deviation"];

fn statistics(quantiles: Option<Quantiles>) -> [String; 5] {
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
    let single = row.draws.len() == 1;
    let median = |figure: Figure, decimals: usize| {
        row.figure(figure).map_or_else(String::new, |found| format!("{:.decimals$}", found.median))
    };
    // The peak position of one draw does not represent the others.
    let only = row.first().figures().filter(|_| single);
    let of_only = |of: fn(&MapFigures) -> String| only.map_or_else(String::new, of);
    let position = match row.outside() {
        0 => ON_MAP.to_owned(),
        _ if single => OUTSIDE.to_owned(),
        some => format!("{OUTSIDE} in {some} draws"),
    };
    let limits = row.limits;
    [
        row.simulator.to_string(),
        row.elements.to_string(),
        length(row.z_mm),
        median(Figure::FocalRadius, 4),
        median(Figure::Peak, 6),
        of_only(|of| length(of.peak_x_mm)),
        of_only(|of| length(of.peak_y_mm)),
        median(Figure::SubPeaks, if single { 0 } else { 1 }),
        of_only(|of| optional(of.largest_sub_peak)),
        of_only(|of| of.cut_off.clone()),
        position,
        format!("{:.4}", limits.wavelength_mm),
        optional(limits.pitch_mm),
        optional(limits.critical_pitch_mm),
        format!("{:.4}", limits.element_near_field_mm),
        format!("{:.4}", limits.array_near_field_mm),
    ]
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:.4}"))
}

/// Millimetres without binary rounding errors.
fn length(millimetres: f64) -> String {
    // Negative zero becomes zero.
    format!("{}", (millimetres * 1e6).round() / 1e6 + 0.0)
}

fn csv_text(rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.write_record(&row).expect("rows of equal length, in memory");
    }
    let bytes = writer.into_inner().expect("rows in memory");
    String::from_utf8(bytes).expect("text")
}
