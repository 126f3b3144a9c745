//! Scans with noise on the robot's line: whole lines are lost, damaged or doubled in both directions, and each place that a
//! driver reports is compared with the true place of the nozzle.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use fieldgap_acoustics::{Array, Medium, Vec3};
use fieldgap_input::{Positive, TomlSource};
use fieldgap_rig::link::Wire;
use fieldgap_rig::link::fault_injection::{FaultRates, with_faults};
use fieldgap_rig::motion::grbl::{Grbl, GrblConfig};
use fieldgap_rig::motion::guarded::Guarded;
use fieldgap_rig::motion::marlin::{Marlin, MarlinConfig};
use fieldgap_rig::travel::AxisBox;
use fieldgap_rig::{Cause, Device, Envelope, Feed, Motion, RigError, RobotPosition, Role};
use fieldgap_virtual_rig::memory::MemoryRig;
use fieldgap_virtual_rig::{Believed, Truth, VirtualConfig};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex, split};

/// What a rig file allows by default, m.
const TOLERANCE_M: f64 = 0.05e-3;

/// How long a reading takes.
const READING: Duration = Duration::from_millis(50);

/// The robots, by their firmware.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Robot {
    Marlin,
    Grbl,
    GrblHal,
}

impl Robot {
    const ALL: [Self; 3] = [Self::Marlin, Self::Grbl, Self::GrblHal];

    fn firmware(self) -> &'static str {
        match self {
            Self::Marlin => "marlin",
            Self::Grbl => "grbl",
            Self::GrblHal => "grblhal",
        }
    }

    /// The robot's zero, from its switches, mm.
    fn zero_mm(self) -> Vec3 {
        match self {
            Self::Marlin => Vec3::zeros(),
            Self::Grbl | Self::GrblHal => Vec3::new(300.0, 300.0, 250.0),
        }
    }

    fn envelope(self) -> Envelope {
        let travel_m = Vec3::new(0.3, 0.3, 0.25);
        let least_m = -self.zero_mm() * 1e-3;
        let largest_m = least_m + travel_m;
        let travel = AxisBox { least_m: least_m.into(), largest_m: largest_m.into() };
        Envelope { travel, keep_out: Vec::new() }
    }

    async fn open(
        self,
        wire: Wire<impl fieldgap_rig::link::ByteLink>,
    ) -> Result<Guarded, RigError> {
        let robot: Box<dyn Motion> = match self {
            Self::Marlin => Box::new(Marlin::begin(wire, &MarlinConfig::default()).await?),
            Self::Grbl | Self::GrblHal => {
                Box::new(Grbl::begin(wire, &GrblConfig::default(), self.envelope(), feed()).await?)
            }
        };
        Ok(Guarded::new(robot, self.envelope(), TOLERANCE_M))
    }
}

fn feed() -> Feed {
    Feed::from_mm_s(Positive::new(80.0).expect("above zero"))
}

/// A share of all lines is damaged: a third of them is lost, a third has one bit inverted, a third comes twice.
fn noise(share: f64) -> FaultRates {
    let each = share / 3.0;
    toml::from_str(&format!("lose = {each}\nflip = {each}\ndouble = {each}")).expect("rates")
}

fn power_up(robot: Robot) -> MemoryRig {
    let text = format!(
        "seed = 1\npace = {{ times = 1.0 }}\ntruth = \"t\"\n[robot]\nfirmware = \"{}\"\nacceleration_mm_s2 = 1000.0\n",
        robot.firmware()
    );
    let config: VirtualConfig = toml::from_str(&text).expect("a virtual rig");
    let believed = Believed {
        array: Array::square(2, 2, 10.5e-3).expect("not empty"),
        medium: Medium { speed_of_sound_m_s: 343.0 },
        frequency_hz: 40e3,
        array_origin_m: Vec3::zeros(),
    };
    let truth = Truth::from_source(&TomlSource::new(Path::new("truth.toml"), ""));
    MemoryRig::power_up(&config, truth.expect("no effect"), &believed).expect("it powers up")
}

