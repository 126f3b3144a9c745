//! What was understood of a file of points, for a person to check.

use std::fmt::Write;

use fieldgap_records::{OFF_LINE_MM, Plane, RecordedSample, SAME_HEIGHT_MM, plane_map, planes};

use super::points::Points;

/// Columns of the map in a terminal.
const MAP_COLUMNS: usize = 64;

/// Most rows of the map.
const MAP_ROWS: usize = 24;

/// Characters of rising readings.
const SHADES: [char; 10] = [' ', '.', ':', '-', '=', '+', '*', '#', '%', '@'];

/// Heights that are listed.
const LISTED_HEIGHTS: usize = 8;

impl Points {
    /// What was understood, in lines of at most 80 columns beside texts of the file: number and ranges, grids, heights, the largest reading,
    /// and a map of the plane with it.
    pub fn summary(&self) -> String {
        let mut text = String::new();
        let planes = planes(&self.samples, SAME_HEIGHT_MM);
        // Writing to a string cannot fail.
        let _ = self.write_summary(&mut text, &planes);
        text
    }

    fn write_summary(&self, text: &mut String, planes: &[Plane<'_>]) -> std::fmt::Result {
        let unit = self.base.label();
        // What follows the format itself goes onto a line of its own.
        writeln!(text, "format    {}", self.format.replace("; ", "\n          "))?;
        writeln!(text, "readings  {}", self.samples.len())?;
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            let (least, most) = range(self.samples.iter().map(|sample| sample.position_mm[axis]));
            writeln!(text, "{name}         {} to {} mm", trimmed(least), trimmed(most))?;
        }
        let (least, most) = range(self.samples.iter().map(|sample| sample.reading));
        write!(text, "reading   {} to {} {unit}", significant(least), significant(most))?;
        match self.unit_in_file == unit {
            true => writeln!(text)?,
            false => writeln!(text, " (in the file: {})", self.unit_in_file)?,
        }
        let silent = self.samples.iter().filter(|sample| sample.focus.is_none()).count();
        if silent > 0 {
            writeln!(text, "silent    {silent} readings with the array silent")?;
        }
        write_heights(text, planes)?;
        if let Some(plane) = planes.first() {
            writeln!(text, "points    {}", arrangement(plane, planes))?;
        }
        for remark in &self.remarks {
            writeln!(text, "note      {remark}")?;
        }
        if self.samples.iter().any(|sample| sample.position_mm.z <= 0.0) {
            writeln!(text, "note      Some places lie at or below the array (z of 0 or less).")?;
        }
        let peak = planes
            .iter()
            .flat_map(|plane| plane.samples.iter().map(move |sample| (plane, *sample)))
            .max_by(|(_, a), (_, b)| a.reading.total_cmp(&b.reading));
        if let Some((plane, peak)) = peak {
            let at = peak.position_mm;
            writeln!(
                text,
                "largest   {} {unit} at x = {}, y = {}, z = {} mm",
                significant(peak.reading),
                trimmed(at.x),
                trimmed(at.y),
                trimmed(at.z)
            )?;
            write_map(text, plane)?;
        }
        Ok(())
    }
}

fn write_heights(text: &mut String, planes: &[Plane<'_>]) -> std::fmt::Result {
    let drives: std::collections::BTreeSet<usize> =
        planes.iter().map(|plane| plane.focus).collect();
    let mut heights: Vec<f64> = planes.iter().map(|plane| plane.z_mm).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|a, b| (*a - *b).abs() <= SAME_HEIGHT_MM);
    let listed: Vec<String> = heights.iter().take(LISTED_HEIGHTS).map(|z| trimmed(*z)).collect();
    let more = match heights.len() - listed.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    writeln!(text, "heights   {}: {}{more} mm", heights.len(), listed.join(", "))?;
    if drives.len() > 1 {
        writeln!(text, "drives    {}", drives.len())?;
    }
    Ok(())
}

