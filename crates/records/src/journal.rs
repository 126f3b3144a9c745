//! The folder of a running scan.
//!
//! The files of a [`RecordedScan`](super::RecordedScan), which grow by one line for each visit, and beside them
//!
//! | file | what it holds |
//! |---|---|
//! | `state.toml` | the state of the scan: scanning, partial, complete |
//! | `journal.csv` | each point with the commanded position and a checksum |
//! | `events.jsonl` | events: homing, reference checks, faults, resumes |
//! | copies | the plan and the rig file at the start, with which the scan is resumed |
//!
//! Record k of `journal.csv` and row k of `samples.csv` belong to visit k of the plan. The record is on disk before
//! [`Journal::append`] returns. After a crash or power failure at any time, [`Journal::resume`] finds every acknowledged record. At
//! most the record that was being written is incomplete, which its checksum shows. `samples.csv` is restored from the journal.

mod error;
mod event;
mod presence;
mod record;
mod state;
mod tail;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use jiff::Timestamp;

pub use self::error::JournalError;
pub use self::event::{Event, EventKind, read_events};
use self::presence::Presence;
pub use self::record::Record;
pub use self::state::ScanState;
pub use self::tail::JournalTail;
use super::durable::{self, Lines};
use super::inside::without_ways_out;
use super::sample::RecordedSample;
use super::samples_csv::{Columns, SampleLimits, UnwritableSample, samples_of};
use super::setup::ScanSetup;
use super::table::Table;
use fieldgap_acoustics::Vec3;
use fieldgap_input::{Fault, MOST_TABLE, read_bytes, read_text, regular};

const SAMPLES: &str = "samples.csv";
const EVENTS: &str = "events.jsonl";
const SETUP: &str = "scan.toml";

/// Most characters of an incomplete line that are kept; a power failure can leave a long run of zeros.
const KEPT_OF_TORN_LINE: usize = 200;

/// The folder of a running scan, locked by this process.
#[derive(Debug)]
pub struct Journal {
    folder: PathBuf,
    columns: Columns,
    limits: SampleLimits,
    records: Lines<File>,
    /// The same points as the records, from which it is restored after a crash.
    samples: Lines<File>,
    /// Locked as long as the journal exists; the lock ends with the process.
    events: Lines<File>,
    /// The files that must stay where they are.
    files: Vec<Presence>,
    visits_done: usize,
}

/// A resumed scan.
#[derive(Debug)]
pub struct Resumed {
    /// The journal, ready for the next visit.
    pub journal: Journal,
    /// The set-up.
    pub setup: ScanSetup,
    /// The records so far: record k belongs to visit k.
    pub records: Vec<Record>,
    /// The text of an incomplete record that was cut off, if there was one: that visit is to be repeated.
    pub cut: Option<String>,
}

impl Journal {
    /// The file of a scan's folder that the process which runs the scan keeps locked.
    pub fn lock_file(folder: &Path) -> PathBuf {
        folder.join(EVENTS)
    }

    /// Starts a scan in a folder, which is created if necessary.
    ///
    /// `copies` are files to keep with it, by name and contents (the plan, the rig file). `scan.toml` is written last: a folder with it
    /// can be resumed, and a folder without it has no readings.
    ///
    /// # Errors
    /// [`JournalError::Occupied`] if the folder contains a scan, [`JournalError::Busy`] if another process uses it; or an error of the
    /// file system.
    pub fn create(
        folder: &Path,
        setup: &ScanSetup,
        columns: Columns,
        copies: &[(&str, &[u8])],
        at: Timestamp,
    ) -> Result<Self, JournalError> {
        let files = setup.files()?;
        refuse_occupied(folder)?;
        make_folder(folder)?;
        let events = open_locked(folder)?;
        // Checked again, now that no other process can start a scan here.
        refuse_occupied(folder)?;

        let header = columns.header();
        let records_header = record::header(columns);
        let put = |name: &str, contents: &[u8]| {
            let path = folder.join(name);
            durable::replace(&path, contents).map_err(write_error(&path))
        };
        put(record::FILE, records_header.as_bytes())?;
        put(SAMPLES, header.as_bytes())?;
        for (name, contents) in copies {
            put(name, contents)?;
        }
        ScanState::Scanning.write(folder).map_err(write_error(&folder.join(state::FILE)))?;
        for (name, contents) in files {
            put(name, &contents)?;
        }
        let samples = open_for_append(&folder.join(SAMPLES))?;
        let mut journal = Self {
            folder: folder.to_owned(),
            columns,
            limits: SampleLimits::of(setup),
            records: Lines::after(
                open_for_append(&folder.join(record::FILE))?,
                records_header.len() as u64,
            ),
            samples: Lines::after(samples, header.len() as u64),
            events,
            files: files_of(folder)?,
            visits_done: 0,
        };
        journal.record(at, EventKind::Started, &setup.name)?;
        Ok(journal)
    }

