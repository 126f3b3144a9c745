//! The tables of the index, and the writing of records into them.

use std::ffi::OsString;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};

use fieldgap_text::Uncertain;
use rusqlite::types::{Value, ValueRef};
use rusqlite::{Connection, Statement, Transaction, params};

use crate::changes::Stamp;
use crate::entry::Entry;

/// The tables, as people see them who query the index with other programs.
const TABLES: &str = include_str!("schema.sql");

/// Marks the file as an index of fieldgap: `fgix` in ASCII.
const APPLICATION: i32 = 0x6667_6978;

/// Raised with each change of the tables or of what is read from a record.
const VERSION: i32 = 1;

/// The tables that have rows of a record, besides `records`.
const OF_RECORD: [&str; 5] = ["foci", "heights", "effects", "figures", "notes"];

/// Whether an existing index is one that this version of the program made; of an index in the cache, also for this folder.
pub(crate) fn is_ours(connection: &Connection, root: Option<&str>) -> rusqlite::Result<bool> {
    let number =
        |pragma: &str| connection.pragma_query_value(None, pragma, |row| row.get::<_, i32>(0));
    if number("application_id")? != APPLICATION || number("user_version")? != VERSION {
        return Ok(false);
    }
    let mut about = connection.prepare("select value from about where key = ?1")?;
    let mut known = |key: &str| match about.query_row([key], |row| row.get::<_, Option<String>>(0))
    {
        Err(rusqlite::Error::QueryReturnedNoRows) => Ok(None),
        known => known,
    };
    Ok(known("software")?.as_deref() == Some(env!("CARGO_PKG_VERSION"))
        && known("root")?.as_deref() == root)
}

/// Whether there is nothing in it yet.
pub(crate) fn is_empty(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row("select count(*) = 0 from sqlite_schema", [], |row| row.get(0))
}

/// Makes the tables.
pub(crate) fn make_tables(
    transaction: &Transaction<'_>,
    root: Option<&str>,
) -> rusqlite::Result<()> {
    transaction.execute_batch(TABLES)?;
    let mut about = transaction.prepare("insert into about values (?1, ?2)")?;
    about.execute(["software", env!("CARGO_PKG_VERSION")])?;
    if let Some(root) = root {
        about.execute(["root", root])?;
    }
    transaction.pragma_update(None, "application_id", APPLICATION)?;
    transaction.pragma_update(None, "user_version", VERSION)
}

/// A folder as it is stored.
pub(crate) fn folder_value(folder: &Path) -> Value {
    match folder.to_str() {
        Some(text) => Value::Text(text.to_owned()),
        None => Value::Blob(folder.as_os_str().as_bytes().to_vec()),
    }
}

/// A folder as it was stored.
pub(crate) fn folder_of(value: ValueRef<'_>) -> PathBuf {
    let bytes = match value {
        ValueRef::Text(bytes) | ValueRef::Blob(bytes) => bytes,
        _ => &[],
    };
    PathBuf::from(OsString::from_vec(bytes.to_vec()))
}

/// Text in lower case, in which is searched.
pub(crate) fn folded(text: &str) -> String {
    text.to_lowercase()
}

/// Writes records in one transaction.
pub(crate) struct Writer<'t> {
    record: Statement<'t>,
    forget: Vec<Statement<'t>>,
    focus: Statement<'t>,
    height: Statement<'t>,
    effect: Statement<'t>,
    figure: Statement<'t>,
    note: Statement<'t>,
    remove: Statement<'t>,
}

