//! Recordings: samples without a pause while the robot moves.

use std::future::Future;
use std::pin::Pin;

use super::protocol::{Event, Sample};

/// What runs during a recording: a move of the robot.
pub type DuringRecording<'a> = Pin<Box<dyn Future<Output = ()> + Send + 'a>>;

/// How far a sample's time may be from the time that its number implies, in periods.
const JITTER: f64 = 0.5;

/// One sample and its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedSample {
    /// When, s, on the receiver's clock.
    pub t_s: f64,
    /// What was read, in the receiver's unit; finite. Of a sample with a phase, its amplitude: the phase turns while the robot moves.
    pub value: f64,
    /// Whether the converter was at its limit.
    pub clipped: bool,
}

/// The samples of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Its clock just before that began, s.
    pub began_s: f64,
    /// Its clock just after it had ended, s.
    pub ended_s: f64,
    /// The samples, by their time.
    pub samples: Vec<TimedSample>,
}

/// Collects the events of a recording.
#[derive(Debug)]
pub(super) struct Recorder {
    asked_at_us: u64,
    period_us: f64,
    samples: Vec<Sample>,
}

impl Recorder {
    /// Of a recording that was asked for at `asked_at_us` on the receiver's clock.
    pub(super) fn new(asked_at_us: u64, rate_hz: f64) -> Self {
        Self { asked_at_us, period_us: 1e6 / rate_hz, samples: Vec::new() }
    }

    /// Takes one event; the receiver's clock where it is the end mark.
    pub(super) fn take(&mut self, event: Event) -> Option<u64> {
        match event {
            Event::Sample(sample) if sample.t_us >= self.asked_at_us => {
                self.samples.push(sample);
                None
            }
            Event::End { t_us, .. } if t_us >= self.asked_at_us => Some(t_us),
            // Received before the question.
            _ => None,
        }
    }

    /// The recording, without the samples whose number and time contradict each other.
    pub(super) fn recording(self, ended_at_us: u64) -> Recording {
        let first = self.samples.first().map_or(0, |sample| sample.seq);
        let begins_us = |sample: &Sample| {
            let steps = sample.seq.wrapping_sub(first) as i32;
            sample.t_us as f64 - f64::from(steps) * self.period_us
        };
        let mut starts_us: Vec<f64> = self.samples.iter().map(begins_us).collect();
        starts_us.sort_by(f64::total_cmp);
        // Most samples are whole, so the one in the middle is.
        let begins = starts_us.get(starts_us.len() / 2).copied().unwrap_or(0.0);
        let allowed_us = JITTER * self.period_us + 2.0;
        let mut samples: Vec<TimedSample> = self
            .samples
            .iter()
            .filter(|sample| (begins_us(sample) - begins).abs() <= allowed_us)
            .map(|sample| TimedSample {
                t_s: sample.t_us as f64 * 1e-6,
                value: sample.quadrature.map_or(sample.value, |q| sample.value.hypot(q)),
                clipped: sample.clipped,
            })
            .collect();
        samples.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        Recording {
            began_s: self.asked_at_us as f64 * 1e-6,
            ended_s: ended_at_us as f64 * 1e-6,
            samples,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sample(seq: u32) -> Sample {
        let t_us = 5_000_000 + u64::from(seq.wrapping_sub(u32::MAX - 5)) * 1000;
        Sample { seq, t_us, value: 1.0, quadrature: None, clipped: false }
    }

    fn recorded(samples: impl IntoIterator<Item = Sample>) -> Recording {
        let mut recorder = Recorder::new(5_000_000, 1000.0);
        for sample in samples {
            assert_eq!(recorder.take(Event::Sample(sample)), None);
        }
        let ended = recorder.take(Event::End { next_seq: 0, t_us: 6_000_000 });
        recorder.recording(ended.expect("the end mark"))
    }

    #[test]
    fn what_came_is_there_by_its_time_though_numbers_wrap() {
        let recording = recorded((0..20).map(|n| sample((u32::MAX - 5).wrapping_add(n))));
        assert_eq!((recording.began_s, recording.ended_s), (5.0, 6.0));
        let times: Vec<f64> = recording.samples.iter().map(|sample| sample.t_s).collect();
        assert_eq!(times.len(), 20);
        assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 1e-3).abs() < 1e-9));
    }

    proptest! {
        #[test]
        fn a_damaged_time_or_number_costs_that_sample_alone(
            at in 0usize..20, shift in prop_oneof![1_000u64..1_000_000, 2_000_000u64..9_000_000], number in any::<bool>(),
        ) {
            let mut samples: Vec<Sample> = (0..20).map(|n| sample((u32::MAX - 5).wrapping_add(n))).collect();
            if number {
                samples[at].seq = samples[at].seq.wrapping_add(shift as u32);
            } else {
                samples[at].t_us += shift;
            }
            let whole = samples.clone();
            let recording = recorded(samples);
            prop_assert_eq!(recording.samples.len(), 19);
            for kept in &recording.samples {
                let known = whole.iter().enumerate().any(|(n, s)| n != at && s.t_us as f64 * 1e-6 == kept.t_s);
                prop_assert!(known);
            }
        }
    }
}
