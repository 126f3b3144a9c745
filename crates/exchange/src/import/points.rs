//! Points of a file as readings of a record: units, missing values, signs, and limits.

use std::path::Path;

use fieldgap_acoustics::Vec3;
use fieldgap_input::{Delay, Fault, Place};
use fieldgap_records::import::MADE_UP_SECONDS_A_POINT;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup, Spread};

use super::request::{Negative, PointsRequest, Units};
use super::rows::{Role, Rows};
use super::summary::significant;
use crate::arrays::MOST_POINTS;
use crate::unit::{AngleUnit, Base, LengthUnit, ReadingUnit};

/// Share of negative readings from which both signs are a property of the data, not noise about zero.
const SUBSTANTIAL: f64 = 0.05;

/// Points of a file, understood as readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// What the file is: its format and the columns used.
    pub format: String,
    /// The unit of the readings in the file.
    pub unit_in_file: String,
    /// The unit of the readings in the record.
    pub base: Base,
    /// The readings, in the order of the file; at least one.
    pub samples: Vec<RecordedSample>,
    /// What was left out or changed, a sentence each.
    pub remarks: Vec<String>,
}

impl Points {
    /// The points as a record.
    ///
    /// # Errors
    /// A [`Fault`] if the set-up states another unit of readings, or has no such drive.
    pub fn into_scan(self, setup: ScanSetup, setup_path: &Path) -> Result<RecordedScan, Fault> {
        if setup.unit != self.base.label() {
            return Err(Fault::of_file(
                setup_path,
                format!(
                    "states readings in {}, but the points are imported in {}",
                    setup.unit,
                    self.base.label()
                ),
                format!("write reading = \"{}\", or correct --units", self.base.label()),
            ));
        }
        let last = self.samples.iter().filter_map(|sample| sample.focus).max();
        if let Some(last) = last
            && last >= setup.foci.len()
        {
            return Err(Fault::of_file(
                setup_path,
                format!(
                    "has {} drives ([[focus]]), but readings belong to drive {last}",
                    setup.foci.len()
                ),
                "drives are numbered from 0; add the missing ones, or correct --focus or --drive-column",
            ));
        }
        Ok(RecordedScan { setup, samples: self.samples })
    }
}

/// Rows as readings.
pub(crate) fn points(
    rows: Rows,
    format: String,
    units: &Units,
    request: &PointsRequest,
) -> Result<Points, Fault> {
    if rows.len() > MOST_POINTS {
        let problem = format!("has {} points; a record has at most {MOST_POINTS}", rows.len());
        return Err(Fault::of_file(rows.path(), problem, "split the file into several"));
    }
    let mut remarks = Vec::new();
    let kept = kept(&rows, &units.reading, &mut remarks)?;
    let (amplitudes, kept) = amplitudes(&rows, kept, units, request.negative, &mut remarks)?;
    remarks.extend(rows.second.as_ref().filter(|_| !request.phase).map(|_| {
        let phase = match units.phase {
            None => "phase of the complex readings",
            Some(AngleUnit::Degree) => "phase (in degrees)",
            Some(AngleUnit::Radian) => "phase (in radians)",
        };
        format!("The {phase} is left out: --phase-convention, or [phase] of the set-up, says what it means.")
    }));
    let samples = kept
        .iter()
        .zip(&amplitudes)
        .enumerate()
        .map(|(order, (&row, &amplitude))| sample(&rows, row, order, amplitude, units, request))
        .collect::<Result<Vec<RecordedSample>, Fault>>()?;
    let base = units.reading.base().unwrap_or(Base::Relative);
    refuse_tiny_extent(&rows, &samples, units.place)?;
    Ok(Points { format, unit_in_file: units.reading.to_string(), base, samples, remarks })
}

