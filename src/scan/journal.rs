//! The folder of a scan that is running.
//!
//! What a [`RecordedScan`](super::RecordedScan) needs, growing by one line a visit, and beside it
//!
//! | file | what it holds |
//! |---|---|
//! | `state.toml` | how the scan stands: scanning, partial, complete |
//! | `events.jsonl` | what happened: homing, reference checks, faults, resumes |
//! | copies | the plan and the rig file it was begun with, so that it can be resumed as it was begun |
//!
//! Row k of `samples.csv` is visit k of the plan, and is on disk before [`Journal::append`] returns. Whatever instant
//! the process or the power dies at, [`Journal::resume`] finds every acknowledged row: at most the line being written
//! is torn, and a torn line has no line end.

mod error;
mod event;
mod state;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use jiff::Timestamp;

pub use self::error::{BadSample, JournalError};
pub use self::event::{Event, EventKind, read_events};
pub use self::state::ScanState;
use super::durable::{self, Lines};
use super::sample::Sample;
use super::samples_csv::{Columns, samples_of};
use super::setup::ScanSetup;
use super::table::Table;
use crate::input::Fault;

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
    /// What was measured so far: sample k is of visit k.
    pub samples: Vec<Sample>,
    /// What stood of a line that was cut off, if one was: that visit is to be made again.
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
        let put = |name: &str, contents: &[u8]| {
            let path = folder.join(name);
            durable::replace(&path, contents).map_err(write_error(&path))
        };
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
            samples: Lines::after(samples, header.len() as u64),
            events,
            visits_done: 0,
        };
        journal.record(at, EventKind::Started, &setup.name)?;
        Ok(journal)
    }

    /// Takes up a scan that was broken off, however it ended.
    ///
    /// A last line without its end is cut off, and its text kept in `events.jsonl`.
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
        let path = folder.join(SAMPLES);
        let mut bytes = fs::read(&path).map_err(|error| {
            Box::new(Fault::of_file(
                &path,
                format!("cannot be read: {error}"),
                "bring the file back; without it nothing of the scan is left",
            ))
        })?;
        let torn = bytes.split_off(whole_lines(&bytes));
        let length = bytes.len() as u64;
        let table = Table::from_bytes(&path, bytes).map_err(Box::new)?;
        let (columns, samples) = samples_of(&table, setup.foci.len()).map_err(Box::new)?;

        let mut journal = Self {
            folder: folder.to_owned(),
            columns,
            foci: setup.foci.len(),
            samples: Lines::after(open_for_append(&path)?, length),
            events,
            visits_done: samples.len(),
        };
        let cut = (!torn.is_empty()).then(|| {
            String::from_utf8_lossy(&torn).chars().take(KEPT_OF_TORN_LINE).collect::<String>()
        });
        if let Some(text) = &cut {
            // Kept before it is cut: killed in between, it is found and kept once more.
            journal.record(at, EventKind::LineCut, text)?;
            journal.samples.mend().map_err(write_error(&path))?;
        }
        ScanState::Scanning.write(folder).map_err(write_error(&folder.join(state::FILE)))?;
        journal.record(at, EventKind::Resumed, "")?;
        Ok(Resumed { journal, setup, samples, cut })
    }

    /// Keeps the sample of the next visit; it is on disk when this returns.
    ///
    /// # Errors
    /// [`JournalError::Sample`] if the record could not be read with it, [`JournalError::Append`] if it did not reach the
    /// disk. Either way all samples before it are safe, nothing of this one is left, and it may be tried again.
    pub fn append(&mut self, sample: &Sample) -> Result<(), JournalError> {
        let line = self
            .line(sample)
            .map_err(|reason| JournalError::Sample { visit: self.visits_done, reason })?;
        self.samples.append(&line).map_err(|source| JournalError::Append {
            folder: self.folder.clone(),
            kept: self.visits_done,
            source,
        })?;
        self.visits_done += 1;
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

    fn line(&self, sample: &Sample) -> Result<String, BadSample> {
        match sample.focus {
            Some(focus) if focus >= self.foci => {
                Err(BadSample::NoSuchFocus { focus, foci: self.foci })
            }
            _ => Ok(self.columns.line(sample)?),
        }
    }
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
