//! The driver with this firmware over a line that loses and damages bytes.

use std::collections::VecDeque;
use std::time::Duration;

use proptest::prelude::*;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};
use tokio::time::{Instant, sleep_until};

use super::*;
use fieldgap_input::Positive;
use fieldgap_rig::link::Wire;
use fieldgap_rig::motion::grbl::{Grbl, GrblConfig};
use fieldgap_rig::motion::marlin::{Marlin, MarlinConfig};
use fieldgap_rig::travel::AxisBox;
use fieldgap_rig::{Cause, Device, Envelope, Feed, Motion, RigError, RobotPosition, Role};

/// What goes wrong with one line.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Damage {
    /// The line to the firmware never arrives, its end included.
    LoseLine,
    /// The second half of it and its end never arrive.
    LoseTail,
    /// A byte of it is changed.
    Garble,
    /// The answer that begins with this never arrives.
    LoseAnswer(&'static str),
    /// One byte of that answer is changed.
    GarbleAnswer(&'static str),
    /// The board restarts as the line arrives.
    PowerCycle,
    /// Somebody presses hold as the line arrives.
    Hold,
    /// A second after the line has arrived the firmware runs out of steps.
    Starve,
}

/// The firmware behind a line with faults.
struct Board {
    firmware: GrblFirmware,
    link: DuplexStream,
    damage: VecDeque<(&'static str, Damage)>,
    begun: Instant,
    starves: Option<Instant>,
    lines: Arc<Mutex<Vec<String>>>,
}

impl Board {
    fn now_s(&self) -> f64 {
        self.begun.elapsed().as_secs_f64()
    }

    async fn run(mut self) {
        let mut out = Vec::new();
        self.firmware.power_up(self.now_s(), &mut out);
        let mut line = Vec::new();
        let mut bytes = [0; 256];
        loop {
            self.firmware.step(self.now_s(), &mut out);
            if self.say(&mut out).await.is_err() {
                return;
            }
            let wake = self.firmware.wake();
            let until = wake.map(|wake| self.begun + Duration::from_secs_f64(wake.at_s + 1e-6));
            tokio::select! {
                biased;
                read = self.link.read(&mut bytes) => match read {
                    Ok(count) if count > 0 => {
                        for &byte in &bytes[..count] {
                            self.receive(byte, &mut line, &mut out);
                        }
                    }
                    _ => return,
                },
                () = sleep_until(self.starves.unwrap_or_else(Instant::now)), if self.starves.is_some() => {
                    self.starves = None;
                    self.firmware.starve(self.now_s());
                }
                () = sleep_until(until.unwrap_or_else(Instant::now)), if until.is_some() => {}
            }
        }
    }

    /// Bytes that act at once go through; lines are looked at as a whole.
    fn receive(&mut self, byte: u8, line: &mut Vec<u8>, out: &mut Vec<u8>) {
        let now_s = self.now_s();
        if matches!(byte, 0x18 | b'?' | b'!' | b'~' | 0x80..) {
            return self.firmware.receive(byte, now_s);
        }
        line.push(byte);
        if byte != b'\n' {
            return;
        }
        let mut line = std::mem::take(line);
        let text = String::from_utf8_lossy(&line).trim().to_owned();
        self.lines.lock().expect("not poisoned").push(text.clone());
        match self.damage_for(&text) {
            Some(Damage::LoseLine) => return,
            Some(Damage::LoseTail) => line.truncate(line.len() / 2),
            Some(Damage::Garble) => {
                let middle = line.len() / 2;
                line[middle] = b'#';
            }
            Some(Damage::PowerCycle) => return self.firmware.power_up(now_s, out),
            Some(Damage::Starve) => self.starves = Some(Instant::now() + Duration::from_secs(1)),
            Some(Damage::Hold) => self.firmware.receive(b'!', now_s),
            _ => {}
        }
        for byte in line {
            self.firmware.receive(byte, now_s);
        }
        self.firmware.step(now_s, out);
    }

    fn damage_for(&mut self, line: &str) -> Option<Damage> {
        let &(begins, damage) = self.damage.front()?;
        let of_answers = matches!(damage, Damage::LoseAnswer(_) | Damage::GarbleAnswer(_));
        if of_answers || !line.starts_with(begins) {
            return None;
        }
        self.damage.pop_front();
        Some(damage)
    }

    async fn say(&mut self, out: &mut Vec<u8>) -> std::io::Result<()> {
        let output = String::from_utf8(std::mem::take(out)).expect("the firmware sends text");
        for line in output.split_inclusive('\n') {
            let mut line = line.as_bytes().to_vec();
            match self.damage.front() {
                Some(&(_, Damage::LoseAnswer(begins))) if line.starts_with(begins.as_bytes()) => {
                    self.damage.pop_front();
                    continue;
                }
                Some(&(_, Damage::GarbleAnswer(begins))) if line.starts_with(begins.as_bytes()) => {
                    self.damage.pop_front();
                    line[1] = b'#';
                }
                _ => {}
            }
            self.link.write_all(&line).await?;
        }
        Ok(())
    }
}

struct Bench {
    robot: Grbl<DuplexStream>,
    trajectory: Arc<Mutex<Trajectory>>,
    jam: Arc<AtomicBool>,
    begun: Instant,
    lines: Arc<Mutex<Vec<String>>>,
}

fn board(
    dialect: Dialect,
    settings: GrblSettings,
    damage: &[(&'static str, Damage)],
) -> (Wire<DuplexStream>, Board) {
    let (near, far) = duplex(4096);
    let parked_mm = Vector3::from(settings.parked_mm.map(f64::from));
    let travel_mm = Vector3::from(settings.travel_mm.map(f64::from));
    let trajectory = Arc::new(Mutex::new(Trajectory::new(parked_mm, travel_mm)));
    let firmware = GrblFirmware::new(settings, dialect, trajectory, Arc::default());
    let board = Board {
        firmware,
        link: far,
        damage: damage.iter().copied().collect(),
        begun: Instant::now(),
        starves: None,
        lines: Arc::default(),
    };
    (Wire::new(near, Device::new(Role::Robot, "memory")), board)
}

fn feed() -> Feed {
    Feed::from_mm_s(Positive::new(50.0).expect("positive"))
}

fn envelope() -> Envelope {
    let travel = AxisBox { least_m: [-0.3, -0.3, -0.25], largest_m: [0.0; 3] };
    Envelope { travel, keep_out: vec![] }
}

impl Bench {
    async fn with(
        dialect: Dialect,
        settings: GrblSettings,
        damage: &[(&'static str, Damage)],
    ) -> Result<Self, RigError> {
        let (wire, mut board) = board(dialect, settings, damage);
        let parked_mm = Vector3::from(settings.parked_mm.map(f64::from));
        let travel_mm = Vector3::from(settings.travel_mm.map(f64::from));
        let trajectory = Arc::new(Mutex::new(Trajectory::new(parked_mm, travel_mm)));
        let jam = Arc::<AtomicBool>::default();
        board.firmware = GrblFirmware::new(settings, dialect, trajectory.clone(), jam.clone());
        let (begun, lines) = (board.begun, board.lines.clone());
        tokio::spawn(board.run());
        let robot = Grbl::begin(wire, &GrblConfig::default(), envelope(), feed()).await?;
        Ok(Self { robot, trajectory, jam, begun, lines })
    }

    async fn new(dialect: Dialect, damage: &[(&'static str, Damage)]) -> Self {
        let mut bench =
            Self::with(dialect, GrblSettings::default(), damage).await.expect("it opens");
        bench.robot.home().await.expect("it homes");
        bench
    }

    async fn go(&mut self, x_mm: f64) -> Result<RobotPosition, RigError> {
        let target = RobotPosition::from_axes_mm([x_mm, -150.0, -100.0]);
        let reached = self.robot.move_to(target, feed()).await?;
        if reached.is_within(5e-5, target) {
            let head_mm = self.head_mm();
            assert!(
                (head_mm - Vector3::new(x_mm + 300.0, 150.0, 150.0)).norm() < 0.02,
                "reported as reached, but the tool head is at {head_mm:?}"
            );
        }
        Ok(reached)
    }

    fn head_mm(&self) -> Vector3<f64> {
        let now_s = self.begun.elapsed().as_secs_f64();
        self.trajectory.lock().expect("not poisoned").at(now_s).position_mm
    }

    fn received_lines(&self) -> Vec<String> {
        self.lines.lock().expect("not poisoned").clone()
    }
}

const DIALECTS: [Dialect; 2] = [Dialect::Grbl, Dialect::GrblHal];

/// Homes, makes three moves, and expects a report of the position after each.
async fn survives(damage: &[(&'static str, Damage)]) {
    for dialect in DIALECTS {
        let mut bench = Bench::new(dialect, damage).await;
        for x_mm in [-200.0, -190.5, -250.0] {
            let reached = bench.go(x_mm).await.unwrap_or_else(|e| panic!("{damage:?}: {e}"));
            let target = RobotPosition::from_axes_mm([x_mm, -150.0, -100.0]);
            assert!(reached.is_within(5e-6, target), "{damage:?}: {reached}");
        }
    }
}

async fn fails_in_a_move(damage: Damage) -> (Bench, RigError) {
    let mut bench = Bench::new(Dialect::Grbl, &[("G21G90", damage)]).await;
    let error = bench.go(-200.0).await.expect_err("the fault must show");
    (bench, error)
}

#[tokio::test(start_paused = true)]
async fn a_session_opens_without_moving_and_keeps_the_motors_on() {
    let bench = Bench::with(Dialect::Grbl, GrblSettings::default(), &[]).await.expect("it opens");
    // The settings are read twice, and again behind the one that was written.
    assert_eq!(bench.received_lines(), ["$I", "$$", "$$", "$1=255", "$$", "$$"]);
    assert_eq!(bench.robot.firmware(), "Grbl 1.1h");
    assert_eq!(bench.head_mm(), Vector3::new(42.0, 61.0, 180.0));
    assert!(bench.robot.advice().is_empty(), "{:?}", bench.robot.advice());
    let held = GrblSettings { idle_ms: 255, ..GrblSettings::default() };
    let bench = Bench::with(Dialect::GrblHal, held, &[]).await.expect("it opens");
    assert_eq!(bench.received_lines(), ["$I", "$$", "$$"], "nothing is written that is so already");
    assert_eq!(bench.robot.firmware(), "GrblHAL 1.1f");
}

#[tokio::test(start_paused = true)]
async fn each_move_arrives_before_it_is_told() {
    survives(&[]).await;
    let bench = Bench::new(Dialect::Grbl, &[]).await;
    assert!(
        !bench.received_lines().iter().any(|line| line.contains("$X")),
        "nothing is unlocked blindly"
    );
}

#[tokio::test(start_paused = true)]
async fn lines_that_are_lost_or_damaged_are_sent_again() {
    for line in ["G21G90", "G4P0"] {
        for damage in [Damage::LoseLine, Damage::LoseTail, Damage::Garble] {
            survives(&[(line, damage)]).await;
        }
    }
    for line in ["$I", "$$", "$1=255"] {
        survives(&[(line, Damage::Garble), (line, Damage::LoseLine)]).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_move_that_ended_in_its_middle_is_finished() {
    survives(&[("G4P0", Damage::Starve)]).await;
}

#[tokio::test(start_paused = true)]
async fn answers_that_are_lost_or_damaged_change_nothing() {
    for answer in ["ok", "<Idle", "<Run", "[OPT", "$22", "Grbl"] {
        survives(&[("", Damage::LoseAnswer(answer))]).await;
        survives(&[("", Damage::GarbleAnswer(answer)); 2]).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_restart_in_a_move_is_noticed_and_homing_mends_it() {
    let (mut bench, error) = fails_in_a_move(Damage::PowerCycle).await;
    assert!(matches!(error.cause(), Cause::Reset), "{error}");
    assert!(error.to_string().contains("moving to (-200.00, -150.00, -100.00) mm"), "{error}");
    bench.robot.home().await.expect("homes again");
    bench.go(-200.0).await.expect("goes on");
}

#[tokio::test(start_paused = true)]
async fn a_hold_that_nobody_asked_for_is_told() {
    let (mut bench, error) = fails_in_a_move(Damage::Hold).await;
    assert!(matches!(error.cause(), Cause::Paused { .. }), "{error}");
    bench.robot.home().await.expect("a reset ends it");
}

#[tokio::test(start_paused = true)]
async fn a_limit_is_told_and_homing_ends_its_silence() {
    for dialect in DIALECTS {
        let mut bench = Bench::new(dialect, &[]).await;
        let outside = RobotPosition::from_axes_mm([5.0, -150.0, -100.0]);
        let error = bench.robot.move_to(outside, feed()).await.expect_err("out of travel");
        assert!(matches!(error.cause(), Cause::Alarm { .. }), "{error}");
        assert!(error.to_string().contains("(ALARM:2)"), "{error}");
        bench.robot.home().await.expect("homes again");
        bench.go(-200.0).await.expect("goes on");
    }
}

#[tokio::test(start_paused = true)]
async fn homing_that_fails_is_told_and_may_be_tried_again() {
    for dialect in DIALECTS {
        let mut bench = Bench::with(dialect, GrblSettings::default(), &[]).await.expect("it opens");
        bench.jam.store(true, Ordering::Relaxed);
        let error = bench.robot.home().await.expect_err("no switch");
        assert!(error.to_string().contains("did not find its end switch"), "{error}");
        bench.jam.store(false, Ordering::Relaxed);
        bench.robot.home().await.expect("homes");
        bench.go(-200.0).await.expect("goes on");
    }
}

#[tokio::test(start_paused = true)]
async fn a_homing_command_that_is_lost_is_not_taken_for_homed() {
    for dialect in DIALECTS {
        for damage in [Damage::LoseLine, Damage::Garble, Damage::LoseTail, Damage::LoseAnswer("ok")]
        {
            let held = GrblSettings { idle_ms: 255, ..GrblSettings::default() };
            // Not the answers to what comes before.
            let damage = [("$H", Damage::LoseLine), ("$H", damage)];
            let mut bench = Bench::with(dialect, held, &damage).await.expect("it opens");
            bench.robot.home().await.expect("homes in the end");
            assert_eq!(bench.head_mm(), Vector3::new(2.0, 2.0, 2.0), "{dialect:?} {damage:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn stopping_a_move_in_its_middle_takes_no_time_and_homing_goes_on() {
    for dialect in DIALECTS {
        let mut bench = Bench::new(dialect, &[]).await;
        let cancelled = tokio::time::timeout(Duration::from_secs(2), bench.go(-200.0)).await;
        assert!(cancelled.is_err(), "the move takes longer");
        let begun = Instant::now();
        bench.robot.stop().await.expect("stops");
        assert!(begun.elapsed() < Duration::from_millis(100));
        tokio::time::sleep(Duration::from_secs(1)).await;
        let stands_mm = bench.head_mm();
        tokio::time::sleep(Duration::from_secs(5)).await;
        assert_eq!(bench.head_mm(), stands_mm);
        bench.robot.home().await.expect("homes");
        bench.go(-200.0).await.expect("goes on");
    }
}

#[tokio::test(start_paused = true)]
async fn what_the_settings_forbid_is_told_before_anything_moves() {
    let no_homing = GrblSettings { homing: false, soft_limits: false, ..GrblSettings::default() };
    let mut bench = Bench::with(Dialect::Grbl, no_homing, &[]).await.expect("it opens");
    let error = bench.robot.home().await.expect_err("cannot home");
    assert!(error.to_string().contains("homing is off"), "{error}");
    assert_eq!(bench.robot.advice().len(), 2, "{:?}", bench.robot.advice());
    let positive = GrblSettings { origin_at_switches: true, ..GrblSettings::default() };
    let Err(error) = Bench::with(Dialect::Grbl, positive, &[]).await else {
        panic!("the rig file's travel lies below zero")
    };
    assert!(error.to_string().contains("$130=300"), "{error}");
}

#[tokio::test(start_paused = true)]
async fn motors_that_let_go_let_the_axis_fall_which_nobody_reports() {
    let (wire, board) = board(Dialect::Grbl, GrblSettings::default(), &[]);
    tokio::spawn(board.run());
    let config = GrblConfig { hold_motors: false, ..GrblConfig::default() };
    let robot = Grbl::begin(wire, &config, envelope(), feed()).await.expect("it opens");
    let advice = robot.advice();
    assert!(advice[0].problem.contains("switch off 25 ms after each move"), "{advice:?}");
}

#[tokio::test(start_paused = true)]
async fn positions_of_the_work_and_in_inches_are_understood() {
    for settings in [
        GrblSettings { report_mask: 0, ..GrblSettings::default() },
        GrblSettings { report_inches: true, ..GrblSettings::default() },
    ] {
        let mut bench = Bench::with(Dialect::Grbl, settings, &[]).await.expect("it opens");
        bench.robot.home().await.expect("homes");
        let reached = bench.go(-200.0).await.expect("arrives");
        assert!(reached.is_within(5e-6, RobotPosition::from_axes_mm([-200.0, -150.0, -100.0])));
    }
}

#[tokio::test(start_paused = true)]
async fn a_driver_for_another_firmware_says_so() {
    let (wire, board) = board(Dialect::Grbl, GrblSettings::default(), &[]);
    tokio::spawn(board.run());
    let error = Marlin::begin(wire, &MarlinConfig::default()).await.expect_err("not Marlin");
    assert!(matches!(error.cause(), Cause::OtherFirmware { named: "Marlin", .. }), "{error}");
    assert!(error.remedy().contains("[motion.grbl]"));
}

#[tokio::test(start_paused = true)]
async fn a_dead_board_is_given_up_in_bounded_time() {
    let (near, _far) = duplex(4096);
    let wire = Wire::new(near, Device::new(Role::Robot, "memory"));
    let begun = Instant::now();
    let error = Grbl::begin(wire, &GrblConfig::default(), envelope(), feed()).await;
    let error = error.expect_err("nobody answers");
    assert!(matches!(error.cause(), Cause::Silent { .. }), "{error}");
    assert!(begun.elapsed() < Duration::from_secs(30));
}

#[tokio::test(start_paused = true)]
async fn a_query_behind_the_drivers_own_pause_takes_as_long_as_the_firmware() {
    let mut bench = Bench::new(Dialect::Grbl, &[]).await;
    bench.robot.position().await.expect("it answers");
    tokio::time::sleep(bench.robot.query_pause()).await;
    let asked = Instant::now();
    bench.robot.position().await.expect("it answers");
    assert!(asked.elapsed() < Duration::from_millis(10), "{:?}", asked.elapsed());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Whatever is lost or damaged, a reported arrival is true, every wait ends, and any failure is an error.
    #[test]
    fn no_sequence_of_faults_makes_a_wrong_move(
        hal in any::<bool>(),
        damage in prop::collection::vec(
            (
                prop::sample::select(vec!["", "G21", "G4P0", "$"]),
                prop::sample::select(vec![
                    Damage::LoseLine, Damage::LoseTail, Damage::Garble, Damage::LoseAnswer("ok"),
                    Damage::LoseAnswer("<"), Damage::GarbleAnswer("<"), Damage::GarbleAnswer("ok"),
                    Damage::LoseAnswer("error"), Damage::PowerCycle, Damage::Hold,
                    Damage::Starve,
                ]),
            ),
            0..10,
        ),
    ) {
        let dialect = if hal { Dialect::GrblHal } else { Dialect::Grbl };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time().start_paused(true).build().expect("a runtime");
        runtime.block_on(async {
            let Ok(mut bench) = Bench::with(dialect, GrblSettings::default(), &damage).await else { return };
            if bench.robot.home().await.is_err() {
                return;
            }
            for x_mm in [-200.0, -190.0, -200.0] {
                let begun = Instant::now();
                let gone = bench.go(x_mm).await;
                assert!(begun.elapsed() < Duration::from_secs(90), "{damage:?}: {gone:?}");
                if gone.is_err() {
                    return;
                }
            }
        });
    }
}
