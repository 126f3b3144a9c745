//! Scans with every supported device, on virtual rigs.

use std::path::Path;

use fieldgap::acquisition::{Ending, Event, PlannedScan, RigSetup, ScanRun};
use fieldgap::input::TomlSource;
use fieldgap::records::RecordedScan;
use fieldgap::rig::check::check;
use fieldgap::rig::{Cause, ElementDelay, open, open_array};
use fieldgap::rig_file::{RigFile, simulated_devices};
use fieldgap::virtual_rig::{Fault, LineFault, Part, VirtualRig};

const PLAN: &str = r#"
name = "devices"
rig = "rig.toml"
[simulator]
model = "piston"
[[focus]]
x_mm = 5.0
y_mm = -5.0
z_mm = 60.0
[dark]
before = 2
after = 0
[[plane]]
z_mm = 60.0
centre_mm = [5.0, -5.0]
size_mm = [12.0, 12.0]
step_mm = 6.0
"#;

/// A rig file: the thesis's array under the robot of the virtual rig, with these devices.
fn rig(receiver: &str, focus_array: &str, virtual_devices: &str) -> String {
    format!(
        r#"
name = "devices"
[array]
frequency_hz = 40000.0
layout = "square"
columns = 6
rows = 6
element_diameter_mm = 10.5
spacing_mm = 0.0
[medium]
speed_of_sound_m_s = 343.0
[motion]
origin_mm = [150.0, 150.0, -20.0]
travel_mm = {{ x = [0.0, 300.0], y = [0.0, 300.0], z = [0.0, 250.0] }}
feed_mm_s = 80.0
position_tolerance_mm = 0.05
[motion.marlin]
[receiver]
settle_ms = 5.0
samples = 4
{receiver}
[focus_array]
modulation_hz = 0.0
modulation_duty_percent = 100.0
{focus_array}
[virtual]
seed = 3
pace = "lockstep"
truth = "truth.toml"
{virtual_devices}
"#
    )
}

const STREAM: &str = "[receiver.stream]";
const THESIS: &str = "[focus_array.thesis]";

/// A receiver without saturation and noise.
const QUIET: &str = "[microphone]\nsensitivity_v_pa = 0.001\n";

/// Runs the plan on a rig, in a new folder.
async fn scan(folder: &Path, rig: &str, truth: &str) -> (RecordedScan, Vec<Event>) {
    std::fs::write(folder.join("rig.toml"), rig).expect("written");
    std::fs::write(folder.join("truth.toml"), truth).expect("written");
    std::fs::write(folder.join("plan.toml"), PLAN).expect("written");
    let campaign = PlannedScan::read(&folder.join("plan.toml"), None).expect("a valid plan");
    let out = folder.join("scan");
    let session = ScanRun::begin(campaign, &out, simulated_devices).await.expect("the rig opens");
    let mut events = Vec::new();
    let mut watch = |event: &Event| events.push(event.clone());
    let ended = session.run(&mut watch, std::future::pending()).await.expect("it is kept");
    assert_eq!(ended, Ending::Complete);
    (RecordedScan::open(&out).expect("the record is whole"), events)
}

/// The readings of a scan on a rig: two dark readings, then nine around the focus.
async fn readings(rig: &str, truth: &str) -> Vec<f64> {
    let folder = tempfile::tempdir().expect("a folder");
    let (record, _) = scan(folder.path(), rig, truth).await;
    record.samples.iter().map(|sample| sample.reading).collect()
}

