//! Which figures of some records are drawn over time.

use std::collections::BTreeMap;

use crate::picture::{TrendCurves, TrendPoint};
use fieldgap_archive::{Entry, SeriesName};
use fieldgap_records::NoteKind;
use fieldgap_text::Uncertain;

/// Rigs with a mark of their own; further ones share the last.
const MOST_RIGS: usize = 7;

/// Fewest records with a figure for a curve over time.
const FEWEST: usize = 2;

/// The figures that every record has.
const OF_EVERY_RECORD: [&str; 4] = ["gap", "correlation", "level", "air.temperature_c"];

/// Figures at single heights are drawn only where they are asked for.
fn is_of_height(name: &SeriesName) -> bool {
    name.as_str().starts_with('z') && name.as_str().contains(".focus")
}

/// The names of the figures to draw: those of every record, then those asked for, then the parameters of causes.
pub(super) fn followed(entries: &[Entry], asked: &[SeriesName]) -> Vec<SeriesName> {
    let mut counts: BTreeMap<&SeriesName, usize> = BTreeMap::new();
    for name in entries.iter().filter(|e| e.recorded.is_some()).flat_map(|e| e.figures.keys()) {
        *counts.entry(name).or_default() += 1;
    }
    let mut names: Vec<SeriesName> = Vec::new();
    let usual = OF_EVERY_RECORD.iter().filter_map(|name| name.parse().ok());
    names.extend(usual.filter(|name: &SeriesName| counts.contains_key(name)));
    names.extend(asked.iter().filter(|name| counts.contains_key(name)).cloned());
    let parameters = counts.iter().filter(|(name, count)| {
        let drawn_with_another = matches!(name.as_str(), "noise_floor" | "air.humidity_percent");
        **count >= FEWEST && !is_of_height(name) && !drawn_with_another
    });
    names.extend(parameters.map(|(name, _)| (*name).clone()));
    let mut seen = std::collections::BTreeSet::new();
    names.retain(|name| seen.insert(name.clone()));
    names
}

/// The curve of a figure; records without a time or without the figure have no part in it. `entries` are in the order of time.
pub(super) fn curve(entries: &[Entry], name: &SeriesName) -> TrendCurves {
    let per_cent =
        matches!(name.as_str(), "gap" | "noise_floor") || name.as_str().ends_with(".gap");
    let factor = if per_cent { 100.0 } else { 1.0 };
    let mut rigs: Vec<(String, Vec<TrendPoint>)> = Vec::new();
    for entry in entries {
        let (Some(at_s), Some(figure)) = (seconds(entry), entry.figures.get(name)) else {
            continue;
        };
        let Uncertain { value, standard_error } = *figure;
        let point = TrendPoint { at_s, value: value * factor, error: standard_error * factor };
        let rig = entry.rig.as_deref().unwrap_or("no rig file");
        let place = rigs.iter().position(|(known, _)| known == rig);
        let place = place.unwrap_or_else(|| {
            if rigs.len() < MOST_RIGS {
                rigs.push((rig.to_owned(), Vec::new()));
            } else if rigs.len() == MOST_RIGS {
                rigs.push(("other rigs".to_owned(), Vec::new()));
            }
            rigs.len() - 1
        });
        rigs[place].1.push(point);
    }
    let short = name.as_str().rsplit('.').next().unwrap_or(name.as_str());
    let label = if per_cent { format!("{short} (%)") } else { short.to_owned() };
    let mut curves = TrendCurves::new(name.to_string(), label, rigs);
    curves.least = per_cent.then_some(0.0);
    let mut floor = Vec::new();
    if name.as_str() == "gap" {
        let known = |entry: &Entry| Some((seconds(entry)?, 100.0 * entry.noise_floor?));
        floor = entries.iter().filter_map(known).collect();
    }
    curves.with(floor, notes(entries))
}

fn seconds(entry: &Entry) -> Option<f64> {
    entry.recorded.map(|at| at.as_second() as f64)
}

/// Times and kinds of all notes, in the order of time.
fn notes(entries: &[Entry]) -> Vec<(f64, NoteKind)> {
    let all = entries.iter().flat_map(|entry| &entry.notes);
    let mut notes: Vec<(f64, NoteKind)> =
        all.map(|note| (note.at.as_second() as f64, note.kind)).collect();
    notes.sort_by(|a, b| a.0.total_cmp(&b.0));
    notes
}
