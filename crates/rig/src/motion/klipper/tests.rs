//! The driver against a host software that answers as a real one did: the lines are those of a session of Klipper's
//! host software with its micro-controller code on the same computer.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, DuplexStream, duplex};
use tokio::time::{sleep, timeout, timeout_at};

use super::*;
use crate::Motion as _;
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};
use crate::link::Wire;
use crate::link::fault_injection::with_faults;
use crate::motion::guarded::Guarded;
use crate::space::{Feed, RobotPosition};
use crate::travel::{AxisBox, Envelope};
use fieldgap_input::Positive;

/// What the host software does beside the usual.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Behaviour {
    shut_down: bool,
    homing_fails: bool,
}

const SHUTDOWN_NOTES: &str = "// Shutdown due to M112 command\n// Once the underlying issue is corrected, use the\n\
    // \"FIRMWARE_RESTART\" command to reset the firmware, reload the\n// config, and restart the host software.\n\
    // Printer is shutdown\n!! Shutdown due to M112 command\nok\n";

/// Where the tool head goes, and when it is there.
#[derive(Debug, Clone, Copy)]
struct Motion {
    target: [f64; 3],
    ends: tokio::time::Instant,
}

type Machine = Arc<Mutex<Motion>>;

fn machine() -> Machine {
    Arc::new(Mutex::new(Motion { target: [0.0; 3], ends: tokio::time::Instant::now() }))
}

async fn host(link: DuplexStream, behaviour: Behaviour, machine: Machine) {
    let mut link = BufReader::new(link);
    let Behaviour { mut shut_down, homing_fails } = behaviour;
    let mut homed = false;
    let mut line;
    let mut waiting = VecDeque::new();
    loop {
        match waiting.pop_front() {
            Some(next) => line = next,
            None => match read_line(&mut link).await {
                Some(next) => line = next,
                None => return,
            },
        }
        let Motion { mut target, mut ends } = *machine.lock().expect("not poisoned");
        let command = unnumbered(line.trim()).to_owned();
        let number = |letter: char| -> f64 {
            let word = command.split(' ').find_map(|word| word.strip_prefix(letter));
            word.and_then(|word| word.parse().ok()).unwrap_or(0.0)
        };
        let answer = match command.split(' ').next().unwrap_or("") {
            "M112" => {
                (shut_down, homed) = (true, false);
                "// Klipper state: Shutdown\nok\n".to_owned()
            }
            "FIRMWARE_RESTART" => {
                shut_down = false;
                let _ = link.get_mut().write_all(b"ok\n// Klipper state: Disconnect\n").await;
                sleep(Duration::from_millis(1680)).await;
                "// Klipper state: Ready\n".to_owned()
            }
            "STATUS" if shut_down => "// Klipper state: Shutdown\nok\n".to_owned(),
            "STATUS" => "// Klipper state: Ready\nok\n".to_owned(),
            "M115" => "ok FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.12.0\n".to_owned(),
            "GET_POSITION" => {
                let [x, y, z] = target;
                format!(
                    "// mcu: stepper_x:0 stepper_y:0 stepper_z:0\n// kinematic: X:{x:.6} Y:{y:.6} Z:{z:.6}\n\
                     // toolhead: X:{x:.6} Y:{y:.6} Z:{z:.6} E:0.000000\nok\n"
                )
            }
            "M118" => format!("echo: {}\nok\n", command[4..].trim()),
            "" | "G21" | "G90" | "M110" | "SET_IDLE_TIMEOUT" if !shut_down => "ok\n".to_owned(),
            _ if shut_down => SHUTDOWN_NOTES.to_owned(),
            "G28" if homing_fails => "!! No trigger on x after full movement\nok\n".to_owned(),
            "G28" => {
                sleep(Duration::from_secs(4)).await;
                (homed, target) = (true, [0.0; 3]);
                "ok\n".to_owned()
            }
            "G1" if !homed => {
                "!! Must home axis first: 10.000 0.000 0.000 [0.000]\nok\n".to_owned()
            }
            "G1" => {
                target = [number('X'), number('Y'), number('Z')];
                ends = tokio::time::Instant::now() + Duration::from_secs(3);
                "ok\n".to_owned()
            }
            "M400" => {
                // M112 acts at once, also behind it; other lines wait.
                while let Ok(Some(next)) = timeout_at(ends, read_line(&mut link)).await {
                    if next.trim() == "M112" {
                        (shut_down, homed) = (true, false);
                        let shutdown = b"ok\n// Klipper state: Shutdown\n";
                        let _ = link.get_mut().write_all(shutdown).await;
                        break;
                    }
                    waiting.push_back(next);
                }
                "ok\n".to_owned()
            }
            unknown => format!("// Unknown command:\"{}\"\nok\n", name_of(unknown)),
        };
        *machine.lock().expect("not poisoned") = Motion { target, ends };
        if link.get_mut().write_all(answer.as_bytes()).await.is_err() {
            return;
        }
    }
}