/// The rows with a place and a reading.
fn kept(rows: &Rows, unit: &ReadingUnit, remarks: &mut Vec<String>) -> Result<Vec<usize>, Fault> {
    let (mut kept, mut no_reading, mut no_place) = (Vec::new(), Vec::new(), Vec::new());
    let silent_decibel = matches!(unit, ReadingUnit::Decibel(_));
    for row in 0..rows.len() {
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            if rows.place[axis][row].is_infinite() {
                let problem = format!("{name} is infinite");
                return Err(rows.fault(
                    row,
                    Role::Place(axis),
                    problem,
                    "correct the value, or remove the row",
                ));
            }
        }
        let reading = rows.reading[row];
        let second = rows.second.as_ref().map_or(0.0, |second| second[row]);
        if rows.place.iter().any(|along| along[row].is_nan()) {
            no_place.push(row);
        } else if reading.is_nan() || second.is_nan() {
            no_reading.push(row);
        } else if second.is_infinite()
            || (reading.is_infinite() && !(silent_decibel && reading < 0.0))
        {
            let remedy =
                "the receiver was perhaps overloaded there: correct the value, or remove the row";
            return Err(rows.fault(row, Role::Reading, "the reading is infinite", remedy));
        } else {
            kept.push(row);
        }
    }
    for (left_out, lack) in [(no_reading, "reading"), (no_place, "place")] {
        if !left_out.is_empty() {
            let without = if left_out.len() == 1 { "point" } else { "points" };
            let places = rows.places(&left_out);
            remarks
                .push(format!("{} {without} without a {lack} left out: {places}.", left_out.len()));
        }
    }
    if kept.is_empty() {
        let remedy = "check the choice of columns";
        return Err(Fault::of_file(rows.path(), "no row has a place and a reading", remedy));
    }
    Ok(kept)
}

/// The amplitudes of the kept rows in the unit of the record, and the rows that they belong to.
fn amplitudes(
    rows: &Rows,
    kept: Vec<usize>,
    units: &Units,
    negative: Negative,
    remarks: &mut Vec<String>,
) -> Result<(Vec<f64>, Vec<usize>), Fault> {
    let reading = |&row: &usize| rows.reading[row];
    let in_base: Vec<f64> = match (&units.reading, &rows.second, units.phase) {
        (ReadingUnit::Linear(linear), Some(imaginary), None) => kept
            .iter()
            .map(|&row| linear.to_base(rows.reading[row].hypot(imaginary[row])))
            .collect(),
        (ReadingUnit::Linear(linear), ..) => {
            kept.iter().map(|row| linear.to_base(reading(row))).collect()
        }
        (ReadingUnit::Decibel(reference), ..) => {
            let largest = kept.iter().map(reading).fold(f64::NEG_INFINITY, f64::max);
            let (zero_db, value) = match reference {
                Some(reference) => (0.0, reference.value),
                None => (largest, 1.0),
            };
            kept.iter().map(|row| value * 10f64.powf((reading(row) - zero_db) / 20.0)).collect()
        }
        (ReadingUnit::Phase(_), ..) => Vec::new(),
    };
    refuse_absurd(rows, &kept, &in_base, units)?;
    let below: Vec<usize> =
        kept.iter().zip(&in_base).filter(|(_, value)| **value < 0.0).map(|(row, _)| *row).collect();
    if below.is_empty() {
        return Ok((in_base, kept));
    }
    match negative {
        Negative::Refuse => Err(negative_readings(rows, &below, &in_base, units)),
        Negative::Rectify => {
            remarks.push(format!(
                "{} negative readings rectified: their sign was removed ({}).",
                below.len(),
                rows.places(&below)
            ));
            Ok((in_base.into_iter().map(f64::abs).collect(), kept))
        }
        Negative::LeaveOut => {
            remarks.push(format!(
                "{} negative readings left out: {}.",
                below.len(),
                rows.places(&below)
            ));
            let both = in_base.into_iter().zip(kept).filter(|(value, _)| *value >= 0.0);
            let (values, kept): (Vec<f64>, Vec<usize>) = both.unzip();
            if kept.is_empty() {
                let remedy = "use --negative rectify, or check the choice of columns";
                return Err(Fault::of_file(rows.path(), "every reading is negative", remedy));
            }
            Ok((values, kept))
        }
    }
}

