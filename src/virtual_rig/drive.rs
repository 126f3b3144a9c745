//! What the array emits: the delays it was told, whether it is on, and the modulation.

use std::collections::VecDeque;

/// Drives that are remembered, for samples taken a little late.
const REMEMBERED_DRIVES: usize = 256;

/// The state of the array's outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Whether it emits.
    pub emitting: bool,
    /// The delay of each channel, seconds; `None`: that channel is silent.
    pub delays_s: Vec<Option<f64>>,
    /// Share of time that the modulation leaves on, 0 to 1.
    pub duty: f64,
}

impl Drive {
    /// As at power-up: off, no delays, no modulation.
    pub fn silent(elements: usize) -> Self {
        Self { emitting: false, delays_s: vec![Some(0.0); elements], duty: 1.0 }
    }
}

/// The drives in the order in which they took effect.
#[derive(Debug)]
pub(super) struct DriveHistory {
    drives: VecDeque<(f64, Drive)>,
    forgotten: u64,
}

impl DriveHistory {
    /// A history that begins with a drive.
    pub fn new(first: Drive) -> Self {
        Self { drives: VecDeque::from([(0.0, first)]), forgotten: 0 }
    }

    /// From `time_s` on this drive is in effect.
    pub fn push(&mut self, time_s: f64, drive: Drive) {
        self.drives.push_back((time_s, drive));
        if self.drives.len() > REMEMBERED_DRIVES {
            self.drives.pop_front();
            self.forgotten += 1;
        }
    }

    /// The drive in effect at `time_s`, and a number that no other drive of this history has.
    pub fn at(&self, time_s: f64) -> (u64, &Drive) {
        let index = self.drives.partition_point(|&(since_s, _)| since_s <= time_s).max(1) - 1;
        (self.forgotten + index as u64, &self.drives[index].1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_drive_is_in_effect_until_the_next() {
        let mut history = DriveHistory::new(Drive::silent(1));
        history.push(2.0, Drive { emitting: true, ..Drive::silent(1) });
        assert!(!history.at(1.9).1.emitting);
        assert!(history.at(2.0).1.emitting);
        for i in 0..1000 {
            history.push(3.0 + f64::from(i), Drive::silent(1));
        }
        assert!(history.at(1002.5).0 > history.at(999.0).0);
    }
}
