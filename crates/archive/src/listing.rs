//! Records as a table for a terminal, and as CSV.

use fieldgap_diagnosis::{Verdict, joined};
use fieldgap_text::{ABSENT, Uncertain, fixed, paragraph, uncertain};
use jiff::tz::TimeZone;

use crate::entry::{Entry, State};
use crate::series::SeriesName;

/// Line width of a terminal, characters.
const WIDTH: usize = 80;

/// Between columns.
const BETWEEN: &str = "  ";

/// Names and causes are not made shorter than this.
const SHORTEST: usize = 8;

/// Longest name of a figure at the head of its column.
const FIGURE: usize = 14;

/// Records as a table at most 80 columns wide, unless many figures are asked for; then what is wrong with the damaged ones.
pub fn to_text(entries: &[Entry], figures: &[SeriesName]) -> String {
    let columns_with = |name: fn(&Entry) -> String| {
        let mut columns = vec![
            column("recorded (UTC)", entries, |entry| {
                let at = entry.recorded.map(|at| at.to_zoned(TimeZone::UTC));
                at.map_or(ABSENT.to_owned(), |at| at.strftime("%Y-%m-%d %H:%M").to_string())
            }),
            column("record", entries, name),
        ];
        columns.extend(figures.iter().map(|figure| {
            let head = shortened(figure.as_str(), FIGURE);
            column(&head, entries, |entry| number(entry.figures.get(figure).copied(), 1.0))
        }));
        columns.push(column("gap (%)", entries, |entry| number(entry.gap, 100.0)));
        // The figures that are asked for take its place.
        if figures.is_empty() {
            columns.push(column("r", entries, |entry| {
                entry.correlation.map_or(ABSENT.to_owned(), |r| fixed(r.value, 4))
            }));
        }
        columns.push(column("cause", entries, cause));
        columns
    };
    let mut columns = columns_with(folder_and_name);
    if total(&columns) > WIDTH {
        columns = columns_with(folder);
        fit(&mut columns);
    }
    let mut text = String::new();
    for row in 0..=entries.len() {
        let last = columns.len() - 1;
        let cell = |(place, column): (usize, &Vec<String>)| {
            let width = width(column);
            match place {
                0 | 1 => format!("{:<width$}", column[row]),
                _ if place == last => column[row].clone(),
                _ => format!("{:>width$}", column[row]),
            }
        };
        let cells: Vec<String> = columns.iter().enumerate().map(cell).collect();
        text += cells.join(BETWEEN).trim_end();
        text.push('\n');
    }
    for entry in entries {
        if let Some(fault) = &entry.fault {
            text.push('\n');
            text += &paragraph(&format!("{}: {fault}", entry.folder.display()), 0, 2);
        }
    }
    text
}

/// Head and cells.
fn column(head: &str, entries: &[Entry], cell: impl Fn(&Entry) -> String) -> Vec<String> {
    std::iter::once(head.to_owned()).chain(entries.iter().map(cell)).collect()
}

fn width(column: &[String]) -> usize {
    column.iter().map(|cell| cell.chars().count()).max().unwrap_or(0)
}

/// Width of a table.
fn total(columns: &[Vec<String>]) -> usize {
    let widths: usize = columns.iter().map(|column| width(column)).sum();
    widths + BETWEEN.len() * columns.len().saturating_sub(1)
}

/// Shortens names and causes until the table fits.
fn fit(columns: &mut [Vec<String>]) {
    let last = columns.len() - 1;
    let widths: Vec<usize> = columns.iter().map(|column| width(column)).collect();
    let others: usize = widths.iter().sum::<usize>() - widths[1] - widths[last];
    let room = WIDTH.saturating_sub(others + BETWEEN.len() * last);
    // Two thirds for the names, and what one of them leaves is the other's.
    let name = widths[1].min((2 * room / 3).max(room.saturating_sub(widths[last]))).max(SHORTEST);
    let cause = room.saturating_sub(name).max(SHORTEST);
    for (place, width) in [(1, name), (last, cause)] {
        for cell in &mut columns[place] {
            *cell = shortened(cell, width);
        }
    }
}

/// A text of at most so many characters: its middle left out, because names of a series differ at their ends.
fn shortened(text: &str, width: usize) -> String {
    let characters: Vec<char> = text.chars().collect();
    if characters.len() <= width {
        return text.to_owned();
    }
    let kept = width.saturating_sub(1);
    let tail = kept / 2;
    let head: String = characters[..kept - tail].iter().collect();
    let tail: String = characters[characters.len() - tail..].iter().collect();
    format!("{head}…{tail}")
}

