//! Detection rates of a thousand swipes over the controller's protocol.

use std::path::Path;
use std::sync::{Arc, Mutex};

use fieldgap::acoustics::{Array, Medium, Vec3};
use fieldgap::input::TomlSource;
use fieldgap::rig::Sensed;
use fieldgap::sensing::{Direction, Swipe, SwipeDetector};
use fieldgap::virtual_rig::array_firmware::ArrayFirmware;
use fieldgap::virtual_rig::firmware::Firmware;
use fieldgap::virtual_rig::gestures::Gesture;
use fieldgap::virtual_rig::trajectory::Trajectory;
use fieldgap::virtual_rig::{Believed, Clock, Pace, Truth, World};

const RATE_HZ: f64 = 250.0;
const ELEMENTS: [usize; 4] = [17, 15, 9, 11];

/// The world of `rigs/truth/hand.toml` with a replacement, and a two-ring display.
fn display(from: &str, to: &str, seed: u64) -> (ArrayFirmware, Arc<World>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/truth/hand.toml");
    let text = std::fs::read_to_string(&path).expect("the truth file is there");
    assert!(text.contains(from), "{from}");
    let truth = Truth::from_source(&TomlSource::new(&path, text.replace(from, to))).expect("valid");
    let believed = Believed {
        array: Array::hexagonal(2, 10.5e-3),
        medium: Medium { speed_of_sound_m_s: 343.0 },
        frequency_hz: 40e3,
        array_origin_m: Vec3::zeros(),
    };
    let trajectory = Arc::new(Mutex::new(Trajectory::new(Vec3::zeros(), Vec3::repeat(300.0))));
    let clock = Arc::new(Clock::new(Pace::Lockstep));
    let world = World::new(&believed, truth, seed, trajectory, clock).expect("it fits");
    let world = Arc::new(world);
    (ArrayFirmware::new(19, 40e3, world.clone()), world)
}

/// Swipes detected until `until_s`, from the lines of the wire only.
fn detected(firmware: &mut ArrayFirmware, until_s: f64) -> Vec<Swipe> {
    let mut detector = SwipeDetector::new(RATE_HZ);
    let mut out = Vec::new();
    let listen = format!(
        "2 sense {RATE_HZ} {} {} {} {}",
        ELEMENTS[0], ELEMENTS[1], ELEMENTS[2], ELEMENTS[3]
    );
    for body in ["1 on", &listen] {
        let line = format!("{body}*{:08x}\n", crc32fast::hash(body.as_bytes()));
        line.bytes().for_each(|byte| firmware.receive(byte, 0.0));
    }
    let mut swipes = Vec::new();
    for second in 0..=until_s.ceil() as u64 {
        firmware.step(second as f64, &mut out);
        for line in String::from_utf8(std::mem::take(&mut out)).expect("text").lines() {
            if let Some(sensed) = Sensed::decode(line) {
                let volts = sensed.volts.try_into().expect("four elements");
                swipes.extend(detector.take(sensed.t_us as f64 * 1e-6, volts));
            }
        }
    }
    swipes
}

/// Detection counts.
#[derive(Debug, Default)]
struct Rates {
    right: usize,
    missed: usize,
    wrong_way: usize,
    /// Detected without a swipe, or twice.
    false_ones: usize,
}

fn rates(from: &str, to: &str, seed: u64, gestures: usize) -> Rates {
    let (mut firmware, world) = display(from, to, seed);
    let mut until_s = 10.0;
    while world.swipes_until(until_s).len() <= gestures {
        until_s *= 1.1;
    }
    let truth: Vec<_> = world.swipes_until(until_s).into_iter().take(gestures).collect();
    let last_s = truth.last().expect("there are some").ends_s + 0.7;
    let swipes = detected(&mut firmware, last_s);
    let mut rates = Rates::default();
    let mut matched = vec![false; swipes.len()];
    for gesture in &truth {
        let way = match gesture.kind {
            Gesture::Left => Some(Direction::Left),
            Gesture::Right => Some(Direction::Right),
            Gesture::Push => None,
        };
        let overlaps =
            |swipe: &Swipe| swipe.came_s < gesture.ends_s && swipe.went_s > gesture.begins_s;
        let first = (0..swipes.len()).find(|&n| !matched[n] && overlaps(&swipes[n]));
        match (way, first) {
            (None, _) => {}
            (Some(_), None) => rates.missed += 1,
            (Some(way), Some(n)) => {
                matched[n] = true;
                if swipes[n].direction == way { rates.right += 1 } else { rates.wrong_way += 1 }
            }
        }
    }
    rates.false_ones = matched.iter().filter(|matched| !**matched).count();
    rates
}

/// The figures of the documentation for one set; another set is within the same limits.
#[test]
fn nearly_all_of_a_thousand_swipes_are_detected_correctly() {
    let rates = rates("tilt_deg = 8.0", "tilt_deg = 8.0", 2026, 1000);
    println!("{rates:?}");
    assert_eq!(rates.right + rates.missed + rates.wrong_way, 1000);
    assert!(rates.missed <= 15 && rates.wrong_way <= 2 && rates.false_ones <= 2, "{rates:?}");
}

#[test]
fn slow_and_fast_swipes_are_detected_equally_well() {
    for (speed, seed) in [("speed_m_s = [0.1, 0.12]", 11), ("speed_m_s = [0.9, 1.0]", 12)] {
        let rates = rates("speed_m_s = [0.1, 1.0]", speed, seed, 100);
        println!("{speed}: {rates:?}");
        assert!(
            rates.missed <= 4 && rates.wrong_way <= 1 && rates.false_ones <= 1,
            "{speed}: {rates:?}"
        );
    }
}

#[test]
fn without_a_hand_nothing_is_detected() {
    let (mut firmware, _) = display("pause_s = [0.8, 4.0]", "pause_s = [4000.0, 4000.0]", 3);
    assert_eq!(detected(&mut firmware, 1800.0), [], "in half an hour");
}

#[test]
fn a_vertical_movement_is_seldom_taken_for_a_swipe() {
    let rates = rates("drift = 0.05", "drift = 0.05\npushes = 1.0", 5, 150);
    println!("pushes: {rates:?}");
    assert!(rates.false_ones <= 18, "{rates:?}");
}
