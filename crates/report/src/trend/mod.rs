//! Records over time: gap and parameters with their errors, what was noted, and links to the report of each record.

mod address;
mod followed;

use std::path::{Path, PathBuf};

use maud::{Markup, html};

use self::address::address;
use super::error::ReportError;
use super::figure::Figure;
use super::folder::Folder;
use super::html::{document, glossary, navigation, section};
use super::page::STYLE;
use super::picture::{Drawn, PrintStyle};
use fieldgap_archive::{Entry, SeriesName, State};
use fieldgap_diagnosis::joined;
use fieldgap_text::{ABSENT, Uncertain, fixed, percent, uncertain};

/// Records whose trend is shown.
#[derive(Debug, Clone, Copy)]
pub struct Trend<'a> {
    /// The folder that the folders of the records are relative to.
    pub root: &'a Path,
    /// The records with all their figures, in any order.
    pub entries: &'a [Entry],
    /// Figures to draw besides gap, correlation, level, temperature and the parameters of causes.
    pub figures: &'a [SeriesName],
    /// Name and version of the software.
    pub software: &'a str,
}

/// The files of a trend.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrendFiles {
    /// The page.
    pub page: PathBuf,
    /// The pictures, PNG and SVG, beside it.
    pub pictures: Vec<PathBuf>,
}

/// Writes a page of records over time, and its pictures beside it. `page` is the file if it ends in `.html`, else a folder for
/// `index.html`.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_trend(page: &Path, trend: Trend<'_>) -> Result<TrendFiles, ReportError> {
    let is_file = page.extension().is_some_and(|end| end == "html") && !page.is_dir();
    let here = || Path::new(".");
    let (dir, stem) = match (is_file, page.parent(), page.file_stem()) {
        (true, Some(dir), Some(stem)) => {
            let dir = if dir.as_os_str().is_empty() { here() } else { dir };
            (dir, Some(stem.to_string_lossy().into_owned()))
        }
        _ => (page, None),
    };
    let mut entries = trend.entries.to_vec();
    entries.sort_by(|a, b| a.recorded.cmp(&b.recorded).then_with(|| a.folder.cmp(&b.folder)));
    let names = followed::followed(&entries, trend.figures);
    let mut figures = Vec::new();
    for name in &names {
        let curves = followed::curve(&entries, name);
        let narrow = Drawn::new(&curves.narrow())?;
        let file = match &stem {
            Some(stem) => format!("{stem}-{name}"),
            None => name.to_string(),
        };
        let drawn = Drawn::printed(curves, PrintStyle::default())?;
        figures.push((name, Figure::new(file, drawn).with_narrow(narrow)));
    }
    let folder = Folder::make(dir)?;
    let pictures = folder.put_figures(figures.iter().map(|(_, figure)| figure))?;
    let text = page_of(dir, &trend, &entries, &figures);
    let name = stem.map_or("index.html".to_owned(), |stem| format!("{stem}.html"));
    let page = folder.put(&name, text.as_bytes())?;
    Ok(TrendFiles { page, pictures })
}

fn page_of(
    dir: &Path,
    trend: &Trend<'_>,
    entries: &[Entry],
    figures: &[(&SeriesName, Figure)],
) -> String {
    let count = entries.len();
    let title = match count {
        1 => "1 record over time".to_owned(),
        _ => format!("{count} records over time"),
    };
    let damaged: Vec<&Entry> = entries.iter().filter(|entry| entry.fault.is_some()).collect();
    let body = html! {
        header {
            h1 { (title) }
            p class="subtitle" { (subtitle(trend, entries)) }
        }
        @if !damaged.is_empty() {
            div class="warnings" role="note" {
                @for entry in damaged { p { (folder(entry)) ": " (entry.fault.as_deref().unwrap_or_default()) } }
            }
        }
        main {
            (navigation([("trend", "Figures over time"), ("notes", "Notes"), ("records", "Records"), ("guide", "How to read this page")]))
            (section("trend", "Figures over time", &html! {
                @if figures.is_empty() { p { "No record was compared with its simulation, so there is nothing to draw." } }
                @for (name, figure) in figures { (figure.markup(&html! { p { (caption(name)) } })) }
            }))
            (section("notes", "Notes", &notes(dir, trend, entries)))
            (section("records", "Records", &records(dir, trend, entries)))
            (section("guide", "How to read this page", &guide()))
            p class="subtitle" { "Written by " (trend.software) "." }
        }
    };
    document(&title, &[STYLE], &body)
}

fn subtitle(trend: &Trend<'_>, entries: &[Entry]) -> String {
    let times = || entries.iter().filter_map(|entry| entry.recorded);
    let day = |at: jiff::Timestamp| at.strftime("%Y-%m-%d").to_string();
    let span = match times().min().zip(times().max()) {
        Some((first, last)) if day(first) == day(last) => format!(", recorded on {}", day(first)),
        Some((first, last)) => format!(", recorded from {} to {}", day(first), day(last)),
        None => String::new(),
    };
    format!("Records below {}{span} (UTC)", trend.root.display())
}

