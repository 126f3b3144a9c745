//! Detection of swipes in the readings of four elements.

use std::collections::VecDeque;

use serde::Serialize;

use super::channel::Channel;

/// Initial time without detection, in which rest and noise are estimated, s.
const LEARNING_S: f64 = 0.4;

/// Departure at which a passage begins, standard deviations of the noise.
const BEGIN_SIGMA: f64 = 6.0;

/// Consecutive readings beyond this departure for a passage to begin.
const BEGIN_READINGS: usize = 2;

/// Departure below which a reading is quiet, standard deviations of the noise.
const QUIET_SIGMA: f64 = 4.0;

/// Quiet time after which the hand is gone, s.
const GONE_S: f64 = 0.2;

/// Time of constant readings after which they become the level at rest, s: leakage may drift during a passage.
const STILL_S: f64 = 0.5;

/// Scatter over the noise below which readings are constant.
const STILL_SCATTER: f64 = 1.6;

/// Longest passage, s.
const LONGEST_S: f64 = 12.0;

/// Shortest passage, s.
const SHORTEST_S: f64 = 0.03;

/// Smallest lag between the sides over the duration of the passage; this ratio does not depend on the speed. For a hand twice
/// as wide as the distance of the sides it is about a tenth, with a scatter of a third of that from echo and leakage.
const MIN_RELATIVE_LAG: f64 = 0.02;

/// Shares of a side's integrated departure whose times are compared between the sides.
const QUANTILES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// Direction of a swipe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// From the right side to the left.
    Left,
    /// From the left side to the right.
    Right,
}

impl std::fmt::Display for Direction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
        })
    }
}

/// A detected swipe.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Swipe {
    /// Direction.
    pub direction: Direction,
    /// Begin, s on the clock of the readings.
    pub came_s: f64,
    /// End, s.
    pub went_s: f64,
    /// Lag between the two sides, s, above zero.
    pub lag_s: f64,
}

/// A detector for four elements: two on the left, two on the right.
#[derive(Debug, Clone)]
pub struct SwipeDetector {
    rate_hz: f64,
    channels: [Channel; 4],
    recent: VecDeque<[f64; 4]>,
    learning_readings: usize,
    consecutive: usize,
    passage: Option<Passage>,
}

/// A passage of a hand in progress.
#[derive(Debug, Clone, Default)]
struct Passage {
    times_s: Vec<f64>,
    /// Departures of each channel, in deviations of the noise.
    departures: Vec<[f64; 4]>,
    quiet: usize,
}

