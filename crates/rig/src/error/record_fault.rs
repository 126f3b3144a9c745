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
    /// The channel of the drive's clock shows none.
    #[error(
        "the sync's channel shows no clock of the drives: at the carrier's frequency it has {steps:.1} steps of its converter and {share:.1} times the \
         rms of the rest; at least 8 and 1 are needed"
    )]
    NoSync {
        /// Its amplitude at the carrier's frequency, in steps of the converter.
        steps: f64,
        /// The same over the rms of the rest of the record.
        share: f64,
    },
    /// The records of the two channels are not of the same times.
    #[error(
        "the two channels' records differ: {} samples {:.3} µs apart, and of the sync {} samples {:.3} µs apart",
        samples[0], interval_s[0] * 1e6, samples[1], interval_s[1] * 1e6
    )]
    Unequal {
        /// Samples of the signal and of the sync.
        samples: [usize; 2],
        /// Their intervals, s.
        interval_s: [f64; 2],
    },
}

/// To one decimal, so that a number too small does not read like the one that is needed.
fn rounded_down(number: f64) -> f64 {
    // A whole number of tenths may lie below itself by rounding.
    (number * 10.0 + 1e-9).floor() / 10.0
}
