//! The controller's protocol as seen by a driver.

use proptest::prelude::*;

use super::super::clock::Pace;
use super::super::testing;
use super::*;

fn powered_up() -> (ArrayFirmware, Arc<World>) {
    let (world, _) = testing::world("", Pace::Lockstep);
    let mut firmware = ArrayFirmware::new(36, 40e3, world.clone());
    firmware.power_up(0.0, &mut Vec::new());
    (firmware, world)
}

fn raw(firmware: &mut ArrayFirmware, line: &str) -> String {
    let mut out = Vec::new();
    line.bytes().for_each(|byte| firmware.receive(byte, 1.0));
    firmware.step(1.0, &mut out);
    String::from_utf8(out).expect("text")
}

fn sealed(body: &str) -> String {
    format!("{body}*{:08x}\n", crc32fast::hash(body.as_bytes()))
}

/// Sends a line with its checksum; the answer must have one too, and is returned without it.
fn send(firmware: &mut ArrayFirmware, body: &str) -> String {
    let answer = raw(firmware, &sealed(body));
    let (text, _) = answer.rsplit_once('*').expect("a checksum");
    assert_eq!(answer, sealed(text));
    text.to_owned()
}

#[test]
fn it_says_who_it_is() {
    let (mut firmware, _) = powered_up();
    assert_eq!(
        send(&mut firmware, "7 hello"),
        "7 ok thesis-array 1 elements=36 clock_hz=10240000 period_steps=256 frames=4096 levels=4096 sensors=4"
    );
}

#[test]
fn it_is_silent_until_it_is_switched_on() {
    let (mut firmware, world) = powered_up();
    assert_eq!(send(&mut firmware, "1 state"), "1 ok off");
    assert_eq!(world.reading_v(2.0, 0), 0.0);
    assert_eq!(send(&mut firmware, "2 on"), "2 ok");
    assert_eq!(send(&mut firmware, "3 state"), "3 ok on");
    assert!(world.reading_v(2.0, 0) > 0.0);
    firmware.power_up(3.0, &mut Vec::new());
    assert_eq!(world.reading_v(3.0, 0), 0.0, "a reset silences it");
}

#[test]
fn delays_take_effect_at_once_and_a_dash_silences_an_element() {
    let (mut firmware, world) = powered_up();
    send(&mut firmware, "1 on");
    let before = world.reading_v(1.0, 0);
    let delays: Vec<String> = (0..36).map(|n| (7 * n % 256).to_string()).collect();
    assert_eq!(send(&mut firmware, &format!("2 delays {}", delays.join(" "))), "2 ok");
    assert!((world.reading_v(1.0, 0) - before).abs() > 1e-3);
    assert_eq!(send(&mut firmware, &format!("3 delays{}", " -".repeat(36))), "3 ok");
    assert_eq!(world.reading_v(1.0, 0), 0.0);
}

#[test]
fn modulation_scales_the_reading() {
    let (mut firmware, world) = powered_up();
    send(&mut firmware, "1 on");
    let whole = world.reading_v(1.0, 0);
    assert_eq!(send(&mut firmware, "2 modulate 200 50"), "2 ok");
    assert!((world.reading_v(1.0, 0) / whole - 0.5).abs() < 1e-12);
    send(&mut firmware, "3 modulate 0 100");
    assert!((world.reading_v(1.0, 0) / whole - 1.0).abs() < 1e-12);
}

#[test]
fn a_damaged_line_is_refused_without_a_number() {
    let (mut firmware, _) = powered_up();
    assert_eq!(raw(&mut firmware, "1 on*00000000\n"), sealed("- error 1 checksum"));
    assert_eq!(raw(&mut firmware, "\n"), sealed("- error 1 checksum"));
    assert_eq!(send(&mut firmware, "2 state"), "2 ok off", "it did nothing");
}

#[test]
fn wrong_commands_and_arguments_are_refused_with_a_code() {
    let (mut firmware, _) = powered_up();
    for (line, answer) in [
        ("1 dance", "1 error 2 "),
        ("2 delays 1 2 3", "2 error 3 "),
        ("3 modulate 200", "3 error 3 "),
        ("4 modulate 200 101", "4 error 3 "),
        ("5 modulate NaN 50", "5 error 3 "),
        ("6 on now", "6 error 3 "),
    ] {
        assert!(send(&mut firmware, line).starts_with(answer), "{line}");
    }
    let too_large = format!("7 delays{}", " 256".repeat(36));
    assert!(send(&mut firmware, &too_large).starts_with("7 error 3 "));
}

/// Three frames of two periods under an envelope of two levels.
fn loaded() -> (ArrayFirmware, Arc<World>) {
    let (mut firmware, world) = powered_up();
    for (seq, channel) in ["0", "64", "128:200"].into_iter().enumerate() {
        let channels = format!(" {channel}").repeat(36);
        assert_eq!(
            send(&mut firmware, &format!("{seq} frame {seq} 2{channels}")),
            format!("{seq} ok")
        );
    }
    assert_eq!(send(&mut firmware, "3 envelope 0 255"), "3 ok");
    assert_eq!(send(&mut firmware, "4 envelope 1 100"), "4 ok");
    (firmware, world)
}

