//! The receiver's clock tied to this computer's.
//!
//! A sample that arrives late was delayed, never advanced. So the difference between the time of arrival here and the
//! receiver's own time is smallest where nothing delayed the sample. The lower envelope of these differences is the offset
//! of the two clocks plus the smallest delay, and its slope their drift: the line below all points that is nearest to them
//! (S. B. Moon, P. Skelly, D. Towsley, *Estimation and removal of clock skew from network delay measurements*, INFOCOM 1999).
//! A sample's departure from it is how long the sample waited in buffers.

use std::collections::VecDeque;

/// Of each interval this long the smallest difference is kept, s.
const INTERVAL_S: f64 = 1.0;

/// Intervals kept: longer than any stall of a computer that still scans, and short beside changes of a crystal's drift.
const INTERVALS: usize = 60;

/// Intervals from which the drift is estimated. Before, the smallest difference of all stands for the line, which errs to the
/// safe side: a sample may seem older than it is.
const INTERVALS_FOR_DRIFT: usize = 10;

/// Largest drift: counted samples of a nominal rate may be off by so much. Ceramic resonators are within 0.5 %, crystals
/// within 0.01 %.
const MOST_DRIFT: f64 = 0.02;

/// A stream without backlog arrives at its own rate for this long, s.
const STEADY_S: f64 = 0.5;

/// A backlog that is being worked off arrives faster than this many times the nominal rate.
const STEADY_RATE: f64 = 1.2;

/// Bridges from USB hand over what they have at intervals of up to this, s (16 ms of FTDI's, and a margin).
const BRIDGE_S: f64 = 0.02;

/// Samples without a time are counted. Where so much more time has passed than was counted, s, samples were lost.
const LOST_S: f64 = 0.05;

/// Ties samples to the time of their arrival.
#[derive(Debug)]
pub(super) struct ClockTie {
    rate_hz: f64,
    /// Whether samples carry their time; otherwise they are counted.
    own_clock: bool,
    /// Of each interval of the receiver's time: a time and the smallest difference, s.
    lowest: VecDeque<(f64, f64)>,
    /// Offset at time zero, s, and drift.
    line: (f64, f64),
    /// Samples that arrived within the last [`STEADY_S`]: arrival, difference, how many.
    recent: VecDeque<(f64, f64, u32)>,
    recent_count: u32,
    begun_s: Option<f64>,
}

impl ClockTie {
    pub(super) fn new(rate_hz: f64, own_clock: bool) -> Self {
        Self {
            rate_hz,
            own_clock,
            lowest: VecDeque::new(),
            line: (0.0, 0.0),
            recent: VecDeque::new(),
            recent_count: 0,
            begun_s: None,
        }
    }

    /// Forgets all, as after a jump of the receiver's clock.
    pub(super) fn restart(&mut self) {
        *self = Self::new(self.rate_hz, self.own_clock);
    }

    /// Takes a sample of the receiver's time `t_s` that arrived at `arrived_s` of this computer's.
    pub(super) fn take(&mut self, t_s: f64, arrived_s: f64) {
        self.begun_s.get_or_insert(arrived_s);
        let difference_s = arrived_s - t_s;
        self.note_arrival(arrived_s, difference_s);
        if !self.own_clock && self.is_steady() {
            let least_s = self.recent.iter().map(|recent| recent.1).fold(f64::INFINITY, f64::min);
            if least_s > self.offset_s(t_s) + LOST_S {
                self.lowest.clear();
            }
        }
        self.note_difference(t_s, difference_s);
    }

    /// Whether a sample of `t_s` was certainly taken at or after `instant_s` of this computer's time, if it took at most
    /// `latency_s` to arrive where nothing delayed it.
    pub(super) fn is_after(&self, t_s: f64, instant_s: f64, latency_s: f64) -> bool {
        t_s + self.offset_s(t_s) - latency_s >= instant_s
    }

    /// The receiver's time of a sample that arrives at `instant_s` without delay, s.
    pub(super) fn receiver_s(&self, instant_s: f64) -> f64 {
        let (offset_s, drift) = self.line;
        (instant_s - offset_s) / (1.0 + drift)
    }

    /// Whether samples have arrived at their own rate for some time: nothing is left in buffers.
    pub(super) fn is_steady(&self) -> bool {
        let Some(&(newest_s, ..)) = self.recent.back() else { return false };
        let lasted = self.begun_s.is_some_and(|begun_s| newest_s - begun_s >= STEADY_S);
        let most = self.rate_hz * (STEADY_S * STEADY_RATE + BRIDGE_S) + 2.0;
        lasted && f64::from(self.recent_count) <= most
    }

    fn offset_s(&self, t_s: f64) -> f64 {
        self.line.0 + self.line.1 * t_s
    }

    fn note_arrival(&mut self, arrived_s: f64, difference_s: f64) {
        match self.recent.back_mut() {
            Some((last_s, least_s, count)) if *last_s == arrived_s => {
                *least_s = least_s.min(difference_s);
                *count += 1;
            }
            _ => self.recent.push_back((arrived_s, difference_s, 1)),
        }
        self.recent_count += 1;
        while let Some(&(first_s, _, count)) = self.recent.front()
            && arrived_s - first_s > STEADY_S
        {
            self.recent_count -= count;
            self.recent.pop_front();
        }
    }