impl SwipeDetector {
    /// A detector for readings at a rate, Hz.
    pub fn new(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            channels: std::array::from_fn(|_| Channel::new(rate_hz)),
            recent: VecDeque::new(),
            learning_readings: 0,
            consecutive: 0,
            passage: None,
        }
    }

    /// Takes four readings (left, left, right, right) at a time, s; returns the swipe that they complete, if any.
    pub fn take(&mut self, time_s: f64, volts: [f64; 4]) -> Option<Swipe> {
        self.recent.push_back(volts);
        if self.recent.len() > self.samples(STILL_S) {
            self.recent.pop_front();
        }
        let departures: [f64; 4] = std::array::from_fn(|n| self.channels[n].departure(volts[n]));
        let largest = departures.iter().copied().fold(0.0, f64::max);
        if self.learning_readings < self.samples(LEARNING_S) {
            self.learning_readings += 1;
            self.rest(volts);
            return None;
        }
        let Some(mut passage) = self.passage.take() else {
            self.consecutive = if largest > BEGIN_SIGMA { self.consecutive + 1 } else { 0 };
            if self.consecutive < BEGIN_READINGS {
                // A departure that may begin a passage does not count as rest.
                if self.consecutive == 0 {
                    self.rest(volts);
                }
                return None;
            }
            self.consecutive = 0;
            self.passage = Some(Passage::default());
            return self.follow(time_s, volts, departures);
        };
        passage.quiet = if largest < QUIET_SIGMA { passage.quiet + 1 } else { 0 };
        self.passage = Some(passage);
        self.follow(time_s, volts, departures)
    }

    fn samples(&self, seconds: f64) -> usize {
        ((seconds * self.rate_hz).round() as usize).max(1)
    }

    fn rest(&mut self, volts: [f64; 4]) {
        for (channel, volts) in self.channels.iter_mut().zip(volts) {
            channel.take(volts, true);
        }
    }

    /// Continues the passage; returns its swipe at the end, if it is one.
    fn follow(&mut self, time_s: f64, volts: [f64; 4], departures: [f64; 4]) -> Option<Swipe> {
        let mut passage = self.passage.take()?;
        passage.times_s.push(time_s);
        passage.departures.push(departures);
        for (channel, volts) in self.channels.iter_mut().zip(volts) {
            channel.take(volts, false);
        }
        let count = passage.times_s.len();
        let gone = passage.quiet >= self.samples(GONE_S);
        let still = count > self.samples(STILL_S) && self.is_still();
        if !gone && !still && count < self.samples(LONGEST_S) {
            self.passage = Some(passage);
            return None;
        }
        let used = count - if gone { passage.quiet } else { self.samples(STILL_S).min(count) };
        if !gone {
            for (n, channel) in self.channels.iter_mut().enumerate() {
                let mean = self.recent.iter().map(|volts| volts[n]).sum::<f64>()
                    / self.recent.len() as f64;
                channel.settle(mean);
            }
        }
        passage.swipe(used).filter(|_| count < self.samples(LONGEST_S))
    }

    /// Whether the recent readings scatter by noise only.
    fn is_still(&self) -> bool {
        let count = self.recent.len() as f64;
        (0..4).all(|n| {
            let mean = self.recent.iter().map(|volts| volts[n]).sum::<f64>() / count;
            let scatter = self.recent.iter().map(|volts| (volts[n] - mean).powi(2)).sum::<f64>();
            (scatter / count).sqrt() < STILL_SCATTER * self.channels[n].noise()
        })
    }
}

impl Passage {
    /// The swipe in the first `used` readings, if one side clearly changed before the other.
    fn swipe(&self, used: usize) -> Option<Swipe> {
        let (&came_s, &went_s) = (self.times_s.first()?, self.times_s.get(used.checked_sub(1)?)?);
        let duration_s = went_s - came_s;
        if duration_s < SHORTEST_S {
            return None;
        }
        let left = self.side_s(used, [0, 1])?;
        let right = self.side_s(used, [2, 3])?;
        let lags = left.iter().zip(right).map(|(left_s, right_s)| right_s - left_s);
        let lag_s = lags.sum::<f64>() / QUANTILES.len() as f64;
        let direction = if lag_s > 0.0 { Direction::Right } else { Direction::Left };
        (lag_s.abs() > MIN_RELATIVE_LAG * duration_s).then_some(Swipe {
            direction,
            came_s,
            went_s,
            lag_s: lag_s.abs(),
        })
    }

    /// Times at which the integrated departure of a side reaches the quantiles; both elements have equal weight.
    fn side_s(&self, used: usize, elements: [usize; 2]) -> Option<[f64; 5]> {
        // The square root limits the weight of the instants when echo and leakage add in phase.
        let weight = |departure: f64| (departure - QUIET_SIGMA).max(0.0).sqrt();
        let totals =
            elements.map(|n| self.departures[..used].iter().map(|all| weight(all[n])).sum::<f64>());
        let active: Vec<usize> = (0..2).filter(|&element| totals[element] > 0.0).collect();
        if active.is_empty() {
            return None;
        }
        let mut reached = 0.0;
        let mut times_s = [f64::NAN; 5];
        let mut next = 0;
        for (time_s, all) in self.times_s[..used].iter().zip(&self.departures) {
            for &element in &active {
                reached += weight(all[elements[element]]) / totals[element] / active.len() as f64;
            }
            while next < 5 && reached >= QUANTILES[next] - 1e-12 {
                times_s[next] = *time_s;
                next += 1;
            }
        }
        (next == 5).then_some(times_s)
    }
}

#[cfg(test)]
mod tests;