/// Refuses a reading that no receiver gives, and names the unit in which it may be.
fn refuse_absurd(rows: &Rows, kept: &[usize], values: &[f64], units: &Units) -> Result<(), Fault> {
    let Some(base) = units.reading.base() else { return Ok(()) };
    // Numbers of a record are at most 1e12.
    let most = base.most().min(1e12);
    let Some(index) = values.iter().position(|value| value.is_nan() || value.abs() > most) else {
        return Ok(());
    };
    let (value, unit) = (values[index], &units.reading);
    let likely = match (unit, base) {
        (ReadingUnit::Decibel(_), _) => "is the column in dB? Readings that are not need V or Pa",
        (_, Base::Volt) => "is the column in mV or uV, or a count of the converter?",
        (_, Base::Pascal) => "is the column in mPa or uPa, or in dB:20uPa?",
        _ => "check the choice of columns",
    };
    let problem =
        format!("a reading of {value:.6e} {} is beyond every receiver (in {unit})", base.label());
    Err(rows.fault(kept[index], Role::Reading, problem, likely))
}

/// What negative readings are, by their share and size.
fn negative_readings(rows: &Rows, below: &[usize], values: &[f64], units: &Units) -> Fault {
    let share = below.len() as f64 / values.len() as f64;
    let (least, most) = values.iter().fold((0.0f64, 0.0f64), |(a, b), &v| (a.min(v), b.max(v)));
    let unit = units.reading.base().map_or("", Base::label);
    let count = format!(
        "{} of {} readings are negative ({} to {} {unit})",
        below.len(),
        values.len(),
        significant(least),
        significant(most)
    );
    let (problem, remedy) = if most <= 0.0 {
        (
            format!("{count}: they look like decibels"),
            "give --units ...,dB or dB:1V if they are; --negative rectify removes the sign if the receiver inverts",
        )
    } else if share > SUBSTANTIAL {
        (
            format!(
                "{count}: they look like instantaneous samples of the wave, or like the real part of a complex field, not like \
                 amplitudes"
            ),
            "export the amplitude, or give the imaginary part too (--columns x,y,z,re,im); --negative rectify takes the magnitude, which \
             is not the amplitude where the sample missed the crest",
        )
    } else {
        (
            format!("{count}: they look like noise about zero after an offset was subtracted"),
            "use --negative rectify to remove their sign, or --negative leave-out to leave them out",
        )
    };
    rows.fault(below[0], Role::Reading, problem, remedy)
}

fn sample(
    rows: &Rows,
    row: usize,
    order: usize,
    amplitude: f64,
    units: &Units,
    request: &PointsRequest,
) -> Result<RecordedSample, Fault> {
    let mut position_mm = Vec3::zeros();
    for axis in 0..3 {
        let mm = units.place[axis].to_mm(rows.place[axis][row]);
        position_mm[axis] = Place::new(mm).map_err(|_| out_of_reach(rows, row, axis, units))?.get();
    }
    let time_s = match &rows.time {
        None => order as f64 * MADE_UP_SECONDS_A_POINT,
        // A clock of any origin: seconds since 1970 are below 1e10.
        Some(times) if times[row].abs() <= 1e12 => times[row],
        Some(_) => {
            return Err(rows.fault(
                row,
                Role::Time,
                "the time is missing or beyond 1e12 s",
                "correct it, or leave out --time-column",
            ));
        }
    };
    let focus = match &rows.drive {
        None => Some(request.focus),
        Some(drives) => match drives[row] {
            -1.0 => None,
            drive if drive >= 0.0 && drive.fract() == 0.0 && drive < 1e6 => Some(drive as usize),
            _ => {
                let remedy = "drives are numbered from 0; -1 means that the array was silent";
                return Err(rows.fault(
                    row,
                    Role::Drive,
                    "this is not the number of a drive",
                    remedy,
                ));
            }
        },
    };
    let spread = match &rows.spread {
        None => None,
        Some([std, count]) => Some(spread(rows, row, std[row], count[row], units)?),
    };
    let phase_rad = request.phase.then(|| phase_rad(rows, row, units)).flatten();
    Ok(RecordedSample { time_s, focus, position_mm, reading: amplitude, phase_rad, spread })
}

/// The phase of a reading of two parts.
fn phase_rad(rows: &Rows, row: usize, units: &Units) -> Option<f64> {
    let (first, second) = (rows.reading[row], rows.second.as_ref()?[row]);
    let Some(angle) = units.phase else { return Some(second.atan2(first)) };
    // An amplitude whose sign was removed was in the opposite phase. (Decibels below zero are no such amplitude.)
    let is_inverted = first < 0.0 && matches!(units.reading, ReadingUnit::Linear(_));
    Some(angle.to_rad(second) + if is_inverted { std::f64::consts::PI } else { 0.0 })
}

