//! One run of samples: which of them belong to the point.

use std::time::Duration;

use super::protocol::{Event, Sample};
use super::reading::{Reading, ReadingBuilder};

/// How far the time between two samples may be from the time that their numbers imply, as a share of it.
const JITTER: f64 = 0.5;

/// Sorts the events of one run: what is older than the question, what is still settling, what counts.
#[derive(Debug)]
pub(super) struct Run {
    asked_at_us: u64,
    settle_us: u64,
    wanted: usize,
    sent: usize,
    period_us: f64,
    received: usize,
    first: Option<Sample>,
    last: Option<Sample>,
    /// Numbers used by the run, where the end mark gave them.
    numbered: Option<u32>,
    tally: ReadingBuilder,
}

impl Run {
    /// How many samples to ask for so that `wanted` are left when those of `settle` are dropped.
    ///
    /// One more than the sum, since the time stamps are whole microseconds and may round the last one out.
    pub(super) fn samples_for(settle: Duration, wanted: usize, rate_hz: f64) -> u32 {
        let settling = (settle.as_secs_f64() * rate_hz).ceil();
        (settling + wanted as f64 + 1.0) as u32
    }

    /// A run of `sent` samples that was asked for at `asked_at_us` on the receiver's clock.
    pub(super) fn new(
        asked_at_us: u64,
        settle: Duration,
        wanted: usize,
        sent: u32,
        rate_hz: f64,
    ) -> Self {
        Self {
            asked_at_us,
            settle_us: u64::try_from(settle.as_micros()).unwrap_or(u64::MAX),
            wanted,
            sent: sent as usize,
            period_us: 1e6 / rate_hz,
            received: 0,
            first: None,
            last: None,
            numbered: None,
            tally: ReadingBuilder::default(),
        }
    }

    /// Takes one event; true when the run is over.
    pub(super) fn take(&mut self, event: Event) -> bool {
        match event {
            Event::Sample(sample) if sample.t_us >= self.asked_at_us => self.take_sample(sample),
            Event::End { next_seq, t_us } if t_us >= self.asked_at_us => {
                self.numbered = self.first.map(|first| next_seq.wrapping_sub(first.seq));
                return true;
            }
            // Received before the question.
            _ => {}
        }
        self.received >= self.sent
    }

    fn take_sample(&mut self, sample: Sample) {
        if !self.last.is_none_or(|last| self.follows(last, sample)) {
            // A damaged number or time, here or before. Settling again from here only errs to the late side.
            self.first = None;
            self.tally = ReadingBuilder::default();
            self.received = 0;
        }
        let first = *self.first.get_or_insert(sample);
        self.last = Some(sample);
        self.received += 1;
        let settled = sample.t_us.saturating_sub(first.t_us) >= self.settle_us;
        if settled && self.tally.count() < self.wanted {
            let Sample { t_us, value, quadrature, clipped, .. } = sample;
            match quadrature {
                Some(quadrature) => {
                    self.tally.add_with_phase(t_us, [value, quadrature], clipped);
                }
                None => self.tally.add(t_us, value, clipped),
            }
        }
    }

    /// Whether number and time of two samples agree.
    fn follows(&self, last: Sample, sample: Sample) -> bool {
        let steps = f64::from(sample.seq.wrapping_sub(last.seq));
        let expected_us = steps * self.period_us;
        let seen_us = sample.t_us as f64 - last.t_us as f64;
        // A microsecond for the rounding of each time stamp.
        steps > 0.0 && (seen_us - expected_us).abs() <= expected_us * JITTER + 2.0
    }

