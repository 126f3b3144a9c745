//! When and how the hand passes.

use std::sync::{Mutex, PoisonError};

use nalgebra::{Rotation3, Unit};

use super::echo::Plate;
use super::truth::HandTruth;
use crate::counter_rng::CounterRng;
use fieldgap_acoustics::Vec3;

/// Distance from the array's centre at which a hand counts as gone, in addition to its half width, m.
const GONE_M: f64 = 0.15;

/// Height at which a push begins and ends, m.
const HIGH_M: f64 = 0.45;

/// The kind of gesture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gesture {
    /// Towards smaller x.
    Left,
    /// Towards larger x.
    Right,
    /// Down and up again.
    Push,
}

/// One gesture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swipe {
    /// Its kind.
    pub kind: Gesture,
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// When the hand appears, s.
    pub begins_s: f64,
    /// When its middle passes the array's centre, s.
    pub passes_s: f64,
    /// When it is gone, s.
    pub ends_s: f64,
    middle_m: Vec3,
    along: Vec3,
    across: Vec3,
    half_m: [f64; 2],
    reflection: f64,
    tremor: Tremor,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Tremor {
    amplitude_m: f64,
    frequency_hz: f64,
    turns: f64,
}

impl Swipe {
    /// The `number`th gesture, after a pause that begins at `after_s`.
    fn drawn(truth: &HandTruth, rng: CounterRng, number: u64, after_s: f64) -> Self {
        let rng = rng.substream(number);
        let draw = |index: u64| rng.uniform(index);
        let symmetric = |index: u64, most: f64| (2.0 * rng.uniform(index) - 1.0) * most;
        let kind = match (draw(0) < truth.pushes.get(), draw(1) < 0.5) {
            (true, _) => Gesture::Push,
            (false, true) => Gesture::Left,
            (false, false) => Gesture::Right,
        };
        let speed_m_s = truth.speed_m_s.at_logarithm(draw(2));
        let half_m = [truth.width_mm, truth.length_mm].map(|side| 0.5e-3 * side.at(draw(3)));
        let height_m = truth.height_mm.at(draw(4)) * 1e-3;
        let aside_m = symmetric(5, truth.aside_mm.get() * 1e-3);
        let path_m = match kind {
            Gesture::Push => HIGH_M - height_m,
            Gesture::Left | Gesture::Right => half_m[0] + GONE_M,
        };
        let tilt = truth.tilt_deg.get().to_radians();
        let turned =
            Rotation3::from_axis_angle(&Unit::new_unchecked(Vec3::x()), symmetric(6, tilt))
                * Rotation3::from_axis_angle(&Unit::new_unchecked(Vec3::y()), symmetric(7, tilt));
        let begins_s = after_s + truth.pause_s.at(draw(8));
        let passes_s = begins_s + path_m / speed_m_s;
        Self {
            kind,
            speed_m_s,
            begins_s,
            passes_s,
            ends_s: passes_s + path_m / speed_m_s,
            middle_m: Vec3::new(0.0, aside_m, height_m),
            along: turned * Vec3::x(),
            across: turned * Vec3::y(),
            half_m,
            reflection: truth.reflection.at(draw(9)),
            tremor: Tremor {
                amplitude_m: truth.tremor_mm.get() * 1e-3,
                frequency_hz: 8.0 + 4.0 * draw(10),
                turns: draw(11),
            },
        }
    }

    /// The hand at a time, s; `None` where it is absent.
    pub fn plate(&self, time_s: f64) -> Option<Plate> {
        if !(self.begins_s..self.ends_s).contains(&time_s) {
            return None;
        }
        let gone_m = self.speed_m_s * (time_s - self.passes_s);
        let shift_m = match self.kind {
            Gesture::Right => Vec3::x() * gone_m,
            Gesture::Left => -Vec3::x() * gone_m,
            Gesture::Push => Vec3::z() * gone_m.abs(),
        };
        let Tremor { amplitude_m, frequency_hz, turns } = self.tremor;
        let shake_m = amplitude_m * (std::f64::consts::TAU * (frequency_hz * time_s + turns)).sin();
        Some(Plate {
            centre_m: self.middle_m + shift_m + Vec3::z() * shake_m,
            along: self.along,
            across: self.across,
            half_m: self.half_m,
            reflection: self.reflection,
        })
    }
}

