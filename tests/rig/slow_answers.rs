//! Scans with answers that come late and in slices, on pseudo-terminals: the readings are those of prompt answers.

use std::path::Path;

use fieldgap::acquisition::{Ending, Event, PlannedScan, ScanRun};
use fieldgap::records::{RecordedSample, RecordedScan};
use fieldgap::rig_file::simulated_devices;

const PLAN: &str = "name = \"slow\"\nrig = \"rig.toml\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 5.0\ny_mm = -5.0\nz_mm = 60.0\n\
     [dark]\nbefore = 1\nafter = 0\n";
const POINTS: &str =
    "[[plane]]\nz_mm = 60.0\ncentre_mm = [5.0, -5.0]\nsize_mm = [12.0, 6.0]\nstep_mm = 6.0\n";
const ROWS: &str = "[[plane]]\nz_mm = 60.0\ncentre_mm = [5.0, -5.0]\nsize_mm = [30.0, 2.0]\nstep_mm = 2.0\n[fly]\nspeed_mm_s = 90.0\n";

/// A receiver without saturation and noise.
const QUIET: &str = "[microphone]\nsensitivity_v_pa = 0.001\n";

/// Sizes of slices: single bytes, pieces of a line, and what the kernel holds at once.
const SLICES: [usize; 3] = [1, 7, 4096];

/// A rig file of the project without its truth file, with replaced lines.
fn rig(file: &str, changes: &[(&str, &str)]) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs").join(file);
    let mut text = std::fs::read_to_string(path).expect("it is there");
    for (from, to) in [("truth/thesis-lab.toml", "truth.toml")].iter().chain(changes) {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

/// The rig whose devices answer late and in slices of at most so many bytes.
fn slowly(rig: &str, slice_bytes: usize) -> String {
    // A pause takes a millisecond at least: small slices with pauses would be too slow for a receiver.
    let pause_ms = if slice_bytes > 1000 { 2.0 } else { 0.0 };
    let mut text = format!("{rig}\n[virtual.answers]\n");
    for device in ["robot", "receiver", "array", "environment"] {
        text += &format!(
            "{device} = {{ delay_ms = [0.0, 3.0], slice_bytes = {slice_bytes}, slice_pause_ms = [0.0, {pause_ms}] }}\n"
        );
    }
    text
}

async fn samples(rig: &str, regions: &str) -> Vec<RecordedSample> {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("written");
    };
    write("rig.toml", rig);
    write("truth.toml", QUIET);
    write("plan.toml", &format!("{PLAN}{regions}"));
    let plan = PlannedScan::read(&folder.path().join("plan.toml"), None).expect("a valid plan");
    let out = folder.path().join("scan");
    let scan = ScanRun::begin(plan, &out, simulated_devices).await.expect("the rig opens");
    let mut watch = |_: &Event| {};
    let ended = scan.run(&mut watch, std::future::pending()).await.expect("it is kept");
    assert_eq!(ended, Ending::Complete, "{rig}");
    RecordedScan::open(&out).expect("the record is whole").samples
}

