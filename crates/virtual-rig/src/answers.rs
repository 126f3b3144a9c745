//! How a device's answers reach the host: late, and in slices, as over a slow line or from a busy computer.

use std::collections::VecDeque;
use std::time::Duration;

use serde::Deserialize;
use tokio::time::Instant;

use super::counter_rng::CounterRng;

/// The longest piece with a delay of its own, bytes.
const PIECE: usize = 64;

/// The longest delay and the longest pause, ms: beyond it every driver takes a device for silent.
const LONGEST_MS: f64 = 10_000.0;

/// The largest slice, bytes: what the kernel's buffer of a serial line holds.
const LARGEST_SLICE: usize = 4096;

/// `[virtual.answers]`: how the answers of each device come. Without a table they come at once and whole.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AnswerSettings {
    /// The robot's.
    pub robot: AnswerTiming,
    /// The receiver's answers and samples.
    pub receiver: AnswerTiming,
    /// Those of the array's controller.
    pub array: AnswerTiming,
    /// The air sensor's.
    pub environment: AnswerTiming,
}

/// How the answers of one device come. Time is that of the computer, at every pace.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AnswerTiming {
    /// How late each line comes, or 64 bytes of what does not come in lines, ms: drawn from this range. The order is kept.
    pub delay_ms: Pause,
    /// The most bytes that come at once, 1 to 4096; without it, all that there are.
    pub slice_bytes: Option<SliceBytes>,
    /// Time from slice to slice, ms: drawn from this range. More bytes wait meanwhile.
    pub slice_pause_ms: Pause,
}

/// A range of times, `[shortest, longest]` in ms, each from 0 to 10,000.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(try_from = "[f64; 2]")]
pub struct Pause {
    shortest_ms: f64,
    longest_ms: f64,
}

impl TryFrom<[f64; 2]> for Pause {
    type Error = String;
    fn try_from([shortest_ms, longest_ms]: [f64; 2]) -> Result<Self, String> {
        let in_range = (0.0..=LONGEST_MS).contains(&shortest_ms)
            && (shortest_ms..=LONGEST_MS).contains(&longest_ms);
        if !in_range {
            return Err(format!(
                "[shortest, longest] in ms, each from 0 to {LONGEST_MS}, are expected, not [{shortest_ms}, {longest_ms}]"
            ));
        }
        Ok(Self { shortest_ms, longest_ms })
    }
}

impl Pause {
    fn is_none(self) -> bool {
        self.longest_ms == 0.0
    }

    /// The time at a share of the range, 0 to 1.
    fn at(self, share: f64) -> Duration {
        let ms = self.shortest_ms + share * (self.longest_ms - self.shortest_ms);
        Duration::from_secs_f64(ms * 1e-3)
    }
}

/// The size of a slice, 1 to 4096 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "usize")]
pub struct SliceBytes(usize);

impl TryFrom<usize> for SliceBytes {
    type Error = String;
    fn try_from(bytes: usize) -> Result<Self, String> {
        match bytes {
            1..=LARGEST_SLICE => Ok(Self(bytes)),
            _ => Err(format!("a slice has 1 to {LARGEST_SLICE} bytes, not {bytes}")),
        }
    }
}

/// The answers of one device that are under way.
#[derive(Debug)]
pub(super) struct AnswersUnderWay {
    timing: AnswerTiming,
    delays: CounterRng,
    pauses: CounterRng,
    pieces: u64,
    slices: u64,
    waiting: VecDeque<(Instant, Vec<u8>)>,
    /// When the next slice may come.
    free_at: Option<Instant>,
}

impl AnswersUnderWay {
    /// Of the device with this number. The same seed gives the same delays.
    pub fn new(timing: AnswerTiming, seed: u64, device: u64) -> Self {
        let draws = |purpose| CounterRng::new(seed).stream(purpose).substream(device);
        Self {
            timing,
            delays: draws("delay of answers"),
            pauses: draws("pause between slices"),
            pieces: 0,
            slices: 0,
            waiting: VecDeque::new(),
            free_at: None,
        }
    }

    /// Takes bytes from the device at `now`.
    pub fn push(&mut self, bytes: &[u8], now: Instant) {
        if self.timing.delay_ms.is_none() {
            self.waiting.push_back((now, bytes.to_vec()));
            return;
        }
        let lines = bytes.split_inclusive(|&byte| byte == b'\n');
        for piece in lines.flat_map(|line| line.chunks(PIECE)) {
            let late = self.timing.delay_ms.at(self.delays.uniform(self.pieces));
            self.pieces += 1;
            let due = self.waiting.back().map_or(now + late, |(due, _)| (now + late).max(*due));
            self.waiting.push_back((due, piece.to_vec()));
        }
    }

    /// When the next slice is due; `None` if nothing is under way.
    pub fn due(&self) -> Option<Instant> {
        let (due, _) = self.waiting.front()?;
        Some(self.free_at.map_or(*due, |free_at| free_at.max(*due)))
    }

