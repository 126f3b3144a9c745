//! Why a display cannot be played.

use fieldgap_rig::focus_array::{FrameFault, ProgramFault};

/// Why a display that is well written still cannot be played.
#[derive(Debug, Clone, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum DisplayError {
    /// Loops that never come together.
    #[error(
        "focus {focus} takes {loop_s:.4} s for its path and the longest loop {longest_s:.4} s: they never begin together again"
    )]
    #[diagnostic(help(
        "let all loops last alike, or one a whole number of times the other: here {would_do_s:.4} s would do"
    ))]
    Incommensurable {
        /// The focus, from 0.
        focus: usize,
        /// How long its path takes, s.
        loop_s: f64,
        /// The loop that it must fit into, s.
        longest_s: f64,
        /// What would fit, s.
        would_do_s: f64,
    },
    /// A loop within one period of the carrier.
    #[error("a loop of {:.2} µs is shorter than one period of the carrier", loop_s * 1e6)]
    #[diagnostic(help("take a lower speed or frequency"))]
    TooShort {
        /// The loop, s.
        loop_s: f64,
    },
    /// More frames than the controller holds.
    #[error("the display has {frames} frames, and the controller holds {most}")]
    #[diagnostic(help(
        "take a larger `step_mm`, a shorter path, a higher speed or fewer swings in a loop"
    ))]
    TooLong {
        /// Frames, as far as they were counted.
        frames: usize,
        /// What the controller holds.
        most: usize,
    },
    /// A modulation that the envelope's clock cannot follow.
    #[error(
        "a modulation of {frequency_hz} Hz leaves {periods:.1} periods of the carrier to a cycle, and {least} are needed"
    )]
    #[diagnostic(help("take a lower frequency: skin feels 40 to 800 Hz"))]
    TooFast {
        /// Asked for, Hz.
        frequency_hz: f64,
        /// Periods of the carrier in a cycle of it.
        periods: f64,
        /// The fewest that give it a shape.
        least: f64,
    },
    /// A rate that comes to a stand, or sweeps faster than it swells.
    #[error(
        "a modulation of {frequency_hz} Hz cannot go {deviation_hz} Hz to either side {sweep_hz} times a second"
    )]
    #[diagnostic(help("keep `deviation_hz` below `frequency_hz`, and `sweep_hz` at most as high"))]
    Sweep {
        /// The mean rate, Hz.
        frequency_hz: f64,
        /// To either side, Hz.
        deviation_hz: f64,
        /// Sweeps a second.
        sweep_hz: f64,
    },
    /// A focus below the array.
    #[error("focus {focus} comes to z = {z_mm:.2} mm, and the array radiates to z above 0")]
    #[diagnostic(help("lift the path, or tilt it less"))]
    BehindArray {
        /// The focus, from 0.
        focus: usize,
        /// Where it comes to, mm.
        z_mm: f64,
    },
    /// A frame that does not fit the controller.
    #[error(transparent)]
    #[diagnostic(help("make [array] in the rig file the array that is connected"))]
    Frame(#[from] FrameFault),
    /// A program that does not fit the controller.
    #[error(transparent)]
    #[diagnostic(help("take a larger `step_mm` or a shorter path"))]
    Program(#[from] ProgramFault),
}
