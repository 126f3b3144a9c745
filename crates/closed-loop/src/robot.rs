//! What a reading costs: the time of this robot, this receiver and this array.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use fieldgap_acoustics::Vec3;
use fieldgap_acquisition::{RigSetup, move_s, reading_s};
use fieldgap_rig::{Envelope, Frame};

/// One reading to take: place, m, and drive; `None` with the array silent.
pub type Planned = (Vec3, Option<usize>);

/// The times of a rig, and where its robot may go.
#[derive(Debug)]
pub struct Robot {
    envelope: Envelope,
    frame: Frame,
    feed_m_s: f64,
    reading_s: f64,
    free: Mutex<HashMap<[u64; 6], bool>>,
}

impl Robot {
    /// The robot of a rig file.
    pub fn of(rig_setup: &RigSetup) -> Self {
        let motion = &rig_setup.rig.motion;
        Self {
            envelope: motion.envelope(),
            frame: motion.frame(),
            feed_m_s: motion.feed().m_s(),
            reading_s: reading_s(rig_setup),
            free: Mutex::default(),
        }
    }

    /// Time of a reading with its settling, s.
    pub fn reading_s(&self) -> f64 {
        self.reading_s
    }

    /// Time of a move from standstill to standstill, s.
    pub fn move_s(&self, from_m: Vec3, to_m: Vec3) -> f64 {
        let distance_m = (to_m - from_m).norm();
        if distance_m == 0.0 { 0.0 } else { move_s(distance_m, self.feed_m_s) }
    }

    /// Time of some readings one after another, from a place, s.
    pub fn duration_s(&self, from_m: Vec3, readings: &[Planned]) -> f64 {
        let mut at_m = from_m;
        let each = readings.iter().map(|(to_m, _)| {
            let took_s = self.move_s(at_m, *to_m) + self.reading_s();
            at_m = *to_m;
            took_s
        });
        each.sum()
    }

    /// Whether the robot can stand at a place.
    pub fn reaches(&self, at_m: Vec3) -> bool {
        self.envelope.check_target(self.frame.to_robot(at_m)).is_ok()
    }

    /// Whether the straight way from one place to another is free.
    pub fn is_free(&self, from_m: Vec3, to_m: Vec3) -> bool {
        let key = [from_m.x, from_m.y, from_m.z, to_m.x, to_m.y, to_m.z].map(f64::to_bits);
        let check = || {
            let [from, to] = [from_m, to_m].map(|at_m| self.frame.to_robot(at_m));
            self.envelope.check_path(from, to).is_ok()
        };
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        *free.entry(key).or_insert_with(check)
    }

    /// Where the robot stands after homing, array frame, m.
    pub fn home_m(&self) -> Vec3 {
        let home = fieldgap_rig::RobotPosition::from_axes_m(self.envelope.travel.least_m);
        self.frame.to_array(home)
    }
}