/// What a picture shows.
fn caption(name: &SeriesName) -> String {
    match name.as_str() {
        "gap" => "Rms of the residual over rms of the readings, with the scatter that noise alone makes from scan to scan. The dashed grey \
                  line is the gap that noise alone would leave."
            .to_owned(),
        "correlation" => "Pearson's correlation of scan and simulation over all readings.".to_owned(),
        "level" => "Reading per unit of the simulation: transducers, driver, receiver and amplifier together.".to_owned(),
        "air.temperature_c" => "Mean temperature of the air during the scan, °C.".to_owned(),
        other if other.starts_with('z') && other.contains(".focus") => {
            format!("{other}: a figure at one height of one drive.")
        }
        other => format!("{other}: as fitted, in the records whose diagnosis names this effect."),
    }
}

fn folder(entry: &Entry) -> String {
    let folder = entry.folder.display().to_string();
    if folder.is_empty() { ".".to_owned() } else { folder }
}

/// The name of a record; a link to its report where it has one.
fn link(dir: &Path, trend: &Trend<'_>, entry: &Entry) -> Markup {
    let report = trend.root.join(&entry.folder).join("report").join("index.html");
    let address = if report.is_file() { address(dir, &report) } else { None };
    let name = match &entry.name {
        Some(name) if *name == folder(entry) => name.clone(),
        Some(name) => format!("{} ({name})", folder(entry)),
        None => folder(entry),
    };
    html! {
        @if let Some(address) = address { a href=(address) { (name) } } @else { (name) }
    }
}

fn minute(at: jiff::Timestamp) -> String {
    at.strftime("%Y-%m-%d %H:%M").to_string()
}

fn notes(dir: &Path, trend: &Trend<'_>, entries: &[Entry]) -> Markup {
    let mut notes: Vec<_> = entries
        .iter()
        .flat_map(|entry| entry.notes.iter().map(move |note| (note, entry)))
        .collect();
    notes.sort_by_key(|(note, _)| note.at);
    html! {
        @if notes.is_empty() { p { "Nothing was noted about these records." } }
        @else {
            div class="wide" {
                table class="facts" {
                    caption { "Alarms (A), calibrations (C), repairs (R) and other notes (N), as they are marked in the pictures" }
                    thead { tr { @for head in ["Time (UTC)", "Kind", "Who", "Note", "Record"] { th scope="col" { (head) } } } }
                    tbody {
                        @for (note, entry) in notes {
                            tr {
                                th scope="row" { (minute(note.at)) }
                                td { (note.kind.as_str()) } td { (note.who()) } td { (note.text()) } td { (link(dir, trend, entry)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn records(dir: &Path, trend: &Trend<'_>, entries: &[Entry]) -> Markup {
    let heads = [
        "Record",
        "Recorded (UTC)",
        "Rig",
        "State",
        "Readings",
        "Gap (%)",
        "Noise alone",
        "Correlation",
        "Cause",
    ];
    let in_percent = |figure: Uncertain| {
        let (value, standard_error) = (100.0 * figure.value, 100.0 * figure.standard_error);
        uncertain(Uncertain { value, standard_error })
    };
    let or_absent = |text: Option<String>| text.unwrap_or_else(|| ABSENT.to_owned());
    html! {
        div class="wide" {
            table class="names" {
                caption { "The oldest first. The name leads to the record's own report, where there is one." }
                thead { tr { @for head in heads { th scope="col" { (head) } } } }
                tbody {
                    @for entry in entries {
                        tr {
                            th scope="row" { (link(dir, trend, entry)) }
                            td { (or_absent(entry.recorded.map(minute))) }
                            td { (or_absent(entry.rig.clone())) }
                            td { @if entry.state != State::Imported { (entry.state.as_str()) } @else { (ABSENT) } }
                            td { (or_absent(entry.points.map(|points| points.to_string()))) }
                            td { (or_absent(entry.gap.map(in_percent))) }
                            td { (or_absent(entry.noise_floor.map(percent))) }
                            td { (or_absent(entry.correlation.map(|figure| fixed(figure.value, 4)))) }
                            td { (cause(entry)) }
                        }
                    }
                }
            }
        }
    }
}

fn cause(entry: &Entry) -> String {
    match entry.verdict {
        None => ABSENT.to_owned(),
        Some(verdict) if entry.effects.is_empty() => verdict.as_str().to_owned(),
        Some(_) => joined(&entry.effects, " + "),
    }
}

fn guide() -> Markup {
    glossary([
        (
            "Point",
            "The figure of one record, at the time when its scan was started. Each rig has its own mark and colour.",
        ),
        (
            "Error bar",
            "One standard error. Of gap and correlation it is what noise makes them scatter if the same scan is made again; of a \
                       parameter it is that of its fit. Records that were compared by an early version have none.",
        ),
        (
            "Noise alone",
            "The gap that the noise of the readings would leave if the simulation were exact. The squares add: a gap near this \
                         line says nothing about the simulation.",
        ),
        (
            "Upright line",
            "A note, at the time when it was written: A alarm, C calibration, R repair, N other.",
        ),
    ])
}