    fn note_difference(&mut self, t_s: f64, difference_s: f64) {
        let interval = |t_s: f64| (t_s / INTERVAL_S).floor();
        match self.lowest.back_mut() {
            Some(last) if interval(last.0) == interval(t_s) => {
                if difference_s >= last.1 {
                    return;
                }
                *last = (t_s, difference_s);
            }
            _ => self.lowest.push_back((t_s, difference_s)),
        }
        if self.lowest.len() > INTERVALS {
            self.lowest.pop_front();
        }
        self.line = line_below(self.lowest.make_contiguous());
    }
}

/// The line below all points, of ascending abscissae, that is nearest to them: the edge of their lower convex hull over
/// their mean abscissa. Its value at zero, and its slope.
fn line_below(points: &[(f64, f64)]) -> (f64, f64) {
    let mut hull: Vec<(f64, f64)> = Vec::new();
    for &(x, y) in points {
        while let [.., a, b] = hull[..]
            && (b.0 - a.0) * (y - a.1) <= (b.1 - a.1) * (x - a.0)
        {
            hull.pop();
        }
        hull.push((x, y));
    }
    let mean = points.iter().map(|point| point.0).sum::<f64>() / points.len().max(1) as f64;
    let edge = hull.windows(2).find(|edge| edge[1].0 >= mean);
    let edge = edge.filter(|_| points.len() >= INTERVALS_FOR_DRIFT);
    let slope = edge.map_or(0.0, |edge| (edge[1].1 - edge[0].1) / (edge[1].0 - edge[0].0));
    let slope = slope.clamp(-MOST_DRIFT, MOST_DRIFT);
    // Below all points also where the slope had to be limited.
    let at_zero = points.iter().map(|(x, y)| y - slope * x).fold(f64::INFINITY, f64::min);
    (if at_zero.is_finite() { at_zero } else { 0.0 }, slope)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A clock that is 1000 s ahead and 80 ppm fast, and samples that take 4 ms at least.
    fn tied(delays_s: impl IntoIterator<Item = f64>) -> ClockTie {
        let mut tie = ClockTie::new(100.0, true);
        for (number, delay_s) in delays_s.into_iter().enumerate() {
            let taken_s = number as f64 * 0.01;
            tie.take(1000.0 + taken_s * (1.0 + 80e-6), taken_s + 4e-3 + delay_s);
        }
        tie
    }

    #[test]
    fn offset_and_drift_are_found_though_most_samples_are_delayed() {
        let tie = tied((0..4000).map(|number| f64::from(number % 7) * 3e-3));
        let taken_s = 39.9;
        let t_s = 1000.0 + taken_s * (1.0 + 80e-6);
        assert!((tie.receiver_s(taken_s + 4e-3) - t_s).abs() < 1e-6);
        assert!(tie.is_after(t_s, taken_s - 1e-6, 4e-3));
        assert!(!tie.is_after(t_s, taken_s + 1e-6, 4e-3));
    }

    #[test]
    fn counted_samples_find_their_place_again_after_a_loss() {
        let mut tie = ClockTie::new(100.0, false);
        let mut now_s = 0.0;
        for number in 0..1000 {
            now_s += if number == 500 { 2.0 } else { 0.01 };
            tie.take(f64::from(number) * 0.01, now_s);
        }
        assert!((tie.receiver_s(now_s) - 9.99).abs() < 1e-9);
    }

    #[test]
    fn a_backlog_is_no_steady_stream() {
        let mut tie = ClockTie::new(100.0, true);
        for number in 0..200 {
            tie.take(f64::from(number) * 0.01, f64::from(number) * 0.005);
            assert!(!tie.is_steady());
        }
        for number in 200..300 {
            tie.take(f64::from(number) * 0.01, 1.0 + f64::from(number - 200) * 0.01);
        }
        assert!(tie.is_steady());
    }

    proptest! {
        #[test]
        fn the_line_is_below_all_points_and_touches_one(
            differences in proptest::collection::vec(-1.0..1.0, 1..70)
        ) {
            let points: Vec<(f64, f64)> =
                differences.iter().enumerate().map(|(x, &y)| (x as f64, y)).collect();
            let (at_zero, slope) = line_below(&points);
            let above = |point: &(f64, f64)| point.1 - at_zero - slope * point.0;
            let least = points.iter().map(above).fold(f64::INFINITY, f64::min);
            prop_assert!(least.abs() < 1e-9);
        }

        #[test]
        fn no_delay_makes_a_sample_seem_younger_than_it_is(
            delays_s in proptest::collection::vec(0.0..2.0, 1..400)
        ) {
            // The smallest delay of all is added to the stated latency: it cannot be known.
            let least_s = delays_s.iter().copied().fold(f64::INFINITY, f64::min);
            let count = delays_s.len();
            let tie = tied(delays_s);
            for number in 0..count {
                let taken_s = number as f64 * 0.01;
                let t_s = 1000.0 + taken_s * (1.0 + 80e-6);
                // In four seconds the clocks drift apart by 0.3 ms, which is not estimated yet.
                prop_assert!(!tie.is_after(t_s, taken_s + least_s + 5e-4, 4e-3));
            }
        }
    }
}