/// Compares the readings of a board with those of the thesis's controller, whose slots are at least 16 times finer. The phase
/// error is uniform within half a slot, so that the field at the focus is reduced by 1 - sinc(1/slots); elsewhere the errors
/// of 36 elements add to a few percent of the level at the focus.
async fn agrees_with_the_thesis_controller(focus_array: &str, virtual_array: &str, slots: f64) {
    let board = readings(&rig(STREAM, focus_array, virtual_array), QUIET).await;
    let thesis = readings(&rig(STREAM, THESIS, ""), QUIET).await;
    assert_eq!((board.len(), thesis.len()), (11, 11));
    assert_eq!(board[..2], [0.0, 0.0], "it was silenced after its power-up");
    let peak = thesis.iter().copied().fold(0.0, f64::max);
    assert!(peak > 0.1, "{thesis:?}");
    let half_slot_rad = std::f64::consts::PI / slots;
    // Four standard deviations of a uniform error over the square root of the number of elements, and the loss.
    let allowed = 4.0 * half_slot_rad / 3f64.sqrt() / 6.0 + half_slot_rad.powi(2) / 6.0 + 0.002;
    for (board, thesis) in board[2..].iter().zip(&thesis[2..]) {
        assert!((board - thesis).abs() < allowed * peak, "{board} {thesis}, {allowed} of {peak}");
    }
}