impl<'t> Writer<'t> {
    /// A writer in a transaction.
    pub(crate) fn new(transaction: &'t Transaction<'_>) -> rusqlite::Result<Self> {
        let forget = OF_RECORD
            .map(|table| transaction.prepare(&format!("delete from {table} where record = ?1")));
        Ok(Self {
            record: transaction.prepare(
                "insert into records (folder, stamp, fault, name, name_folded, recorded, recorded_us, rig, rig_folded, state, points, \
                 simulator, gap, gap_error, noise_floor, level, level_error, correlation, correlation_error, verdict, temperature_c, \
                 temperature_error_c) values (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19, ?20, \
                 ?21, ?22) on conflict (folder) do update set stamp = excluded.stamp, fault = excluded.fault, name = excluded.name, \
                 name_folded = excluded.name_folded, recorded = excluded.recorded, recorded_us = excluded.recorded_us, \
                 rig = excluded.rig, rig_folded = excluded.rig_folded, state = excluded.state, points = excluded.points, \
                 simulator = excluded.simulator, gap = excluded.gap, gap_error = excluded.gap_error, \
                 noise_floor = excluded.noise_floor, level = excluded.level, level_error = excluded.level_error, \
                 correlation = excluded.correlation, correlation_error = excluded.correlation_error, verdict = excluded.verdict, \
                 temperature_c = excluded.temperature_c, temperature_error_c = excluded.temperature_error_c returning id",
            )?,
            forget: forget.into_iter().collect::<Result<_, _>>()?,
            focus: transaction.prepare("insert into foci values (?1, ?2, ?3, ?4, ?5)")?,
            height: transaction.prepare("insert or ignore into heights values (?1, ?2)")?,
            effect: transaction.prepare("insert into effects values (?1, ?2, ?3)")?,
            figure: transaction.prepare("insert into figures values (?1, ?2, ?3, ?4)")?,
            note: transaction.prepare("insert into notes values (?1, ?2, ?3, ?4, ?5, ?6, ?7)")?,
            remove: transaction.prepare("delete from records where folder = ?1 returning id")?,
        })
    }

    /// Writes a record in place of what was known of it. Without a stamp it is read again next time.
    pub(crate) fn put(&mut self, entry: &Entry, stamp: Option<&Stamp>) -> rusqlite::Result<()> {
        let value = |figure: Option<Uncertain>| figure.map(|figure| figure.value);
        let error = |figure: Option<Uncertain>| figure.map(|figure| figure.standard_error);
        let id: i64 = self.record.query_row(
            params![
                folder_value(&entry.folder),
                stamp.map(Stamp::bytes),
                entry.fault,
                entry.name,
                entry.name.as_deref().map(folded),
                entry.recorded.map(|at| at.to_string()),
                entry.recorded.map(|at| at.as_microsecond()),
                entry.rig,
                entry.rig.as_deref().map(folded),
                entry.state.as_str(),
                entry.points.map(|points| points as i64),
                entry.simulator.map(|simulator| simulator.to_string()),
                value(entry.gap),
                error(entry.gap),
                entry.noise_floor,
                value(entry.level),
                error(entry.level),
                value(entry.correlation),
                error(entry.correlation),
                entry.verdict.map(|verdict| verdict.as_str()),
                value(entry.temperature_c),
                error(entry.temperature_c),
            ],
            |row| row.get(0),
        )?;
        self.forget_details(id)?;
        for (number, focus_mm) in entry.foci_mm.iter().enumerate() {
            let at = |axis: usize| focus_mm.map(|focus_mm| focus_mm[axis]);
            self.focus.execute(params![id, number as i64, at(0), at(1), at(2)])?;
        }
        for z_mm in &entry.heights_mm {
            self.height.execute(params![id, z_mm])?;
        }
        for (position, effect) in entry.effects.iter().enumerate() {
            self.effect.execute(params![id, position as i64, effect.as_str()])?;
        }
        for (name, figure) in &entry.figures {
            self.figure.execute(params![id, name.as_str(), figure.value, figure.standard_error])?;
        }
        for (position, note) in entry.notes.iter().enumerate() {
            let (at, kind) = (note.at.to_string(), note.kind.as_str());
            let (who, text) = (note.who(), note.text());
            self.note.execute(params![id, position as i64, at, who, kind, text, folded(text)])?;
        }
        Ok(())
    }

    /// Removes a record.
    pub(crate) fn remove(&mut self, folder: &Path) -> rusqlite::Result<()> {
        match self.remove.query_row([folder_value(folder)], |row| row.get::<_, i64>(0)) {
            Ok(id) => self.forget_details(id),
            // Another process was faster.
            Err(rusqlite::Error::QueryReturnedNoRows) => Ok(()),
            Err(error) => Err(error),
        }
    }

    fn forget_details(&mut self, id: i64) -> rusqlite::Result<()> {
        self.forget.iter_mut().try_for_each(|forget| forget.execute([id]).map(drop))
    }
}
