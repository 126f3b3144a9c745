//! Why the record of an oscilloscope does not show the carrier.

/// Fewer cycles than this leave too little to tell the carrier from what drifts.
pub(crate) const FEWEST_CYCLES: f64 = 3.0;

/// Fewer samples than this in a cycle cannot tell the carrier from its mirror images.
pub(crate) const FEWEST_SAMPLES_A_CYCLE: f64 = 2.5;

/// Why a record does not show the carrier.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RecordFault {
    /// Too short.
    #[error(
        "the record of {:.1} µs holds {:.1} cycles of the carrier; at least {FEWEST_CYCLES} are needed",
        span_s * 1e6, rounded_down(*cycles)
    )]
    TooShort {
        /// Length of the record, s.
        span_s: f64,
        /// Cycles of the carrier in it.
        cycles: f64,
    },
    /// Some samples were not taken.
    #[error(
        "the record has samples that were not taken (value 0): it was read before it was complete"
    )]
    Hole,
    /// Too coarse.
    #[error(
        "the record has {:.1} samples per cycle of the carrier; at least {FEWEST_SAMPLES_A_CYCLE} are needed",
        rounded_down(*samples_a_cycle)
    )]
    TooCoarse {
        /// Samples in one cycle.
        samples_a_cycle: f64,
    },
}

/// To one decimal, so that a number too small does not read like the one that is needed.
fn rounded_down(number: f64) -> f64 {
    // A whole number of tenths may lie below itself by rounding.
    (number * 10.0 + 1e-9).floor() / 10.0
}
