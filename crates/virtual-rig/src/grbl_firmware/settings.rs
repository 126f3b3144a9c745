//! What is compiled into, or stored in, the virtual robot's GRBL firmware at power-up.

use serde::Deserialize;

use fieldgap_input::{Exact, Gap, Length, Positive, Speed, literal};

/// The two dialects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// GRBL 1.1.
    Grbl,
    /// grblHAL.
    GrblHal,
}

/// The robot's mechanics and its firmware's build options and settings, `[virtual.robot]` with `firmware = "grbl"` or
/// `"grblhal"`.
///
/// Every key has a default, that of a common, configured three-axis gantry. The switches are at
/// the low ends; machine coordinates go from minus the travel to zero, as in stock builds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GrblSettings {
    /// Travel of each axis from its switch (`$130` to `$132`).
    pub travel_mm: Exact<Length, 3>,
    /// Position of the tool head at power-up, from its switches. The firmware does not know it before homing.
    pub parked_mm: Exact<Gap, 3>,
    /// Acceleration along the path (`$120` to `$122`).
    pub acceleration_mm_s2: Positive,
    /// Highest speed of each axis (`$110` to `$112`).
    pub max_feed_mm_s: Exact<Speed, 3>,
    /// Speed towards the switches (`$25`).
    pub homing_feed_mm_s: Speed,
    /// Distance by which it backs off its switches (`$27`).
    pub pull_off_mm: Length,
    /// Motor steps per millimetre (`$100` to `$102`).
    pub steps_per_mm: Positive,
    /// Moves that the planner holds before `ok` has to wait: 15, or 100 for grblHAL.
    pub planner_moves: Option<usize>,
    /// Bytes of the receive buffer; further ones are lost without an error. 128, or 1024 for grblHAL.
    pub receive_buffer: Option<usize>,
    /// Idle time after which the motors are switched off, ms (`$1`; 255: never).
    pub idle_ms: u8,
    /// Distance by which the z axis falls when the motors are switched off.
    pub sag_mm: Gap,
    /// Content of reports (`$10`): bit 0, machine position instead of work position; bit 1, free places of the buffers.
    pub report_mask: u8,
    /// Whether positions are reported in inches (`$13`).
    pub report_inches: bool,
    /// Whether targets are checked against the travel (`$20`).
    pub soft_limits: bool,
    /// Whether the switches stop the machine (`$21`).
    pub hard_limits: bool,
    /// Whether homing is enabled (`$22`).
    pub homing: bool,
    /// Whether zero is where homing has backed off the switches; otherwise it is at the far ends.
    pub origin_at_switches: bool,
}

impl Default for GrblSettings {
    fn default() -> Self {
        Self {
            travel_mm: [literal(300.0), literal(300.0), literal(250.0)].into(),
            parked_mm: [literal(42.0), literal(61.0), literal(180.0)].into(),
            acceleration_mm_s2: literal(500.0),
            max_feed_mm_s: [literal(100.0); 3].into(),
            homing_feed_mm_s: literal(50.0),
            pull_off_mm: literal(2.0),
            steps_per_mm: literal(250.0),
            planner_moves: None,
            receive_buffer: None,
            idle_ms: 25,
            sag_mm: literal(1.0),
            report_mask: 1,
            report_inches: false,
            soft_limits: true,
            hard_limits: true,
            homing: true,
            origin_at_switches: false,
        }
    }
}

impl GrblSettings {
    /// Moves that the planner holds.
    pub(super) fn planner_moves(&self, dialect: Dialect) -> usize {
        self.planner_moves.unwrap_or(match dialect {
            Dialect::Grbl => 15,
            Dialect::GrblHal => 100,
        })
    }

    /// Bytes of the receive buffer.
    pub(super) fn receive_buffer(&self, dialect: Dialect) -> usize {
        self.receive_buffer.unwrap_or(match dialect {
            Dialect::Grbl => 128,
            Dialect::GrblHal => 1024,
        })
    }

    /// Position of the machine's zero after homing, from the switches, mm.
    pub fn machine_zero_mm(&self) -> [f64; 3] {
        match self.origin_at_switches {
            true => [self.pull_off_mm.get(); 3],
            false => self.travel_mm.map(f64::from),
        }
    }
}
