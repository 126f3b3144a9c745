//! The receiver's protocol as seen by a driver.

use num_complex::Complex64;
use proptest::prelude::*;

use super::super::clock::Pace;
use super::super::drive::Drive;
use super::super::testing;
use super::*;

struct Bench {
    firmware: ReceiverFirmware,
    now_s: f64,
}

impl Bench {
    fn with(settings: ReceiverSettings, truth: &str) -> Self {
        let (world, _) = testing::world(truth, Pace::Lockstep);
        world.drive(0.0, Drive { emitting: true, ..Drive::silent(36) });
        let mut firmware = ReceiverFirmware::new(settings, world);
        firmware.power_up(0.0, &mut Vec::new());
        Self { firmware, now_s: 0.0 }
    }

    fn new() -> Self {
        Self::with(ReceiverSettings::default(), "[noise]\nadditive_v = 0.01\n")
    }

    fn send(&mut self, text: &str) -> Vec<u8> {
        let mut out = Vec::new();
        text.bytes().for_each(|byte| self.firmware.receive(byte, self.now_s));
        self.firmware.step(self.now_s, &mut out);
        // What lockstep does: jump to what the answer needs.
        while let Some(wake) = self.firmware.wake().filter(|wake| wake.answer_needs_it) {
            self.now_s = wake.at_s;
            self.firmware.step(self.now_s, &mut out);
        }
        out
    }

    fn text(&mut self, text: &str) -> String {
        String::from_utf8(self.send(text)).expect("text was asked for")
    }

    fn wait(&mut self, seconds: f64) -> String {
        self.now_s += seconds;
        let mut out = Vec::new();
        self.firmware.step(self.now_s, &mut out);
        String::from_utf8(out).expect("text was asked for")
    }
}

#[test]
fn it_says_who_it_is_and_what_time_it_has() {
    let mut bench = Bench::new();
    assert_eq!(bench.text("?\n"), "receiver 1 rate_hz=1000 full_scale=5.000000 unit=V\n");
    bench.now_s = 1.5;
    assert_eq!(bench.text("T\n"), "time 1500000\n");
    assert!(bench.text("hello\n").starts_with("error "));
    assert!(bench.text("S many\n").starts_with("error "));
}

#[test]
fn n_samples_follow_the_command_and_then_an_end_mark() {
    let mut bench = Bench::new();
    bench.now_s = 2.0;
    let answer = bench.text("S 3\n");
    let lines: Vec<&str> = answer.lines().collect();
    assert!(lines[0].starts_with("0 2001000 ") && lines[2].starts_with("2 2003000 "), "{answer}");
    assert_eq!(lines[3], "end 3 2003000");
    assert!((bench.now_s - 2.003).abs() < 1e-12);
    assert!(bench.text("S 1\n").starts_with("3 2004000 "), "numbers go on");
}

#[test]
fn an_endless_run_follows_the_time_of_others_until_it_is_stopped() {
    let mut bench = Bench::new();
    assert_eq!(bench.text("S 0\n"), "");
    assert_eq!(bench.wait(0.0101).lines().count(), 10);
    assert!(bench.text("X\n").starts_with("end 10 "));
    assert_eq!(bench.wait(1.0), "");
}

#[test]
fn binary_frames_carry_the_same_samples_with_a_checksum() {
    let text = Bench::new().text("S 2\n");
    let mut bench = Bench::new();
    assert_eq!(bench.text("E binary\n"), "ok\n");
    let frames = bench.send("S 2\n");
    assert_eq!(frames.len(), 3 * 24);
    for (frame, line) in frames.chunks(24).zip(text.lines()) {
        assert_eq!(frame[..2], [0xa5, 0x5a]);
        assert_eq!(frame[20..], crc32fast::hash(&frame[2..20]).to_le_bytes());
        if frame[2] == 1 {
            let value = f32::from_le_bytes(frame[16..20].try_into().expect("four bytes"));
            let written: f32 =
                line.split(' ').nth(2).and_then(|v| v.parse().ok()).expect("a value");
            assert!((value - written).abs() < 1e-6);
        } else {
            assert_eq!(u32::from_le_bytes(frame[4..8].try_into().expect("four bytes")), 2);
        }
    }
}

#[test]
fn iq_frames_carry_the_amplitude_of_the_same_samples_and_the_phase_of_the_drives_clock() {
    let frames_with = |truth: &str| {
        let mut bench = Bench::with(ReceiverSettings::default(), truth);
        assert_eq!(bench.text("E iq\n"), "ok\n");
        bench.send("S 2\n")
    };
    let truth = "[noise]\nadditive_v = 0.01\nmultiplicative = 0.02\n";
    let text = Bench::with(ReceiverSettings::default(), truth).text("S 2\n");
    let [plain, turned] = ["", "[phase]\noffset_rad = 0.5\ndrift_rad_h = 1800.0\n"]
        .map(|phase| frames_with(&format!("{truth}{phase}")));
    assert_eq!((plain.len(), plain[2 * 28 + 2]), (2 * 28 + 24, 2));
    let part = |frame: &[u8], at: usize| {
        f64::from(f32::from_le_bytes(frame[at..at + 4].try_into().expect("four bytes")))
    };
    for (n, line) in text.lines().take(2).enumerate() {
        let [before, after] = [&plain, &turned].map(|frames| &frames[28 * n..28 * n + 28]);
        assert_eq!(
            (before[2], before[24..].to_vec()),
            (3, crc32fast::hash(&before[2..24]).to_le_bytes().to_vec())
        );
        let written: f64 = line.split(' ').nth(2).and_then(|v| v.parse().ok()).expect("a value");
        let [before, after] =
            [before, after].map(|frame| Complex64::new(part(frame, 16), part(frame, 20)));
        // Half a step of the converter in each part.
        assert!((before.norm() - written).abs() < 5.0 / 16383.0, "{before} {written}");
        // Samples are taken a millisecond apart from the power-up on.
        let turn_rad = 0.5 + 0.5 * 1e-3 * (n + 1) as f64;
        assert!(((after / before).arg() - turn_rad).abs() < 2e-3, "{before} {after}");
    }
}

#[test]
fn what_is_beyond_the_full_scale_is_marked_as_clipped() {
    let mut bench = Bench::with(ReceiverSettings::default(), "[effects.clipping]\nlevel = 0.01\n");
    assert!(bench.text("?\n").contains("full_scale=0.010000"));
    assert!(bench.text("S 1\n").starts_with("0 1000 0.010000 !\n"));
}

#[test]
fn a_free_running_receiver_streams_and_heeds_no_command() {
    let settings = ReceiverSettings { mode: Mode::FreeRunning, ..ReceiverSettings::default() };
    let mut bench = Bench::with(settings, "");
    assert_eq!(bench.text("?\nX\n"), "");
    let output = bench.wait(0.0051);
    assert_eq!(output.lines().count(), 5);
    assert_eq!(output.lines().next().map(|line| line.split(' ').count()), Some(2));
    assert!(bench.wait(100.0).lines().count() < 300, "it never falls far behind");
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let mut bench = Bench::new();
        bytes.iter().for_each(|&byte| bench.firmware.receive(byte, 0.0));
        bench.firmware.step(0.01, &mut Vec::new());
        let _ = bench.firmware.wake();
    }

    #[test]
    fn words_of_the_protocol_in_any_order_do_not_either(
        lines in prop::collection::vec("(S|E|X|T|\\?)( (text|binary|iq|[0-9]{1,2}))?", 0..12),
    ) {
        let mut bench = Bench::new();
        for line in lines {
            bench.send(&format!("{line}\n"));
        }
    }
}