/// Where a scan goes, from the switches, mm: rows there and back, on planes.
fn places_mm(points: usize) -> impl Iterator<Item = Vec3> {
    (0..points).map(|point| {
        let (along, row, plane) = (point % 10, point / 10 % 10, point / 100);
        let along = if row % 2 == 0 { along } else { 9 - along };
        Vec3::new(120.0 + 7.3 * along as f64, 110.0 + 8.15 * row as f64, 60.0 + 21.7 * plane as f64)
    })
}

/// Scans so many points; the points that were reached, and the error that ended it.
async fn scan(
    robot: Robot,
    seed: u64,
    rates: FaultRates,
    points: usize,
) -> (usize, Option<RigError>) {
    let memory = power_up(robot);
    let [plug, ..] = memory.plugs();
    let wire = Wire::new(with_faults(plug, rates, seed), Device::new(Role::Robot, "memory"));
    let mut reached = 0;
    let error = match robot.open(wire).await {
        Ok(mut motion) => scan_on(robot, &memory, &mut motion, points, &mut reached).await.err(),
        Err(error) => Some(error),
    };
    (reached, error)
}

async fn scan_on(
    robot: Robot,
    memory: &MemoryRig,
    motion: &mut Guarded,
    points: usize,
    reached: &mut usize,
) -> Result<(), RigError> {
    motion.home().await?;
    // Over the plane, then across.
    let high_mm = Vec3::new(5.0, 5.0, 240.0);
    for place_mm in std::iter::once(high_mm).chain(places_mm(points)) {
        let target_mm = place_mm - robot.zero_mm();
        motion.move_to(RobotPosition::from_axes_mm(target_mm.into()), feed()).await?;
        let true_place_is_right = || {
            let true_mm = memory.world.nozzle_m(memory.clock.now_s()) * 1e3;
            let off_mm = (true_mm - target_mm).norm();
            assert!(off_mm < 0.1, "{robot:?}: reported at {target_mm:?}, and it is at {true_mm:?}");
        };
        true_place_is_right();
        tokio::time::sleep(READING).await;
        true_place_is_right();
        *reached += 1;
    }
    Ok(())
}

/// How scans ended.
#[derive(Debug, Default)]
struct Ends {
    scans: usize,
    completed: usize,
    /// What ended the others: the messages, with the points before.
    errors: Vec<(usize, RigError)>,
}

/// Makes scans one after the other.
async fn scans(robot: Robot, scans: u64, rates: FaultRates, points: usize) -> Ends {
    let mut ends = Ends::default();
    for seed in 0..scans {
        let (reached, error) = scan(robot, seed, rates, points).await;
        ends.scans += 1;
        match error {
            None => ends.completed += 1,
            Some(error) => ends.errors.push((reached, error)),
        }
    }
    ends
}

/// Whether an error is of those that a protocol without checksums cannot prevent: a digit 1 became the command to hold, a feed
/// became too slow, or an alarm was lost or came without its reason.
fn is_unavoidable(error: &RigError) -> bool {
    match error.cause() {
        Cause::Paused { state } => state == "hold",
        Cause::StillMoving | Cause::Silent { .. } => true,
        Cause::Alarm { reply, .. } => reply == "Alarm",
        _ => false,
    }
}

#[tokio::test(start_paused = true)]
async fn without_noise_every_scan_is_completed() {
    for robot in Robot::ALL {
        let ends = scans(robot, 1, noise(0.0), 500).await;
        assert_eq!(ends.completed, 1, "{robot:?}: {:?}", ends.errors);
    }
}

