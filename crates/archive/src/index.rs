//! The index of the records below a folder.
//!
//! The index is an SQLite file, `.fieldgap-index.sqlite`. SQLite, and not a store of keys and values such as redb: people of a laboratory can
//! query it with their own tools, by columns that have names (`schema.sql`); its own indices answer filters; it is one file; and several
//! processes may use it at once. It costs a C compiler, which the build needs anyway. It keeps a rollback journal, not a write-ahead log,
//! because the latter does not work on network file systems.
//!
//! It is never the only place of anything. Whatever is wrong with it, it is made anew from the records.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::{Connection, ErrorCode, TransactionBehavior};

use crate::changes::{Found, Search, by_bytes, records_below};
use crate::entry::{Entry, State};
use crate::place::Place;
use crate::query::Query;
use crate::reading::read_entry;
use crate::store::{self, Writer, folder_of};

/// How long one process waits for another that writes: the time for some hundred thousand records.
const PATIENCE: Duration = Duration::from_secs(300);

/// Records that are read and written together; so many entries are in memory at once.
const BATCH: usize = 256;

/// Why records cannot be listed.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ArchiveError {
    /// The folder cannot be read.
    #[error("the records below {} cannot be listed: {source}", folder.display())]
    #[diagnostic(help("check the path and its permissions"))]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The reason.
        source: io::Error,
    },
    /// The index cannot be used, though it was made anew.
    #[error("the index {} cannot be used: {source}", path.display())]
    #[diagnostic(help(
        "is the disk full? The index can be deleted at any time: it is made from the records"
    ))]
    Index {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: rusqlite::Error,
    },
}

/// The index of a folder.
#[derive(Debug)]
pub struct Index {
    root: PathBuf,
    place: Place,
    connection: Connection,
    /// The folder of the index, locked in common with other users of it; alone while the file is replaced.
    lock: Option<File>,
    renewed: Option<&'static str>,
}

/// What an update did.
#[derive(Debug, Default)]
pub struct Updated {
    /// Records that were read, as they were new or their files had changed.
    pub read: usize,
    /// Records that are there no more.
    pub removed: usize,
    /// All records.
    pub records: usize,
    /// Records whose files are damaged.
    pub damaged: usize,
    /// Folders that cannot be read, with the reason.
    pub unreadable: Vec<(PathBuf, io::Error)>,
}

impl Index {
    /// Opens the index of the records below `root`, or makes an empty one. `cache` is the folder for an index that cannot lie there.
    ///
    /// # Errors
    /// [`ArchiveError`] if `root` is no folder, or the index can neither be used nor made anew.
    pub fn open(root: &Path, cache: Option<&Path>) -> Result<Self, ArchiveError> {
        let no_folder = |source| ArchiveError::Folder { folder: root.to_owned(), source };
        std::fs::read_dir(root).map_err(no_folder)?;
        let place = Place::of(root, cache);
        let lock = place.file().and_then(Path::parent).and_then(|folder| File::open(folder).ok());
        // Where folders cannot be locked, as on some network file systems, only the replacement of a damaged index is unprotected.
        lock.as_ref().map(File::lock_shared);
        let connection = Connection::open_in_memory().map_err(failed(&place))?;
        let mut index = Self { root: root.to_owned(), place, connection, lock, renewed: None };
        match index.connect() {
            Ok(true) => {}
            Ok(false) => index.renew("it was made by another version")?,
            Err(error) if is_damage(&error) => index.renew(DAMAGED)?,
            Err(error) => return Err(failed(&index.place)(error)),
        }
        Ok(index)
    }

