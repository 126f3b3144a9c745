//! A display as the controller plays it: frames in a loop, under an envelope in a loop of its own.

use std::num::NonZeroU32;

use super::ArrayIdentity;
use super::frame::{DriveFrame, FULL_LEVEL};
use crate::error::ProgramFault;

/// A modulation of the whole array: levels, each held equally long, in a loop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Envelope {
    levels: Vec<u8>,
    hold_periods: NonZeroU32,
}

impl Envelope {
    /// Levels in parts of [`FULL_LEVEL`], each held for some periods of the carrier.
    ///
    /// # Errors
    /// [`ProgramFault::Empty`] if there are none.
    pub fn new(levels: Vec<u8>, hold_periods: NonZeroU32) -> Result<Self, ProgramFault> {
        if levels.is_empty() { Err(ProgramFault::Empty) } else { Ok(Self { levels, hold_periods }) }
    }

    /// No modulation.
    pub fn continuous() -> Self {
        Self { levels: vec![FULL_LEVEL], hold_periods: NonZeroU32::MIN }
    }

    /// The levels, at least one.
    pub fn levels(&self) -> &[u8] {
        &self.levels
    }

    /// Periods of the carrier for which each is held.
    pub fn hold_periods(&self) -> NonZeroU32 {
        self.hold_periods
    }

    /// Periods of the carrier after which it begins again.
    pub fn loop_periods(&self) -> u64 {
        self.levels.len() as u64 * u64::from(self.hold_periods.get())
    }

    /// The level in a period of the carrier, counted from 0 at the start.
    pub fn level_at(&self, period: u64) -> u8 {
        let within = period % self.loop_periods() / u64::from(self.hold_periods.get());
        self.levels[within as usize]
    }
}

/// Frames in a loop under an envelope: at least one frame, all for one array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriveProgram {
    frames: Vec<DriveFrame>,
    envelope: Envelope,
    /// Where each frame ends, periods of the carrier from the loop's start.
    ends: Vec<u64>,
}

impl DriveProgram {
    /// Puts frames under an envelope.
    ///
    /// # Errors
    /// [`ProgramFault`] if there are none, or if they are for different arrays.
    pub fn new(frames: Vec<DriveFrame>, envelope: Envelope) -> Result<Self, ProgramFault> {
        let has = frames.first().ok_or(ProgramFault::Empty)?.channels().len();
        for (number, frame) in frames.iter().enumerate() {
            let given = frame.channels().len();
            if given != has {
                return Err(ProgramFault::Uneven { frame: number, has, given });
            }
        }
        let ends = frames
            .iter()
            .scan(0, |end, frame| {
                *end += u64::from(frame.hold_periods().get());
                Some(*end)
            })
            .collect();
        Ok(Self { frames, envelope, ends })
    }

    /// Whether a controller can hold it.
    ///
    /// # Errors
    /// [`ProgramFault::TooMany`] or [`ProgramFault::Uneven`].
    pub fn fits(&self, controller: &ArrayIdentity) -> Result<(), ProgramFault> {
        let given = self.frames[0].channels().len();
        if given != controller.elements {
            return Err(ProgramFault::Uneven { frame: 0, has: controller.elements, given });
        }
        let counts = [
            ("frames", self.frames.len(), controller.most_frames),
            ("levels", self.envelope.levels.len(), controller.most_levels),
        ];
        match counts.into_iter().find(|(_, given, most)| given > most) {
            Some((what, given, most)) => Err(ProgramFault::TooMany { what, given, most }),
            None => Ok(()),
        }
    }

    /// The frames, at least one.
    pub fn frames(&self) -> &[DriveFrame] {
        &self.frames
    }

    /// The envelope.
    pub fn envelope(&self) -> &Envelope {
        &self.envelope
    }

    /// Periods of the carrier after which the frames begin again.
    pub fn loop_periods(&self) -> u64 {
        self.ends[self.ends.len() - 1]
    }

    /// When a frame begins, periods of the carrier from the loop's start.
    pub fn begins(&self, frame: usize) -> u64 {
        if frame == 0 { 0 } else { self.ends[frame - 1] }
    }

    /// The frame that is out in a period of the carrier, counted from 0 at the start.
    pub fn frame_at(&self, period: u64) -> usize {
        let within = period % self.loop_periods();
        self.ends.partition_point(|&end| end <= within)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frame(hold: u32) -> DriveFrame {
        let hold = NonZeroU32::new(hold).expect("above zero");
        DriveFrame::nearest(&ArrayIdentity::of_thesis(2, 40e3), [(0.0, 1.0), (1.0, 1.0)], hold)
            .expect("fits")
    }

    proptest! {
        #[test]
        fn every_period_has_its_frame_and_its_level(
            holds in prop::collection::vec(1u32..9, 1..12), levels in prop::collection::vec(any::<u8>(), 1..9),
            level_hold in 1u32..5, loops in 0u64..3,
        ) {
            let hold = NonZeroU32::new(level_hold).expect("above zero");
            let envelope = Envelope::new(levels.clone(), hold).expect("not empty");
            let program = DriveProgram::new(holds.iter().map(|&hold| frame(hold)).collect(), envelope).expect("valid");
            // Written out period by period.
            let frames: Vec<usize> =
                holds.iter().enumerate().flat_map(|(n, &hold)| std::iter::repeat_n(n, hold as usize)).collect();
            let levels: Vec<u8> =
                levels.iter().flat_map(|&level| std::iter::repeat_n(level, level_hold as usize)).collect();
            prop_assert_eq!(program.loop_periods(), frames.len() as u64);
            for period in 0..frames.len() as u64 {
                let at = period + loops * program.loop_periods();
                prop_assert_eq!(program.frame_at(at), frames[period as usize]);
                prop_assert_eq!(program.envelope().level_at(at), levels[at as usize % levels.len()]);
            }
        }
    }

    #[test]
    fn what_a_controller_cannot_hold_is_said() {
        let program = |frames: usize, levels: usize| {
            let envelope = Envelope::new(vec![1; levels], NonZeroU32::MIN).expect("not empty");
            DriveProgram::new(vec![frame(1); frames], envelope).expect("valid")
        };
        let controller =
            ArrayIdentity { most_frames: 3, most_levels: 4, ..ArrayIdentity::of_thesis(2, 40e3) };
        assert_eq!(program(3, 4).fits(&controller), Ok(()));
        let fault = program(4, 4).fits(&controller).expect_err("too many");
        assert_eq!(fault.to_string(), "the display has 4 frames, and the controller holds 3");
        assert!(program(3, 5).fits(&controller).is_err());
        assert!(program(1, 1).fits(&ArrayIdentity { elements: 3, ..controller }).is_err());
        assert_eq!(DriveProgram::new(vec![], Envelope::continuous()), Err(ProgramFault::Empty));
    }
}