/// Of a hundred scans, each with a share of all lines damaged, so many are completed at least: four standard deviations less than were
/// counted, as docs/devices has them. The largest share is far more than any line in use has: rare combinations of damage come about.
async fn completed_or_ended_by_damage_that_is_named(robot: Robot, at_least: [(f64, usize); 3]) {
    for (share, least) in at_least {
        let ends = scans(robot, 100, noise(share), 500).await;
        println!("{robot:?}, {share} of all lines: {} of 100 completed", ends.completed);
        assert!(ends.completed >= least, "{robot:?}, {share}: {:?}", ends.errors);
        let unexplained = ends.errors.iter().find(|(_, error)| !is_unavoidable(error));
        assert!(share > 0.05 || unexplained.is_none(), "{robot:?}, {share}: {unexplained:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn scans_by_marlin_on_noisy_lines() {
    let at_least = [(0.01, 95), (0.05, 95), (0.15, 57)];
    completed_or_ended_by_damage_that_is_named(Robot::Marlin, at_least).await;
}

#[tokio::test(start_paused = true)]
async fn scans_by_grbl_on_noisy_lines() {
    let at_least = [(0.01, 92), (0.05, 67), (0.15, 20)];
    completed_or_ended_by_damage_that_is_named(Robot::Grbl, at_least).await;
}

#[tokio::test(start_paused = true)]
async fn scans_by_grblhal_on_noisy_lines() {
    let at_least = [(0.01, 92), (0.05, 65), (0.15, 20)];
    completed_or_ended_by_damage_that_is_named(Robot::GrblHal, at_least).await;
}

/// Bursts replace the rest of a line and its end by random bytes; lines come late, and answers that nobody sent.
#[tokio::test(start_paused = true)]
async fn bursts_and_late_lines_cause_no_wrong_place() {
    for robot in Robot::ALL {
        let rates =
            toml::from_str("garble = 0.004\ndelay = 0.004\nwrong_ok = 0.004").expect("rates");
        let ends = scans(robot, 20, rates, 200).await;
        assert!(ends.completed >= 10, "{robot:?}: {:?}", ends.errors);
    }
}

/// A link on which each of these texts is replaced once, on its way to the device.
fn with_replaced(
    link: impl fieldgap_rig::link::ByteLink,
    replaced: Arc<Mutex<Vec<(&'static str, &'static str)>>>,
) -> DuplexStream {
    let (near, far) = duplex(4096);
    let (mut from_host, mut to_host) = split(far);
    let (mut from_device, mut to_device) = split(link);
    tokio::spawn(async move {
        let down = async {
            let mut bytes = vec![0; 4096];
            loop {
                let count = from_host.read(&mut bytes).await?;
                if count == 0 {
                    return Ok::<_, std::io::Error>(());
                }
                let mut text = String::from_utf8_lossy(&bytes[..count]).into_owned();
                replaced.lock().expect("no panic").retain(|(good, damaged)| {
                    let here = text.contains(good);
                    text = text.replacen(good, damaged, 1);
                    !here
                });
                to_device.write_all(text.as_bytes()).await?;
            }
        };
        tokio::select! {
            ended = down => ended,
            ended = tokio::io::copy(&mut from_device, &mut to_host) => ended.map(drop),
        }
    });
    near
}

/// A place out of the firmware's travel locks it. The command that unlocks it becomes the one that homes, which is then ended
/// by a reset: the firmware's place is lost.
#[tokio::test(start_paused = true)]
async fn an_unlock_that_became_homing_gives_no_wrong_place() {
    for robot in [Robot::Grbl, Robot::GrblHal] {
        let memory = power_up(robot);
        let [plug, ..] = memory.plugs();
        let replaced = vec![("G90G94G53G1X-160", "G91G94G53G1X-160"), ("$X", "$H")];
        let replaced = Arc::new(Mutex::new(replaced));
        let link = with_replaced(plug, Arc::clone(&replaced));
        let wire = Wire::new(link, Device::new(Role::Robot, "memory"));
        let mut motion = robot.open(wire).await.expect("no damage yet");
        motion.home().await.expect("no damage yet");
        let before = RobotPosition::from_axes_mm([-150.0, -200.0, -100.0]);
        motion.move_to(before, feed()).await.expect("no damage yet");
        let target_mm = Vec3::new(-160.0, -200.0, -100.0);
        let target = RobotPosition::from_axes_mm(target_mm.into());
        if motion.move_to(target, feed()).await.is_ok() {
            let true_mm = memory.world.nozzle_m(memory.clock.now_s()) * 1e3;
            assert!((true_mm - target_mm).norm() < 0.1, "{robot:?} is at {true_mm:?}");
        }
        assert!(replaced.lock().expect("no panic").is_empty(), "both lines were damaged");
    }
}
