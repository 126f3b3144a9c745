//! The small maps of a campaign: each drawn once, all on one colour scale.

use std::path::Path;

use rayon::prelude::*;

use super::super::error::ReportError;
use super::super::picture::small_map;
use super::addresses::file_name;
use super::kept::put;
use super::map_file::{Entry, MapFile, Outcome, Place};
use fieldgap_campaign::{CellOverview, cell_folder};
use fieldgap_records::{MappedPlane, OFF_LINE_MM, RecordedScan, SAME_HEIGHT_MM, plane_map};

/// A map of a record.
struct Read {
    place: Place,
    unit: String,
    peak: f64,
    mapped: MappedPlane,
}

/// When a cell was measured, as the file of maps says it.
fn time_of(cell: &CellOverview) -> String {
    cell.run.as_ref().map_or(String::new(), |run| run.at.to_string())
}

/// The name of a map's file.
pub(super) fn map_name(cell: &CellOverview) -> String {
    format!("{}.png", file_name(&cell.id))
}

/// Draws the maps of cells that are not drawn yet; the first ones of the settings before the others, because they decide at which height a
/// setting is shown. `folder` is that of the maps.
pub(super) fn draw(
    campaign: &Path,
    folder: &Path,
    firsts: &[&CellOverview],
    others: &[&CellOverview],
) -> Result<MapFile, ReportError> {
    let mut file = MapFile::read(folder);
    let before = file.clone();
    let fresh = |file: &MapFile, cell: &CellOverview| {
        file.maps.get(&cell.id).is_some_and(|entry| {
            let there =
                matches!(entry.result, Outcome::None(_)) || folder.join(map_name(cell)).is_file();
            entry.at == time_of(cell) && there
        })
    };
    // A second pass draws those again whose scale the first had to change; a scale only grows to the largest peak, so that it is the last.
    for _ in 0..2 {
        let mut changed = false;
        for (cells, first) in [(firsts, true), (others, false)] {
            let todo: Vec<&CellOverview> =
                cells.iter().copied().filter(|cell| !fresh(&file, cell)).collect();
            let places = &file.places;
            let read: Vec<(&CellOverview, Result<Read, String>)> = todo
                .into_par_iter()
                .map(|cell| {
                    let place = if first { None } else { places.get(&cell.setting) };
                    (cell, read(campaign, cell, place))
                })
                .collect();
            for (cell, read) in &read {
                if let Ok(read) = read {
                    match first {
                        true => drop(file.places.insert(cell.setting.clone(), read.place)),
                        false => {
                            file.places.entry(cell.setting.clone()).or_insert(read.place);
                        }
                    }
                    changed |= file.reach(&read.unit, read.peak);
                }
            }
            let entries: Vec<(String, Entry)> = read
                .into_par_iter()
                .map(|(cell, read)| {
                    let result = match read {
                        Ok(read) => paint(&file, folder, cell, read)?,
                        Err(reason) => Outcome::None(reason),
                    };
                    Ok((cell.id.clone(), Entry { at: time_of(cell), result }))
                })
                .collect::<Result<_, ReportError>>()?;
            file.maps.extend(entries);
        }
        if !changed {
            break;
        }
    }
    if file != before {
        file.write(folder)?;
    }
    Ok(file)
}

fn paint(
    file: &MapFile,
    folder: &Path,
    cell: &CellOverview,
    read: Read,
) -> Result<Outcome, ReportError> {
    let Read { place, unit, peak, mapped } = read;
    let top = file.tops.get(&unit).copied().unwrap_or(1.0);
    let drawn = small_map(&mapped.map, mapped.step_mm, top)?;
    put(&folder.join(map_name(cell)), &drawn.png)?;
    Ok(Outcome::Drawn { place, unit, peak, extent_mm: drawn.extent_mm })
}

/// The map of a cell's record: at a place, or else at that of the largest reading, where the focus is.
fn read(campaign: &Path, cell: &CellOverview, place: Option<&Place>) -> Result<Read, String> {
    let scan =
        RecordedScan::open(&cell_folder(campaign, &cell.id)).map_err(|fault| fault.to_string())?;
    let mut why = "the record has no readings with the array driven".to_owned();
    let mut best: Option<Read> = None;
    for plane in scan.planes(SAME_HEIGHT_MM) {
        if place.is_some_and(|place| {
            place.focus != plane.focus || (place.z_mm - plane.z_mm).abs() > SAME_HEIGHT_MM
        }) {
            why = "the record has no readings at the height that is shown".to_owned();
            continue;
        }
        let mapped = match plane_map(&plane, OFF_LINE_MM) {
            Ok(mapped) => mapped,
            Err(reason) => {
                why = reason.to_string();
                continue;
            }
        };
        let finite = mapped.map.values().iter().copied().filter(|value| value.is_finite());
        let peak = finite.fold(0.0, f64::max);
        if best.as_ref().is_none_or(|best| peak > best.peak) {
            let place = Place { focus: plane.focus, z_mm: plane.z_mm };
            best = Some(Read { place, unit: scan.setup.unit.clone(), peak, mapped });
        }
    }
    best.ok_or(why)
}