    /// Whether a folder holds a scan that is not complete.
    ///
    /// # Errors
    /// [`JournalError::NoScan`], [`JournalError::AlreadyComplete`].
    pub fn resumable(folder: &Path) -> Result<(), JournalError> {
        if !folder.join(SETUP).exists() {
            return Err(JournalError::NoScan(folder.to_owned()));
        }
        match ScanState::of(folder).map_err(Box::new)? {
            Some(ScanState::Complete) => Err(JournalError::AlreadyComplete(folder.to_owned())),
            _ => Ok(()),
        }
    }

    /// Resumes an interrupted scan, for whatever reason it ended.
    ///
    /// An incomplete last line of the journal is cut off, and its text kept in `events.jsonl`. `samples.csv` is made equal to the
    /// journal.
    ///
    /// # Errors
    /// [`JournalError::NoScan`], [`JournalError::AlreadyComplete`], [`JournalError::Busy`]; [`JournalError::Fault`] if a file has
    /// errors other than an incomplete end.
    pub fn resume(folder: &Path, at: Timestamp) -> Result<Resumed, JournalError> {
        Self::resumable(folder)?;
        // Resuming writes to the files of the record.
        without_ways_out(folder).map_err(Box::new)?;
        let events = open_locked(folder)?;
        // Another process may have completed it before the lock was free.
        Self::resumable(folder)?;
        let setup = ScanSetup::read(&folder.join(SETUP)).map_err(Box::new)?;
        let limits = SampleLimits::of(&setup);
        if !folder.join(record::FILE).exists() {
            begin_records(folder, &limits)?;
        }
        let path = folder.join(record::FILE);
        let bytes = read_back(&path)?;
        let record::Contents { columns, records, whole } =
            record::read(&path, &bytes, &limits).map_err(Box::new)?;
        let torn = &bytes[whole..];
        let mut journal = Self {
            folder: folder.to_owned(),
            columns,
            limits,
            records: Lines::after(open_for_append(&path)?, whole as u64),
            samples: Lines::after(open_for_append(&folder.join(SAMPLES))?, 0),
            events,
            files: files_of(folder)?,
            visits_done: records.len(),
        };
        let cut = (!torn.is_empty()).then(|| {
            String::from_utf8_lossy(torn).chars().take(KEPT_OF_TORN_LINE).collect::<String>()
        });
        if let Some(text) = &cut {
            // Kept before it is cut: after a crash in between it is found and kept again.
            journal.record(at, EventKind::LineCut, text)?;
            journal.records.cut_torn_end().map_err(write_error(&path))?;
        }
        journal.restore_samples(&records)?;
        ScanState::Scanning.write(folder).map_err(write_error(&folder.join(state::FILE)))?;
        journal.record(at, EventKind::Resumed, "")?;
        Ok(Resumed { journal, setup, records, cut })
    }

    /// Makes `samples.csv` equal to the records: after a crash its end may be missing, after a power failure all that was not synced.
    fn restore_samples(&mut self, records: &[Record]) -> Result<(), JournalError> {
        let path = self.folder.join(SAMPLES);
        let mut wanted = self.columns.header();
        for (row, record) in records.iter().enumerate() {
            let line = self.columns.line(&record.sample);
            wanted += &line.map_err(|reason| JournalError::Sample { visit: row, reason })?;
        }
        let there = read_back(&path)?;
        let same = there.iter().zip(wanted.as_bytes()).take_while(|(a, b)| a == b).count();
        let same = whole_lines(&wanted.as_bytes()[..same]);
        // Its end may be incomplete; a row that differs otherwise was changed by somebody.
        if same < whole_lines(&there) && !is_torn(&there[same..]) {
            return Err(JournalError::Fault(Box::new(differs(&path, &there, &wanted, same))));
        }
        self.samples = Lines::after(open_for_append(&path)?, same as u64);
        self.samples
            .cut_torn_end()
            .and_then(|()| self.samples.append(&wanted[same..]))
            .map_err(write_error(&path))
    }