/// The next line, whatever its bytes.
async fn read_line(link: &mut BufReader<DuplexStream>) -> Option<String> {
    let mut line = Vec::new();
    let read = link.read_until(b'\n', &mut line).await;
    read.is_ok_and(|count| count > 0).then(|| String::from_utf8_lossy(&line).into_owned())
}

/// A line without number and checksum, which the host software ignores.
fn unnumbered(line: &str) -> &str {
    let line = line.split('*').next().unwrap_or(line);
    match line.strip_prefix('N').and_then(|rest| rest.split_once(' ')) {
        Some((number, command)) if number.bytes().all(|byte| byte.is_ascii_digit()) => command,
        _ => line,
    }
}

/// The name of a command as the host software takes it: letters and underscores, then one number.
fn name_of(command: &str) -> String {
    let letters = command.find(|c: char| c.is_ascii_digit()).unwrap_or(command.len());
    let digits = command[letters..].find(|c: char| !c.is_ascii_digit());
    command[..digits.map_or(command.len(), |digits| letters + digits)].to_uppercase()
}

async fn opened(behaviour: Behaviour) -> Result<Klipper<DuplexStream>, RigError> {
    let (near, far) = duplex(4096);
    tokio::spawn(host(far, behaviour, machine()));
    let wire = Wire::new(near, Device::new(Role::Robot, "memory"));
    Klipper::begin(wire, &KlipperConfig::default(), envelope()).await
}

fn envelope() -> Envelope {
    let travel = AxisBox { least_m: [0.0; 3], largest_m: [0.3; 3] };
    Envelope { travel, keep_out: Vec::new() }
}

fn feed() -> Feed {
    Feed::from_mm_s(Positive::new(50.0).expect("above zero"))
}

fn at(x_mm: f64) -> RobotPosition {
    RobotPosition::from_axes_mm([x_mm, 2.0, 3.0])
}

#[tokio::test(start_paused = true)]
async fn it_homes_and_moves() {
    let mut robot = opened(Behaviour::default()).await.expect("ready");
    assert_eq!(robot.firmware(), "Klipper v0.12.0");
    robot.home().await.expect("homed");
    let begun = tokio::time::Instant::now();
    let reported = robot.move_to(at(10.0), feed()).await.expect("moved");
    assert!(reported.is_within(1e-6, at(10.0)));
    assert!(begun.elapsed() >= Duration::from_secs(3), "it waited for the end of the move");
}

