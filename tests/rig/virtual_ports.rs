//! The virtual rig over its pseudo-terminals, as seen by any program.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::time::Duration;

use fieldgap::input::TomlSource;
use fieldgap::rig_file::RigFile;
use fieldgap::virtual_rig::{Fault, LineFault, Part, VirtualRig};
use serialport::TTYPort;

/// The rig of `rigs/virtual.toml`, with a replacement.
fn rig_with(from: &str, to: &str) -> VirtualRig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml");
    let text = std::fs::read_to_string(&path).expect("the rig file is there");
    assert!(text.contains(from), "the rig file has {from:?}");
    let rig_file =
        RigFile::parse(TomlSource::new(&path, text.replace(from, to))).expect("it is valid");
    rig_file.open_virtual().expect("it opens").expect("it is virtual")
}

fn rig() -> VirtualRig {
    rig_with("seed = 1", "seed = 1")
}

/// A line-based client.
struct Client {
    port: BufReader<TTYPort>,
}

impl Client {
    fn open(path: Option<String>) -> Self {
        let path = path.expect("a virtual rig has all three ports");
        let port = serialport::new(path, 115_200).timeout(Duration::from_secs(20));
        Self { port: BufReader::new(TTYPort::open(&port).expect("the port opens")) }
    }

    fn send(&mut self, text: &str) {
        self.port.get_mut().write_all(text.as_bytes()).expect("the port takes it");
    }

    fn line(&mut self) -> String {
        let mut line = Vec::new();
        self.port.read_until(b'\n', &mut line).expect("a line comes");
        String::from_utf8_lossy(&line).trim_end().to_owned()
    }

    /// Sends a line and returns the answer up to and including a line that begins with `end`.
    fn ask(&mut self, text: &str, end: &str) -> Vec<String> {
        self.send(&format!("{text}\n"));
        self.until(end)
    }

    fn until(&mut self, end: &str) -> Vec<String> {
        let mut lines = Vec::new();
        loop {
            lines.push(self.line());
            if lines.last().is_some_and(|line| line.starts_with(end)) {
                return lines;
            }
        }
    }
}

fn sealed(body: &str) -> String {
    format!("{body}*{:08x}", crc32fast::hash(body.as_bytes()))
}

/// A short manual scan: home, switch on, and read at a few positions. Returns all answers of the devices.
fn short_scan(rig: &VirtualRig) -> Vec<String> {
    let ports = rig.ports();
    let mut robot = Client::open(ports.motion);
    let mut receiver = Client::open(ports.receiver);
    let mut array = Client::open(ports.focus_array);
    let mut said = robot.ask("G28", "ok");
    said.extend(array.ask(&sealed("1 modulate 200 50"), "1 ok"));
    said.extend(array.ask(&sealed("2 on"), "2 ok"));
    for x_mm in [150, 152, 154, 140] {
        said.extend(robot.ask(&format!("G1 X{x_mm} Y150 Z80 F4800"), "ok"));
        said.extend(robot.ask("M400", "ok"));
        said.extend(robot.ask("M114", "ok"));
        said.extend(receiver.ask("S 10", "end"));
    }
    said
}

#[test]
fn the_seed_determines_all_bytes() {
    let first = short_scan(&rig());
    assert_eq!(first, short_scan(&rig()));
    let other = short_scan(&rig_with("seed = 1", "seed = 2"));
    assert_ne!(first, other);
    assert_eq!(first.len(), other.len(), "only the noise differs");
}

#[test]
fn hours_of_virtual_motion_take_no_time() {
    let rig = rig();
    let mut robot = Client::open(rig.ports().motion);
    robot.ask("G28", "ok");
    let begun = std::time::Instant::now();
    robot.ask("G1 X300 F1", "ok");
    let said = robot.ask("M400", "ok");
    // Five hours at 1 mm/min.
    assert!(rig.clock().now_s() > 17_000.0);
    assert!(said.len() > 8000, "a busy line every two seconds: {}", said.len());
    assert!(begun.elapsed() < Duration::from_secs(20));
}

#[test]
fn a_client_can_be_replaced_by_another() {
    let rig = rig();
    for _ in 0..3 {
        let mut robot = Client::open(rig.ports().motion);
        assert_eq!(robot.ask("M400", "ok").last().map(String::as_str), Some("ok"));
    }
}