    /// Records the point of the next visit, with the commanded position `commanded_m` (array frame). It is on disk when this returns.
    ///
    /// # Errors
    /// As [`Journal::append_row`].
    pub fn append(
        &mut self,
        sample: &RecordedSample,
        commanded_m: Vec3,
    ) -> Result<(), JournalError> {
        self.append_row(&[(*sample, commanded_m)])
    }

    /// Records the points of the next visits, each with the commanded position. All are on disk when this returns.
    ///
    /// # Errors
    /// [`JournalError::Sample`] if one of them could not be read back, [`JournalError::Append`] if they were not written. In both
    /// cases all points before them are safe, none of these is recorded, and they may be tried again. [`JournalError::Displaced`] if
    /// the record is no longer in its folder.
    pub fn append_row(&mut self, points: &[(RecordedSample, Vec3)]) -> Result<(), JournalError> {
        let (mut records, mut lines) = (String::new(), String::new());
        for (n, &(sample, commanded_m)) in points.iter().enumerate() {
            let visit = self.visits_done + n;
            let (record, line) = self
                .lines(visit, &Record::new(sample, commanded_m))
                .map_err(|reason| JournalError::Sample { visit, reason })?;
            records += &record;
            lines += &line;
        }
        self.records
            .append(&records)
            .and_then(|()| {
                // Not synced: the record is.
                self.samples.write(&lines).inspect_err(|_| self.records.forget(&records))
            })
            .map_err(|source| JournalError::Append {
                folder: self.folder.clone(),
                kept: self.visits_done,
                source,
            })?;
        self.in_place()?;
        self.visits_done += points.len();
        Ok(())
    }

    /// Checks that the files are still in the folder: a deleted file takes lines without an error.
    fn in_place(&self) -> Result<(), JournalError> {
        match self.files.iter().find(|file| !file.is_there()) {
            None => Ok(()),
            Some(file) => Err(JournalError::Displaced {
                folder: self.folder.clone(),
                file: file.path().to_owned(),
                kept: self.visits_done,
            }),
        }
    }

    /// Records an event; it is on disk when this returns.
    ///
    /// # Errors
    /// [`JournalError::Write`] if it did not reach the disk.
    pub fn record(
        &mut self,
        at: Timestamp,
        kind: EventKind,
        text: &str,
    ) -> Result<(), JournalError> {
        let event = Event { at, kind, visits_done: self.visits_done, text: text.to_owned() };
        serde_json::to_string(&event)
            .map_err(io::Error::other)
            .and_then(|json| self.events.append(&(json + "\n")))
            .map_err(write_error(&self.folder.join(EVENTS)))
    }

    /// Ends the scan: records its state and unlocks the folder.
    ///
    /// # Errors
    /// [`JournalError::Write`] if the state was not written; the scan then counts as killed and can be resumed.
    pub fn end(mut self, at: Timestamp, state: &ScanState) -> Result<(), JournalError> {
        let recorded = self.record(at, EventKind::Ended, &state.to_string());
        self.samples.sync().map_err(write_error(&self.folder.join(SAMPLES)))?;
        let path = self.folder.join(state::FILE);
        state.write(&self.folder).map_err(write_error(&path))?;
        recorded
    }

