//! How much of the firmware's receive buffer is taken by lines that it has not answered.

use std::collections::VecDeque;

/// The usable bytes of the smallest buffer in use, before the firmware has stated its own.
const SMALLEST: usize = 127;

/// Lines sent and not yet answered, counted in characters.
///
/// The firmware answers each line once, in order, as it takes it out of its buffer.
#[derive(Debug)]
pub(super) struct Window {
    capacity: usize,
    unanswered: VecDeque<usize>,
}

impl Window {
    /// An empty window on a buffer of unknown size.
    pub(super) fn new() -> Self {
        Self { capacity: SMALLEST, unanswered: VecDeque::new() }
    }

    /// The buffer has this many bytes; of some firmwares' one stays empty.
    pub(super) fn set_buffer(&mut self, bytes: usize) {
        self.capacity = bytes.saturating_sub(1).max(SMALLEST);
    }

    /// Whether a line of so many bytes surely finds room.
    pub(super) fn has_room_for(&self, bytes: usize) -> bool {
        // A line longer than the buffer is taken out of it as it comes in, if nothing waits before it.
        self.unanswered.is_empty() || self.unanswered.iter().sum::<usize>() + bytes <= self.capacity
    }

    /// A line of so many bytes was sent.
    pub(super) fn sent(&mut self, bytes: usize) {
        self.unanswered.push_back(bytes);
    }

    /// The oldest line was answered. False if none was waiting: an answer too many.
    pub(super) fn answered(&mut self) -> bool {
        self.unanswered.pop_front().is_some()
    }

    /// Whether every line was answered.
    pub(super) fn is_empty(&self) -> bool {
        self.unanswered.is_empty()
    }

    /// The firmware was reset: its buffer is empty.
    pub(super) fn clear(&mut self) {
        self.unanswered.clear();
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn an_answer_frees_the_oldest_line() {
        let mut window = Window::new();
        window.set_buffer(128);
        window.sent(100);
        assert!(window.has_room_for(27) && !window.has_room_for(28));
        window.sent(27);
        assert!(!window.has_room_for(1));
        assert!(window.answered());
        assert!(window.has_room_for(100));
        assert!(window.answered() && window.is_empty());
        assert!(!window.answered(), "one too many");
    }

    proptest! {
        /// Against a buffer that empties at any time, no byte is ever lost.
        #[test]
        fn the_buffer_never_overruns(
            lines in prop::collection::vec((1usize..80, any::<bool>()), 1..200), bytes in 128usize..1025,
        ) {
            let mut window = Window::new();
            window.set_buffer(bytes);
            let mut buffered = VecDeque::new();
            for (length, answers) in lines {
                if answers && buffered.pop_front().is_some() {
                    prop_assert!(window.answered());
                }
                if window.has_room_for(length) {
                    window.sent(length);
                    buffered.push_back(length);
                }
                prop_assert!(buffered.iter().sum::<usize>() < bytes);
            }
        }
    }
}
