//! Displays on a rig: the virtual array receives the composed program, and it is silent after every end.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use fieldgap::acquisition::RigSetup;
use fieldgap::display::{
    ComposedDisplay, DisplayFile, Playback, PlaybackEnd, RadiatingArray, compose, play,
};
use fieldgap::input::TomlSource;
use fieldgap::level::level_db;
use fieldgap::rig::{ArrayIdentity, FocusArray, open_array};
use fieldgap::rig_file::RigFile;
use fieldgap::sensing::{Direction, Swipe, SwipeListener};
use fieldgap::virtual_rig::VirtualRig;
use fieldgap::virtual_rig::gestures::Gesture;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A rig file of the repository, at a multiple of real time.
fn rig_setup(name: &str, times: f64) -> RigSetup {
    let path = root().join("rigs").join(name);
    let text = std::fs::read_to_string(&path).expect("the rig file is there");
    let lines = text.lines().map(|line| match line.starts_with("pace = ") {
        true => format!("pace = {{ times = {times:?} }}\n"),
        false => format!("{line}\n"),
    });
    RigSetup::parse(TomlSource::new(&path, lines.collect::<String>())).expect("valid")
}

fn opened(rig_setup: &RigSetup) -> VirtualRig {
    RigFile::of(rig_setup.clone())
        .expect("valid")
        .open_virtual()
        .expect("it opens")
        .expect("it is virtual")
}

fn display(text: &str) -> DisplayFile {
    let head = "name = \"test\"\nrig = \"rigs/virtual.toml\"\n";
    DisplayFile::parse(TomlSource::new(&root().join("test.toml"), format!("{head}{text}")))
        .expect("valid")
}

fn radiating<'a>(rig_setup: &'a RigSetup, display: &DisplayFile) -> RadiatingArray<'a> {
    RadiatingArray {
        array: rig_setup.nominal_array(),
        medium: rig_setup.nominal_medium(),
        frequency_hz: rig_setup.array.frequency_hz(),
        transducer: display.output.simulator.transducer(rig_setup.nominal_array()),
    }
}

async fn array(rig_setup: &RigSetup, rig: &VirtualRig) -> (Box<dyn FocusArray>, ArrayIdentity) {
    let array = open_array(&rig_setup.rig, &rig.ports()).await.expect("it answers");
    let identity = array.identity().clone();
    (array, identity)
}

fn composed(
    rig_setup: &RigSetup,
    display: &DisplayFile,
    controller: &ArrayIdentity,
) -> ComposedDisplay {
    compose(display, &radiating(rig_setup, display), controller).expect("it fits")
}

const TWO_FOCI: &str = "[modulation.am]\nfrequency_hz = 173.0\n[[focus]]\n\
    path.circle = { centre_mm = [0, 0, 100], radius_mm = 15 }\nloops_per_s = 4\n\
    [[focus]]\npath.point_mm = [-5, 12, 110]\nlevel = 0.5\n";