/// All gestures, drawn as time proceeds.
#[derive(Debug)]
pub struct Swipes {
    truth: HandTruth,
    rng: CounterRng,
    drawn: Mutex<Vec<Swipe>>,
}

impl Swipes {
    /// The gestures of a seed.
    pub fn new(truth: HandTruth, rng: CounterRng) -> Self {
        Self { truth, rng: rng.stream("hand"), drawn: Mutex::default() }
    }

    /// The gestures that began before a time, s.
    pub fn until(&self, time_s: f64) -> Vec<Swipe> {
        self.at(time_s);
        let drawn = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        drawn.iter().copied().filter(|swipe| swipe.begins_s <= time_s).collect()
    }

    /// The current gesture at a time, s, or the next one.
    pub fn at(&self, time_s: f64) -> Swipe {
        let mut drawn = self.drawn.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            match drawn.last().copied() {
                Some(last) if time_s < last.ends_s => {
                    let place = drawn.partition_point(|swipe| swipe.ends_s <= time_s);
                    return drawn[place];
                }
                last => {
                    let after_s = last.map_or(0.0, |last| last.ends_s);
                    let number = drawn.len() as u64;
                    drawn.push(Swipe::drawn(&self.truth, self.rng, number, after_s));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_comes_passes_the_middle_and_goes_with_pauses_between() {
        let truth = HandTruth::default();
        let swipes = Swipes::new(truth, CounterRng::new(3));
        let all = swipes.until(4000.0);
        assert!(all.len() > 700, "{}", all.len());
        let mut ended_s = 0.0;
        let mut left = 0;
        for swipe in &all {
            let pause_s = swipe.begins_s - ended_s;
            assert!(
                pause_s >= truth.pause_s.least() - 1e-9 && pause_s <= truth.pause_s.most() + 1e-9
            );
            assert!((0.1..=1.0).contains(&swipe.speed_m_s));
            assert_eq!(swipe.plate(swipe.begins_s - 1e-6), None);
            let middle = swipe.plate(swipe.passes_s).expect("it is there");
            assert!(middle.centre_m.x.abs() < 1e-9);
            let later = swipe.plate(swipe.passes_s + 0.05).expect("still there");
            assert!((later.centre_m.x.abs() - 0.05 * swipe.speed_m_s).abs() < 1e-9);
            assert_eq!(later.centre_m.x < 0.0, swipe.kind == Gesture::Left);
            assert!((middle.along.cross(&middle.across).norm() - 1.0).abs() < 1e-12);
            ended_s = swipe.ends_s;
            left += usize::from(swipe.kind == Gesture::Left);
        }
        let share = left as f64 / all.len() as f64;
        assert!((0.44..0.56).contains(&share), "{share}");
        assert_eq!(all, Swipes::new(truth, CounterRng::new(3)).until(4000.0), "the same seed");
        assert_ne!(all, Swipes::new(truth, CounterRng::new(4)).until(4000.0));
    }

    #[test]
    fn a_push_comes_down_and_goes_up() {
        let truth = HandTruth {
            pushes: fieldgap_input::Fraction::new(1.0).expect("whole"),
            ..HandTruth::default()
        };
        let push = Swipes::new(truth, CounterRng::new(1)).at(0.0);
        let height_m = |time_s: f64| push.plate(time_s).expect("there").centre_m.z;
        assert!(height_m(push.begins_s) > 0.4 && height_m(push.passes_s) < 0.13);
        assert!(height_m(push.ends_s - 1e-6) > 0.4);
    }
}
