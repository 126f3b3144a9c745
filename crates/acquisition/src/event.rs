//! What happens during a scan, told to whoever watches.

use serde::Serialize;

/// One thing that happened.
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
    /// The robot found its origin.
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
    /// A row was flown there and back to see how far the readings lag behind the robot.
    LagFound {
        /// The lag, ms.
        lag_ms: f64,
        /// Its standard error, ms.
        standard_error_ms: f64,
    },
    /// The reference point was revisited, to see what drifts.
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
    /// A reading is not as it should be: the converter was at its limit, or samples were lost.
    Spoilt {
        /// Its row in `samples.csv`, from 0.
        row: usize,
        /// What is wrong with it.
        text: String,
    },
    /// The scan waits because somebody asked it to. The array is silent.
    Paused,
    /// It goes on; the point under way is measured anew.
    Continued {
        /// How long it waited, s.
        waited_s: f64,
    },
    /// A person is wanted; the scan goes on where it can.
    Question {
        /// What was seen.
        text: String,
    },
    /// A hook was started and did not do what it should. The scan goes on.
    HookFailed {
        /// Which, and what was seen.
        text: String,
    },
    /// A point was measured and is on disk.
    Measured {
        /// Its row in `samples.csv`, from 0.
        row: usize,
        /// Rows that the whole plan has.
        of: usize,
        /// The drive, -1 with the array silent.
        focus: i64,
        /// Where the robot reports to be, array frame, mm.
        at_mm: [f64; 3],
        /// Mean reading, in the receiver's unit.
        reading: f64,
        /// Whether the converter was at its limit.
        clipped: bool,
    },
    /// There is no room for a reading. The array is silent, and the scan waits until there is.
    Waiting {
        /// What was refused, and what to do.
        reason: String,
    },
    /// There is room again, and the scan goes on.
    WentOn {
        /// How long it waited, s.
        waited_s: f64,
    },
    /// The scan ended.
    Ended {
        /// Rows on disk.
        rows: usize,
        /// Rows that the whole plan has.
        of: usize,
        /// Why, where it ended before its plan.
        reason: Option<String>,
    },
}

/// Whoever watches a scan. Called between points: it must not block.
pub type EventSink<'a> = &'a mut (dyn FnMut(&Event) + Send);
