//! The units of points: as requested, or as the file states them.

use std::path::Path;

use fieldgap_input::Fault;

use super::request::{PointsRequest, Source, Units};
use super::rows::Role;
use crate::unit::{LengthUnit, ReadingUnit};

/// The units of the requested columns. What the file states must not contradict the request.
pub(crate) fn units<'f>(
    path: &Path,
    request: &PointsRequest,
    complex: bool,
    stated: &dyn Fn(Role) -> Option<&'f str>,
) -> Result<Units, Fault> {
    let remedy = "give the units of x, y, z and the reading, as --units mm,mm,mm,V";
    let Some(units) = &request.units else {
        return of_file(path, request, complex, stated, remedy);
    };
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        if let Some(Ok(in_file)) = stated(Role::Place(axis)).map(str::parse::<LengthUnit>)
            && in_file != units.place[axis]
        {
            return Err(contradiction(
                path,
                name,
                &in_file.to_string(),
                &units.place[axis].to_string(),
            ));
        }
    }
    if let Some(Ok(in_file)) = stated(Role::Reading).map(str::parse::<ReadingUnit>)
        && in_file != units.reading
        // A heading says `dB` without its reference.
        && !matches!((&in_file, &units.reading), (ReadingUnit::Decibel(None), ReadingUnit::Decibel(_)))
    {
        return Err(contradiction(
            path,
            "the reading",
            &in_file.to_string(),
            &units.reading.to_string(),
        ));
    }
    match (complex, units.phase) {
        (false, Some(_)) => {
            let problem = "--units has the unit of a phase, but --columns has no column for it";
            Err(Fault::of_file(
                path,
                problem,
                "name amplitude and phase, as --columns x,y,z,amplitude,phase",
            ))
        }
        (true, None) if matches!(units.reading, ReadingUnit::Decibel(_)) => {
            let problem = "the two parts of a complex reading cannot be in dB";
            Err(Fault::of_file(
                path,
                problem,
                "for an amplitude in dB and a phase give --units mm,mm,mm,dB,rad",
            ))
        }
        _ => Ok(units.clone()),
    }
}

fn of_file<'f>(
    path: &Path,
    request: &PointsRequest,
    complex: bool,
    stated: &dyn Fn(Role) -> Option<&'f str>,
    remedy: &str,
) -> Result<Units, Fault> {
    let places = request.columns.iter().flat_map(|columns| &columns.place);
    let mut texts = Vec::new();
    for (axis, source) in places.enumerate() {
        texts.push(match source {
            Source::Column(_) => stated(Role::Place(axis)),
            // A constant is in the unit of the other coordinates.
            Source::Constant(_) => (0..3).find_map(|axis| stated(Role::Place(axis))),
        });
    }
    texts.push(stated(Role::Reading));
    if complex {
        texts.push(stated(Role::Second));
    }
    let names = ["x", "y", "z", "the reading", "the second part of the reading"];
    let unknown: Vec<&str> = names
        .iter()
        .zip(&texts)
        .filter(|(_, unit)| unit.is_none())
        .map(|(name, _)| *name)
        .collect();
    if !unknown.is_empty() {
        let problem = format!("does not state the unit of {}", unknown.join(", "));
        return Err(Fault::of_file(path, problem, remedy));
    }
    let texts: Vec<&str> = texts.into_iter().flatten().collect();
    Units::of(&texts).map_err(|wrong| {
        Fault::of_file(path, format!("states units that cannot be used: {wrong}"), remedy)
    })
}

fn contradiction(path: &Path, what: &str, in_file: &str, requested: &str) -> Fault {
    Fault::of_file(
        path,
        format!("states that {what} is in {in_file}, but --units says {requested}"),
        "correct --units, or leave it out to take the units of the file",
    )
}