    /// The reading, or `None` where nothing settled was received.
    pub(super) fn reading(&self) -> Option<Reading> {
        let (first, last) = (self.first?, self.last?);
        let seen = last.seq.wrapping_sub(first.seq).saturating_add(1);
        let numbered = self.numbered.unwrap_or(0).max(seen) as usize;
        let lost = numbered.max(self.sent).saturating_sub(self.received);
        self.tally.finish(u32::try_from(lost).unwrap_or(u32::MAX))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RATE_HZ: f64 = 1000.0;
    const SETTLE: Duration = Duration::from_millis(20);

    fn sample(seq: u32, t_us: u64) -> Sample {
        // The value tells the time, so that a mean tells which samples were taken.
        Sample { seq, t_us, value: t_us as f64, quadrature: None, clipped: false }
    }

    /// The samples of a run asked for at 5 s, numbered from `first_seq`.
    fn samples(first_seq: u32) -> Vec<Sample> {
        let sent = u64::from(Run::samples_for(SETTLE, 16, RATE_HZ));
        (0..sent).map(|k| sample(first_seq.wrapping_add(k as u32), 5_000_000 + k * 1000)).collect()
    }

    fn run(events: impl IntoIterator<Item = Event>) -> (Run, bool) {
        let sent = Run::samples_for(SETTLE, 16, RATE_HZ);
        let mut run = Run::new(5_000_000, SETTLE, 16, sent, RATE_HZ);
        let over = events.into_iter().any(|event| run.take(event));
        (run, over)
    }

    #[test]
    fn settling_samples_are_dropped_and_the_rest_counted() {
        let (run, over) = run(samples(0).into_iter().map(Event::Sample));
        let reading = run.reading().expect("samples");
        assert!(over);
        assert_eq!((reading.count, reading.gaps), (16, 0));
        assert!(
            (reading.first_t_s - 5.020).abs() < 1e-9 && (reading.last_t_s - 5.035).abs() < 1e-9
        );
    }

    #[test]
    fn what_is_older_than_the_question_is_not_counted() {
        let old = (0..10).map(|k| sample(k, 4_990_000 + u64::from(k) * 1000));
        let end = Event::End { next_seq: 10, t_us: 4_999_999 };
        let events =
            old.map(Event::Sample).chain([end]).chain(samples(10).into_iter().map(Event::Sample));
        let (run, over) = run(events);
        assert!(over);
        assert_eq!(run.reading().map(|reading| (reading.count, reading.gaps)), Some((16, 0)));
    }

    #[test]
    fn lost_samples_are_gaps_wherever_they_were() {
        let all = samples(0);
        let end = Event::End { next_seq: all.len() as u32, t_us: 6_000_000 };
        for lost in [0..1, 5..8, 30..31, all.len() - 3..all.len()] {
            let left = all.iter().filter(|sample| !lost.contains(&(sample.seq as usize)));
            let (run, over) = run(left.copied().map(Event::Sample).chain([end]));
            let reading = run.reading().expect("samples");
            assert!(over);
            assert_eq!(reading.gaps as usize, lost.len(), "{lost:?}");
        }
    }

    #[test]
    fn the_sample_number_may_wrap() {
        let (run, _) = run(samples(u32::MAX - 5).into_iter().map(Event::Sample));
        assert_eq!(run.reading().map(|reading| (reading.count, reading.gaps)), Some((16, 0)));
    }

    #[test]
    fn a_damaged_time_never_lets_an_unsettled_sample_in() {
        for damaged in 0..samples(0).len() {
            let mut all = samples(0);
            all[damaged].t_us += 40_000_000;
            all[damaged].value = 0.0;
            let (run, _) = run(all.into_iter().map(Event::Sample));
            if let Some(reading) = run.reading() {
                assert!(reading.mean >= 5_020_000.0, "sample {damaged}: {reading:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn no_events_make_a_run_panic(
            events in proptest::collection::vec(
                (any::<bool>(), any::<u32>(), any::<u64>(), any::<f64>()), 0..60)
        ) {
            let (run, _) = run(events.into_iter().map(|(is_end, seq, t_us, value)| {
                if is_end { Event::End { next_seq: seq, t_us } }
                else { Event::Sample(Sample { seq, t_us, value, quadrature: None, clipped: false }) }
            }));
            run.reading();
        }
    }
}
