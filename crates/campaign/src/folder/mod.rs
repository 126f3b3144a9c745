//! The folder of a campaign.
//!
//! | name | what it holds |
//! |---|---|
//! | `campaign.toml` | a copy of the campaign's file |
//! | `origin.toml` | the path of that file, which is read again when the campaign is resumed |
//! | `campaign.jsonl` | what happened, a line of JSON each; the state is what these lines say |
//! | `cells/` | a record for each cell |
//! | `index.html` | the page |
//!
//! A line is on disk before what it announces begins. A process that is killed at any time leaves at most one incomplete line, which is cut
//! off, and cells whose records say how far they are.

mod entry;
mod state;

use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use serde::{Deserialize, Serialize};

pub use self::entry::{Entry, What};
pub use self::state::{CellLog, CellState, LoggedAlarm, State};
use super::error::CampaignError;
use super::file::Campaign;
use fieldgap_input::{Fault, MOST_TABLE, TomlSource, read_text};
use fieldgap_records::{Lines, write_whole};

const COPY: &str = "campaign.toml";
const ORIGIN: &str = "origin.toml";
const LOG: &str = "campaign.jsonl";
const CELLS: &str = "cells";

/// `origin.toml`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Origin {
    campaign: PathBuf,
}

/// The folder of a campaign that this process runs: locked until it is dropped.
#[derive(Debug)]
pub struct CampaignFolder {
    path: PathBuf,
    log: Lines<File>,
    state: State,
}

impl CampaignFolder {
    /// Begins a campaign in a folder, which is made if it is missing.
    ///
    /// # Errors
    /// [`CampaignError::Occupied`] if the folder has one, or if it cannot be written.
    pub fn begin(
        campaign: &Campaign,
        path: &Path,
        seed: u64,
        at: Timestamp,
    ) -> Result<Self, CampaignError> {
        if path.join(LOG).exists() {
            return Err(CampaignError::Occupied(path.to_owned()));
        }
        fs::create_dir_all(path.join(CELLS)).map_err(CampaignError::writing(path))?;
        let file = campaign.source().path();
        let file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
        let origin = toml::to_string(&Origin { campaign: file }).expect("a path is TOML");
        for (name, text) in [(COPY, campaign.source().text()), (ORIGIN, &origin)] {
            let path = path.join(name);
            write_whole(&path, |file| std::io::Write::write_all(file, text.as_bytes()))
                .map_err(CampaignError::writing(&path))?;
        }
        let mut folder = Self::locked(path)?;
        let software = concat!("fieldgap ", env!("CARGO_PKG_VERSION")).to_owned();
        folder.log(at, What::Began { seed, software })?;
        Ok(folder)
    }

    /// Opens the folder of a campaign to continue it.
    ///
    /// # Errors
    /// [`CampaignError::NoCampaign`], [`CampaignError::Busy`], or a line of the log that is damaged.
    pub fn open(path: &Path) -> Result<Self, CampaignError> {
        if !path.join(LOG).is_file() {
            return Err(CampaignError::NoCampaign(path.to_owned()));
        }
        Self::locked(path)
    }

    fn locked(path: &Path) -> Result<Self, CampaignError> {
        let log = path.join(LOG);
        let file = OpenOptions::new().create(true).append(true).open(&log);
        let file = file.map_err(CampaignError::writing(&log))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(CampaignError::Busy(path.to_owned())),
            Err(TryLockError::Error(source)) => return Err(CampaignError::writing(&log)(source)),
        }
        let (state, length) = read_log(&log)?;
        let mut log_lines = Lines::after(file, length);
        log_lines.cut_torn_end().map_err(CampaignError::writing(&log))?;
        Ok(Self { path: path.to_owned(), log: log_lines, state })
    }

    /// The state of the campaign in a folder, which another process may be running.
    ///
    /// # Errors
    /// As [`CampaignFolder::open`], but for [`CampaignError::Busy`].
    pub fn read(path: &Path) -> Result<State, CampaignError> {
        let log = path.join(LOG);
        if !log.is_file() {
            return Err(CampaignError::NoCampaign(path.to_owned()));
        }
        Ok(read_log(&log)?.0)
    }

    /// Whether a process runs the campaign in a folder.
    pub fn is_running(path: &Path) -> bool {
        let file = OpenOptions::new().append(true).open(path.join(LOG));
        file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
    }

    /// The campaign's file as it is now; its copy if the file is gone.
    ///
    /// # Errors
    /// A fault in the file.
    pub fn campaign(path: &Path) -> Result<Campaign, CampaignError> {
        if !path.join(LOG).is_file() {
            return Err(CampaignError::NoCampaign(path.to_owned()));
        }
        let origin: Origin = TomlSource::read(&path.join(ORIGIN))?.parse()?;
        if origin.campaign.is_file() {
            return Campaign::read(&origin.campaign);
        }
        let copy = TomlSource::read(&path.join(COPY))?;
        Campaign::parse(TomlSource::new(&origin.campaign, copy.text()))
    }

    /// The state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of a cell's record.
    pub fn cell(&self, id: &str) -> PathBuf {
        cell_folder(&self.path, id)
    }

    /// Writes a line, which is on disk when this returns.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn log(&mut self, at: Timestamp, what: What) -> Result<(), CampaignError> {
        let entry = Entry { at, what };
        let line = serde_json::to_string(&entry).expect("an entry is JSON") + "\n";
        self.log.append(&line).map_err(CampaignError::writing(&self.path.join(LOG)))?;
        self.state.take(&entry);
        Ok(())
    }

    /// Moves the folder of a cell aside, so that the cell can be measured anew. Nothing is deleted.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn move_aside(&mut self, id: &str, why: &str, at: Timestamp) -> Result<(), CampaignError> {
        let from = self.cell(id);
        let name = |number: u32| format!("{id}.{why}-{number}");
        let free = (1..).map(name).find(|name| !self.cell(name).exists());
        let to = free.expect("there are more numbers than folders");
        fs::rename(&from, self.cell(&to)).map_err(CampaignError::writing(&from))?;
        self.log(at, What::MovedAside { cell: id.to_owned(), to })
    }
}

/// The folder of a cell's record in that of a campaign.
pub fn cell_folder(campaign: &Path, id: &str) -> PathBuf {
    campaign.join(CELLS).join(id)
}

/// The state, and the bytes of complete lines.
fn read_log(path: &Path) -> Result<(State, u64), CampaignError> {
    let text = read_text(path, MOST_TABLE).map_err(|source| CampaignError::Disk {
        what: "read",
        path: path.to_owned(),
        source,
    })?;
    let (mut state, mut length) = (State::default(), 0);
    let whole = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    for (number, line) in whole.enumerate() {
        let entry: Entry = serde_json::from_str(line).map_err(|error| {
            let problem = format!("line {} is damaged: {error}", number + 1);
            Fault::of_file(
                path,
                problem,
                "remove the line; the records of the cells say how far they are",
            )
        })?;
        state.take(&entry);
        length += line.len() as u64;
    }
    Ok((state, length))
}
