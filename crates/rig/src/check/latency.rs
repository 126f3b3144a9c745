//! How fast a device answers.

use std::fmt;
use std::time::Duration;

use serde::Serialize;

use super::distribution::Distribution;
use super::{Finding, Severity};
use crate::device::Role;

/// A reply that takes this long, and this many times as long as the middle one, is held up by something.
const HELD_UP: (Duration, f64) = (Duration::from_millis(100), 10.0);

/// A median latency above this makes scans slow: three replies a point.
const SLOW: Duration = Duration::from_millis(50);

/// Reply latency over several queries, ms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Latency {
    /// The shortest.
    pub min_ms: f64,
    /// The middle one.
    pub median_ms: f64,
    /// The longest.
    pub max_ms: f64,
    /// Over how many queries.
    pub queries: usize,
    /// How they are spread.
    pub distribution: Distribution,
}

impl Latency {
    pub(super) fn of(mut times: Vec<Duration>) -> Self {
        times.sort_unstable();
        let ms = |time: Option<&Duration>| time.map_or(0.0, |time| time.as_secs_f64() * 1e3);
        Self {
            min_ms: ms(times.first()),
            median_ms: ms(times.get(times.len() / 2)),
            max_ms: ms(times.last()),
            queries: times.len(),
            distribution: Distribution::of_sorted(&times),
        }
    }

    pub(super) fn judge(&self, device: Role, findings: &mut Vec<Finding>) {
        if self.median_ms > SLOW.as_secs_f64() * 1e3 {
            findings.push(Finding {
                device,
                severity: Severity::Warning,
                problem: format!("a reply takes {:.0} ms, which makes scans slow", self.median_ms),
                remedy:
                    "raise the baud rate; on USB bridges lower the latency timer (16 ms by default)"
                        .to_owned(),
            });
        }
        let (held_up, times) = HELD_UP;
        if self.max_ms > held_up.as_secs_f64() * 1e3 && self.max_ms > times * self.median_ms {
            findings.push(Finding {
                device,
                severity: Severity::Warning,
                problem: format!(
                    "one of {} replies took {:.0} ms; the median is {:.1} ms",
                    self.queries, self.max_ms, self.median_ms
                ),
                remedy: "connect the device without a USB hub, close other programs, switch USB power saving off"
                    .to_owned(),
            });
        }
    }
}

impl fmt::Display for Latency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { min_ms, median_ms, max_ms, queries, distribution } = self;
        write!(
            f,
            "{median_ms:.2} ms (of {queries}: {min_ms:.2} ▕{}▏ {max_ms:.2}; 95 % within {:.2})",
            distribution.columns(),
            distribution.p95_ms
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latency_is_that_of_the_middle_reply() {
        let latency = Latency::of([9, 1, 2].map(Duration::from_millis).to_vec());
        assert_eq!((latency.min_ms, latency.median_ms, latency.max_ms), (1.0, 2.0, 9.0));
        assert_eq!(latency.queries, 3);
        let mut findings = Vec::new();
        latency.judge(Role::Robot, &mut findings);
        assert!(findings.is_empty());
        Latency::of([1, 2, 150].map(Duration::from_millis).to_vec())
            .judge(Role::Robot, &mut findings);
        assert!(findings[0].problem.contains("took 150 ms"), "{findings:?}");
    }
}
