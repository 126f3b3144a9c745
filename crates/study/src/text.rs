//! What a study found, in words and columns for people.

use std::fmt::Write;

use super::{Figure, Limits, Onset, Quantiles, Row, Study, StudyResult};

/// The figures as columns, and under them what theory says of the set-ups, and where sub-peaks appear.
pub fn text(study: &Study, result: &StudyResult, onsets: &[Onset]) -> String {
    let mut text = columns(study, result);
    text += "\n";
    text += &limits(study, result);
    text += &sub_peaks(study, result, onsets);
    text
}

fn columns(study: &Study, result: &StudyResult) -> String {
    let mut rows: Vec<Vec<String>> = Vec::with_capacity(result.rows.len() + 1);
    let mut header: Vec<String> = study.sweeps.iter().map(|sweep| sweep.name()).collect();
    header.extend(
        ["focal radius (mm)", "peak", "at x, y (mm)", "sub-peaks", "cut off"].map(str::to_owned),
    );
    rows.push(header);
    for row in &result.rows {
        let mut cells: Vec<String> = study
            .sweeps
            .iter()
            .zip(&row.values)
            .map(|(sweep, &value)| sweep.values[value].label.clone())
            .collect();
        cells.extend(figures(row));
        rows.push(cells);
    }
    let widths: Vec<usize> = (0..rows[0].len())
        .map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0))
        .collect();
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:>width$}")).collect();
        text += cells.join("  ").trim_end();
        text += "\n";
    }
    if result.rows.iter().any(|row| row.draws.len() > 1) {
        text += "a random array's figures are the median over its draws, and in brackets what nine in ten lie between\n";
    }
    text
}

fn figures(row: &Row) -> [String; 5] {
    let first = row.first();
    if let [(_, only)] = &row.draws[..] {
        return [
            only.focal_radius_mm.map_or("-".to_owned(), |radius| format!("{radius:.4}")),
            format!("{:.6}", only.peak),
            format!("{}, {}", short(first.peak_x_mm), short(first.peak_y_mm)),
            only.sub_peaks.to_string(),
            only.cut_off.clone(),
        ];
    }
    let spread = |figure: Figure, decimals: usize| {
        row.figure(figure).map_or("-".to_owned(), |Quantiles { median, p05, p95, .. }| {
            format!("{median:.decimals$} [{p05:.decimals$} to {p95:.decimals$}]")
        })
    };
    [
        spread(Figure::FocalRadius, 2),
        spread(Figure::Peak, 3),
        String::new(),
        spread(Figure::SubPeaks, 0),
        String::new(),
    ]
}

fn short(millimetres: f64) -> f64 {
    (millimetres * 1e3).round() / 1e3 + 0.0
}

/// The limits that all rows share, or between which they lie.
fn limits(study: &Study, result: &StudyResult) -> String {
    let range = |read: &dyn Fn(&Limits) -> Option<f64>| {
        let values = result.rows.iter().filter_map(|row| read(&row.limits));
        let (least, most) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| {
                (least.min(value), most.max(value))
            });
        if !least.is_finite() {
            return None;
        }
        let (least, most) = (format!("{least:.1}"), format!("{most:.1}"));
        Some(if least == most { format!("{least} mm") } else { format!("{least} to {most} mm") })
    };
    let mut text = String::new();
    if let Some(face) = range(&|limits| Some(limits.element_near_field_mm)) {
        let _ = writeln!(text, "near field of an element (a²/λ): {face} from its face");
    }
    if let Some(array) = range(&|limits| Some(limits.array_near_field_mm)) {
        let _ = writeln!(
            text,
            "near field of the array (half its size squared, over λ): {array}; beyond that its delays make no focus"
        );
    }
    // A sweep of the spacing says it for itself.
    if gap_sweep(study).is_none()
        && let (Some(critical), Some(pitch)) =
            (range(&|limits| limits.critical_pitch_mm), range(&|limits| limits.pitch_mm))
    {
        let _ = writeln!(
            text,
            "critical spacing λ/(1 + sin θ), centre to centre: {critical}; the elements stand {pitch} apart"
        );
    }
    text
}

/// The gaps of a study that sweeps over nothing but the gap between neighbouring rims.
fn gap_sweep(study: &Study) -> Option<Vec<f64>> {
    match &study.sweeps[..] {
        [sweep] if sweep.parameters == ["array.spacing_mm"] => sweep.rising_numbers(),
        _ => None,
    }
}

fn sub_peaks(study: &Study, result: &StudyResult, onsets: &[Onset]) -> String {
    let mut text = String::new();
    let gaps = gap_sweep(study);
    if let Some(gaps) = &gaps
        && let Some(critical) = critical_gap_mm(gaps, result)
    {
        let diameter = result.rows[0].limits.pitch_mm.unwrap_or(0.0) - gaps[0];
        let _ = writeln!(
            text,
            "critical spacing λ/(1 + sin θ) where the gap itself is put for it, as the thesis does: {critical:.2} mm"
        );
        let _ = writeln!(
            text,
            "the formula speaks of centres, and these stand {diameter:.1} mm apart without any gap: by it, grating lobes \
             are there at every gap; what counts is whether they come onto the map, and how weak the lobes make them"
        );
    }
    for onset in onsets {
        let what = if onset.appear { "appear" } else { "vanish" };
        let place = format!("{} = {:.4} and {:.4}", study.sweeps[0].name(), onset.from, onset.to);
        let _ = writeln!(text, "sub-peaks {what} between {place}");
        if gaps.is_some()
            && let Some(row) = result.rows.first()
            && let (Some(pitch), Some(gaps)) = (row.limits.pitch_mm, &gaps)
        {
            let centres = pitch - gaps[0] + onset.to;
            let _ = writeln!(text, "  that is {centres:.2} mm from centre to centre");
        }
    }
    let single = study.sweeps.len() == 1 && study.sweeps[0].rising_numbers().is_some();
    if onsets.is_empty() && single {
        let there = result.rows.iter().all(|row| row.first().sub_peaks > 0);
        let _ =
            writeln!(text, "sub-peaks: {}", if there { "at every value" } else { "at no value" });
    }
    text
}

/// Where the gap equals the critical spacing, which itself falls as the array grows with the gap: between two values of the
/// sweep, linearly.
fn critical_gap_mm(gaps: &[f64], result: &StudyResult) -> Option<f64> {
    let over: Vec<f64> = gaps
        .iter()
        .zip(&result.rows)
        .map(|(gap, row)| Some(gap - row.limits.critical_pitch_mm?))
        .collect::<Option<_>>()?;
    let index = over.windows(2).position(|pair| pair[0] < 0.0 && pair[1] >= 0.0)?;
    let share = -over[index] / (over[index + 1] - over[index]);
    Some(gaps[index] + share * (gaps[index + 1] - gaps[index]))
}
