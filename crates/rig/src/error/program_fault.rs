//! Why a display is no program for a controller.

/// Why frames and envelope make no program, or none for this controller.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProgramFault {
    /// Nothing to play.
    #[error("a display needs at least one frame and one level")]
    Empty,
    /// Frames for different arrays.
    #[error("frame {frame} has {given} channels, the first has {has}")]
    Uneven {
        /// The frame, from 0.
        frame: usize,
        /// Channels of the first.
        has: usize,
        /// Its channels.
        given: usize,
    },
    /// More than the controller's memory holds.
    #[error("the display has {given} {what}, and the controller holds {most}")]
    TooMany {
        /// Frames or levels.
        what: &'static str,
        /// How many it has.
        given: usize,
        /// How many there may be.
        most: usize,
    },
}
