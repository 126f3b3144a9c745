//! The guard's orders, which it gets at its start as one line of JSON.

use std::os::fd::{AsFd, AsRawFd, RawFd};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::emergency::Emergency;

/// What to do when the guarded program has ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Orders {
    /// The guarded process.
    pub program: u32,
    /// Where to write what was done.
    pub log: Option<PathBuf>,
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
    /// For this process as the guarded one.
    pub fn new(emergencies: &[Emergency], log: Option<&Path>) -> Self {
        let order = |emergency: &Emergency| Order {
            device: emergency.device.to_string(),
            port: emergency.device.port.clone(),
            baud: emergency.spare.baud(),
            handle: emergency.spare.as_fd().as_raw_fd(),
            bytes: emergency.bytes.clone(),
        };
        Self {
            program: std::process::id(),
            log: log.map(|log| std::path::absolute(log).unwrap_or_else(|_| log.to_owned())),
            devices: emergencies.iter().map(order).collect(),
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
