//! The guard's orders, which it gets at its start as one line of JSON.

use std::os::fd::{AsFd, AsRawFd, RawFd};
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::Duties;
use crate::emergency::Emergency;

/// What to do when the guarded program has ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Orders {
    /// The guarded process.
    pub program: u32,
    /// Its thread that beats.
    pub thread: i32,
    /// Where to write what was done.
    pub log: Option<PathBuf>,
    /// What is returned to whoever called the guard, if it had to act.
    pub note: Option<String>,
    /// The devices, the one first that matters most.
    pub devices: Vec<Order>,
}

/// What to send to one device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Order {
    /// Its name, for the log.
    pub device: String,
    /// Its port, and the port's speed, should the handle be dead.
    pub port: String,
    /// See `port`.
    pub baud: u32,
    /// The handle that was left open for the guard.
    pub handle: RawFd,
    /// What is sent.
    pub bytes: Vec<u8>,
}

impl Orders {
    /// For this process as the guarded one; this thread beats.
    pub fn new(duties: &Duties) -> Self {
        let order = |emergency: &Emergency| Order {
            device: emergency.device.to_string(),
            port: emergency.device.port.clone(),
            baud: emergency.spare.baud(),
            handle: emergency.spare.as_fd().as_raw_fd(),
            bytes: emergency.bytes.clone(),
        };
        Self {
            program: std::process::id(),
            thread: rustix::thread::gettid().as_raw_pid(),
            log: duties
                .log
                .as_ref()
                .map(|log| std::path::absolute(log).unwrap_or_else(|_| log.clone())),
            note: duties.note.clone(),
            devices: duties.emergencies.iter().map(order).collect(),
        }
    }

    /// As a line, without its end.
    pub fn encode(&self) -> String {
        serde_json::to_string(self).expect("numbers and text are JSON")
    }

    /// Reads the line.
    pub fn decode(line: &str) -> Option<Self> {
        serde_json::from_str(line).ok()
    }
}