    /// The slice that is due at `now`; empty if none is.
    pub fn take(&mut self, now: Instant) -> Vec<u8> {
        let mut slice = Vec::new();
        if self.due().is_none_or(|due| due > now) {
            return slice;
        }
        let most = self.timing.slice_bytes.map_or(usize::MAX, |SliceBytes(bytes)| bytes);
        while slice.len() < most
            && let Some((_, piece)) = self.waiting.front_mut().filter(|(due, _)| *due <= now)
        {
            let count = piece.len().min(most - slice.len());
            slice.extend(piece.drain(..count));
            if piece.is_empty() {
                self.waiting.pop_front();
            }
        }
        self.free_at = Some(now + self.timing.slice_pause_ms.at(self.pauses.uniform(self.slices)));
        self.slices += 1;
        slice
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;

    use super::*;
    use fieldgap_input::{Fault, toml_text};

    fn read(text: &str) -> Result<AnswerSettings, Fault> {
        toml_text(Path::new("rig.toml"), text)
    }

    /// All slices with their times in ms, of an answer at each of these times.
    fn slices(timing: AnswerTiming, seed: u64, answers: &[(u64, &[u8])]) -> Vec<(f64, Vec<u8>)> {
        let begun = Instant::now();
        let mut under_way = AnswersUnderWay::new(timing, seed, 0);
        let mut taken = Vec::new();
        let mut take_until = |under_way: &mut AnswersUnderWay, until: Option<Instant>| {
            while let Some(due) = under_way.due().filter(|&due| until.is_none_or(|t| due <= t)) {
                taken.push(((due - begun).as_secs_f64() * 1e3, under_way.take(due)));
            }
        };
        for (at_ms, bytes) in answers {
            let now = begun + Duration::from_millis(*at_ms);
            take_until(&mut under_way, Some(now));
            under_way.push(bytes, now);
        }
        take_until(&mut under_way, None);
        taken
    }

    #[test]
    fn each_key_is_read_and_values_out_of_range_are_refused_at_their_line() {
        let read_settings = read(
            "[robot]\ndelay_ms = [5, 20.5]\nslice_bytes = 7\nslice_pause_ms = [0, 2]\n[array]\n",
        )
        .expect("valid");
        let robot = read_settings.robot;
        assert_eq!(robot.delay_ms, Pause { shortest_ms: 5.0, longest_ms: 20.5 });
        assert_eq!(robot.slice_bytes, Some(SliceBytes(7)));
        assert_eq!(read_settings.receiver, AnswerTiming::default());
        for wrong in [
            "delay_ms = [5, 4]",
            "delay_ms = [-1, 4]",
            "delay_ms = [nan, 4]",
            "delay_ms = [0, inf]",
            "delay_ms = [0, 10001]",
            "delay_ms = 5",
            "slice_bytes = 0",
            "slice_bytes = 4097",
            "slice_ms = [1, 2]",
        ] {
            let fault = read(&format!("[robot]\n{wrong}\n")).expect_err("wrong");
            assert_eq!(fault.line_column().map(|(line, _)| line), Some(2), "{fault}");
        }
    }

    #[test]
    fn slices_have_their_size_and_their_distance_in_time() {
        let timing = read("[robot]\nslice_bytes = 3\nslice_pause_ms = [2, 2]\n");
        let timing = timing.expect("valid").robot;
        let expected: Vec<(f64, Vec<u8>)> = vec![
            (0.0, b"ok\n".to_vec()),
            (2.0, b"X:1".to_vec()),
            (4.0, b".00".to_vec()),
            (6.0, b"\n".to_vec()),
        ];
        assert_eq!(slices(timing, 1, &[(0, b"ok\nX:1.00\n")]), expected);
    }

    proptest! {
        #[test]
        fn no_byte_is_lost_early_or_out_of_order(
            seed: u64, shortest in 0.0..20.0f64, more in 0.0..50.0f64, slice in 1usize..100, pause in 0.0..5.0f64,
            answers in prop::collection::vec((0u64..100, prop::collection::vec(any::<u8>(), 1..200)), 1..8),
        ) {
            let timing = AnswerTiming {
                delay_ms: [shortest, shortest + more].try_into().expect("in range"),
                slice_bytes: Some(slice.try_into().expect("in range")),
                slice_pause_ms: [0.0, pause].try_into().expect("in range"),
            };
            let mut at_ms = 0;
            let answers: Vec<(u64, &[u8])> = answers.iter().map(|(after_ms, bytes)| {
                at_ms += after_ms;
                (at_ms, bytes.as_slice())
            }).collect();
            let taken = slices(timing, seed, &answers);
            prop_assert_eq!(&taken, &slices(timing, seed, &answers));
            let all: Vec<u8> = taken.iter().flat_map(|(_, bytes)| bytes.clone()).collect();
            let sent: Vec<u8> = answers.iter().flat_map(|(_, bytes)| bytes.to_vec()).collect();
            prop_assert_eq!(all, sent);
            prop_assert!(taken.iter().all(|(_, bytes)| (1..=slice).contains(&bytes.len())));
            let mut passed = 0;
            for (came_ms, bytes) in &taken {
                let mut before = 0;
                let sent_ms = answers.iter().find(|(_, bytes)| { before += bytes.len(); passed < before }).expect("it was sent").0;
                prop_assert!(*came_ms >= sent_ms as f64 + shortest - 1e-3, "{came_ms} {sent_ms}");
                passed += bytes.len();
            }
        }
    }
}
