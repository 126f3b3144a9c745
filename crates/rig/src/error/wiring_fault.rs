//! Why a wiring does not fit its board.

use std::path::PathBuf;

/// Why a wiring does not fit its board.
#[derive(Debug, thiserror::Error)]
pub enum WiringFault {
    /// The file of channels cannot be read.
    #[error("the channel file {path} cannot be read: {source}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The file of channels holds something else.
    #[error("the channel file {path} has `{word}` where a channel number is expected")]
    NoNumber {
        /// The file.
        path: PathBuf,
        /// The word.
        word: String,
    },
    /// No elements.
    #[error("no element has a channel")]
    Empty,
    /// A channel that the board lacks.
    #[error("element {element} is wired to channel {channel}, which the board does not have")]
    NoChannel {
        /// The element, from 0.
        element: usize,
        /// Its channel.
        channel: usize,
    },
    /// Two elements on one channel.
    #[error("elements {first} and {second} are both wired to channel {channel}")]
    Shared {
        /// One of them, from 0.
        first: usize,
        /// The other.
        second: usize,
        /// Their channel.
        channel: usize,
    },
    /// Corrections for another number of elements.
    #[error("`late_rad` has {given} values for {elements} elements")]
    LateCount {
        /// Elements wired.
        elements: usize,
        /// Values given.
        given: usize,
    },
    /// An element that is not wired.
    #[error("`inverted` names element {element}, and {elements} elements are wired")]
    NoElement {
        /// The element.
        element: usize,
        /// Elements wired.
        elements: usize,
    },
}
