//! The state of the array's outputs: delays, modulation, and whether it emits.

use std::collections::VecDeque;
use std::sync::Arc;

use fieldgap_rig::focus_array::{ArrayIdentity, DriveProgram};

/// Past drives that are kept, for samples taken a little late.
const REMEMBERED_DRIVES: usize = 256;

/// The state of the array's outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Whether it emits.
    pub emitting: bool,
    /// The delay of each channel, seconds; `None`: that channel is silent.
    pub delays_s: Vec<Option<f64>>,
    /// Amplitude of each channel's fundamental, 0 to 1; empty: all 1.
    pub amplitudes: Vec<f64>,
    /// Share of time that the modulation leaves on, 0 to 1.
    pub duty: f64,
    /// The display that plays in place of the delays.
    pub display: Option<Played>,
    /// Channels used as receivers, which do not emit.
    pub listening: Vec<usize>,
}

/// The output of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// Delay of its fundamental, s; can be negative by a part of a clock step.
    pub delay_s: f64,
    /// Amplitude of the fundamental, 0 to 1.
    pub amplitude: f64,
}

/// A display that is playing.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    program: Arc<DriveProgram>,
    since_s: f64,
    loops: u64,
    period_steps: u32,
    clock_hz: f64,
}

impl Played {
    /// A display that plays from `since_s` on, `loops` times; 0: without end.
    pub fn new(
        program: Arc<DriveProgram>,
        controller: &ArrayIdentity,
        since_s: f64,
        loops: u64,
    ) -> Self {
        let ArrayIdentity { period_steps, clock_hz, .. } = *controller;
        Self { program, since_s, loops, period_steps, clock_hz }
    }

    /// Its program.
    pub fn program(&self) -> &DriveProgram {
        &self.program
    }

    /// When its last loop ends, s; `None` if it never does.
    pub fn ends_s(&self) -> Option<f64> {
        let periods = self.loops * self.program.loop_periods();
        (self.loops > 0).then(|| self.since_s + periods as f64 * self.period_s())
    }

    /// The intervals from `from_s` to `to_s` in which the output is constant: the share of each in the whole time, its frame and
    /// its level. There are none before the start and after the end.
    pub fn stretches(&self, from_s: f64, to_s: f64) -> Vec<(f64, usize, u8)> {
        let end_s = self.ends_s().unwrap_or(f64::INFINITY).min(to_s);
        let period =
            |time_s: f64| ((time_s - self.since_s) / self.period_s()).max(0.0).round() as u64;
        let (first, last) = (period(from_s), period(end_s));
        let whole = ((to_s - from_s) / self.period_s()).max(1.0);
        let mut stretches: Vec<(f64, usize, u8)> = Vec::new();
        for period in first..last {
            let (frame, level) =
                (self.program.frame_at(period), self.program.envelope().level_at(period));
            match stretches.last_mut() {
                Some((share, known, same)) if (*known, *same) == (frame, level) => {
                    *share += 1.0 / whole;
                }
                _ => stretches.push((1.0 / whole, frame, level)),
            }
        }
        stretches
    }

    /// The output of each channel in a frame at a level of the envelope; `None`: silent.
    pub fn outputs(&self, frame: usize, level: u8) -> Vec<Option<Output>> {
        self.program.frames()[frame]
            .fundamentals(level, self.period_steps)
            .map(|fundamental| {
                let fundamental = fundamental?;
                let delay_s = fundamental.delay_steps / self.clock_hz;
                Some(Output { delay_s, amplitude: fundamental.amplitude })
            })
            .collect()
    }

    fn period_s(&self) -> f64 {
        f64::from(self.period_steps) / self.clock_hz
    }
}

impl Drive {
    /// The state at power-up: off, no delays, no modulation.
    pub fn silent(elements: usize) -> Self {
        Self {
            emitting: false,
            delays_s: vec![Some(0.0); elements],
            amplitudes: Vec::new(),
            duty: 1.0,
            display: None,
            listening: Vec::new(),
        }
    }

