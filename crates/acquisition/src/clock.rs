//! The time that stands in a record: seconds since the scan was begun.

use jiff::Timestamp;

/// When scans on virtual rigs begin: they have a clock but no calendar, and the same seed must leave the same bytes.
const VIRTUAL_EPOCH: &str = "2026-01-01T00:00:00Z";

/// Turns the receiver's clock into the scan's.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScanClock {
    /// What is added to the receiver's time, seconds, once the first reading has told it.
    offset_s: Option<f64>,
    /// The scan's time at the last reading, or where it begins, seconds.
    at_s: f64,
}

impl ScanClock {
    /// A scan that begins with its first reading.
    pub(super) fn from_start() -> Self {
        Self::from(0.0)
    }

    /// A scan that goes on, its next reading at `begins_at_s`.
    pub(super) fn from(begins_at_s: f64) -> Self {
        Self { offset_s: None, at_s: begins_at_s }
    }

    /// The scan's time of an instant on the receiver's clock, seconds, to the microsecond that receivers count in.
    ///
    /// A receiver's clock that wraps or restarts does not take the scan's back with it: time goes on from the last reading.
    pub(super) fn at(&mut self, receiver_s: f64) -> f64 {
        let anchored = self.offset_s.filter(|offset_s| receiver_s + offset_s >= self.at_s);
        let offset_s = anchored.unwrap_or(self.at_s - receiver_s);
        self.offset_s = Some(offset_s);
        self.at_s = receiver_s + offset_s;
        (self.at_s * 1e6).round() / 1e6
    }
}

/// When a scan begins.
pub(super) fn begins(on_virtual_rig: bool) -> Timestamp {
    if on_virtual_rig {
        VIRTUAL_EPOCH.parse().expect("the epoch is a date")
    } else {
        let now = Timestamp::now();
        // Whole seconds: what a person writes down and reads back.
        now.round(jiff::Unit::Second).unwrap_or(now)
    }
}

/// The scan's time at which it goes on after an interruption: on a real rig by the calendar, on a virtual one a second
/// after its last reading.
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
    fn the_scan_begins_with_its_first_reading() {
        let mut clock = ScanClock::from_start();
        assert_eq!(clock.at(12.5), 0.0);
        assert_eq!(clock.at(14.0), 1.5);
    }

    #[test]
    fn a_receiver_that_restarts_does_not_take_time_back() {
        let mut clock = ScanClock::from_start();
        assert_eq!([4294.0, 4294.5, 0.2, 0.7].map(|t| clock.at(t)), [0.0, 0.5, 0.5, 1.0]);
    }

    #[test]
    fn a_scan_that_goes_on_never_runs_backwards() {
        let mut clock = ScanClock::from(goes_on_at_s(Timestamp::now(), 40.0, false));
        assert!(clock.at(0.3) >= 41.0);
        assert!(clock.at(0.4) > 41.0);
    }
}
