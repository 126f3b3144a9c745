//! Errors of displays that cannot be played.

use fieldgap_rig::focus_array::{FrameFault, ProgramFault};

/// Why a valid display file cannot be played.
#[derive(Debug, Clone, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum DisplayError {
    /// Loop durations without a common multiple.
    #[error(
        "the loop of focus {focus} takes {loop_s:.4} s and the longest loop {longest_s:.4} s; the longest must be a whole multiple of the others"
    )]
    #[diagnostic(help(
        "change speeds or paths so that the loop durations are equal or whole multiples; here {would_do_s:.4} s fits"
    ))]
    Incommensurable {
        /// The focus, from 0.
        focus: usize,
        /// Duration of its loop, s.
        loop_s: f64,
        /// Duration of the longest loop, s.
        longest_s: f64,
        /// The nearest duration that fits, s.
        would_do_s: f64,
    },
    /// A loop shorter than one carrier period.
    #[error("a loop of {:.2} µs is shorter than one carrier period", loop_s * 1e6)]
    #[diagnostic(help("choose a lower speed or frequency"))]
    TooShort {
        /// The loop, s.
        loop_s: f64,
    },
    /// More frames than the controller can store.
    #[error("the display has {frames} frames, but the controller can store {most}")]
    #[diagnostic(help(
        "choose a larger `step_mm`, a shorter path, a higher speed or fewer oscillations per loop"
    ))]
    TooLong {
        /// Frames; counting stops at the limit.
        frames: usize,
        /// Capacity of the controller, frames.
        most: usize,
    },
    /// A modulation too fast for the envelope.
    #[error(
        "a modulation of {frequency_hz} Hz has {periods:.1} carrier periods per cycle; at least {least} are needed"
    )]
    #[diagnostic(help("choose a lower frequency: skin responds to 40 to 800 Hz"))]
    TooFast {
        /// Requested frequency, Hz.
        frequency_hz: f64,
        /// Carrier periods per cycle.
        periods: f64,
        /// Fewest carrier periods per cycle.
        least: f64,
    },
    /// A sweep down to zero frequency, or faster than the modulation itself.
    #[error(
        "a modulation of {frequency_hz} Hz cannot be swept by ±{deviation_hz} Hz at {sweep_hz} Hz"
    )]
    #[diagnostic(help(
        "`deviation_hz` must be below `frequency_hz`, and `sweep_hz` must not exceed it"
    ))]
    Sweep {
        /// Mean frequency, Hz.
        frequency_hz: f64,
        /// Deviation, Hz.
        deviation_hz: f64,
        /// Sweep frequency, Hz.
        sweep_hz: f64,
    },
    /// A focus behind the array.
    #[error("focus {focus} reaches z = {z_mm:.2} mm; z must be above 0")]
    #[diagnostic(help("raise the path, or tilt it less"))]
    BehindArray {
        /// The focus, from 0.
        focus: usize,
        /// Its lowest z, mm.
        z_mm: f64,
    },
    /// A frame that does not fit the controller.
    #[error(transparent)]
    #[diagnostic(help("correct [array] in the rig file, or connect the array that it describes"))]
    Frame(#[from] FrameFault),
    /// A program that does not fit the controller.
    #[error(transparent)]
    #[diagnostic(help("choose a larger `step_mm` or a shorter path"))]
    Program(#[from] ProgramFault),
}
