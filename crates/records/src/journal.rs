//! The folder of a scan that is running.
//!
//! What a [`RecordedScan`](super::RecordedScan) needs, growing by one line a visit, and beside it
//!
//! | file | what it holds |
//! |---|---|
//! | `state.toml` | how the scan stands: scanning, partial, complete |
//! | `journal.csv` | each point with where the robot was sent for it and a checksum |
//! | `events.jsonl` | what happened: homing, reference checks, faults, resumes |
//! | copies | the plan and the rig file it was begun with, so that it can be resumed as it was begun |
//!
//! Record k of `journal.csv`, and row k of `samples.csv`, is visit k of the plan. The record is on disk before
//! [`Journal::append`] returns. Whatever instant the process or the power dies at, [`Journal::resume`] finds every acknowledged
//! record: at most the one being written is torn, which its checksum tells; and `samples.csv` is put right by the journal.

mod error;
mod event;
mod record;
mod state;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use jiff::Timestamp;

pub use self::error::{BadSample, JournalError};
pub use self::event::{Event, EventKind, read_events};
pub use self::record::Record;
pub use self::state::ScanState;
use super::durable::{self, Lines};
use super::sample::RecordedSample;
use super::samples_csv::{Columns, samples_of};
use super::setup::ScanSetup;
use super::table::Table;
use fieldgap_acoustics::Vec3;
use fieldgap_input::Fault;

const SAMPLES: &str = "samples.csv";
const EVENTS: &str = "events.jsonl";
const SETUP: &str = "scan.toml";

/// Most characters of a torn line that are kept; a power cut can leave a long stretch of nothing.
const KEPT_OF_TORN_LINE: usize = 200;

/// The folder of a scan that is running. One process at a time holds it.
#[derive(Debug)]
pub struct Journal {
    folder: PathBuf,
    columns: Columns,
    foci: usize,
    records: Lines<File>,
    /// The same points as the records; what a crash takes of it is put back from them.
    samples: Lines<File>,
    /// Locked as long as the journal lives; the lock goes with the process, however it ends.
    events: Lines<File>,
    visits_done: usize,
}

/// A scan taken up again.
#[derive(Debug)]
pub struct Resumed {
    /// Where it goes on.
    pub journal: Journal,
    /// What was set up.
    pub setup: ScanSetup,
    /// What was measured so far: record k is of visit k.
    pub records: Vec<Record>,
    /// What stood of a record that was cut off, if one was: that visit is to be made again.
    pub cut: Option<String>,
}

