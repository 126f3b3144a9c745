//! From four readings at a time to swipes.

use std::collections::VecDeque;

use serde::Serialize;

use super::channel::Channel;

/// Readings before anything is told: rest and noise are learnt first, s.
const LEARNS_S: f64 = 0.4;

/// Deviations of the noise from which on something is there.
const SOMETHING: f64 = 6.0;

/// Readings in a row that must say so.
const IN_A_ROW: usize = 2;

/// Deviations of the noise below which nothing is there any more.
const NOTHING: f64 = 4.0;

/// How long nothing must be there for the hand to be gone, s.
const GONE_S: f64 = 0.2;

/// How long all must stand still, wherever it is, to be taken for rest, s: what leaks drifts while a hand is there.
const STILL_S: f64 = 0.5;

/// Scatter, over what the noise explains, below which all stands still.
const STILL: f64 = 1.6;

/// The longest passage, s: what stays longer is no swipe.
const LONGEST_S: f64 = 12.0;

/// The shortest passage, s.
const SHORTEST_S: f64 = 0.03;

/// How far apart the sides must be, as a share of how long the hand was there, which does not depend on the hand's speed. Of a
/// hand twice as broad as the sides are apart it is about a tenth; echo and leakage scatter it by a third of that.
const APART: f64 = 0.02;

/// Shares of a side's whole departure whose times are compared with the other side's.
const QUANTILES: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// Which way a hand passed.
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

/// A hand that passed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Swipe {
    /// Which way.
    pub direction: Direction,
    /// When it came, s on the clock of the readings.
    pub came_s: f64,
    /// When it went.
    pub went_s: f64,
    /// How much later the one side was met than the other, s, above zero.
    pub lag_s: f64,
}

/// Listens to four elements: two on the left, two on the right.
#[derive(Debug, Clone)]
pub struct SwipeDetector {
    rate_hz: f64,
    channels: [Channel; 4],
    recent: VecDeque<[f64; 4]>,
    learnt: usize,
    in_a_row: usize,
    passage: Option<Passage>,
}

/// Something that is there.
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
            learnt: 0,
            in_a_row: 0,
            passage: None,
        }
    }

    /// Takes four readings, left, left, right, right, at a time, s; gives the swipe that they complete.
    pub fn take(&mut self, time_s: f64, volts: [f64; 4]) -> Option<Swipe> {
        self.recent.push_back(volts);
        if self.recent.len() > self.samples(STILL_S) {
            self.recent.pop_front();
        }
        let departures: [f64; 4] = std::array::from_fn(|n| self.channels[n].departure(volts[n]));
        let farthest = departures.iter().copied().fold(0.0, f64::max);
        if self.learnt < self.samples(LEARNS_S) {
            self.learnt += 1;
            self.rest(volts);
            return None;
        }
        let Some(mut passage) = self.passage.take() else {
            self.in_a_row = if farthest > SOMETHING { self.in_a_row + 1 } else { 0 };
            if self.in_a_row < IN_A_ROW {
                // A departure that may be the first of more is not rest.
                if self.in_a_row == 0 {
                    self.rest(volts);
                }
                return None;
            }
            self.in_a_row = 0;
            self.passage = Some(Passage::default());
            return self.follow(time_s, volts, departures);
        };
        passage.quiet = if farthest < NOTHING { passage.quiet + 1 } else { 0 };
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

    /// Goes on with what is there; tells when it is gone.
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
        let kept = count - if gone { passage.quiet } else { self.samples(STILL_S).min(count) };
        if !gone {
            for (n, channel) in self.channels.iter_mut().enumerate() {
                let mean = self.recent.iter().map(|volts| volts[n]).sum::<f64>()
                    / self.recent.len() as f64;
                channel.settle(mean);
            }
        }
        passage.swipe(kept).filter(|_| count < self.samples(LONGEST_S))
    }

    /// Whether all that was heard of late scatters as noise does.
    fn is_still(&self) -> bool {
        let count = self.recent.len() as f64;
        (0..4).all(|n| {
            let mean = self.recent.iter().map(|volts| volts[n]).sum::<f64>() / count;
            let scatter = self.recent.iter().map(|volts| (volts[n] - mean).powi(2)).sum::<f64>();
            (scatter / count).sqrt() < STILL * self.channels[n].noise()
        })
    }
}

impl Passage {
    /// What passed in the first `kept` readings, if it was met on one side clearly before the other.
    fn swipe(&self, kept: usize) -> Option<Swipe> {
        let (&came_s, &went_s) = (self.times_s.first()?, self.times_s.get(kept.checked_sub(1)?)?);
        let lasted_s = went_s - came_s;
        if lasted_s < SHORTEST_S {
            return None;
        }
        let left = self.side_s(kept, [0, 1])?;
        let right = self.side_s(kept, [2, 3])?;
        let lags = left.iter().zip(right).map(|(left_s, right_s)| right_s - left_s);
        let lag_s = lags.sum::<f64>() / QUANTILES.len() as f64;
        let direction = if lag_s > 0.0 { Direction::Right } else { Direction::Left };
        (lag_s.abs() > APART * lasted_s).then_some(Swipe {
            direction,
            came_s,
            went_s,
            lag_s: lag_s.abs(),
        })
    }

    /// When shares of what a side departed in all have come together; each of its elements counts alike.
    fn side_s(&self, kept: usize, elements: [usize; 2]) -> Option<[f64; 5]> {
        // The root keeps the few instants when echo and leakage add to their most from outweighing all others.
        let beyond = |departure: f64| (departure - NOTHING).max(0.0).sqrt();
        let whole =
            elements.map(|n| self.departures[..kept].iter().map(|all| beyond(all[n])).sum::<f64>());
        let heard: Vec<usize> = (0..2).filter(|&place| whole[place] > 0.0).collect();
        if heard.is_empty() {
            return None;
        }
        let mut reached = 0.0;
        let mut times_s = [f64::NAN; 5];
        let mut next = 0;
        for (time_s, all) in self.times_s[..kept].iter().zip(&self.departures) {
            for &place in &heard {
                reached += beyond(all[elements[place]]) / whole[place] / heard.len() as f64;
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