    /// The output of each channel by its delay; `None` where it is silent or a receiver.
    pub fn outputs(&self) -> Vec<Option<Output>> {
        let sounds = |channel: &usize| self.emitting && !self.listening.contains(channel);
        self.delays_s
            .iter()
            .enumerate()
            .map(|(channel, delay_s)| {
                let delay_s = delay_s.filter(|_| sounds(&channel))?;
                let amplitude = self.amplitudes.get(channel).copied().unwrap_or(1.0);
                Some(Output { delay_s, amplitude })
            })
            .collect()
    }
}

/// The drives in the order in which they took effect.
#[derive(Debug)]
pub(super) struct DriveHistory {
    drives: VecDeque<(f64, Drive)>,
    forgotten: u64,
}

impl DriveHistory {
    /// A history that begins with a drive.
    pub fn new(first: Drive) -> Self {
        Self { drives: VecDeque::from([(0.0, first)]), forgotten: 0 }
    }

    /// From `time_s` on this drive is in effect.
    pub fn push(&mut self, time_s: f64, drive: Drive) {
        self.drives.push_back((time_s, drive));
        if self.drives.len() > REMEMBERED_DRIVES {
            self.drives.pop_front();
            self.forgotten += 1;
        }
    }

    /// The drive in effect at `time_s`, and a number that no other drive of this history has.
    pub fn at(&self, time_s: f64) -> (u64, &Drive) {
        let index = self.drives.partition_point(|&(since_s, _)| since_s <= time_s).max(1) - 1;
        (self.forgotten + index as u64, &self.drives[index].1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_display_is_cut_where_it_changes_and_ends_after_its_loops() {
        use std::num::NonZeroU32;

        use fieldgap_rig::focus_array::{DriveFrame, Envelope};

        let controller = ArrayIdentity::of_thesis(1, 40e3);
        let frame = |phase_rad: f64, hold: u32| {
            let hold = NonZeroU32::new(hold).expect("above zero");
            DriveFrame::nearest(&controller, [(phase_rad, 1.0)], hold).expect("fits")
        };
        let envelope =
            Envelope::new(vec![255, 0], NonZeroU32::new(3).expect("three")).expect("two");
        let program =
            DriveProgram::new(vec![frame(0.0, 4), frame(1.0, 2)], envelope).expect("valid");
        let played = Played::new(Arc::new(program), &controller, 1.0, 2);
        let period_s = 25e-6;
        assert!((played.ends_s().expect("two loops") - (1.0 + 12.0 * period_s)).abs() < 1e-12);
        // Six periods: frame 0 loud for three and silent for one, frame 1 silent for two.
        let one_loop = played.stretches(1.0, 1.0 + 6.0 * period_s);
        assert_eq!(
            one_loop.iter().map(|&(_, frame, level)| (frame, level)).collect::<Vec<_>>(),
            [(0, 255), (0, 0), (1, 0)]
        );
        assert!((one_loop[0].0 - 0.5).abs() < 1e-9 && (one_loop[1].0 - 1.0 / 6.0).abs() < 1e-9);
        // Half of this window lies after the end.
        let late = played.stretches(1.0 + 9.0 * period_s, 1.0 + 15.0 * period_s);
        assert!((late.iter().map(|(share, _, _)| share).sum::<f64>() - 0.5).abs() < 1e-9);
        assert!(played.stretches(0.5, 0.9).is_empty());
        assert_eq!(played.outputs(0, 0), [None]);
    }

    #[test]
    fn a_channel_that_listens_is_silent() {
        let drive = Drive { emitting: true, listening: vec![1], ..Drive::silent(3) };
        let sounds: Vec<bool> = drive.outputs().iter().map(Option::is_some).collect();
        assert_eq!(sounds, [true, false, true]);
    }

    #[test]
    fn each_drive_is_in_effect_until_the_next() {
        let mut history = DriveHistory::new(Drive::silent(1));
        history.push(2.0, Drive { emitting: true, ..Drive::silent(1) });
        assert!(!history.at(1.9).1.emitting);
        assert!(history.at(2.0).1.emitting);
        for i in 0..1000 {
            history.push(3.0 + f64::from(i), Drive::silent(1));
        }
        assert!(history.at(1002.5).0 > history.at(999.0).0);
    }
}
