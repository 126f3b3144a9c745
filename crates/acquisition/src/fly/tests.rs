//! Rows at constant speed in real time, so that what a driver waits for moves the samples: on the virtual rig, whose places are known.

use std::path::Path;
use std::time::Duration;

use async_trait::async_trait;

use super::*;
use crate::clock::ScanClock;
use fieldgap_input::{Positive, TomlSource};
use fieldgap_records::{FocusSection, PlanPart, VisitKind, VisitPace};
use fieldgap_rig::focus_array::{Modulation, ThesisArray};
use fieldgap_rig::link::Wire;
use fieldgap_rig::motion::grbl::Grbl;
use fieldgap_rig::motion::guarded::Guarded;
use fieldgap_rig::motion::marlin::Marlin;
use fieldgap_rig::receiver::{Encoding, StreamReceiver};
use fieldgap_rig::{Device, Emergency, Motion, RigError, RobotPosition, Role};
use fieldgap_virtual_rig::memory::MemoryRig;
use fieldgap_virtual_rig::{Believed, Pace, Truth, VirtualConfig};

/// No noise, and readings within the range of the converter.
const TRUTH: &str = "[microphone]\nsensitivity_v_pa = 0.002\n";

/// The section of a rig file that the virtual rig reads.
#[derive(serde::Deserialize)]
struct Sections {
    #[serde(rename = "virtual")]
    virtual_rig: VirtualConfig,
}

fn rig_setup(file: &str) -> RigSetup {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs").join(file);
    RigSetup::parse(TomlSource::read(&path).expect("it is there")).expect("a rig file")
}

/// Powers up the virtual rig of a rig file, in the time of the test, with further keys of `[virtual]`.
fn power_up(rig_setup: &RigSetup, more: &str) -> MemoryRig {
    let sections: Sections = rig_setup.source().parse().expect("a [virtual] section");
    let answers = toml::from_str(more).expect("valid");
    let config = VirtualConfig {
        pace: Pace::Times(Positive::new(1.0).expect("above zero")),
        answers,
        ..sections.virtual_rig
    };
    let believed = Believed {
        array: rig_setup.nominal_array().clone(),
        medium: rig_setup.nominal_medium(),
        frequency_hz: rig_setup.array.frequency_hz(),
        array_origin_m: rig_setup.rig.motion.frame().origin_m,
    };
    let truth = Truth::from_source(&TomlSource::new(Path::new("truth.toml"), TRUTH));
    MemoryRig::power_up(&config, truth.expect("no noise"), &believed).expect("it powers up")
}

/// A robot that reports every fifth arrival late, as behind a busy computer.
struct Stalling {
    robot: Box<dyn Motion>,
    moves: usize,
}

#[async_trait]
impl Motion for Stalling {
    fn device(&self) -> &Device {
        self.robot.device()
    }

    fn firmware(&self) -> &str {
        self.robot.firmware()
    }

    async fn home(&mut self) -> Result<RobotPosition, RigError> {
        self.robot.home().await
    }