impl Journal {
    /// Begins a scan in a folder, which is made if need be.
    ///
    /// `copies` are files to keep with it, by name and contents (the plan, the rig file). `scan.toml` is written last: a
    /// folder that has it can be resumed, and a folder that has not holds nothing that was measured.
    ///
    /// # Errors
    /// [`JournalError::Occupied`] if the folder holds a scan, [`JournalError::Busy`] if another process is at it; or
    /// what the file system refused.
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
        // Again, now that no other process can begin a scan here.
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
            foci: setup.foci.len(),
            records: Lines::after(
                open_for_append(&folder.join(record::FILE))?,
                records_header.len() as u64,
            ),
            samples: Lines::after(samples, header.len() as u64),
            events,
            visits_done: 0,
        };
        journal.record(at, EventKind::Started, &setup.name)?;
        Ok(journal)
    }

    /// Takes up a scan that was broken off, however it ended.
    ///
    /// A torn tail of the journal is cut off, and its text kept in `events.jsonl`; `samples.csv` is made to hold what the
    /// journal holds.
    ///
    /// # Errors
    /// [`JournalError::NoScan`], [`JournalError::AlreadyComplete`], [`JournalError::Busy`]; [`JournalError::Fault`] if a
    /// file that is not torn but wrong stands in the folder.
    pub fn resume(folder: &Path, at: Timestamp) -> Result<Resumed, JournalError> {
        if !folder.join(SETUP).exists() {
            return Err(JournalError::NoScan(folder.to_owned()));
        }
        let events = open_locked(folder)?;
        if ScanState::of(folder).map_err(Box::new)? == Some(ScanState::Complete) {
            return Err(JournalError::AlreadyComplete(folder.to_owned()));
        }
        let setup = ScanSetup::read(&folder.join(SETUP)).map_err(Box::new)?;
        if !folder.join(record::FILE).exists() {
            begin_records(folder, setup.foci.len())?;
        }
        let path = folder.join(record::FILE);
        let bytes = read_back(&path)?;
        let record::Contents { columns, records, whole } =
            record::read(&path, &bytes, setup.foci.len()).map_err(Box::new)?;
        let torn = &bytes[whole..];
        let mut journal = Self {
            folder: folder.to_owned(),
            columns,
            foci: setup.foci.len(),
            records: Lines::after(open_for_append(&path)?, whole as u64),
            samples: Lines::after(open_for_append(&folder.join(SAMPLES))?, 0),
            events,
            visits_done: records.len(),
        };
        let cut = (!torn.is_empty()).then(|| {
            String::from_utf8_lossy(torn).chars().take(KEPT_OF_TORN_LINE).collect::<String>()
        });
        if let Some(text) = &cut {
            // Kept before it is cut: killed in between, it is found and kept once more.
            journal.record(at, EventKind::LineCut, text)?;
            journal.records.mend().map_err(write_error(&path))?;
        }
        journal.put_samples_right(&records)?;
        ScanState::Scanning.write(folder).map_err(write_error(&folder.join(state::FILE)))?;
        journal.record(at, EventKind::Resumed, "")?;
        Ok(Resumed { journal, setup, records, cut })
    }

    /// Makes `samples.csv` hold what the records hold: a crash may have taken its end, a power cut all that was not synced.
    fn put_samples_right(&mut self, records: &[Record]) -> Result<(), JournalError> {
        let path = self.folder.join(SAMPLES);
        let mut wanted = self.columns.header();
        for (row, record) in records.iter().enumerate() {
            let line = self.columns.line(&record.sample);
            wanted += &line
                .map_err(|reason| JournalError::Sample { visit: row, reason: reason.into() })?;
        }
        let there = read_back(&path)?;
        let same = there.iter().zip(wanted.as_bytes()).take_while(|(a, b)| a == b).count();
        let same = whole_lines(&wanted.as_bytes()[..same]);
        // Its end may be torn; a row that differs otherwise was changed by somebody.
        if same < whole_lines(&there) && !is_torn(&there[same..]) {
            return Err(JournalError::Fault(Box::new(differs(&path, &there, &wanted, same))));
        }
        self.samples = Lines::after(open_for_append(&path)?, same as u64);
        self.samples
            .mend()
            .and_then(|()| self.samples.append(&wanted[same..]))
            .map_err(write_error(&path))
    }

    /// Keeps the point of the next visit, for which the robot was sent to `commanded_m` (array frame); it is on disk when
    /// this returns.
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

    /// Keeps the points of the next visits, each with where the robot was sent; all are on disk when this returns.
    ///
    /// # Errors
    /// [`JournalError::Sample`] if the record could not be read with one of them, [`JournalError::Append`] if they did not
    /// reach the disk. Either way all points before them are safe, nothing of these is left, and they may be tried again.
    pub fn append_row(&mut self, points: &[(RecordedSample, Vec3)]) -> Result<(), JournalError> {
        let (mut records, mut lines) = (String::new(), String::new());
        for (n, &(sample, commanded_m)) in points.iter().enumerate() {
            let (record, line) = self
                .lines(&Record::new(sample, commanded_m))
                .map_err(|reason| JournalError::Sample { visit: self.visits_done + n, reason })?;
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
        self.visits_done += points.len();
        Ok(())
    }

    /// Keeps what happened; it is on disk when this returns.
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

    /// Ends the scan: keeps how it stands, and lets go of the folder.
    ///
    /// # Errors
    /// [`JournalError::Write`] if that did not reach the disk; the scan then counts as killed, and can be resumed.
    pub fn end(mut self, at: Timestamp, state: &ScanState) -> Result<(), JournalError> {
        let recorded = self.record(at, EventKind::Ended, &state.to_string());
        self.samples.sync().map_err(write_error(&self.folder.join(SAMPLES)))?;
        let path = self.folder.join(state::FILE);
        state.write(&self.folder).map_err(write_error(&path))?;
        recorded
    }

    /// How many visits have their sample on disk; the next visit has this number.
    pub fn visits_done(&self) -> usize {
        self.visits_done
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn lines(&self, record: &Record) -> Result<(String, String), BadSample> {
        match record.sample.focus {
            Some(focus) if focus >= self.foci => {
                Err(BadSample::NoSuchFocus { focus, foci: self.foci })
            }
            _ => Ok(record::lines(self.visits_done, record, self.columns)?),
        }
    }
}

/// Begins the journal of a scan that has none, from its `samples.csv`: where the robot was sent is then not known.
fn begin_records(folder: &Path, foci: usize) -> Result<(), JournalError> {
    let path = folder.join(SAMPLES);
    let mut bytes = read_back(&path)?;
    bytes.truncate(whole_lines(&bytes));
    let table = Table::from_bytes(&path, bytes).map_err(Box::new)?;
    let (columns, samples) = samples_of(&table, foci).map_err(Box::new)?;
    let mut text = record::header(columns);
    for (row, sample) in samples.into_iter().enumerate() {
        let record = Record { commanded_mm: None, sample };
        let lines = record::lines(row, &record, columns);
        text +=
            &lines.map_err(|reason| JournalError::Sample { visit: row, reason: reason.into() })?.0;
    }
    let path = folder.join(record::FILE);
    durable::replace(&path, text.as_bytes()).map_err(write_error(&path))
}

fn read_back(path: &Path) -> Result<Vec<u8>, JournalError> {
    let bytes = fs::read(path).map_err(|error| {
        let remedy = "bring the file back from a copy";
        Box::new(Fault::of_file(path, format!("cannot be read: {error}"), remedy))
    })?;
    Ok(bytes)
}

/// Whether this is what a crash leaves: one line that was broken off, or zeros, as a power cut leaves them.
fn is_torn(tail: &[u8]) -> bool {
    whole_lines(tail) == 0 || tail.contains(&0)
}

/// `samples.csv` and the journal tell of different points.
fn differs(path: &Path, there: &[u8], wanted: &str, same: usize) -> Fault {
    let line = |text: &str| text.lines().next().unwrap_or("").to_owned();
    let number = wanted[..same].matches('\n').count() + 1;
    Fault::on_line(
        path,
        number,
        1,
        &line(&String::from_utf8_lossy(&there[same..])),
        format!("the row was changed: {} has `{}`", record::FILE, line(&wanted[same..])),
        "bring the file back from a copy; or move journal.csv away, and the scan goes on from what stands here",
    )
}

fn make_folder(folder: &Path) -> Result<(), JournalError> {
    fs::create_dir_all(folder)
        .and_then(|()| durable::sync_folder(folder.parent().unwrap_or(Path::new(""))))
        .map_err(write_error(folder))
}

/// Opens `events.jsonl`, locks it against other processes, and cuts off what a killed one left of a line.
fn open_locked(folder: &Path) -> Result<Lines<File>, JournalError> {
    let path = folder.join(EVENTS);
    let open = OpenOptions::new().create(true).append(true).open(&path);
    let file = open.map_err(write_error(&path))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(JournalError::Busy(folder.to_owned())),
        Err(TryLockError::Error(source)) => return Err(JournalError::Write { path, source }),
    }
    let whole = fs::read(&path).map_err(write_error(&path)).map(|bytes| whole_lines(&bytes))?;
    let mut events = Lines::after(file, whole as u64);
    events.mend().map_err(write_error(&path))?;
    Ok(events)
}

fn refuse_occupied(folder: &Path) -> Result<(), JournalError> {
    // A header alone is what a scan killed before its scan.toml leaves behind.
    let rows = fs::read_to_string(folder.join(SAMPLES)).map_or(0, |text| text.lines().count());
    if !folder.join(SETUP).exists() && rows <= 1 {
        return Ok(());
    }
    let state = ScanState::of(folder).map_err(Box::new)?.unwrap_or(ScanState::Complete);
    Err(JournalError::Occupied { folder: folder.to_owned(), state })
}

fn open_for_append(path: &Path) -> Result<File, JournalError> {
    OpenOptions::new().append(true).open(path).map_err(write_error(path))
}

/// Bytes up to the end of the last whole line.
fn whole_lines(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1)
}

fn write_error(path: &Path) -> impl FnOnce(io::Error) -> JournalError + use<> {
    let path = path.to_owned();
    |source| JournalError::Write { path, source }
}

#[cfg(test)]
mod tests;