    /// Where it lies.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// Why it was made anew since it was opened; `None` if it was not.
    pub fn renewed(&self) -> Option<&'static str> {
        self.renewed
    }

    /// Connects to the file, which is made if it is missing; whether its tables are those of this version.
    fn connect(&mut self) -> rusqlite::Result<bool> {
        let mut connection = match self.place.file() {
            Some(path) => Connection::open(path)?,
            None => Connection::open_in_memory()?,
        };
        connection.busy_timeout(PATIENCE)?;
        let root = match &self.place {
            Place::Cache(_) => Some(self.root_text()),
            Place::Beside(_) | Place::Memory => None,
        };
        let mut ours = store::is_ours(&connection, root.as_deref());
        if matches!(ours, Ok(false) | Err(_)) && store::is_empty(&connection)? {
            let transaction =
                connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
            // Asked again, now that no other process writes.
            if store::is_empty(&transaction)? {
                store::make_tables(&transaction, root.as_deref())?;
            }
            transaction.commit()?;
            ours = store::is_ours(&connection, root.as_deref());
        }
        self.connection = connection;
        match ours {
            // Tables of another program.
            Err(error)
                if !is_damage(&error) && error.sqlite_error_code() == Some(ErrorCode::Unknown) =>
            {
                Ok(false)
            }
            ours => ours,
        }
    }

    fn root_text(&self) -> String {
        let root = std::fs::canonicalize(&self.root).unwrap_or_else(|_| self.root.clone());
        root.to_string_lossy().into_owned()
    }

    /// Replaces the file by an empty index.
    fn renew(&mut self, why: &'static str) -> Result<(), ArchiveError> {
        // The connection is closed before the file goes.
        self.connection = Connection::open_in_memory().map_err(failed(&self.place))?;
        if let Some(lock) = &self.lock {
            let _ = lock.unlock();
            let _ = lock.lock();
        }
        // Another process may have been faster.
        let usable = matches!(self.connect(), Ok(true)) && self.is_sound();
        if !usable {
            self.connection = Connection::open_in_memory().map_err(failed(&self.place))?;
            if let Some(path) = self.place.file() {
                for end in ["", "-journal", "-wal", "-shm"] {
                    let mut file = path.as_os_str().to_owned();
                    file.push(end);
                    let _ = std::fs::remove_file(file);
                }
            }
            self.connect().map_err(failed(&self.place))?;
            self.renewed = Some(why);
        }
        self.lock.as_ref().map(File::lock_shared);
        Ok(())
    }

    fn is_sound(&self) -> bool {
        let check =
            self.connection.query_row("pragma quick_check(1)", [], |row| row.get::<_, String>(0));
        check.is_ok_and(|answer| answer == "ok")
    }

    /// Does something with the index; if it turns out to be damaged, again with a new one.
    fn recovering<T>(
        &mut self,
        work: impl Fn(&mut Self) -> rusqlite::Result<T>,
    ) -> Result<T, ArchiveError> {
        match work(self) {
            Err(error) if is_damage(&error) => {
                self.renew(DAMAGED)?;
                let found = self.search()?.records;
                self.bring_up_to_date(&found).and_then(|_| work(self)).map_err(failed(&self.place))
            }
            done => done.map_err(failed(&self.place)),
        }
    }

    fn search(&self) -> Result<Search, ArchiveError> {
        let unreadable = |source| ArchiveError::Folder { folder: self.root.clone(), source };
        records_below(&self.root).map_err(unreadable)
    }

    /// Reads the records that are new or have changed, and forgets those that are gone.
    ///
    /// # Errors
    /// [`ArchiveError`] if the folder cannot be read, or the index not written.
    pub fn update(&mut self) -> Result<Updated, ArchiveError> {
        let Search { records: found, unreadable } = self.search()?;
        let (read, removed) = self.recovering(|index| index.bring_up_to_date(&found))?;
        let damaged = self.recovering(|index| {
            let count = "select count(*) from records where fault is not null";
            index.connection.query_row(count, [], |row| row.get::<_, i64>(0))
        })?;
        Ok(Updated { read, removed, records: found.len(), damaged: damaged as usize, unreadable })
    }

    /// How many were read, and how many removed.
    fn bring_up_to_date(&mut self, found: &[Found]) -> rusqlite::Result<(usize, usize)> {
        use rayon::prelude::*;
        let (changed, gone) = self.differences(found)?;
        if !gone.is_empty() {
            let transaction =
                self.connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
            let mut writer = Writer::new(&transaction)?;
            gone.iter().try_for_each(|folder| writer.remove(folder))?;
            drop(writer);
            transaction.commit()?;
        }
        let root = &self.root;
        let read = |batch: &[&Found]| -> Vec<Entry> {
            batch.par_iter().map(|found| read_entry(root, &found.folder)).collect()
        };
        // One batch is written while the next is read.
        let mut ready: (&[&Found], Vec<Entry>) = (&[], Vec::new());
        let batches = changed.chunks(BATCH).map(Some).chain([None]);
        for next in batches {
            let (batch, entries) = std::mem::take(&mut ready);
            let connection = &mut self.connection;
            let (written, entries) = rayon::join(
                || write(connection, batch, &entries),
                || next.map(read).unwrap_or_default(),
            );
            written?;
            ready = (next.unwrap_or_default(), entries);
        }
        Ok((changed.len(), gone.len()))
    }

    /// Records that are to be read, and folders that are no records any more.
    fn differences<'f>(
        &self,
        found: &'f [Found],
    ) -> rusqlite::Result<(Vec<&'f Found>, Vec<PathBuf>)> {
        let mut known = self.connection.prepare("select folder, stamp from records")?;
        let mut rows = known.query([])?;
        let mut current = vec![false; found.len()];
        let mut gone = Vec::new();
        while let Some(row) = rows.next()? {
            let folder = folder_of(row.get_ref(0)?);
            match found.binary_search_by(|found| by_bytes(&found.folder, &folder)) {
                Ok(place) => {
                    let stamp: Option<Vec<u8>> = row.get(1)?;
                    current[place] = stamp.as_deref() == Some(found[place].stamp.bytes());
                }
                Err(_) => gone.push(folder),
            }
        }
        let changed = found.iter().zip(current).filter(|(_, current)| !current);
        Ok((changed.map(|(found, _)| found).collect(), gone))
    }

    /// The records that a query asks for, as of the last [update](Self::update).
    ///
    /// # Errors
    /// [`ArchiveError`] if the index cannot be read.
    pub fn query(&mut self, query: &Query) -> Result<Vec<Entry>, ArchiveError> {
        self.recovering(|index| query.run(&index.connection.transaction()?))
    }
}

const DAMAGED: &str = "it was damaged";

fn write(connection: &mut Connection, batch: &[&Found], entries: &[Entry]) -> rusqlite::Result<()> {
    if entries.is_empty() {
        return Ok(());
    }
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let mut writer = Writer::new(&transaction)?;
    for (found, entry) in batch.iter().zip(entries) {
        // A running scan grows, and a file that was just written may change again within the clock's tick.
        let lasting = found.settled && entry.state != State::Scanning;
        writer.put(entry, lasting.then_some(&found.stamp))?;
    }
    drop(writer);
    transaction.commit()
}

/// Whether the file is no index, or a damaged one.
fn is_damage(error: &rusqlite::Error) -> bool {
    matches!(error.sqlite_error_code(), Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase))
}

fn failed(place: &Place) -> impl FnOnce(rusqlite::Error) -> ArchiveError {
    let path = place.file().unwrap_or(Path::new("in memory")).to_owned();
    |source| ArchiveError::Index { path, source }
}
