//! `journal.csv`: every point of a scan, one line each, with a checksum.
//!
//! `row,to_x_mm,to_y_mm,to_z_mm,` the commanded position (array frame), then the point as in `samples.csv`, with the reported position,
//! then `crc32` (IEEE 802.3, eight hexadecimal digits) of everything before the last comma.

use std::path::Path;

use crate::sample::{RecordedSample, millimetres};
use crate::samples_csv::{Columns, SampleLimits, UnwritableSample, samples_of};
use crate::table::Table;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Fault;

pub(super) const FILE: &str = "journal.csv";

/// Longest part of a damaged line that a fault shows, characters.
const SHOWN: usize = 120;

/// A point with its commanded position.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Commanded position, millimetres, array frame; `None` in records that were started without a journal.
    pub commanded_mm: Option<Vec3>,
    /// The sample, with the reported position.
    pub sample: RecordedSample,
}

impl Record {
    /// A sample and its commanded position in metres (array frame), rounded to the nanometre.
    pub fn new(sample: RecordedSample, commanded_m: Vec3) -> Self {
        Self { commanded_mm: Some(commanded_m.map(millimetres)), sample }
    }
}

/// The header line, with its line end.
pub(super) fn header(columns: Columns) -> String {
    format!("row,to_x_mm,to_y_mm,to_z_mm,{},crc32\n", columns.names().join(","))
}

/// A record as a line, with its line end, and its line of `samples.csv`.
pub(super) fn lines(
    row: usize,
    record: &Record,
    columns: Columns,
) -> Result<(String, String), UnwritableSample> {
    let sample = columns.line(&record.sample)?;
    let to = record
        .commanded_mm
        .map_or(",,".to_owned(), |to| format!("{:?},{:?},{:?}", to.x, to.y, to.z));
    let body = format!("{row},{to},{}", sample.trim_end());
    let crc = crc32fast::hash(body.as_bytes());
    Ok((format!("{body},{crc:08x}\n"), sample))
}

/// The contents of a journal.
#[derive(Debug)]
pub(super) struct Contents {
    pub columns: Columns,
    pub records: Vec<Record>,
    /// Bytes of the header and the complete records.
    pub whole: usize,
}

/// Reads the complete records of a journal, up to an incomplete end.
///
/// # Errors
/// A [`Fault`] at a damaged line with complete records after it: that file was damaged otherwise than by a crash.
pub(super) fn read(path: &Path, bytes: &[u8], limits: &SampleLimits) -> Result<Contents, Fault> {
    let (columns, mut whole) = columns_of(bytes).ok_or_else(|| {
        Fault::of_file(
            path,
            "does not start with the header of a journal",
            "restore it from a copy; or move it away: the scan then continues from samples.csv",
        )
    })?;
    let (mut commanded, mut samples) = (Vec::new(), columns.header());
    let mut rest = bytes[whole..].split_inclusive(|&byte| byte == b'\n');
    for line in rest.by_ref() {
        let Some((to_mm, sample)) = checked(line, commanded.len()) else {
            // A record after this line would be lost with it.
            if let Some(later) = rest.position(is_record) {
                return Err(damaged(path, line, commanded.len(), later));
            }
            break;
        };
        whole += line.len();
        commanded.push(to_mm);
        samples += sample;
        samples.push('\n');
    }
    let (_, samples) = samples_of(&Table::new(path, samples), limits)?;
    let records = commanded.into_iter().zip(samples);
    let records = records.map(|(commanded_mm, sample)| Record { commanded_mm, sample }).collect();
    Ok(Contents { columns, records, whole })
}

/// The columns that the header line of a journal names, and the length of that line in bytes; `None` without a whole header.
pub(super) fn columns_of(bytes: &[u8]) -> Option<(Columns, usize)> {
    Columns::written().into_iter().find_map(|columns| {
        let header = header(columns);
        bytes.starts_with(header.as_bytes()).then_some((columns, header.len()))
    })
}

/// The commanded position and the sample's line, from a complete line that is record `row`.
pub(super) fn checked(line: &[u8], row: usize) -> Option<(Option<Vec3>, &str)> {
    let body = body(line)?;
    let (number, rest) = body.split_once(',')?;
    let mut cells = rest.splitn(4, ',');
    let to: [&str; 3] = [cells.next()?, cells.next()?, cells.next()?];
    let sample = cells.next()?;
    if number.parse() != Ok(row) {
        return None;
    }
    if to == [""; 3] {
        return Some((None, sample));
    }
    let [x, y, z] = to.map(|cell| cell.parse::<f64>().ok().filter(|mm| mm.is_finite()));
    Some((Some(Vec3::new(x?, y?, z?)), sample))
}

fn is_record(line: &[u8]) -> bool {
    body(line).is_some()
}

/// The part of a complete line that its checksum is for; `None` if the checksum is wrong.
fn body(line: &[u8]) -> Option<&str> {
    let line = std::str::from_utf8(line).ok()?.strip_suffix('\n')?;
    let (body, crc) = line.rsplit_once(',')?;
    (crc == format!("{:08x}", crc32fast::hash(body.as_bytes()))).then_some(body)
}

fn damaged(path: &Path, line: &[u8], row: usize, later: usize) -> Fault {
    let shown: String = String::from_utf8_lossy(line).trim_end().chars().take(SHOWN).collect();
    Fault::on_line(
        path,
        row + 2,
        1,
        &shown,
        format!("record {row} is damaged, but intact records follow ({later} lines later)"),
        "restore the file from a copy; or move it away: the scan then continues from samples.csv, without the commanded positions",
    )
}
