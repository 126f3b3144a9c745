//! Scans that were confirmed and wait for their turn.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use serde_json::{Value, json};

use crate::exposure::Accepted;

/// Most scans that wait.
pub(crate) const MOST_WAITING: usize = 100;

/// A scan that waits.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Waiting {
    id: u64,
    pub plan: String,
    /// Of the plan as it was confirmed.
    pub digest: String,
    /// What was accepted of the exposure of people.
    #[serde(skip)]
    pub accepts: Accepted,
    by: String,
}

#[derive(Debug, Default)]
struct Line {
    waiting: VecDeque<Waiting>,
    running: Option<Waiting>,
    /// The folder of the newest record that was begun here.
    folder: Option<PathBuf>,
    /// After a stop nothing starts until a person lets it.
    held: bool,
    next_id: u64,
}

/// The queue.
#[derive(Debug, Default)]
pub(crate) struct Queue(Mutex<Line>);

impl Queue {
    fn line(&self) -> MutexGuard<'_, Line> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a scan; `None` if too many wait.
    pub fn add(&self, plan: &str, digest: &str, accepts: Accepted, by: &str) -> Option<u64> {
        let mut line = self.line();
        if line.waiting.len() >= MOST_WAITING {
            return None;
        }
        line.next_id += 1;
        let id = line.next_id;
        let (plan, digest, by) = (plan.to_owned(), digest.to_owned(), by.to_owned());
        line.waiting.push_back(Waiting { id, plan, digest, accepts, by });
        Some(id)
    }

    /// Removes a scan that waits; whether it was there.
    pub fn remove(&self, id: u64) -> bool {
        let mut line = self.line();
        let before = line.waiting.len();
        line.waiting.retain(|waiting| waiting.id != id);
        line.waiting.len() < before
    }

    /// Moves a scan to the front; whether it was there.
    pub fn first(&self, id: u64) -> bool {
        let mut line = self.line();
        let place = line.waiting.iter().position(|waiting| waiting.id == id);
        let moved = place.and_then(|place| line.waiting.remove(place));
        moved.map(|moved| line.waiting.push_front(moved)).is_some()
    }

    /// Holds the queue, or lets it go on.
    pub fn hold(&self, held: bool) {
        self.line().held = held;
    }

    /// Takes the next scan to run, if none runs and the queue is not held.
    pub fn begin(&self) -> Option<Waiting> {
        let mut line = self.line();
        if line.held || line.running.is_some() {
            return None;
        }
        let next = line.waiting.pop_front()?;
        line.running = Some(next.clone());
        Some(next)
    }

    /// The record of the scan that was begun.
    pub fn records_in(&self, folder: &Path) {
        self.line().folder = Some(folder.to_owned());
    }

    /// The folder of the newest record that was begun here.
    pub fn newest_folder(&self) -> Option<PathBuf> {
        self.line().folder.clone()
    }

    /// The scan that was begun has ended.
    pub fn ended(&self) {
        self.line().running = None;
    }

    /// Whether a scan of this server runs.
    pub fn runs(&self) -> bool {
        self.line().running.is_some()
    }

    /// As the pages show it.
    pub fn shown(&self) -> Value {
        let line = self.line();
        json!({"waiting": line.waiting, "running": line.running, "held": line.held})
    }
}