fn spread(rows: &Rows, row: usize, std: f64, count: f64, units: &Units) -> Result<Spread, Fault> {
    let ReadingUnit::Linear(linear) = units.reading else {
        return Err(rows.fault(
            row,
            Role::Spread(0),
            "a standard deviation of decibels cannot be imported",
            "leave out --spread-columns, or export linear readings",
        ));
    };
    let std = linear.to_base(std);
    if Delay::new(std).is_err() {
        let remedy =
            "a standard deviation is zero or above; leave out --spread-columns if some are missing";
        return Err(rows.fault(row, Role::Spread(0), "this is not a standard deviation", remedy));
    }
    if !(count >= 1.0 && count.fract() == 0.0 && count <= f64::from(u32::MAX)) {
        let remedy = "a count is a whole number from 1";
        return Err(rows.fault(row, Role::Spread(1), "this is not a count of readings", remedy));
    }
    Ok(Spread { std, count: count as u32 })
}

/// Largest coordinate of a column as it stands in the file.
fn largest(rows: &Rows, axis: usize) -> f64 {
    rows.place[axis].iter().filter(|v| v.is_finite()).fold(0.0f64, |most, v| most.max(v.abs()))
}

/// The unit in which a column of coordinates is likely, if it is not that of its stated unit: its largest value is between 2 mm and 2 m.
fn likely_unit(largest: f64, stated: LengthUnit) -> Option<LengthUnit> {
    let usual =
        |unit: &LengthUnit| *unit != stated && (2.0..=2000.0).contains(&unit.to_mm(largest));
    [LengthUnit::Millimetre, LengthUnit::Micrometre, LengthUnit::Metre, LengthUnit::Centimetre]
        .into_iter()
        .find(usual)
}

fn out_of_reach(rows: &Rows, row: usize, axis: usize, units: &Units) -> Fault {
    let (name, unit) = (["x", "y", "z"][axis], units.place[axis]);
    let problem = format!(
        "{name} is {} {unit}, and places lie within 10 m of the array",
        rows.place[axis][row]
    );
    let remedy = match likely_unit(largest(rows, axis), unit) {
        Some(likely) => {
            format!("is the column in {likely}? Then give --units with {likely} in place of {unit}")
        }
        None => "check the choice of columns and --units".to_owned(),
    };
    rows.fault(row, Role::Place(axis), problem, remedy)
}

/// Largest extent of a field that shows nothing, mm: a twentieth of the wavelength at 40 kHz.
const TINY_MM: f64 = 0.4;

/// Fewest different places for which an extent is judged: fewer may be repeats at one point.
const SOME_PLACES: usize = 5;

fn refuse_tiny_extent(
    rows: &Rows,
    samples: &[RecordedSample],
    units: [LengthUnit; 3],
) -> Result<(), Fault> {
    let (mut least, mut most) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    for sample in samples {
        least = least.inf(&sample.position_mm);
        most = most.sup(&sample.position_mm);
    }
    let extent = (most - least).max();
    let mut places: Vec<[u64; 3]> = Vec::new();
    for sample in samples {
        let place: [f64; 3] = sample.position_mm.into();
        let place = place.map(f64::to_bits);
        if !places.contains(&place) {
            places.push(place);
        }
        if places.len() == SOME_PLACES {
            break;
        }
    }
    if extent >= TINY_MM || places.len() < SOME_PLACES {
        return Ok(());
    }
    let axis = (most - least).imax();
    let likely = likely_unit(largest(rows, axis), units[axis]);
    let remedy = match likely {
        Some(likely) => format!(
            "are the places in {likely}? Then give --units with {likely} in place of {}",
            units[axis]
        ),
        None => "check the choice of columns and --units".to_owned(),
    };
    let problem = format!(
        "all places lie within {extent:.4} mm of each other, which is less than a twentieth of a wavelength"
    );
    Err(Fault::of_file(rows.path(), problem, remedy))
}
