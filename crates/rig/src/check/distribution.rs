//! How the times of many replies are spread.

use std::time::Duration;

use serde::Serialize;

/// Bins that the times are counted in, from the shortest to the longest.
pub const BINS: usize = 12;

/// Characters of rising height.
const HEIGHTS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// How many replies took how long.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Distribution {
    /// 95 of 100 replies came within, ms.
    pub p95_ms: f64,
    /// Replies in each of the bins, which share the time from the shortest to the longest equally.
    pub bins: [u32; BINS],
}

impl Distribution {
    /// Of times that are sorted, the shortest first.
    pub(super) fn of_sorted(times: &[Duration]) -> Self {
        let mut bins = [0; BINS];
        let (Some(first), Some(last)) = (times.first(), times.last()) else {
            return Self { p95_ms: 0.0, bins };
        };
        let width = (*last - *first).as_secs_f64() / BINS as f64;
        for time in times {
            let bin = if width > 0.0 { (*time - *first).as_secs_f64() / width } else { 0.0 };
            bins[(bin as usize).min(BINS - 1)] += 1;
        }
        // The smallest of the times that at least 95 of 100 do not exceed.
        let rank = (times.len() * 95).div_ceil(100).max(1) - 1;
        Self { p95_ms: times[rank].as_secs_f64() * 1e3, bins }
    }

    /// A column for each bin; those without a reply are blank.
    pub(super) fn columns(&self) -> String {
        let largest = self.bins.iter().copied().max().unwrap_or(0);
        let column = |&count: &u32| match count {
            0 => ' ',
            _ => HEIGHTS[((count * (HEIGHTS.len() as u32 - 1)).div_ceil(largest)) as usize],
        };
        self.bins.iter().map(column).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_share_the_span_and_hold_all_replies() {
        let times: Vec<Duration> = (0..=120).map(Duration::from_millis).collect();
        let spread = Distribution::of_sorted(&times);
        assert_eq!(spread.bins.iter().sum::<u32>(), 121);
        assert_eq!(&spread.bins[..3], [10, 10, 10]);
        // The 115th of 121 is 114 ms, since the first is 0.
        assert!((spread.p95_ms - 114.0).abs() < 1e-9);
    }

    #[test]
    fn one_late_reply_stands_by_itself() {
        let mut times = vec![Duration::from_millis(2); 99];
        times.push(Duration::from_millis(200));
        assert_eq!(Distribution::of_sorted(&times).columns(), "█          ▂");
        assert_eq!(Distribution::of_sorted(&times[..1]).columns().trim_end(), "█");
        assert_eq!(Distribution::of_sorted(&[]).columns().trim(), "");
    }
}