#[tokio::test(flavor = "multi_thread")]
async fn the_array_receives_the_composed_program_and_is_silent_afterwards() {
    let rig_setup = rig_setup("virtual.toml", 1.0);
    let rig = opened(&rig_setup);
    let (mut array, identity) = array(&rig_setup, &rig).await;
    assert!(!rig.world().drive_at(rig.clock().now_s()).emitting, "silent when opened");
    let display = display(TWO_FOCI);
    let composed = composed(&rig_setup, &display, &identity);
    assert!(composed.program.frames().len() > 50);

    let received = async {
        loop {
            let drive = rig.world().drive_at(rig.clock().now_s());
            if let Some(played) = drive.display {
                assert!(drive.emitting);
                break played;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let playing = play(array.as_mut(), &composed.program, Some(0.3), std::future::pending());
    let (ended, received) = tokio::join!(playing, received);
    assert_eq!(ended.expect("played"), PlaybackEnd::Played);
    assert_eq!(received.program(), &composed.program);
    assert!(!rig.world().drive_at(rig.clock().now_s()).emitting, "silent when it is over");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_receiver_measures_the_predicted_level() {
    let rig_setup = rig_setup("virtual.toml", 1.0);
    let rig = opened(&rig_setup);
    let nozzle_m = rig.world().nozzle_m(0.0);
    let at_mm = nozzle_m * 1e3;
    let text = format!(
        "[[focus]]\npath.point_mm = [{:?}, {:?}, {:?}]\n[modulation.pwm]\nfrequency_hz = 200\nduty_percent = 40\n",
        at_mm.x, at_mm.y, at_mm.z
    );
    let (mut array, identity) = array(&rig_setup, &rig).await;
    let display = display(&text);
    let composed = composed(&rig_setup, &display, &identity);
    let begun_s = rig.clock().now_s();
    play(array.as_mut(), &composed.program, Some(0.1), std::future::pending())
        .await
        .expect("played");
    // In the middle of the playback, over several samples.
    let ended_s = rig.clock().now_s();
    let playing = |time_s: &f64| rig.world().drive_at(*time_s).display.is_some();
    let times: Vec<f64> = (0..10_000)
        .map(|n| begun_s + (ended_s - begun_s) * f64::from(n) / 1e4)
        .filter(playing)
        .collect();
    let settled = &times[times.len() / 2..];
    let heard_v = settled
        .iter()
        .enumerate()
        .map(|(n, &time_s)| rig.world().reading_v(time_s, n as u64))
        .sum::<f64>()
        / settled.len() as f64;
    // rigs/truth/thesis-lab.toml: 4 Pa at 1 m, 3 mV/Pa. The truth's field is the Rayleigh integral, the display's the far field.
    let element_db = level_db(4.0 / 0.3);
    let playback =
        Playback::new(&composed.program, radiating(&rig_setup, &display), &identity, element_db);
    let promised_v = 0.4 * 0.003 * playback.rms_pa(0, &[nozzle_m])[0];
    assert!((heard_v / promised_v - 1.0).abs() < 0.03, "{heard_v} V, promised {promised_v} V");
}

/// A rig file for the ports of an open virtual rig, for a program in another process, and a display for it.
fn files(folder: &Path, rig: &VirtualRig) -> (PathBuf, PathBuf) {
    let text =
        std::fs::read_to_string(root().join("rigs/virtual.toml")).expect("the rig file is there");
    let ports = rig.ports();
    let text = text[..text.find("[virtual]").expect("a virtual rig")]
        .replace(
            "[motion.marlin]",
            &format!("[motion.marlin]\nport = {:?}", ports.motion.expect("a port")),
        )
        .replace(
            "[receiver.stream]",
            &format!("[receiver.stream]\nport = {:?}", ports.receiver.expect("a port")),
        )
        .replace(
            "[focus_array.thesis]",
            &format!("[focus_array.thesis]\nport = {:?}", ports.focus_array.expect("a port")),
        );
    let (rig_file, display_file) = (folder.join("rig.toml"), folder.join("display.toml"));
    std::fs::write(&rig_file, text).expect("written");
    std::fs::write(&display_file, format!("name = \"test\"\nrig = \"rig.toml\"\n{TWO_FOCI}"))
        .expect("written");
    (rig_file, display_file)
}

fn until(what: &str, holds: impl Fn() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < Duration::from_secs(30), "waited in vain until {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Starts `focus` without a duration and waits until the array plays.
fn playing(rig: &VirtualRig, folder: &Path) -> Child {
    let (_, display) = files(folder, rig);
    let child = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .arg("focus")
        .arg(display)
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    until("it plays", || rig.world().drive_at(rig.clock().now_s()).display.is_some());
    child
}

fn signal(child: &Child, signal: rustix::process::Signal) {
    let id = rustix::process::Pid::from_child(child);
    rustix::process::kill_process(id, signal).expect("it is there");
}

#[test]
fn ctrl_c_silences_the_array() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = opened(&rig_setup("virtual.toml", 1.0));
    let mut child = playing(&rig, folder.path());
    signal(&child, rustix::process::Signal::INT);
    let mut said = String::new();
    child.stdout.take().expect("piped").read_to_string(&mut said).expect("text");
    assert!(child.wait().expect("it ends").success(), "{said}");
    assert!(said.ends_with("interrupted from the keyboard; the array is silent\n"), "{said}");
    assert!(!rig.world().drive_at(rig.clock().now_s()).emitting);
}

#[test]
fn after_a_kill_the_array_is_silent_at_the_end_of_the_lease() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = opened(&rig_setup("virtual.toml", 1.0));
    let mut child = playing(&rig, folder.path());
    signal(&child, rustix::process::Signal::KILL);
    child.wait().expect("it ends");
    let killed_s = rig.clock().now_s();
    until("it is silent", || !rig.world().drive_at(rig.clock().now_s()).emitting);
    assert!(rig.clock().now_s() - killed_s < 4.0, "the lease is two seconds");
}

#[tokio::test(flavor = "multi_thread")]
async fn swipes_are_detected_over_the_port() {
    let rig_setup = rig_setup("swipe.toml", 40.0);
    let rig = opened(&rig_setup);
    let (mut array, _) = array(&rig_setup, &rig).await;
    let section = rig_setup.sensing.expect("it listens");
    let mut session = SwipeListener::begin(array.as_mut(), section).await.expect("it listens");
    let begun_s = rig.clock().now_s();
    let mut swipes: Vec<Swipe> = Vec::new();
    let mut now_s = 0.0;
    while now_s < begun_s + 40.0 {
        let heard = session.next().await.expect("samples come");
        now_s = heard.time_s;
        swipes.extend(heard.swipe);
    }
    session.end().await.expect("silent");
    assert!(!rig.world().drive_at(rig.clock().now_s()).emitting);
    // Swipes after the learning time and before the end.
    let happened: Vec<Direction> = rig
        .world()
        .swipes_until(now_s)
        .into_iter()
        .filter(|swipe| swipe.begins_s > begun_s + 0.5 && swipe.ends_s < now_s - 0.5)
        .map(|swipe| if swipe.kind == Gesture::Left { Direction::Left } else { Direction::Right })
        .collect();
    let told: Vec<Direction> = swipes.iter().map(|swipe| swipe.direction).collect();
    assert!(happened.len() >= 5 && told.len() >= happened.len() - 1, "{happened:?} {told:?}");
    let agree = told
        .iter()
        .filter(|way| **way == Direction::Left)
        .count()
        .abs_diff(happened.iter().filter(|way| **way == Direction::Left).count());
    assert!(agree <= 2, "{happened:?} {told:?}");
}
