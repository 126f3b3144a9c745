//! The lines of `campaign.jsonl`: what happened, in order.

use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use crate::budget::Use;
use fieldgap_monitoring::{Acknowledgement, Alarm};

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// When.
    pub at: Timestamp,
    /// What.
    #[serde(flatten)]
    pub what: What,
}

/// What happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum What {
    /// The campaign began.
    Began {
        /// Seed of the order.
        seed: u64,
        /// The program and its version.
        software: String,
    },
    /// It went on in another process.
    Resumed,
    /// A round began.
    Round {
        /// Its number, from 1.
        round: u32,
        /// Starts that passed during the round before.
        left_out: u32,
    },
    /// A condition was set and confirmed.
    Set {
        /// Its name.
        condition: String,
        /// Its value.
        value: String,
        /// What was read, where a sensor or a program reads it.
        reading: Option<f64>,
    },
    /// A condition could not be set; its cells were left out.
    NotSet {
        /// Its name.
        condition: String,
        /// Its value.
        value: String,
        /// Why.
        reason: String,
    },
    /// The scan of a cell began, or went on.
    Begun {
        /// The cell's folder.
        cell: String,
        /// SHA-256 of its plan and rig file.
        digest: String,
    },
    /// The scan of a cell is complete.
    Measured {
        /// The cell's folder.
        cell: String,
        /// What it took.
        used: Use,
    },
    /// All that follows the scan of a cell is done.
    Closed {
        /// The cell's folder.
        cell: String,
        /// What could not be done after the scan, if anything.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        problem: Option<String>,
    },
    /// A cell failed.
    Failed {
        /// The cell's folder.
        cell: String,
        /// Why.
        reason: String,
    },
    /// A folder was moved, because its record is not one of the cell any more.
    MovedAside {
        /// The cell's folder.
        cell: String,
        /// Where its record is now.
        to: String,
    },
    /// A figure left its limits.
    Alarm {
        /// The cell's folder.
        cell: String,
        /// The alarm.
        alarm: Alarm,
        /// What a comparison of the records before and after says, if anything.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        cause: Option<String>,
    },
    /// A person looked at the alarms: charts begin anew.
    Acknowledged {
        /// Which, and what is expected from now on.
        of: Acknowledgement,
        /// Who.
        who: String,
        /// What was found or done.
        text: String,
    },
    /// A rig is left alone until the campaign is resumed.
    RigLeft {
        /// Name of the rig.
        rig: String,
        /// Why.
        reason: String,
    },
    /// The process ended.
    Ended {
        /// Why, if not because all is done.
        reason: Option<String>,
    },
}
