//! `samples.csv`: the readings of a record, in the order of acquisition.
//!
//! `time_s,focus,x_mm,y_mm,z_mm,reading` and, where the receiver gives them, `std,count`, and last `phase_rad`. Focus -1 means that the
//! array was silent. An empty `phase_rad` is a phase that was lost. Other programs may write `re,im` in place of `reading`. An invalid row
//! is an error at its line and column; it is never skipped.

use std::io::{self, Write};
use std::path::Path;

use super::plan::MAX_VISITS;
use super::reading_range::ReadingRange;
use super::sample::{RecordedSample, Spread};
use super::setup::ScanSetup;
use super::table::{Row, Table, in_range};
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Fault, OutOfRange};

/// The columns of every record, before those of the reading.
const PLACED: [&str; 5] = ["time_s", "focus", "x_mm", "y_mm", "z_mm"];

const USUAL: &str = "the first line is `time_s,focus,x_mm,y_mm,z_mm,reading`, followed by `,std,count` where the receiver gives them and by \
                     `,phase_rad` where it gives a phase; `re,im` may stand in place of `reading`";

/// How a `samples.csv` states readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stated {
    /// `reading`: amplitudes.
    Amplitude,
    /// `reading`, and `phase_rad` as the last column.
    AmplitudeAndPhase,
    /// `re,im` in place of `reading`.
    Parts,
}

/// Which columns a `samples.csv` has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns {
    stated: Stated,
    spread: bool,
}

impl Columns {
    /// The six columns of every record.
    pub const PLAIN: Self = Self { stated: Stated::Amplitude, spread: false };
    /// With standard deviation and count.
    pub const WITH_SPREAD: Self = Self { stated: Stated::Amplitude, spread: true };

    /// Those that this program writes.
    pub(super) fn written() -> [Self; 4] {
        [Self::PLAIN, Self::WITH_SPREAD]
            .map(|columns| [columns, columns.with_phase()])
            .concat()
            .try_into()
            .expect("four")
    }

    /// The same with the phase.
    pub const fn with_phase(self) -> Self {
        Self { stated: Stated::AmplitudeAndPhase, ..self }
    }

    /// The columns for some samples: with spread if every sample has it, with phase if any has it.
    pub fn of(samples: &[RecordedSample]) -> Self {
        let spread = !samples.is_empty() && samples.iter().all(|sample| sample.spread.is_some());
        let columns = Self { spread, ..Self::PLAIN };
        match samples.iter().any(|sample| sample.phase_rad.is_some()) {
            true => columns.with_phase(),
            false => columns,
        }
    }

    /// Whether phases are stated, in one form or the other.
    pub fn have_phase(self) -> bool {
        self.stated != Stated::Amplitude
    }

    /// Whether readings are stated by `re,im`, which this program does not write.
    pub(super) fn are_parts(self) -> bool {
        self.stated == Stated::Parts
    }

    /// The names of the columns.
    pub fn names(self) -> Vec<&'static str> {
        let mut names = PLACED.to_vec();
        names.extend(match self.stated {
            Stated::Parts => &["re", "im"][..],
            Stated::Amplitude | Stated::AmplitudeAndPhase => &["reading"],
        });
        if self.spread {
            names.extend(["std", "count"]);
        }
        if self.stated == Stated::AmplitudeAndPhase {
            names.push("phase_rad");
        }
        names
    }

    /// The header line, with its line end.
    pub fn header(self) -> String {
        self.names().join(",") + "\n"
    }

    /// One sample as a line, with its line end. Each number has the fewest digits that read back as the same number.
    ///
    /// # Errors
    /// [`UnwritableSample`] if the line could not be read back.
    pub fn line(self, sample: &RecordedSample) -> Result<String, UnwritableSample> {
        check(sample)?;
        let at = sample.position_mm;
        let focus = sample.focus.map_or_else(|| "-1".to_owned(), |focus| focus.to_string());
        // {:?} writes the fewest digits that read back as the same number, with an exponent where that is shorter.
        let mut line = format!(
            "{:?},{focus},{:?},{:?},{:?},{:?}",
            sample.time_s, at.x, at.y, at.z, sample.reading
        );
        match (self.spread, sample.spread) {
            (false, None) => {}
            (true, Some(spread)) => line += &format!(",{:?},{}", spread.std, spread.count),
            _ => return Err(UnwritableSample::SpreadMismatch),
        }
        match (self.stated, sample.phase_rad) {
            (Stated::Amplitude, None) => {}
            // A phase that was lost is an empty cell.
            (Stated::AmplitudeAndPhase, None) => line.push(','),
            (Stated::AmplitudeAndPhase, Some(phase_rad)) => line += &format!(",{phase_rad:?}"),
            _ => return Err(UnwritableSample::PhaseMismatch),
        }
        Ok(line + "\n")
    }

    fn of_header(header: &Row<'_>) -> Result<Self, Fault> {
        let parts = [Self::PLAIN, Self::WITH_SPREAD]
            .map(|columns| Self { stated: Stated::Parts, ..columns });
        let known = || Self::written().into_iter().chain(parts);
        if let Some(columns) = known().find(|columns| header.cells().eq(columns.names())) {
            return Ok(columns);
        }
        let agree = |columns: Self| {
            header.cells().zip(columns.names()).take_while(|(cell, name)| cell == name).count()
        };
        let wrong = known().map(agree).max().unwrap_or(0);
        Err(header.fault(wrong, "the header is not that of a samples.csv", USUAL))
    }

    /// Number of the first column behind the reading.
    fn behind_reading(self) -> usize {
        PLACED.len() + if self.are_parts() { 2 } else { 1 }
    }
}