/// In lockstep nothing depends on the computer's time, so that even the times in the record are the same.
async fn reads_the_same(rig: &str, regions: &str, points: usize) {
    let prompt = samples(rig, regions).await;
    assert_eq!(prompt.len(), points);
    for slice_bytes in SLICES {
        assert_eq!(samples(&slowly(rig, slice_bytes), regions).await, prompt, "{slice_bytes}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn each_robot_is_where_it_is_with_prompt_answers() {
    for file in ["virtual.toml", "virtual-grbl.toml"] {
        reads_the_same(&rig(file, &[]), POINTS, 1 + 6).await;
    }
    let hal = rig("virtual-grbl.toml", &[("firmware = \"grbl\"", "firmware = \"grblhal\"")]);
    reads_the_same(&hal, POINTS, 1 + 6).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn rows_at_constant_speed_are_the_same() {
    for file in ["virtual.toml", "virtual-grbl.toml"] {
        reads_the_same(&rig(file, &[]), ROWS, 1 + 2 * 16).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn text_samples_and_boards_with_an_echo_are_read() {
    let text = rig("virtual.toml", &[("encoding = \"binary\"", "encoding = \"text\"")]);
    reads_the_same(&text, POINTS, 1 + 6).await;
    let channels: Vec<usize> = (0..36).collect();
    let echo = format!(
        "[focus_array.ultraino]\nstarts_within_s = 0.0\nexpects_echo = true\nwiring.channels = {channels:?}\n"
    );
    let unmodulated = [
        ("[focus_array.thesis]", echo.as_str()),
        ("modulation_hz = 200.0", "modulation_hz = 0.0"),
        ("modulation_duty_percent = 50.0", "modulation_duty_percent = 100.0"),
    ];
    let board = rig("virtual.toml", &unmodulated)
        + "\n[virtual.array]\ncontroller = \"ultraino-mega\"\n"
        + &format!("channels = {channels:?}\n");
    reads_the_same(&board, POINTS, 1 + 6).await;
}

/// Asked more or less often while they answer late, these take their readings at other times; the field is the same.
async fn reads_the_same_level(rig: &str) {
    let [one, seven, most] = SLICES.map(|slice_bytes| slowly(rig, slice_bytes));
    // All at once, because those in real time have to wait for their robots.
    let (prompt, one, seven, most) = tokio::join!(
        samples(rig, POINTS),
        samples(&one, POINTS),
        samples(&seven, POINTS),
        samples(&most, POINTS)
    );
    let peak = prompt.iter().map(|sample| sample.reading).fold(0.0, f64::max);
    assert!(prompt.len() == 7 && peak > 0.05, "{prompt:?}");
    for slow in [one, seven, most] {
        for (slow, prompt) in slow.iter().zip(&prompt) {
            assert_eq!(slow.position_mm, prompt.position_mm);
            let off = (slow.reading - prompt.reading).abs();
            assert!(off < 4e-3 * peak, "{slow:?} {prompt:?}");
        }
    }
}

/// A rig with another receiver than the protocol's.
fn with_receiver(receiver: &str, virtual_receiver: &str) -> String {
    let stream = "[receiver.stream]\nencoding = \"binary\"";
    let settings = format!("[virtual.receiver]\n{virtual_receiver}");
    rig("virtual.toml", &[(stream, receiver), ("[virtual.receiver]", &settings)])
}

#[tokio::test(flavor = "multi_thread")]
async fn an_oscilloscope_and_a_pin_of_marlin_are_read() {
    let scope = "[receiver.scpi]\nsetup = [\":CHAN1:SCAL 0.5\", \":TIM:MAIN:SCAL 50.5e-6\"]";
    reads_the_same_level(&with_receiver(scope, "mode = \"scpi\"")).await;
    reads_the_same_level(&with_receiver(
        "[receiver.marlin_pin]\npin = 57",
        "mode = \"marlin-pin\"",
    ))
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn receivers_that_run_freely_give_no_sample_of_before() {
    for (lines, mode) in [("time-and-value", "free-running"), ("value", "numbers")] {
        let receiver = format!(
            "[receiver.free-running]\nlines = \"{lines}\"\nrate_hz = 1000.0\nunit = \"V\"\nfull_scale = 5.0\nlatency_ms = 20.0"
        );
        let rig = with_receiver(&receiver, &format!("mode = \"{mode}\""));
        let rig = rig
            .replace("pace = \"lockstep\"", "pace = { times = 1.0 }")
            .replace("feed_mm_s = 80.0", "feed_mm_s = 200.0")
            .replace(
                "[virtual.robot]",
                "[virtual.robot]\nparked_mm = [5.0, 5.0, 5.0]\nhoming_feed_mm_s = 100.0",
            );
        reads_the_same_level(&rig).await;
    }
}
