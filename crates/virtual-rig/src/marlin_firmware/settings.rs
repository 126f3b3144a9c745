//! What is compiled into, or configured in, the virtual robot's firmware.

use serde::Deserialize;

use fieldgap_input::{Delay, Exact, Gap, Length, Positive, Speed, Time, literal};

/// The robot's mechanics and its firmware's build options, `[virtual.robot]` in a rig file.
///
/// Every key has a default, that of a common three-axis gantry on an eight-bit board.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MarlinSettings {
    /// Travel of each axis from its switch.
    pub travel_mm: Exact<Length, 3>,
    /// Position of the tool head at power-up. The firmware does not know it before homing.
    pub parked_mm: Exact<Gap, 3>,
    /// Acceleration along the path.
    pub acceleration_mm_s2: Positive,
    /// Highest speed of each axis.
    pub max_feed_mm_s: Exact<Speed, 3>,
    /// Speed towards the switches.
    pub homing_feed_mm_s: Speed,
    /// Motor steps per millimetre. Targets are rounded to a step.
    pub steps_per_mm: Positive,
    /// Moves that the planner holds before `ok` has to wait.
    pub planner_moves: usize,
    /// Commands that wait behind the one in execution.
    pub command_ring: usize,
    /// Bytes that are kept while the ring is full; further ones are lost without an error.
    pub receive_buffer: usize,
    /// Length at which lines are cut (the last character is the terminator's).
    pub line_length: usize,
    /// `echo:busy: processing` comes at this interval while a command is in execution.
    pub busy_interval_s: Time,
    /// Whether `M112` and `M410` act at once, also while other commands wait.
    pub emergency_parser: bool,
    /// Whether `Resend:` is followed by an `ok` that acknowledges nothing.
    pub resend_ok: bool,
    /// Whether `ok` carries line number and free places, `ok N12 P15 B3`.
    pub advanced_ok: bool,
    /// Whether the build has `M114 R` and `M114 D`.
    pub true_position: bool,
    /// Idle time after which the motors are switched off (0: never); `M84 S` changes it.
    pub stepper_timeout_s: Delay,
    /// Distance by which the z axis then falls.
    pub sag_mm: Gap,
}

impl Default for MarlinSettings {
    fn default() -> Self {
        Self {
            travel_mm: [literal(300.0), literal(300.0), literal(250.0)].into(),
            parked_mm: [literal(42.0), literal(61.0), literal(180.0)].into(),
            acceleration_mm_s2: literal(1000.0),
            max_feed_mm_s: [literal(200.0), literal(200.0), literal(100.0)].into(),
            homing_feed_mm_s: literal(50.0),
            steps_per_mm: literal(80.0),
            planner_moves: 15,
            command_ring: 4,
            receive_buffer: 128,
            line_length: 96,
            busy_interval_s: literal(2.0),
            emergency_parser: true,
            resend_ok: true,
            advanced_ok: false,
            true_position: true,
            stepper_timeout_s: literal(120.0),
            sag_mm: literal(1.0),
        }
    }
}