#[tokio::test(start_paused = true)]
async fn a_failed_homing_is_an_error_though_an_ok_follows() {
    let behaviour = Behaviour { homing_fails: true, ..Behaviour::default() };
    let mut robot = opened(behaviour).await.expect("ready");
    let error = robot.home().await.expect_err("it failed");
    assert!(
        matches!(error.cause(), Cause::Refused { reply } if reply.starts_with("No trigger on x")),
        "{error}"
    );
    let error = robot.move_to(at(10.0), feed()).await.expect_err("not homed");
    assert!(matches!(error.cause(), Cause::Refused { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_shut_down_klipper_is_named_with_its_reason() {
    let behaviour = Behaviour { shut_down: true, ..Behaviour::default() };
    let error = opened(behaviour).await.expect_err("shut down");
    assert_eq!(error.cause().to_string(), "Klipper has shut down: Shutdown due to M112 command");
    assert!(error.remedy().contains("FIRMWARE_RESTART"));
}

#[tokio::test(start_paused = true)]
async fn a_stop_in_mid_move_shuts_klipper_down_and_homing_restarts_it() {
    let mut robot = opened(Behaviour::default()).await.expect("ready");
    robot.home().await.expect("homed");
    let moving = robot.move_to(at(10.0), feed());
    assert!(timeout(Duration::from_secs(1), moving).await.is_err(), "the move takes longer");
    robot.stop().await.expect("stopped");
    let error = robot.move_to(at(10.0), feed()).await.expect_err("shut down");
    assert!(matches!(error.cause(), Cause::Shutdown { .. }), "{error}");
    robot.home().await.expect("restarted and homed");
    robot.move_to(at(10.0), feed()).await.expect("moved");
}

#[tokio::test(start_paused = true)]
async fn a_stop_at_rest_leaves_klipper_running() {
    let mut robot = opened(Behaviour::default()).await.expect("ready");
    robot.home().await.expect("homed");
    robot.stop().await.expect("at rest");
    robot.home().await.expect("homed");
    robot.move_to(at(10.0), feed()).await.expect("moved");
}

#[tokio::test(start_paused = true)]
async fn a_rig_file_that_names_another_firmware_is_told() {
    use crate::motion::marlin::{Marlin, MarlinConfig};
    let (near, far) = duplex(4096);
    tokio::spawn(host(far, Behaviour::default(), machine()));
    let wire = Wire::new(near, Device::new(Role::Robot, "memory"));
    let error = Marlin::begin(wire, &MarlinConfig::default()).await.expect_err("not Marlin");
    assert!(matches!(error.cause(), Cause::OtherFirmware { named: "Marlin", .. }), "{error}");
}

/// Scans 500 points with lines lost, damaged and doubled in both directions; the error that ended it.
async fn scan_with_noise(seed: u64, share: f64) -> Option<RigError> {
    let (near, far) = duplex(4096);
    let machine = machine();
    tokio::spawn(host(far, Behaviour::default(), Arc::clone(&machine)));
    let each = share / 3.0;
    let rates = serde_json::json!({ "lose": each, "flip": each, "double": each });
    let link = with_faults(near, serde_json::from_value(rates).expect("rates"), seed);
    let wire = Wire::new(link, Device::new(Role::Robot, "memory"));
    let scanning = async {
        let robot = Klipper::begin(wire, &KlipperConfig::default(), envelope()).await?;
        let mut robot = Guarded::new(Box::new(robot), envelope(), 0.05e-3);
        robot.home().await?;
        for point in 0..500 {
            let target_mm = [f64::from(point % 10) * 7.3, f64::from(point / 10) * 4.15, 100.0];
            robot.move_to(RobotPosition::from_axes_mm(target_mm), feed()).await?;
            let stands = *machine.lock().expect("not poisoned");
            assert!(stands.ends <= tokio::time::Instant::now(), "it still moves");
            let off_mm = (0..3).map(|axis| (stands.target[axis] - target_mm[axis]).abs());
            assert!(
                off_mm.fold(0.0, f64::max) < 0.05,
                "{target_mm:?} is told, and it is at {stands:?}"
            );
        }
        Ok(())
    };
    scanning.await.err()
}

/// A damaged digit can send the robot out of its travel, which ends the scan: nothing else may.
#[tokio::test(start_paused = true)]
async fn noise_on_the_line_gives_no_wrong_place_and_ends_a_scan_only_where_a_digit_was_damaged() {
    for (share, least) in [(0.01, 17), (0.05, 10)] {
        let mut completed = 0;
        for seed in 0..20 {
            match scan_with_noise(seed, share).await {
                None => completed += 1,
                Some(error) => assert!(
                    matches!(error.cause(), Cause::WrongPosition { .. }),
                    "seed {seed}: {error}"
                ),
            }
        }
        println!("{share} of all lines: {completed} of 20 scans completed");
        assert!(completed >= least, "{share}: {completed} of 20");
    }
}