#[test]
fn a_display_plays_as_often_as_it_was_asked_to_and_falls_silent() {
    let (mut firmware, world) = loaded();
    assert_eq!(send(&mut firmware, "5 play 3 2 3 1000 60000"), "5 ok");
    assert_eq!(send(&mut firmware, "6 state"), "6 ok playing");
    let played = world.drive_at(1.0).display.expect("it plays");
    let program = played.program();
    assert_eq!((program.frames().len(), program.envelope().levels()), (3, &[255, 100][..]));
    assert_eq!(
        program.frames()[2].channels()[7],
        fieldgap_rig::focus_array::Channel { delay_steps: 128, level: 200 }
    );
    assert!(world.reading_v(1.1, 0) > 0.0);
    // A thousand loops of six periods of 25 us.
    let ends_s = firmware.wake().expect("it ends by itself").at_s;
    assert!((ends_s - 1.15).abs() < 1e-9, "{ends_s}");
    firmware.step(2.0, &mut Vec::new());
    assert!(!world.drive_at(1.151).emitting && world.drive_at(1.149).emitting);
    assert_eq!(world.reading_v(1.2, 0), 0.0);
}

#[test]
fn a_host_that_says_no_more_loses_its_display() {
    let (mut firmware, world) = loaded();
    send(&mut firmware, "5 play 3 2 3 0 500");
    assert!((firmware.wake().expect("the lease").at_s - 1.5).abs() < 1e-9);
    firmware.step(1.4, &mut Vec::new());
    assert!(world.drive_at(1.4).emitting);
    firmware.step(1.6, &mut Vec::new());
    assert!(!world.drive_at(1.6).emitting);
    assert_eq!(send(&mut firmware, "6 state"), "6 ok off");
}

#[test]
fn off_ends_a_display_and_a_reset_forgets_it() {
    let (mut firmware, world) = loaded();
    send(&mut firmware, "5 play 3 2 3 0 500");
    assert_eq!(send(&mut firmware, "6 off"), "6 ok");
    assert!(!world.drive_at(1.0).emitting && world.drive_at(1.0).display.is_none());
    send(&mut firmware, "7 play 3 2 3 0 500");
    firmware.power_up(1.0, &mut Vec::new());
    assert!(!world.drive_at(1.0).emitting);
    assert!(
        send(&mut firmware, "8 play 3 2 3 0 500").starts_with("8 error 3 "),
        "nothing is loaded"
    );
}

#[test]
fn displays_that_make_no_sense_are_refused_with_a_code() {
    let (mut firmware, world) = loaded();
    let frame = |number: usize, channel: &str| {
        format!("9 frame {number} 2{}", format!(" {channel}").repeat(36))
    };
    for line in [
        frame(0, "256"),
        frame(0, "1:256"),
        frame(4096, "1"),
        "9 frame 0 2 1 2 3".to_owned(),
        "9 frame".to_owned(),
        "9 envelope 4095 1 2".to_owned(),
        "9 envelope 0 256".to_owned(),
        "9 play 4 2 3 0 500".to_owned(),
        "9 play 3 3 3 0 500".to_owned(),
        "9 play 3 2 0 0 500".to_owned(),
        "9 play 0 2 1 0 500".to_owned(),
        "9 play 3 2".to_owned(),
        "9 sense 250".to_owned(),
        "9 sense 250 1 2 3 4 5".to_owned(),
        "9 sense 250 36".to_owned(),
        "9 sense 1001 1".to_owned(),
    ] {
        let answer = send(&mut firmware, &line);
        assert!(answer.starts_with("9 error 3 "), "{line}: {answer}");
    }
    assert!(!world.drive_at(1.0).emitting);
    send(&mut firmware, "5 play 3 2 3 0 500");
    assert!(send(&mut firmware, &frame(0, "1")).starts_with("9 error 4 "), "while it plays");
}

#[test]
fn elements_that_listen_are_silent_and_told_at_their_rate() {
    let (mut firmware, world) = powered_up();
    send(&mut firmware, "1 on");
    assert_eq!(send(&mut firmware, "2 sense 100 0 5 30 35"), "2 ok");
    assert_eq!(world.drive_at(1.0).outputs().iter().filter(|output| output.is_none()).count(), 4);
    let mut out = Vec::new();
    firmware.step(1.1, &mut out);
    let lines = String::from_utf8(out).expect("text");
    let samples: Vec<Sensed> = lines.lines().filter_map(Sensed::decode).collect();
    assert_eq!(samples.len(), 10);
    assert_eq!((samples[9].number, samples[9].t_us), (9, 1_100_000));
    assert!(samples.iter().all(|sample| sample.volts.len() == 4 && sample.volts[0] > 0.0));
    assert_eq!(send(&mut firmware, "3 sense 0"), "3 ok");
    assert!(world.drive_at(1.0).outputs().iter().all(Option::is_some));
}

proptest! {
    #[test]
    fn any_bytes_are_answered_with_sealed_lines(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let (mut firmware, _) = powered_up();
        let mut out = Vec::new();
        bytes.iter().for_each(|&byte| firmware.receive(byte, 0.0));
        firmware.step(0.0, &mut out);
        let lines = bytes.iter().filter(|&&byte| byte == b'\n').count();
        prop_assert_eq!(out.iter().filter(|&&byte| byte == b'\n').count(), lines);
    }

    #[test]
    fn any_sealed_text_is_answered_and_does_not_panic(text in "[ -~]{0,80}") {
        let (mut firmware, _) = powered_up();
        let answer = raw(&mut firmware, &sealed(&text));
        prop_assert!(answer.contains(" ok") || answer.contains(" error "));
    }
}
