//! Events of a running scan, for progress displays and the monitor.

use serde::Serialize;

/// One event.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "event")]
pub enum Event {
    /// The devices answered.
    Opened {
        /// What the robot's firmware calls itself.
        robot: String,
        /// The receiver's rate and range.
        receiver: String,
        /// The array's controller.
        array: String,
    },
    /// The robot has homed.
    Homed,
    /// On resuming, a point was measured again.
    ReferenceChecked {
        /// Row of `samples.csv` that it repeats, from 0.
        row: usize,
        /// The reading kept there.
        kept: f64,
        /// The reading now.
        now: f64,
        /// How far the robot reports to be from where it reported then, mm.
        moved_mm: f64,
    },
    /// A row was scanned in both directions to find the lag of the readings behind the robot.
    LagFound {
        /// The lag, ms.
        lag_ms: f64,
        /// Its standard error, ms.
        standard_error_ms: f64,
    },
    /// The reference point was measured again, to detect drift.
    ReferenceRevisited {
        /// Where it is, as the robot reports it, array frame, mm.
        at_mm: [f64; 3],
        /// The first reading there.
        first: f64,
        /// The reading now.
        now: f64,
        /// How far the robot reports to be from where it reported at the first, mm.
        moved_mm: f64,
    },
    /// A reading is impaired: the converter was at its limit, or samples were lost.
    #[serde(rename = "spoilt")]
    ImpairedReading {
        /// Its row in `samples.csv`, from 0.
        row: usize,
        /// What impairs it.
        text: String,
    },
    /// The scan is paused on request. The array is silent.
    Paused,
    /// The scan continues after a pause. The interrupted point is measured again.
    Continued {
        /// Duration of the wait, s.
        waited_s: f64,
    },
    /// A person should look at the rig. The scan continues if it can.
    Question {
        /// What was seen.
        text: String,
    },
    /// A hook failed. The scan continues.
    HookFailed {
        /// Which hook, and how it failed.
        text: String,
    },
    /// A point was measured, and the reading is on disk.
    Measured {
        /// Its row in `samples.csv`, from 0.
        row: usize,
        /// Rows of the whole plan.
        of: usize,
        /// The drive, -1 with the array silent.
        focus: i64,
        /// Where the robot reports to be, array frame, mm.
        at_mm: [f64; 3],
        /// When, s on the clock of `samples.csv`.
        time_s: f64,
        /// Mean reading, in the receiver's unit.
        reading: f64,
        /// Whether the converter was at its limit.
        clipped: bool,
    },
    /// All readings of the plan are taken, and the next round was chosen, or none.
    RoundChosen {
        /// The decision in words.
        text: String,
    },
    /// The disk is full. The array is silent, and the scan waits for free space.
    #[serde(rename = "waiting")]
    DiskFull {
        /// What could not be written, and what to do.
        reason: String,
    },
    /// The disk has free space again, and the scan continues.
    #[serde(rename = "went-on")]
    DiskSpaceFreed {
        /// Duration of the wait, s.
        waited_s: f64,
    },
    /// The watchdog process was lost. The array is silent, and the scan waits for another.
    WatchdogLost {
        /// Why.
        reason: String,
    },
    /// The watchdog was started again, and the scan continues.
    WatchdogRestarted {
        /// Duration of the wait, s.
        waited_s: f64,
    },
    /// The computer was suspended and has woken. The array is silent, and the interrupted point is measured again.
    Suspended {
        /// For how long, s.
        suspended_s: f64,
    },
    /// The scan ended.
    Ended {
        /// Rows on disk.
        rows: usize,
        /// Rows of the whole plan.
        of: usize,
        /// Why, if it ended before the plan was complete.
        reason: Option<String>,
    },
}

/// Receives the events of a scan. It is called between points and must not block.
pub type EventSink<'a> = &'a mut (dyn FnMut(&Event) + Send);