    /// Number of visits on disk; the next visit has this number.
    pub fn visits_done(&self) -> usize {
        self.visits_done
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn lines(&self, visit: usize, record: &Record) -> Result<(String, String), UnwritableSample> {
        self.limits.check(&record.sample)?;
        record::lines(visit, record, self.columns)
    }
}

/// Creates the journal of a scan that has none from its `samples.csv`; the commanded positions are then unknown.
fn begin_records(folder: &Path, limits: &SampleLimits) -> Result<(), JournalError> {
    let path = folder.join(SAMPLES);
    let mut bytes = read_back(&path)?;
    bytes.truncate(whole_lines(&bytes));
    let table = Table::from_bytes(&path, bytes).map_err(Box::new)?;
    let (columns, samples) = samples_of(&table, limits).map_err(Box::new)?;
    if columns.are_parts() {
        let remedy = "state its readings by `reading` and `phase_rad`";
        let problem = "states readings by `re,im`, and a scan that is resumed does not";
        return Err(Box::new(Fault::of_file(&path, problem, remedy)).into());
    }
    let mut text = record::header(columns);
    for (row, sample) in samples.into_iter().enumerate() {
        let record = Record { commanded_mm: None, sample };
        let lines = record::lines(row, &record, columns);
        text += &lines.map_err(|reason| JournalError::Sample { visit: row, reason })?.0;
    }
    let path = folder.join(record::FILE);
    durable::replace(&path, text.as_bytes()).map_err(write_error(&path))
}

fn read_back(path: &Path) -> Result<Vec<u8>, JournalError> {
    let bytes = read_bytes(path, MOST_TABLE).map_err(|error| {
        let remedy = "restore the file from a copy";
        Box::new(Fault::of_file(path, format!("cannot be read: {error}"), remedy))
    })?;
    Ok(bytes)
}

/// Whether this is the result of a crash: one incomplete line, or zeros, as after a power failure.
fn is_torn(tail: &[u8]) -> bool {
    whole_lines(tail) == 0 || tail.contains(&0)
}

/// `samples.csv` and the journal have different points.
fn differs(path: &Path, there: &[u8], wanted: &str, same: usize) -> Fault {
    let line = |text: &str| text.lines().next().unwrap_or("").to_owned();
    let number = wanted[..same].matches('\n').count() + 1;
    Fault::on_line(
        path,
        number,
        1,
        &line(&String::from_utf8_lossy(&there[same..])),
        format!("the row was changed: {} has `{}`", record::FILE, line(&wanted[same..])),
        "restore the file from a copy; or move journal.csv away: the scan then continues from this file",
    )
}

/// The files without which a record is lost.
fn files_of(folder: &Path) -> Result<Vec<Presence>, JournalError> {
    let of = |name: &str| {
        let path = folder.join(name);
        Presence::of(&path).map_err(write_error(&path))
    };
    [record::FILE, SAMPLES, EVENTS, SETUP].into_iter().map(of).collect()
}

fn make_folder(folder: &Path) -> Result<(), JournalError> {
    fs::create_dir_all(folder)
        .and_then(|()| durable::sync_folder(folder.parent().unwrap_or(Path::new(""))))
        .map_err(write_error(folder))
}

/// Opens `events.jsonl`, locks it against other processes, and cuts off an incomplete last line.
fn open_locked(folder: &Path) -> Result<Lines<File>, JournalError> {
    let path = folder.join(EVENTS);
    match regular(&path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            return Err(write_error(&path)(error));
        }
        _ => {}
    }
    let open = OpenOptions::new().create(true).append(true).open(&path);
    let file = open.map_err(write_error(&path))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(JournalError::Busy(folder.to_owned())),
        Err(TryLockError::Error(source)) => return Err(JournalError::Write { path, source }),
    }
    let whole = read_bytes(&path, MOST_TABLE)
        .map_err(write_error(&path))
        .map(|bytes| whole_lines(&bytes))?;
    let mut events = Lines::after(file, whole as u64);
    events.cut_torn_end().map_err(write_error(&path))?;
    Ok(events)
}

fn refuse_occupied(folder: &Path) -> Result<(), JournalError> {
    // A scan killed before its scan.toml was written leaves only the header.
    let rows = read_text(&folder.join(SAMPLES), MOST_TABLE).map_or(2, |text| text.lines().count());
    let rows = if folder.join(SAMPLES).exists() { rows } else { 0 };
    if !folder.join(SETUP).exists() && rows <= 1 {
        return Ok(());
    }
    let state = ScanState::of(folder).map_err(Box::new)?.unwrap_or(ScanState::Complete);
    Err(JournalError::Occupied { folder: folder.to_owned(), state })
}

fn open_for_append(path: &Path) -> Result<File, JournalError> {
    regular(path)
        .and_then(|_| OpenOptions::new().append(true).open(path))
        .map_err(write_error(path))
}

/// Bytes up to the end of the last complete line.
fn whole_lines(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1)
}

fn write_error(path: &Path) -> impl FnOnce(io::Error) -> JournalError + use<> {
    let path = path.to_owned();
    |source| JournalError::Write { path, source }
}

#[cfg(test)]
mod tests;