/// Why a sample cannot be written to a `samples.csv`: it could not be read back.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UnwritableSample {
    /// The sample and the columns do not agree on whether there is a standard deviation and count.
    #[error("in one samples.csv either every row has std and count or none has")]
    SpreadMismatch,
    /// The sample has a phase, and the columns do not.
    #[error("the sample has a phase, for which its samples.csv has no column")]
    PhaseMismatch,
    /// The record does not say what its phases mean.
    #[error(
        "the sample has a phase, whose reference and convention [phase] of scan.toml does not state"
    )]
    UnknownPhase,
    /// A number is not finite, or beyond what its quantity can be.
    #[error("{column}: {refused}")]
    OutOfRange {
        /// The column.
        column: &'static str,
        /// The number and its range.
        refused: OutOfRange,
    },
    /// A magnitude is negative, or larger than its unit allows.
    #[error("{column} is {value}, but {wanted} is expected")]
    Impossible {
        /// The column.
        column: &'static str,
        /// The number.
        value: f64,
        /// What is expected.
        wanted: String,
    },
    /// The scan has no such focus.
    #[error("focus {focus} was driven, but the scan has {foci} foci, numbered from 0")]
    NoSuchFocus {
        /// The number.
        focus: usize,
        /// The number of foci.
        foci: usize,
    },
    /// The mean of no readings.
    #[error("count is 0, so nothing was read")]
    NothingRead,
}

fn check(sample: &RecordedSample) -> Result<(), UnwritableSample> {
    let at = sample.position_mm;
    let (std, count) = sample.spread.map_or((0.0, 1), |spread| (spread.std, spread.count));
    for (column, value) in [
        ("time_s", sample.time_s),
        ("x_mm", at.x),
        ("y_mm", at.y),
        ("z_mm", at.z),
        ("reading", sample.reading),
        ("std", std),
        ("phase_rad", sample.phase_rad.unwrap_or(0.0)),
    ] {
        in_range(column, value)
            .map_err(|refused| UnwritableSample::OutOfRange { column, refused })?;
    }
    if count == 0 { Err(UnwritableSample::NothingRead) } else { Ok(()) }
}

/// What the samples of a record can be.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SampleLimits {
    /// Number of `[[focus]]` entries.
    foci: usize,
    readings: ReadingRange,
    /// Whether the record says what a phase means.
    phase: bool,
}

impl SampleLimits {
    /// Those of a record with a set-up.
    pub(super) fn of(setup: &ScanSetup) -> Self {
        Self {
            foci: setup.foci.len(),
            readings: ReadingRange::of(&setup.unit),
            phase: setup.phase.is_some(),
        }
    }

    /// Checks a sample before it is written.
    ///
    /// # Errors
    /// [`UnwritableSample`] if it has a focus without an entry, or a reading that its unit cannot have.
    pub(super) fn check(&self, sample: &RecordedSample) -> Result<(), UnwritableSample> {
        if let Some(focus) = sample.focus.filter(|focus| *focus >= self.foci) {
            return Err(UnwritableSample::NoSuchFocus { focus, foci: self.foci });
        }
        if sample.phase_rad.is_some() && !self.phase {
            return Err(UnwritableSample::UnknownPhase);
        }
        let std = sample.spread.map_or(0.0, |spread| spread.std);
        for (column, value) in [("reading", sample.reading), ("std", std)] {
            if !self.readings.contains(value) {
                let wanted = self.readings.wanted().to_owned();
                return Err(UnwritableSample::Impossible { column, value, wanted });
            }
        }
        Ok(())
    }
}

/// Reads a `samples.csv`.
///
/// # Errors
/// A [`Fault`] at the first invalid row: wrong number of columns, unreadable or non-finite number, negative or impossible reading, focus
/// without an entry, last line cut off.
pub(super) fn read_samples(
    path: &Path,
    limits: &SampleLimits,
) -> Result<(Columns, Vec<RecordedSample>), Fault> {
    samples_of(&Table::read(path)?, limits)
}

