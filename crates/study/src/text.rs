//! The result of a study as text.

use std::fmt::Write;

use super::observation::OUTSIDE;
use super::{Figure, Limits, Onset, Quantiles, Row, Study, StudyResult};

/// The figures in columns, the limits from theory, and where sub-peaks appear.
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
        text += "figures of random arrays: median over the draws [5 % to 95 % quantile]\n";
    }
    if result.rows.iter().any(|row| row.outside() > 0) {
        text += "outside the map: the largest value is on the map's edge, so that no figure is given; take a larger map or move it\n";
    }
    text
}

fn figures(row: &Row) -> [String; 5] {
    if let [(_, only)] = &row.draws[..] {
        let Some(only) = only.figures() else {
            return ["-", "-", OUTSIDE, "-", ""].map(str::to_owned);
        };
        return [
            only.focal_radius_mm.map_or("-".to_owned(), |radius| format!("{radius:.4}")),
            format!("{:.6}", only.peak),
            format!("{}, {}", short(only.peak_x_mm), short(only.peak_y_mm)),
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
        match row.outside() {
            0 => String::new(),
            some => format!("{OUTSIDE} in {some} of {}", row.draws.len()),
        },
        spread(Figure::SubPeaks, 0),
        String::new(),
    ]
}

fn short(millimetres: f64) -> f64 {
    (millimetres * 1e3).round() / 1e3 + 0.0
}

/// The limits, as a range over the rows.
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
        let _ = writeln!(text, "near field of an element (a²/λ): to {face} from its face");
    }
    if let Some(array) = range(&|limits| Some(limits.array_near_field_mm)) {
        let _ = writeln!(
            text,
            "near field of the array (half its size squared, over λ): {array}; it cannot focus beyond"
        );
    }
    // A sweep of the spacing has lines of its own.
    if gap_sweep(study).is_none()
        && let (Some(critical), Some(pitch)) =
            (range(&|limits| limits.critical_pitch_mm), range(&|limits| limits.pitch_mm))
    {
        let _ = writeln!(
            text,
            "critical spacing λ/(1 + sin θ), centre to centre: {critical}; the pitch is {pitch}"
        );
    }
    text
}

/// The gaps, if the only sweep is over the gap between neighbouring rims.
fn gap_sweep(study: &Study) -> Option<Vec<f64>> {
    match &study.sweeps[..] {
        [sweep] if sweep.parameters == ["array.spacing_mm"] => sweep.ascending_numbers(),
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
            "critical spacing λ/(1 + sin θ), applied to the gap as in the thesis: {critical:.2} mm"
        );
        let _ = writeln!(
            text,
            "the formula applies to the pitch, which is {diameter:.1} mm without a gap: grating lobes exist at every \
             gap; whether they are on the map, and how strong, depends on the directivity"
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
            let pitch_mm = pitch - gaps[0] + onset.to;
            let _ = writeln!(text, "  (pitch {pitch_mm:.2} mm)");
        }
    }
    let single = study.sweeps.len() == 1 && study.sweeps[0].ascending_numbers().is_some();
    if onsets.is_empty() && single {
        let mut on_map = result.rows.iter().filter_map(|row| row.first().figures()).peekable();
        if on_map.peek().is_none() {
            let _ = writeln!(text, "sub-peaks: no peak is on the map; take a larger map");
            return text;
        }
        let everywhere = on_map.all(|figures| figures.sub_peaks > 0);
        let _ = writeln!(
            text,
            "sub-peaks: {}",
            if everywhere { "at every value" } else { "at no value" }
        );
    }
    text
}

/// The gap that equals the critical spacing, interpolated between two values of the sweep. The critical spacing itself
/// falls as the array grows with the gap.
fn critical_gap_mm(gaps: &[f64], result: &StudyResult) -> Option<f64> {
    let excess: Vec<f64> = gaps
        .iter()
        .zip(&result.rows)
        .map(|(gap, row)| Some(gap - row.limits.critical_pitch_mm?))
        .collect::<Option<_>>()?;
    let index = excess.windows(2).position(|pair| pair[0] < 0.0 && pair[1] >= 0.0)?;
    let share = -excess[index] / (excess[index + 1] - excess[index]);
    Some(gaps[index] + share * (gaps[index + 1] - gaps[index]))
}
