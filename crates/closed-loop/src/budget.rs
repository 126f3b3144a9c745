//! What rounds may use up, and what they have.

use fieldgap_records::RecordedSample;

/// What all rounds of a plan may use up together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Readings at most.
    pub readings: usize,
    /// Longest time from the first reading to the last on the rig's clock, s.
    pub longest_s: Option<f64>,
    /// Longest time with the array driven, s.
    pub longest_sounding_s: Option<f64>,
}

/// What is used up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UsedUp {
    /// The readings.
    Readings,
    /// The time.
    Time,
    /// The time with the array driven.
    Sounding,
}

/// What the rounds so far have used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spent {
    /// Readings.
    pub readings: usize,
    /// From the first reading to the last, s.
    pub time_s: f64,
    /// With the array driven, s.
    pub sounding_s: f64,
}

impl Budget {
    /// What a next round of so many readings and seconds would use up; `None` if there is enough left.
    pub fn used_up(&self, spent: Spent, readings: usize, round_s: f64) -> Option<UsedUp> {
        let over = |longest_s: Option<f64>, spent_s: f64| {
            longest_s.is_some_and(|longest_s| spent_s + round_s > longest_s)
        };
        if spent.readings + readings > self.readings {
            Some(UsedUp::Readings)
        } else if over(self.longest_s, spent.time_s) {
            Some(UsedUp::Time)
        } else if over(self.longest_sounding_s, spent.sounding_s) {
            Some(UsedUp::Sounding)
        } else {
            None
        }
    }
}

impl Spent {
    /// What these readings took.
    pub fn of(samples: &[RecordedSample]) -> Self {
        let time_s = |from: &RecordedSample, to: &RecordedSample| to.time_s - from.time_s;
        let sounding = samples.windows(2).filter(|pair| pair.iter().all(|s| s.focus.is_some()));
        Self {
            readings: samples.len(),
            time_s: samples.first().zip(samples.last()).map_or(0.0, |(a, b)| time_s(a, b)),
            sounding_s: sounding.map(|pair| time_s(&pair[0], &pair[1])).sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_ends_the_rounds() {
        let spent = Spent { readings: 1750, time_s: 500.0, sounding_s: 400.0 };
        let limits = |longest_s, longest_sounding_s| Budget {
            readings: 1800,
            longest_s,
            longest_sounding_s,
        };
        assert_eq!(limits(None, None).used_up(spent, 51, 10.0), Some(UsedUp::Readings));
        assert_eq!(limits(Some(505.0), None).used_up(spent, 50, 10.0), Some(UsedUp::Time));
        assert_eq!(limits(None, Some(405.0)).used_up(spent, 50, 10.0), Some(UsedUp::Sounding));
        assert_eq!(limits(Some(600.0), Some(600.0)).used_up(spent, 50, 10.0), None);
    }
}
