//! The time in a record: seconds since the scan started.

use jiff::Timestamp;

/// Start of every scan on a virtual rig: the same seed must give the same bytes.
const VIRTUAL_EPOCH: &str = "2026-01-01T00:00:00Z";

/// Converts the receiver's clock to scan time.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScanClock {
    /// Scan time minus receiver time, s; known from the first reading on.
    offset_s: Option<f64>,
    /// Scan time of the last reading, or of the start, s.
    at_s: f64,
}

impl ScanClock {
    /// For a scan that starts with its first reading.
    pub(super) fn from_start() -> Self {
        Self::from(0.0)
    }

    /// For a resumed scan, whose next reading is at `begins_at_s`.
    pub(super) fn from(begins_at_s: f64) -> Self {
        Self { offset_s: None, at_s: begins_at_s }
    }

    /// Scan time of an instant on the receiver's clock, s, rounded to microseconds.
    ///
    /// If the receiver's clock wraps or restarts, scan time continues from the last reading.
    pub(super) fn at(&mut self, receiver_s: f64) -> f64 {
        let anchored = self.offset_s.filter(|offset_s| receiver_s + offset_s >= self.at_s);
        let offset_s = anchored.unwrap_or(self.at_s - receiver_s);
        self.offset_s = Some(offset_s);
        self.at_s = receiver_s + offset_s;
        (self.at_s * 1e6).round() / 1e6
    }
}

/// Start of a scan: now, to whole seconds.
pub(super) fn begins(on_virtual_rig: bool) -> Timestamp {
    if on_virtual_rig {
        VIRTUAL_EPOCH.parse().expect("the epoch is a date")
    } else {
        let now = Timestamp::now();
        now.round(jiff::Unit::Second).unwrap_or(now)
    }
}

/// Scan time at which an interrupted scan resumes, s. On a real rig it follows the calendar; on a virtual rig it is one
/// second after the last reading.
pub(super) fn goes_on_at_s(recorded: Timestamp, last_reading_s: f64, on_virtual_rig: bool) -> f64 {
    let pause_is_over_s = last_reading_s + 1.0;
    if on_virtual_rig {
        pause_is_over_s
    } else {
        Timestamp::now().duration_since(recorded).as_secs_f64().max(pause_is_over_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scan_time_starts_with_the_first_reading() {
        let mut clock = ScanClock::from_start();
        assert_eq!(clock.at(12.5), 0.0);
        assert_eq!(clock.at(14.0), 1.5);
    }

    #[test]
    fn scan_time_never_decreases_when_the_receiver_restarts() {
        let mut clock = ScanClock::from_start();
        assert_eq!([4294.0, 4294.5, 0.2, 0.7].map(|t| clock.at(t)), [0.0, 0.5, 0.5, 1.0]);
    }

    #[test]
    fn a_resumed_scan_never_runs_backwards() {
        let mut clock = ScanClock::from(goes_on_at_s(Timestamp::now(), 40.0, false));
        assert!(clock.at(0.3) >= 41.0);
        assert!(clock.at(0.4) > 41.0);
    }
}