    async fn move_to(&mut self, to: RobotPosition, feed: Feed) -> Result<RobotPosition, RigError> {
        let at = self.robot.move_to(to, feed).await;
        self.moves += 1;
        if self.moves.is_multiple_of(5) {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        at
    }

    async fn position(&mut self) -> Result<RobotPosition, RigError> {
        self.robot.position().await
    }

    async fn stop(&mut self) -> Result<(), RigError> {
        self.robot.stop().await
    }

    fn emergency(&self) -> Option<Emergency> {
        self.robot.emergency()
    }
}

async fn open(rig_setup: &RigSetup, memory: &MemoryRig, grbl: bool, stalls: bool) -> SafeRig {
    let [robot, receiver, array] = memory.plugs();
    let wire = |plug, role| Wire::numbered(plug, Device::new(role, "memory"), 1);
    let modulation = Modulation { frequency_hz: 200.0, duty_percent: 50.0 };
    let array = ThesisArray::begin(wire(array, Role::FocusArray), modulation).await;
    let receiver = StreamReceiver::begin(wire(receiver, Role::Receiver), Encoding::Binary).await;
    let motion = &rig_setup.rig.motion;
    let robot = wire(robot, Role::Robot);
    let defaults = "every key has a default";
    let robot: Box<dyn Motion> = if grbl {
        let config = toml::from_str("").expect(defaults);
        let robot = Grbl::begin(robot, &config, motion.envelope(), motion.feed()).await;
        Box::new(robot.expect("it opens"))
    } else {
        let config = toml::from_str("").expect(defaults);
        Box::new(Marlin::begin(robot, &config).await.expect("it opens"))
    };
    let robot = match stalls {
        true => Box::new(Stalling { robot, moves: 0 }),
        false => robot,
    };
    let robot = Guarded::new(robot, motion.envelope(), motion.position_tolerance_m());
    let mut rig = SafeRig::new(
        Box::new(robot),
        Box::new(receiver.expect("it opens")),
        Box::new(array.expect("it opens")),
    );
    rig.array().continuous_wave().await.expect("it answers");
    rig.motion().home().await.expect("it homes");
    rig
}

/// A row of 36 points across the focus.
fn row() -> Vec<Visit> {
    (0..36)
        .map(|n| Visit {
            kind: VisitKind::Point,
            focus: Some(0),
            position_m: Vec3::new(f64::from(n) * 2e-3 - 35e-3, -22.5e-3, 0.1),
            pace: VisitPace::OfPlan,
            part: PlanPart::Region(0),
        })
        .collect()
}

/// Flies the row in both directions at this speed. Returns the largest difference from the readings at standstill, as a share
/// of the strongest, and the spread of the durations, s.
async fn off_by(rig_file: &str, speed_mm_s: f64, answers: &str, stalls: bool) -> (f64, f64) {
    let rig_setup = rig_setup(rig_file);
    let memory = power_up(&rig_setup, answers);
    let mut rig = open(&rig_setup, &memory, rig_file.contains("grbl"), stalls).await;
    let foci = [FocusSection::Point(Vec3::new(17.5, -22.5, 100.0))];
    let mut sequencer = PointSequencer::new(&rig_setup, &foci, ScanClock::from_start());
    let fly: Fly = toml::from_str(&format!("speed_mm_s = {speed_mm_s}")).expect("valid");
    let mut flights = Flights::new(Flight::new(&fly, &rig_setup));
    let row = row();
    let back: Vec<Visit> = row.iter().rev().copied().collect();
    flights.find_lag(&mut sequencer, &mut rig, &row).await.expect("the lag is found");
    let mut flown = Vec::new();
    for _ in 0..2 {
        for row in [&row, &back] {
            flown.extend(flights.measure(&mut sequencer, &mut rig, row).await.expect("it flies"));
        }
    }
    let mut stopped = Vec::new();
    for visit in &row {
        stopped.push(sequencer.measure(&mut rig, visit).await.expect("it reads"));
    }
    let strongest = stopped.iter().map(|point| point.sample.reading).fold(0.0, f64::max);
    let off = flown.iter().map(|point| {
        let is_there = |other: &&Measurement| distance_mm(&point.sample, &other.sample) < 0.02;
        let other = stopped.iter().find(is_there).expect("the same place");
        assert_eq!(point.lost, 0);
        (point.sample.reading - other.sample.reading).abs()
    });
    let off = off.fold(0.0, f64::max) / strongest;
    let over_s = &flights.over_s;
    let spread_s = over_s.iter().fold(0.0, |most: f64, s| most.max(*s))
        - over_s.iter().fold(f64::INFINITY, |least, s| least.min(*s));
    (off, spread_s)
}

fn distance_mm(one: &RecordedSample, other: &RecordedSample) -> f64 {
    (one.position_mm - other.position_mm).norm()
}

/// 40 mm/s: a row takes longer than the driver otherwise waits in silence. 90 mm/s: less.
#[tokio::test(start_paused = true)]
async fn rows_on_grbl_and_marlin_read_in_motion_what_they_read_at_standstill() {
    for rig_file in ["virtual-grbl.toml", "virtual.toml"] {
        for speed_mm_s in [40.0, 90.0] {
            let (off, spread_s) = off_by(rig_file, speed_mm_s, "", false).await;
            // The slope of the focus is 0.1 of its level per millimetre: 0.01 is 0.1 mm.
            assert!(off < 0.01, "{rig_file} at {speed_mm_s} mm/s: {off}");
            assert!(spread_s < 2e-3, "{rig_file} at {speed_mm_s} mm/s: {spread_s} s");
        }
    }
}

/// A report of GRBL takes 4.5 ms at 115200 Bd, and a USB adapter 1 to 3 ms more.
#[tokio::test(start_paused = true)]
async fn rows_are_located_although_answers_take_their_time() {
    for rig_file in ["virtual-grbl.toml", "virtual.toml"] {
        let answers = "robot = { delay_ms = [5.5, 7.5] }\nreceiver = { delay_ms = [1, 1] }";
        let (off, spread_s) = off_by(rig_file, 90.0, answers, false).await;
        // Two answers, each up to 2 ms late, shift a row by up to half of it, 0.18 mm, and as much by the lag.
        assert!(off < 0.05, "{rig_file}: {off}");
        assert!(spread_s < 8e-3, "{rig_file}: {spread_s} s");
    }
}

/// A stall shifts a pass by half of its 50 ms: 2.3 mm at 90 mm/s.
#[tokio::test(start_paused = true)]
async fn a_pass_that_something_delayed_is_flown_again() {
    for rig_file in ["virtual-grbl.toml", "virtual.toml"] {
        let (off, spread_s) = off_by(rig_file, 90.0, "", true).await;
        assert!(off < 0.01, "{rig_file}: {off}");
        assert!(spread_s < 2e-3, "{rig_file}: {spread_s} s");
    }
}