/// Channels of a board for 36 elements, in irregular order.
fn irregular_channels(of: usize) -> Vec<usize> {
    (0..36).map(|element| element * 29 % of).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sonic_surface_is_driven() {
    let channels = irregular_channels(256);
    let driver = format!("[focus_array.sonic_surface.wiring]\nchannels = {channels:?}");
    let truth = format!("[virtual.array]\ncontroller = \"sonic-surface\"\nchannels = {channels:?}");
    agrees_with_the_thesis_controller(&driver, &truth, 32.0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn two_chained_sonic_surfaces_are_driven() {
    let channels = irregular_channels(509);
    let driver = format!("[focus_array.sonic_surface]\nboards = 2\nwiring.channels = {channels:?}");
    let truth = format!(
        "[virtual.array]\ncontroller = \"sonic-surface\"\nboards = 2\nchannels = {channels:?}"
    );
    agrees_with_the_thesis_controller(&driver, &truth, 32.0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_chain_of_ultraino_megas_is_driven() {
    let channels = irregular_channels(127);
    let driver = format!(
        "[focus_array.ultraino]\nboards = 2\nstarts_within_s = 0.0\nexpects_echo = true\nwiring.channels = {channels:?}"
    );
    let truth = format!(
        "[virtual.array]\ncontroller = \"ultraino-mega\"\nboards = 2\nchannels = {channels:?}"
    );
    agrees_with_the_thesis_controller(&driver, &truth, 10.0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_known_polarity_is_compensated_in_the_host() {
    let channels = irregular_channels(256);
    let wired = |more: &str| {
        let driver = format!("[focus_array.sonic_surface.wiring]\nchannels = {channels:?}\n{more}");
        let array =
            format!("[virtual.array]\ncontroller = \"sonic-surface\"\nchannels = {channels:?}");
        rig(STREAM, &driver, &array)
    };
    let inverted =
        "[microphone]\nsensitivity_v_pa = 0.001\n[effects.polarity]\nelements = [3, 14, 15, 20]\n";
    let right = readings(&wired(""), QUIET).await;
    let wrong = readings(&wired(""), inverted).await;
    let mended = readings(&wired("inverted = [3, 14, 15, 20]"), inverted).await;
    // Point 5 of the plane is the focus.
    assert!(wrong[6] < 0.85 * right[6], "{wrong:?} {right:?}");
    assert_eq!(mended, right, "half a period is sixteen slots, without any rounding");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_gets_the_drive() {
    let folder = tempfile::tempdir().expect("a folder");
    let sink = "[focus_array.file]\npath = \"delays.csv\"\nelements = 36";
    let (record, events) = scan(folder.path(), &rig(STREAM, sink, ""), QUIET).await;
    assert_eq!(record.samples.len(), 11);
    let never = |event: &Event| matches!(event, Event::Opened { array, .. } if array.contains("never answers"));
    assert!(events.iter().any(never), "{events:?}");
    let told =
        std::fs::read_to_string(folder.path().join("delays.csv")).expect("beside the rig file");
    let states: Vec<Vec<&str>> =
        told.lines().skip(1).map(|line| line.split(',').skip(1).collect()).collect();
    let emitting: Vec<&str> = states.iter().map(|state| state[0]).collect();
    assert_eq!(emitting.iter().filter(|state| **state == "true").count(), 1);
    assert_eq!(emitting.last(), Some(&"false"));
    // Delays at the focus: the longest path minus that of each element, at 343 m/s.
    let emits = states.iter().find(|state| state[0] == "true").expect("it emits");
    let path = |element: usize| {
        let x = (element % 6) as f64 * 10.5 - 26.25 - 5.0;
        let y = 26.25 - (element / 6) as f64 * 10.5 + 5.0;
        (x * x + y * y + 3600.0).sqrt()
    };
    let farthest = (0..36).map(path).fold(0.0, f64::max);
    for element in 0..36 {
        let told_us: f64 = emits[3 + element].parse().expect("a delay");
        assert!(
            (told_us - (farthest - path(element)) / 0.343).abs() < 6e-4,
            "{element}: {told_us}"
        );
    }
}

/// Compares a receiver's readings with those of the stream receiver, at the same points of the same field.
async fn agrees_with_the_stream(receiver: &str, virtual_receiver: &str, tolerance: f64) {
    let told = readings(&rig(receiver, THESIS, virtual_receiver), QUIET).await;
    let stream = readings(&rig(STREAM, THESIS, ""), QUIET).await;
    assert_eq!((told.len(), stream.len()), (11, 11));
    let peak = stream.iter().copied().fold(0.0, f64::max);
    for (told, stream) in told.iter().zip(&stream) {
        assert!((told - stream).abs() < tolerance * peak, "{told} {stream}, peak {peak}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_oscilloscope_is_read_over_a_network_socket() {
    // 24.24 cycles per record; one step of the 8 bits is 1.6 % of the range.
    let scope = "[receiver.scpi]\nsetup = [\":CHAN1:SCAL 0.5\", \":TIM:MAIN:SCAL 50.5e-6\"]";
    agrees_with_the_stream(scope, "[virtual.receiver]\nmode = \"scpi\"", 2e-3).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_analog_pin_of_marlin_is_read() {
    let pin = "[receiver.marlin_pin]\npin = 57";
    agrees_with_the_stream(pin, "[virtual.receiver]\nmode = \"marlin-pin\"", 2e-3).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_logger_that_only_prints_numbers_is_read() {
    let logger = "[receiver.free-running]\nlines = \"value\"\nrate_hz = 1000.0\nunit = \"V\"\nfull_scale = 5.0\nlatency_ms = 10.0";
    let told = rig(logger, THESIS, "[virtual.receiver]\nmode = \"numbers\"")
        .replace("pace = \"lockstep\"", "pace = { times = 1.0 }");
    let told = readings(&told, QUIET).await;
    let stream = readings(&rig(STREAM, THESIS, ""), QUIET).await;
    let peak = stream.iter().copied().fold(0.0, f64::max);
    for (told, stream) in told.iter().zip(&stream) {
        assert!((told - stream).abs() < 2e-3 * peak, "{told} {stream}, peak {peak}");
    }
}

/// A rig with an environment sensor.
fn with_environment(environment: &str, sensor: &str) -> String {
    let mut rig = rig(STREAM, THESIS, sensor);
    let at = rig.find("[virtual]").expect("it has a virtual part");
    rig.insert_str(at, environment);
    rig
}

const ASKED: &str =
    "[environment.lines]\npattern = \"T={temperature_c} RH={humidity_percent}\"\nask = \"R\"\n";

#[tokio::test(flavor = "multi_thread")]
async fn the_environment_is_recorded_and_gives_the_speed_of_sound() {
    let folder = tempfile::tempdir().expect("a folder");
    let environment = format!("[environment]\nevery_s = 0.5\nsound_speed = true\n{ASKED}");
    let sensor = "[virtual.environment]\ntemperature_c = 26.0\nhumidity_percent = 40.0\nwarms_c_per_h = 360.0";
    // The record must have the value of Cramer's formula at 26 °C and 40 %; the field uses the same air.
    let speed = fieldgap::acoustics::Medium::air(26.0, 40.0, 101.325).speed_of_sound_m_s;
    let truth = format!("{QUIET}[effects.sound-speed]\nc_m_s = {speed}\n");
    let (record, _) = scan(folder.path(), &with_environment(&environment, sensor), &truth).await;
    assert!((record.setup.medium.medium().speed_of_sound_m_s - speed).abs() < 0.02);
    assert!((speed - 343.0).abs() > 3.0, "{speed}");
    // The focus is the peak only if the delays are for that air.
    let levels: Vec<f64> = record.samples.iter().map(|sample| sample.reading).collect();
    assert!(levels[2..].iter().all(|level| *level <= levels[6]), "{levels:?}");
    let kept =
        std::fs::read_to_string(folder.path().join("scan").join(fieldgap::acquisition::AIR_FILE))
            .expect("it is kept");
    let rows: Vec<Vec<f64>> = kept
        .lines()
        .skip(1)
        .map(|line| line.split(',').filter_map(|word| word.parse().ok()).collect())
        .collect();
    assert!(rows.len() > 2 && rows.is_sorted_by(|a, b| a[0] + 0.5 <= b[0]), "{kept}");
    for row in &rows {
        // It warms by 0.1 °C per second from power-up.
        assert!(row[1] >= 26.0 + 0.1 * row[0] - 0.01 && row[2] == 40.0, "{kept}");
    }
    let last_s = record.samples.last().expect("eleven").time_s;
    assert!(rows.iter().all(|row| row[0] <= last_s));
}

#[tokio::test(flavor = "multi_thread")]
async fn without_sound_speed_the_sensor_does_not_change_the_medium() {
    let folder = tempfile::tempdir().expect("a folder");
    let sensor = "[virtual.environment]\ntemperature_c = 26.0\nhumidity_percent = 40.0\n";
    let (record, _) = scan(folder.path(), &with_environment(ASKED, sensor), QUIET).await;
    assert_eq!(record.setup.medium.medium().speed_of_sound_m_s, 343.0);
    assert!(folder.path().join("scan/environment.csv").is_file());
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unexpected_sensor_line_is_reported_before_the_scan() {
    let folder = tempfile::tempdir().expect("a folder");
    let pattern = ASKED.replace("RH=", "H=") + "line_within_s = 0.2\n";
    let sensor = "[virtual.environment]\ntemperature_c = 26.0\nhumidity_percent = 40.0\n";
    for (name, text) in [
        ("rig.toml", with_environment(&pattern, sensor)),
        ("truth.toml", String::new()),
        ("plan.toml", PLAN.to_owned()),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let campaign = PlannedScan::read(&folder.path().join("plan.toml"), None).expect("a valid plan");
    let refused = ScanRun::begin(campaign, &folder.path().join("scan"), simulated_devices).await;
    let error = refused.err().expect("it says `RH`").to_string();
    assert!(
        error.starts_with("environment sensor on /dev/pts/") && error.contains("T=26.00"),
        "{error}"
    );
}

/// A rig set-up and its virtual rig, for faults injected into a device.
fn opened_rig(rig: &str) -> (tempfile::TempDir, RigSetup, VirtualRig) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("truth.toml"), QUIET).expect("written");
    let rig_file =
        RigFile::parse(TomlSource::new(&folder.path().join("rig.toml"), rig)).expect("valid");
    let firmware = rig_file.open_virtual().expect("it opens").expect("it is virtual");
    (folder, rig_file.setup, firmware)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_board_that_emits_after_power_up_or_reset_is_silenced() {
    let channels = irregular_channels(256);
    let driver = format!("[focus_array.sonic_surface.wiring]\nchannels = {channels:?}");
    let truth = format!("[virtual.array]\ncontroller = \"sonic-surface\"\nchannels = {channels:?}");
    let (_folder, rig_setup, firmware) = opened_rig(&rig(STREAM, &driver, &truth));
    let emitting = || firmware.world().drive_at(f64::MAX).outputs().into_iter().flatten().count();
    // Answered when the board has started.
    assert!(firmware.inject(Part::Array, Fault::Reset));
    assert_eq!(emitting(), 36, "it powers up at full drive");
    let mut array = open_array(&rig_setup.rig, &firmware.ports()).await.expect("it opens");
    assert!(!array.identity().acknowledges);
    assert_eq!(emitting(), 0, "opening silences it");
    let last_words = array.emergency().expect("a port can be held open").bytes;
    assert_eq!((last_words.len(), &last_words[..3]), (517, &[151, 254, 32][..]));
    let mut delays = vec![ElementDelay::Silent; 36];
    delays[7] = ElementDelay::Seconds(6.25e-6);
    array.set_delays(&delays).await.expect("36");
    array.emit().await.expect("open");
    let output = firmware.world().drive_at(f64::MAX).outputs()[7].expect("it sounds");
    assert!((output.delay_s - 6.25e-6).abs() < 1e-12 && emitting() == 1);
    assert!(firmware.inject(Part::Array, Fault::Reset));
    assert_eq!(emitting(), 36, "a brown-out");
    array.refresh().await.expect("open");
    assert_eq!(emitting(), 1, "the next point is right again");
    assert!(firmware.inject(Part::Array, Fault::Unplug));
    let error = array.silence().await.expect_err("it is unplugged");
    assert!(matches!(error.cause(), Cause::Disconnected), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_oscilloscope_reset_or_disconnection_is_reported() {
    let scope = "[receiver.scpi]\nanswer_within_s = 0.5\n";
    let (_folder, rig_setup, firmware) =
        opened_rig(&rig(scope, THESIS, "[virtual.receiver]\nmode = \"scpi\""));
    let mut rig = open(&rig_setup.rig, &firmware.ports()).await.expect("it opens");
    let settle = std::time::Duration::from_millis(1);
    assert_eq!(rig.receiver().read_point(settle, 2).await.expect("it answers").count, 2);
    // One answer is lost: the call times out, and the next one is synchronous again.
    assert!(firmware.inject(Part::Receiver, Fault::OnLines(LineFault::LoseAll)));
    let error = rig.receiver().read_point(settle, 1).await.expect_err("no answer");
    assert!(matches!(error.cause(), Cause::Silent { .. } | Cause::Unreadable { .. }), "{error}");
    assert_eq!(rig.receiver().read_point(settle, 2).await.expect("it answers").count, 2);
    assert!(firmware.inject(Part::Receiver, Fault::Reset));
    assert!(rig.receiver().read_point(settle, 1).await.is_ok(), "its settings are the same");
    assert!(firmware.inject(Part::Receiver, Fault::Unplug));
    let error = rig.receiver().read_point(settle, 1).await.expect_err("it is unplugged");
    assert!(matches!(error.cause(), Cause::Disconnected), "{error}");
    assert!(error.to_string().starts_with("receiver on 127.0.0.1:"), "{error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_check_reports_the_identity_of_each_device() {
    let sink = "[focus_array.file]\npath = \"delays.csv\"\nelements = 36";
    let pin = "[receiver.marlin_pin]\npin = 57";
    let mut text = rig(
        pin,
        sink,
        "[virtual.receiver]\nmode = \"marlin-pin\"\n[virtual.environment]\ntemperature_c = 21.3\nhumidity_percent = 45.0",
    );
    text.insert_str(text.find("[virtual]").expect("it has a virtual part"), ASKED);
    let (_folder, rig_setup, firmware) = opened_rig(&text);
    let report = check(&rig_setup.rig, &firmware.ports(), 36, None).await;
    assert!(report.can_scan(), "{report}");
    let said = report.to_string();
    for words in ["21.3 °C, 45 %", "this controller never answers", "a file, 36 elements"] {
        assert!(said.contains(words), "no `{words}` in {said}");
    }
}