/// Whether the points of the planes lie on grids.
fn arrangement(first: &Plane<'_>, planes: &[Plane<'_>]) -> String {
    match plane_map(first, OFF_LINE_MM) {
        Err(why) => format!("scattered: {why}"),
        Ok(map) => {
            let grids = planes.iter().filter(|plane| plane_map(plane, OFF_LINE_MM).is_ok()).count();
            let (columns, rows) = (map.map.x_m().len(), map.map.y_m().len());
            let [x, y] = map.step_mm.map(trimmed);
            let grid =
                format!("grid of {columns} x {rows}, steps of {x} mm along x and {y} mm along y");
            match (planes.len(), grids) {
                (1, _) => grid,
                (all, on_grids) if all == on_grids => {
                    format!("{grid} (first of {all} planes, all on grids)")
                }
                (all, on_grids) => format!("{grid} (first of {all} planes, {on_grids} on grids)"),
            }
        }
    }
}

/// A map of a plane: each character is the largest reading in its cell, on a scale from zero to the largest reading.
fn write_map(text: &mut String, plane: &Plane<'_>) -> std::fmt::Result {
    let along = |axis: usize| range(plane.samples.iter().map(|sample| sample.position_mm[axis]));
    let ((left, right), (bottom, top)) = (along(0), along(1));
    let (width, height) = (right - left, top - bottom);
    if width <= 0.0 || height <= 0.0 {
        return Ok(());
    }
    // A character is about twice as high as it is wide. No more cells than points, or the map of a grid would have gaps.
    let [columns, rows] = match plane_map(plane, OFF_LINE_MM) {
        Ok(map) => [map.map.x_m().len(), map.map.y_m().len()],
        Err(_) => [(2.0 * (plane.samples.len() as f64).sqrt()).ceil() as usize, MAP_ROWS],
    };
    let columns = columns.min(MAP_COLUMNS);
    let in_proportion = (columns as f64 * height / width / 2.0).round() as usize;
    let rows = rows.min(in_proportion.clamp(2, MAP_ROWS));
    let mut cells = vec![f64::NAN; columns * rows];
    let cell = |sample: &RecordedSample| {
        let part = |at: f64, from: f64, length: f64, count: usize| {
            (((at - from) / length * (count - 1) as f64).round() as usize).min(count - 1)
        };
        let column = part(sample.position_mm.x, left, width, columns);
        let row = part(top - sample.position_mm.y, 0.0, height, rows);
        row * columns + column
    };
    for sample in &plane.samples {
        let value = &mut cells[cell(sample)];
        *value = value.max(sample.reading);
    }
    let most = cells.iter().copied().fold(0.0, f64::max);
    let shade = |value: &f64| match value.is_nan() || most <= 0.0 {
        true => ' ',
        false => SHADES[((value / most * SHADES.len() as f64) as usize).min(SHADES.len() - 1)],
    };
    writeln!(text, "\nplane at z = {} mm, y up, x to the right:", trimmed(plane.z_mm))?;
    let label = |y: f64| format!("{:>9}", trimmed(y));
    for (row, line) in cells.chunks(columns).enumerate() {
        let margin = match row {
            0 => label(top),
            _ if row + 1 == rows => label(bottom),
            _ => " ".repeat(9),
        };
        writeln!(text, "{margin} |{}|", line.iter().map(shade).collect::<String>())?;
    }
    let (left, right) = (trimmed(left), trimmed(right));
    let gap = (columns + 2).saturating_sub(left.len() + right.len()).max(1);
    writeln!(text, "{}{left}{}{right} mm", " ".repeat(10), " ".repeat(gap))
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
}

/// A reading with four significant digits.
pub(crate) fn significant(value: f64) -> String {
    match value.abs().log10().floor() {
        power if value == 0.0 || !power.is_finite() => value.to_string(),
        power if (-4.0..6.0).contains(&power) => {
            format!("{value:.*}", (3.0 - power).max(0.0) as usize)
        }
        _ => format!("{value:.3e}"),
    }
}

/// A length with at most four decimals and no zeros at its end.
fn trimmed(mm: f64) -> String {
    let text = format!("{mm:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