/// The record's folder, which other commands take; the name of a record that is the folder of the list itself.
fn folder(entry: &Entry) -> String {
    let folder = entry.folder.display().to_string();
    if folder.is_empty() { entry.name.clone().unwrap_or_default() } else { folder }
}

/// Its folder, and its name where that is another one.
fn folder_and_name(entry: &Entry) -> String {
    let folder = folder(entry);
    match &entry.name {
        Some(name) if !folder.ends_with(name.as_str()) => format!("{folder} ({name})"),
        _ => folder,
    }
}

fn number(figure: Option<Uncertain>, factor: f64) -> String {
    figure.map_or(ABSENT.to_owned(), |figure| {
        let (value, standard_error) = (figure.value * factor, figure.standard_error * factor);
        uncertain(Uncertain { value, standard_error })
    })
}

/// The cause, and what limits the record.
fn cause(entry: &Entry) -> String {
    let found = match entry.verdict {
        _ if entry.fault.is_some() => "damaged".to_owned(),
        Some(Verdict::None) => "noise alone".to_owned(),
        Some(verdict) if entry.effects.is_empty() => verdict.as_str().to_owned(),
        Some(_) => joined(&entry.effects, " + "),
        None if entry.gap.is_none() => "not compared".to_owned(),
        None => String::new(),
    };
    match (entry.state, found.is_empty()) {
        (State::Complete | State::Imported, _) => found,
        (state, true) => state.as_str().to_owned(),
        (state, false) => format!("{}, {found}", state.as_str()),
    }
}

/// Records as CSV with a row for each. Ratios are plain numbers, lists are separated by semicolons.
///
/// # Errors
/// None that are known: what is written has text alone.
pub fn to_csv(entries: &[Entry], figures: &[SeriesName]) -> Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut head: Vec<String> = [
        "folder",
        "name",
        "recorded",
        "rig",
        "state",
        "points",
        "foci_mm",
        "heights_mm",
        "simulator",
        "gap",
        "gap_error",
        "noise_floor",
        "level",
        "level_error",
        "correlation",
        "correlation_error",
        "verdict",
        "effects",
        "temperature_c",
        "temperature_error_c",
        "notes",
        "fault",
    ]
    .map(str::to_owned)
    .to_vec();
    for figure in figures {
        head.extend([figure.to_string(), format!("{figure}_error")]);
    }
    writer.write_record(&head)?;
    for entry in entries {
        let mut row = vec![
            entry.folder.display().to_string(),
            entry.name.clone().unwrap_or_default(),
            entry.recorded.map(|at| at.to_string()).unwrap_or_default(),
            entry.rig.clone().unwrap_or_default(),
            entry.state.as_str().to_owned(),
            entry.points.map(|points| points.to_string()).unwrap_or_default(),
            list(&entry.foci_mm, |focus| {
                focus.map_or(String::new(), |[x, y, z]| format!("{x} {y} {z}"))
            }),
            list(&entry.heights_mm, f64::to_string),
            entry.simulator.map(|simulator| simulator.to_string()).unwrap_or_default(),
        ];
        row.extend(with_error(entry.gap));
        row.push(finite(entry.noise_floor));
        row.extend(with_error(entry.level));
        row.extend(with_error(entry.correlation));
        row.push(entry.verdict.map(|verdict| verdict.as_str().to_owned()).unwrap_or_default());
        row.push(list(&entry.effects, |effect| effect.as_str().to_owned()));
        row.extend(with_error(entry.temperature_c));
        row.push(list(&entry.notes, |note| note.text().to_owned()));
        row.push(entry.fault.clone().unwrap_or_default());
        for figure in figures {
            row.extend(with_error(entry.figures.get(figure).copied()));
        }
        writer.write_record(&row)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|error| csv::Error::from(std::io::Error::other(error.to_string())))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

fn list<T>(items: &[T], text: impl Fn(&T) -> String) -> String {
    items.iter().map(text).collect::<Vec<_>>().join("; ")
}

fn finite(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map(|value| value.to_string()).unwrap_or_default()
}

fn with_error(figure: Option<Uncertain>) -> [String; 2] {
    [finite(figure.map(|figure| figure.value)), finite(figure.map(|figure| figure.standard_error))]
}
