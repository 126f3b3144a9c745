//! The rig over serial ports: pseudo-terminals with devices that can be disconnected.
#![cfg(unix)]

use std::path::Path;
use std::time::Duration;

use fieldgap::input::toml_file;
use fieldgap::rig::link::open_serial;
use fieldgap::rig::{
    Cause, FocusArrayConfig, MotionConfig, Ports, ReceiverConfig, RigConfig, Role, open,
};
use serde::Deserialize;
use serialport::{SerialPort, TTYPort};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::Instant;
use tokio_serial::SerialStream;

const BAUD: u32 = 115_200;

/// The device end of a pseudo-terminal, and the name of its port.
fn pty() -> (SerialStream, String) {
    let (master, slave) = TTYPort::pair().expect("this system has pseudo-terminals");
    let name = slave.name().expect("a slave has a name");
    (SerialStream::try_from(master).expect("within a runtime"), name)
}

/// The next bytes that the device receives; fails after a time-out.
async fn received<const N: usize>(device: &mut SerialStream) -> [u8; N] {
    let mut bytes = [0; N];
    let reading = tokio::time::timeout_at(soon(), device.read_exact(&mut bytes)).await;
    reading.expect("something comes in time").expect("is there");
    bytes
}

fn soon() -> Instant {
    Instant::now() + Duration::from_secs(10)
}

#[tokio::test]
async fn lines_go_both_ways() {
    let (mut device, port) = pty();
    let mut wire = open_serial(Role::Robot, Some(&port), None, BAUD).expect("opens");
    wire.send(b"M115\n").await.expect("is there");
    assert_eq!(&received(&mut device).await, b"M115\n");
    device.write_all(b"ok\r\n").await.expect("is there");
    assert_eq!(wire.line(soon()).await.expect("is there").as_deref(), Some("ok"));
}

#[tokio::test]
async fn a_pulled_cable_is_a_disconnection_at_once() {
    let (device, port) = pty();
    let mut wire = open_serial(Role::Robot, Some(&port), None, BAUD).expect("opens");
    drop(device);
    let error = wire.line(soon()).await.expect_err("pulled");
    assert!(matches!(error.cause(), Cause::Disconnected), "{error}");
    assert!(error.to_string().starts_with(&format!("robot on {port}")), "{error}");
    let error = wire.send(b"M115\n").await.expect_err("pulled");
    assert!(matches!(error.cause(), Cause::Disconnected), "{error}");
}

#[tokio::test]
async fn a_missing_port_is_reported_with_the_existing_ones() {
    let error =
        open_serial(Role::Receiver, None, Some("/dev/ttyNOWHERE7"), BAUD).expect_err("missing");
    assert!(matches!(error.cause(), Cause::PortMissing { .. }), "{error}");
    assert!(error.to_string().starts_with("receiver on /dev/ttyNOWHERE7"), "{error}");
    assert!(error.remedy().contains("plugged in"));
}

#[tokio::test]
async fn a_port_is_opened_exclusively() {
    let (_device, port) = pty();
    let _first = open_serial(Role::Robot, Some(&port), None, BAUD).expect("opens");
    let error = open_serial(Role::Robot, Some(&port), None, BAUD).expect_err("taken");
    assert!(matches!(error.cause(), Cause::PortBusy), "{error}");
}

#[tokio::test]
async fn a_device_without_a_port_names_the_missing_key() {
    let error = open_serial(Role::FocusArray, None, None, BAUD).expect_err("no port");
    assert!(matches!(error.cause(), Cause::NoPort), "{error}");
    assert!(error.remedy().contains("port ="), "{}", error.remedy());
}

#[tokio::test]
async fn bytes_sent_without_waiting_reach_a_serial_port() {
    let (mut device, port) = pty();
    let mut wire = open_serial(Role::FocusArray, Some(&port), None, BAUD).expect("opens");
    // A port accepts bytes without waiting only after a first write, which every driver makes on opening.
    wire.send(b"on\n").await.expect("is there");
    wire.send_without_waiting(b"off\n");
    assert_eq!(&received(&mut device).await, b"on\noff\n");
}

/// The sections of a rig file that this layer reads.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RigFile {
    name: String,
    #[serde(rename = "array")]
    _array: toml::Table,
    #[serde(rename = "medium")]
    _medium: toml::Table,
    motion: MotionConfig,
    receiver: ReceiverConfig,
    focus_array: FocusArrayConfig,
}

fn thesis_rig() -> RigConfig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/thesis.toml");
    let file: RigFile = toml_file(&path).expect("the lab's own rig is valid");
    assert_eq!(file.name, "thesis");
    RigConfig {
        motion: file.motion,
        receiver: file.receiver,
        focus_array: file.focus_array,
        environment: None,
    }
}

#[test]
fn the_labs_own_rig_keeps_the_receiver_off_the_array() {
    let motion = thesis_rig().motion;
    let (frame, envelope) = (motion.frame(), motion.envelope());
    let at_mm = |x: f64, y: f64, z: f64| frame.to_robot(nalgebra::Vector3::new(x, y, z) * 1e-3);
    // The planes of the thesis: 71 x 71 mm at 50 to 200 mm above the array.
    for z in [50.0, 100.0, 150.0, 200.0] {
        let (from, to) = (at_mm(-35.5, -35.5, z), at_mm(35.5, 35.5, z));
        assert_eq!(envelope.check_path(from, to), Ok(()), "{z} mm");
    }
    assert!(envelope.check_target(at_mm(0.0, 0.0, 5.0)).is_err(), "5 mm above the elements");
    assert!(envelope.check_path(at_mm(-100.0, 0.0, 5.0), at_mm(100.0, 0.0, 5.0)).is_err());
}

#[tokio::test]
async fn a_disconnected_rig_names_its_first_port() {
    let ports = Ports { focus_array: Some("/dev/ttyNOWHERE7".to_owned()), ..Ports::default() };
    let Err(error) = open(&thesis_rig(), &ports).await else { panic!("nothing is plugged in") };
    assert!(error.to_string().starts_with("focus array on /dev/ttyNOWHERE7"), "{error}");
}