/// As [`read_samples`], of a text.
pub(super) fn samples_of(
    table: &Table,
    limits: &SampleLimits,
) -> Result<(Columns, Vec<RecordedSample>), Fault> {
    let mut rows = table.rows(b',');
    let header = rows.next().ok_or_else(|| {
        Fault::of_file(
            table.path(),
            "is empty",
            "its first line is `time_s,focus,x_mm,y_mm,z_mm,reading`; if the recording program was killed, restore the file from a copy",
        )
    })?;
    let columns = Columns::of_header(&header)?;
    if columns.have_phase() && !limits.phase {
        return Err(header.fault(
            columns.names().iter().position(|name| ["re", "phase_rad"].contains(name)).unwrap_or(0),
            "scan.toml does not say what a phase means",
            "add [phase] with reference = \"drive-sync\" and convention = \"exp(-iwt)\" or \"exp(+iwt)\" to scan.toml",
        ));
    }
    let mut samples = Vec::new();
    let mut last = header;
    for row in rows {
        if samples.len() == MAX_VISITS {
            return Err(row.fault(
                0,
                format!("a record has at most {MAX_VISITS} readings"),
                "split the record into several",
            ));
        }
        samples.push(sample_of(&row, columns, limits)?);
        last = row;
    }
    table.refuse_cut_end(&last)?;
    Ok((columns, samples))
}

fn sample_of(
    row: &Row<'_>,
    columns: Columns,
    limits: &SampleLimits,
) -> Result<RecordedSample, Fault> {
    let names = columns.names();
    let wanted = names.len();
    if row.len() != wanted {
        return Err(row.fault(
            row.len().min(wanted),
            format!("the row has {} cells where the header has {wanted}", row.len()),
            "complete the row, or remove it; a file that was cut off has this error at its end",
        ));
    }
    let number = |index: usize| row.number(index, names[index]);
    let possible = |index: usize, value: f64| match limits.readings.contains(value) {
        true => Ok(value),
        false => Err(row.wrong(index, names[index], limits.readings.wanted())),
    };
    let magnitude = |index: usize| possible(index, number(index)?);
    let (first, behind) = (PLACED.len(), columns.behind_reading());
    let (reading, phase_rad) = match columns.stated {
        Stated::Amplitude => (magnitude(first)?, None),
        Stated::AmplitudeAndPhase if row.cell(wanted - 1).is_empty() => (magnitude(first)?, None),
        Stated::AmplitudeAndPhase => (magnitude(first)?, Some(number(wanted - 1)?)),
        Stated::Parts => {
            let (re, im) = (number(first)?, number(first + 1)?);
            (possible(first, re.hypot(im))?, Some(im.atan2(re)))
        }
    };
    Ok(RecordedSample {
        time_s: number(0)?,
        focus: focus_of(row, limits.foci)?,
        position_mm: Vec3::new(number(2)?, number(3)?, number(4)?),
        reading,
        phase_rad,
        spread: match columns.spread {
            false => None,
            true => Some(Spread { std: magnitude(behind)?, count: count_of(row, behind + 1)? }),
        },
    })
}

fn focus_of(row: &Row<'_>, foci: usize) -> Result<Option<usize>, Fault> {
    let number: i64 = row.parse(1, PLACED[1], "-1 (silent) or the number of a [[focus]]")?;
    match usize::try_from(number) {
        Ok(focus) if focus < foci => Ok(Some(focus)),
        Err(_) if number == -1 => Ok(None),
        _ => Err(row.fault(
            1,
            format!("focus {number} has no entry: scan.toml has {foci} [[focus]], numbered from 0"),
            "correct the number (-1 means silent), or add the [[focus]] to scan.toml",
        )),
    }
}

fn count_of(row: &Row<'_>, index: usize) -> Result<u32, Fault> {
    let wanted = "a whole number above zero";
    match row.parse(index, "count", wanted)? {
        0 => Err(row.wrong(index, "count", wanted)),
        count => Ok(count),
    }
}

/// Writes a `samples.csv`.
///
/// # Errors
/// What `out` reports, or [`UnwritableSample`] (as [`io::ErrorKind::InvalidInput`]).
pub(super) fn write_samples(
    out: &mut impl Write,
    samples: &[RecordedSample],
    limits: &SampleLimits,
) -> io::Result<()> {
    let columns = Columns::of(samples);
    out.write_all(columns.header().as_bytes())?;
    for sample in samples {
        let line = limits
            .check(sample)
            .and_then(|()| columns.line(sample))
            .map_err(|unwritable| io::Error::new(io::ErrorKind::InvalidInput, unwritable))?;
        out.write_all(line.as_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