#[test]
fn a_program_that_opens_the_port_as_a_plain_file_is_served_without_echo() {
    let rig = rig();
    let path = rig.ports().receiver.expect("a port");
    let mut file = std::fs::File::options().read(true).write(true).open(path).expect("it opens");
    file.write_all(b"?\n").expect("it is written");
    let mut line = String::new();
    BufReader::new(file).read_line(&mut line).expect("a line comes");
    assert_eq!(line, "receiver 1 rate_hz=1000 full_scale=5.000000 unit=V\n");
}

#[test]
fn a_reset_sends_the_banner_and_loses_the_position() {
    let rig = rig();
    let mut robot = Client::open(rig.ports().motion);
    robot.ask("G28", "ok");
    robot.ask("G1 X100 F6000", "ok");
    robot.ask("M400", "ok");
    assert!(rig.inject(Part::Robot, Fault::Reset));
    robot.until("start");
    assert!(robot.ask("M114", "ok").iter().any(|line| line.starts_with("X:0.00 ")));
    assert!((rig.world().nozzle_m(rig.clock().now_s()).x - (0.1 - 0.15)).abs() < 1e-9);
}

#[test]
fn a_lost_ok_is_detected_by_the_next_numbered_line() {
    let rig = rig();
    let mut robot = Client::open(rig.ports().motion);
    let numbered = |n: i64, command: &str| {
        let line = format!("N{n} {command}");
        let sum = line.bytes().fold(0, |sum, byte| sum ^ byte);
        format!("{line}*{sum}")
    };
    robot.ask("M110 N0", "ok");
    assert!(rig.inject(Part::Robot, Fault::OnLines(LineFault::LoseOk)));
    robot.send(&format!("{}\n{}\n", numbered(1, "G91"), numbered(2, "M115")));
    let said = robot.until("ok");
    assert!(said.iter().any(|line| line.starts_with("FIRMWARE_NAME:Marlin")), "{said:?}");
}

#[test]
fn a_disconnected_device_gives_an_end_of_file_and_the_others_continue() {
    let rig = rig();
    let mut robot = Client::open(rig.ports().motion);
    let mut receiver = Client::open(rig.ports().receiver);
    robot.ask("M400", "ok");
    assert!(rig.inject(Part::Robot, Fault::Unplug));
    let mut rest = Vec::new();
    let ended = robot.port.read_until(b'\n', &mut rest);
    assert!(ended.is_err() || rest.is_empty(), "{rest:?}");
    assert!(!rig.inject(Part::Robot, Fault::Reset), "there is nobody to reset");
    assert_eq!(receiver.ask("S 1", "end").len(), 2);
}

#[test]
fn in_real_time_m112_stops_a_move() {
    let rig = rig_with("pace = \"lockstep\"", "pace = { times = 50.0 }");
    let mut robot = Client::open(rig.ports().motion);
    robot.ask("G28", "ok");
    let begun_s = rig.clock().now_s();
    robot.ask("G1 X100 F3000", "ok");
    robot.ask("M400", "ok");
    assert!(rig.clock().now_s() - begun_s >= 2.0);
    robot.ask("G1 X0 F60", "ok");
    robot.send("M400\nM112\n");
    assert_eq!(
        robot.until("Error:").last().map(String::as_str),
        Some("Error:Printer halted. kill() called!")
    );
}

#[test]
fn dropping_the_rig_closes_its_ports() {
    let rig = rig();
    // (Whether the path opens again says nothing: another rig may have been given it.)
    let mut robot = Client::open(rig.ports().motion);
    drop(rig);
    let mut rest = Vec::new();
    match robot.port.read_to_end(&mut rest) {
        Ok(_) => {}
        Err(error) => assert_ne!(error.kind(), std::io::ErrorKind::TimedOut, "the port is open"),
    }
}

#[test]
fn a_free_running_receiver_needs_real_time() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml");
    let text = std::fs::read_to_string(&path).expect("the rig file is there");
    let text = text.replace("[virtual.receiver]", "[virtual.receiver]\nmode = \"free-running\"");
    let rig_file = RigFile::parse(TomlSource::new(&path, text)).expect("it is valid");
    let refusal = rig_file.open_virtual().err().expect("time stands still in lockstep");
    assert!(refusal.to_string().contains("times = 1.0"), "{refusal}");
}
