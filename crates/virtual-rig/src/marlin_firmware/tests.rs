//! The firmware's behaviour as seen by a host.

use nalgebra::Vector3;
use proptest::prelude::*;

use super::*;

/// A robot on the bench: input goes to its firmware, and time passes on demand.
struct Bench {
    firmware: MarlinFirmware,
    trajectory: Arc<Mutex<Trajectory>>,
    jam: Arc<AtomicBool>,
    now_s: f64,
}

impl Bench {
    fn with(settings: MarlinSettings) -> Self {
        let parked_mm = Vector3::from(settings.parked_mm.map(f64::from));
        let travel_mm = Vector3::from(settings.travel_mm.map(f64::from));
        let trajectory = Arc::new(Mutex::new(Trajectory::new(parked_mm, travel_mm)));
        let jam = Arc::new(AtomicBool::new(false));
        let firmware = MarlinFirmware::new(settings, trajectory.clone(), jam.clone());
        let mut bench = Self { firmware, trajectory, jam, now_s: 0.0 };
        bench.power_up();
        bench
    }

    fn new() -> Self {
        Self::with(MarlinSettings::default())
    }

    fn homed() -> Self {
        let mut bench = Self::new();
        bench.send("G28\n");
        let answer = bench.wait(60.0);
        assert!(answer.ends_with("ok\n"), "{answer}");
        bench
    }

    fn power_up(&mut self) -> String {
        let mut out = Vec::new();
        self.firmware.power_up(self.now_s, &mut out);
        String::from_utf8(out).expect("the firmware sends text")
    }

    /// Sends input and returns the immediate answer.
    fn send(&mut self, text: &str) -> String {
        let mut out = Vec::new();
        for byte in text.bytes() {
            self.firmware.receive(byte, self.now_s);
        }
        self.firmware.step(self.now_s, &mut out);
        String::from_utf8(out).expect("the firmware sends text")
    }

    /// Lets time pass and returns the output of that time.
    fn wait(&mut self, seconds: f64) -> String {
        let until_s = self.now_s + seconds;
        let mut out = Vec::new();
        while let Some(wake) = self.firmware.wake().filter(|wake| wake.at_s <= until_s) {
            self.now_s = self.now_s.max(wake.at_s);
            self.firmware.step(self.now_s, &mut out);
        }
        self.now_s = until_s;
        String::from_utf8(out).expect("the firmware sends text")
    }

    fn head_mm(&self) -> Vector3<f64> {
        self.trajectory.lock().expect("no test panics with it").at(self.now_s).position_mm
    }
}

fn numbered(number: i64, command: &str) -> String {
    let line = format!("N{number} {command}");
    let sum = line.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("{line}*{sum}\n")
}

#[test]
fn it_greets_at_power_up_and_at_every_reset() {
    let mut bench = Bench::new();
    let greeting = bench.power_up();
    assert!(greeting.starts_with("start\nPowerUp\nMarlin 2.1.2.1\n"), "{greeting}");
}

#[test]
fn ok_comes_when_a_move_is_planned_and_m400_when_it_is_done() {
    let mut bench = Bench::homed();
    assert_eq!(bench.send("G1 X80 F4800\n"), "ok\n");
    assert!(bench.head_mm().x < 0.1, "the ok came before the move");
    assert_eq!(bench.send("M400\n"), "");
    // 1.08 s of motion behind the hold of a first move.
    assert_eq!(bench.wait(1.1), "");
    assert_eq!(bench.wait(0.1), "ok\n");
    assert!((bench.head_mm().x - 80.0).abs() < 1e-9);
}

#[test]
fn m114_tells_the_target_and_m114_r_where_the_motors_are() {
    let mut bench = Bench::homed();
    bench.send("G1 X80 F4800\n");
    bench.wait(0.64);
    assert!(bench.send("M114\n").starts_with("X:80.00 Y:0.00 Z:0.00 E:0.00 Count X:6400 "));
    assert!(bench.send("M114 R\n").starts_with("X:40.00 "));
    assert_eq!(bench.send("M114 D\n"), "");
    assert!(bench.wait(2.0).starts_with("X:80.00 "));
}

#[test]
fn the_sixteenth_move_waits_for_room_in_the_planner() {
    let mut bench = Bench::homed();
    for n in 1..=15 {
        assert_eq!(bench.send(&format!("G1 X{}\n", 2 * n)), "ok\n", "move {n}");
    }
    assert_eq!(bench.send("G1 X100\n"), "");
    let first_move_s = 0.1 + 2.0 / 25.0 + 25.0 / 1000.0;
    assert_eq!(bench.wait(first_move_s - 0.001), "");
    assert_eq!(bench.wait(0.002), "ok\n");
}

#[test]
fn it_says_that_it_is_busy_every_two_seconds() {
    let mut bench = Bench::homed();
    bench.send("G1 X100 F1200\nM400\n");
    let output = bench.wait(10.0);
    assert_eq!(output, "echo:busy: processing\necho:busy: processing\nok\n");
    bench.send("M113 S0\nG1 X0\nM400\n");
    assert_eq!(bench.wait(10.0), "ok\n");
}

#[test]
fn homing_takes_the_tool_head_from_wherever_it_was_to_the_switches() {
    let mut bench = Bench::new();
    assert!(bench.head_mm().norm() > 100.0);
    assert!(bench.send("M119\n").contains("x_min: open"));
    assert_eq!(bench.send("G28\n"), "");
    let output = bench.wait(30.0);
    assert!(output.contains("busy") && output.ends_with("ok\n"), "{output}");
    assert_eq!(bench.head_mm(), Vector3::zeros());
    assert!(bench.send("M119\n").contains("x_min: TRIGGERED"));
}

#[test]
fn after_homing_a_move_beyond_the_travel_is_clamped_and_nothing_is_said() {
    let mut bench = Bench::homed();
    assert_eq!(bench.send("G1 X999 Y-5 F9000\n"), "ok\n");
    assert!(bench.send("M114\n").starts_with("X:300.00 Y:0.00 "));
}

#[test]
fn before_homing_a_move_may_run_into_a_switch_and_the_two_positions_part() {
    let mut bench = Bench::new();
    assert_eq!(bench.send("G1 X-72 F3000\n"), "ok\n");
    assert_eq!(bench.wait(5.0), "echo:endstops hit:  X:0.00\n");
    assert_eq!(bench.head_mm().x, 0.0);
    assert!(bench.send("M114\n").starts_with("X:-72.00 "));
    assert!(bench.send("M114 R\n").starts_with("X:-42.00 "));
}

#[test]
fn a_move_into_the_far_end_loses_steps_that_only_homing_finds() {
    let mut bench = Bench::new();
    bench.send("G1 X280 F6000\n");
    bench.wait(10.0);
    assert_eq!(bench.head_mm().x, 300.0);
    bench.send("G1 X270 F6000\n");
    bench.wait(10.0);
    assert!((bench.head_mm().x - 290.0).abs() < 1e-9);
}

#[test]
fn relative_moves_and_named_positions_are_as_in_the_real_firmware() {
    let mut bench = Bench::homed();
    bench.send("G1 X10 Y10\nG91\nG1 X5 Y-2\nG90\n");
    assert!(bench.send("M114\n").starts_with("X:15.00 Y:8.00 "));
    bench.send("G92 X0\n");
    assert!(bench.send("M114\n").starts_with("X:0.00 Y:8.00 Z:0.00 E:0.00 Count X:1200 "));
    bench.send("G1 X1 F3000\n");
    bench.wait(5.0);
    assert!((bench.head_mm().x - 16.0).abs() < 1e-9);
}

#[test]
fn a_damaged_line_is_wanted_again() {
    let mut bench = Bench::new();
    bench.send(&numbered(0, "M110"));
    assert_eq!(bench.send(&numbered(1, "G90")), "ok\n");
    assert_eq!(bench.send("N2 G9x*12\n"), "Error:checksum mismatch, Last Line: 1\nResend: 2\nok\n");
    assert_eq!(
        bench.send(&numbered(7, "G90")),
        "Error:Line Number is not Last Line Number+1, Last Line: 1\nResend: 2\nok\n"
    );
    assert_eq!(
        bench.send("N2 G90\n"),
        "Error:No Checksum with line number, Last Line: 1\nResend: 2\nok\n"
    );
    assert_eq!(bench.send(&numbered(2, "G90")), "ok\n");
}

#[test]
fn a_repeated_line_number_is_dropped_with_no_ok() {
    let mut bench = Bench::homed();
    bench.send(&numbered(0, "M110"));
    assert_eq!(bench.send(&numbered(1, "G91")), "ok\n");
    assert_eq!(bench.send(&numbered(2, "G1 X10")), "ok\n");
    assert_eq!(bench.send(&numbered(2, "G1 X10")), "");
    assert_eq!(bench.send(&numbered(1, "G91")), "");
    assert!(bench.send("M114\n").starts_with("X:10.00 "), "the repeat moved nothing");
}

#[test]
fn blank_lines_get_no_answer_and_unknown_commands_an_echo_and_ok() {
    let mut bench = Bench::new();
    assert_eq!(bench.send("\n\r\n  \n; a comment\n"), "");
    assert_eq!(bench.send("g28\n"), "echo:Unknown command: \"g28\"\nok\n");
    assert_eq!(bench.send("M9999\n"), "echo:Unknown command: \"M9999\"\nok\n");
}

#[test]
fn m118_says_its_text_back_in_the_order_of_the_commands() {
    let mut bench = Bench::homed();
    assert_eq!(bench.send("M118 here 12\n"), "here 12\nok\n");
    bench.send("G1 X80 F4800\nM400\n");
    assert_eq!(bench.send("M118 there\n"), "");
    assert!(bench.wait(2.0).ends_with("ok\nthere\nok\n"));
}

#[test]
fn lines_sent_blind_overrun_the_buffers_and_nothing_is_said() {
    let mut bench = Bench::homed();
    let output = bench.send(&"G4 P100\n".repeat(100));
    let oks = (output + &bench.wait(60.0)).matches("ok\n").count();
    // The receive buffer holds 128 bytes, sixteen of these lines.
    assert!((10..30).contains(&oks), "{oks}");
}

#[test]
fn m410_stops_the_tool_head_and_loses_the_position() {
    let mut bench = Bench::homed();
    bench.send("G1 X200 F4800\nM400\n");
    bench.wait(1.0);
    assert_eq!(bench.send("M410\n"), "");
    assert_eq!(bench.wait(0.99), "", "the planner is being cleaned");
    assert_eq!(
        bench.wait(0.02),
        "ok\nok\n",
        "of M400, which has nothing left to wait for, and of M410"
    );
    let stood_mm = bench.head_mm();
    bench.wait(5.0);
    assert_eq!(bench.head_mm(), stood_mm);
    assert!(stood_mm.x > 70.0 && stood_mm.x < 90.0, "{stood_mm}");
    let reported = bench.send("M114\n");
    let reported_mm: f64 =
        reported[2..].split(' ').next().and_then(|x| x.parse().ok()).expect("a number");
    assert!(
        (reported_mm - stood_mm.x).abs() > 1.0,
        "it coasted uncounted: {reported_mm} {stood_mm}"
    );
}

#[test]
fn without_an_emergency_parser_m410_acts_when_it_is_read_and_again_in_its_turn() {
    let settings = MarlinSettings { emergency_parser: false, ..MarlinSettings::default() };
    let mut bench = Bench::with(settings);
    bench.send("G1 X100 F1200\nM400\n");
    bench.wait(1.0);
    assert_eq!(bench.send("M410\n"), "");
    assert_eq!(bench.wait(1.01), "ok\n", "of M400");
    assert_eq!(bench.wait(1.0), "ok\n", "of M410, 2 s after it");
    assert!(bench.head_mm().x < 142.0 - 50.0);
}

#[test]
fn without_an_emergency_parser_m410_waits_where_the_command_ring_is_full() {
    let settings = MarlinSettings { emergency_parser: false, ..MarlinSettings::default() };
    let mut bench = Bench::with(settings);
    bench.send("G1 X100 F1200\nM400\nM400\nM400\nM400\nM400\n");
    assert_eq!(bench.send("M410\n"), "");
    assert!(bench.wait(20.0).ends_with("ok\n"));
    assert!((bench.head_mm().x - 142.0).abs() < 1e-9);
}

#[test]
fn m112_is_followed_by_silence_until_a_power_cycle() {
    let mut bench = Bench::homed();
    bench.send("G1 X200 F1200\nM400\n");
    assert_eq!(bench.send("M112\n"), "Error:Printer halted. kill() called!\n");
    assert_eq!(bench.send("M114\nM999\n"), "");
    assert_eq!(bench.wait(60.0), "");
    assert!(bench.power_up().starts_with("start\n"));
    assert!(bench.send("M114\n").starts_with("X:0.00 "), "position unknown, taken for zero");
}

#[test]
fn a_homing_that_fails_kills_the_firmware() {
    let mut bench = Bench::new();
    bench.jam.store(true, Ordering::Relaxed);
    bench.send("G28\n");
    assert!(
        bench.wait(60.0).ends_with("Error:Homing Failed\nError:Printer halted. kill() called!\n")
    );
    assert_eq!(bench.send("M114\n"), "");
}

#[test]
fn idle_motors_let_go_after_two_minutes_unless_told_not_to() {
    let mut bench = Bench::homed();
    bench.send("G1 Z50 F3000\n");
    bench.wait(121.0 + 5.0);
    assert!((bench.head_mm().z - 49.0).abs() < 1e-9, "{}", bench.head_mm());
    assert!(bench.send("M114\n").contains("Z:50.00"));
    let mut bench = Bench::homed();
    bench.send("M84 S0\nG1 Z50 F3000\n");
    bench.wait(100_000.0);
    assert!((bench.head_mm().z - 50.0).abs() < 1e-9);
}

#[test]
fn advanced_ok_tells_line_number_and_free_places() {
    let settings = MarlinSettings { advanced_ok: true, ..MarlinSettings::default() };
    let mut bench = Bench::with(settings);
    bench.send("M110 N0\n");
    assert_eq!(bench.send(&numbered(1, "G1 X200")), "ok N1 P14 B4\n");
}

proptest! {
    #[test]
    fn no_bytes_and_no_waiting_make_it_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..300), waits in prop::collection::vec(0.0..5.0f64, 0..5),
    ) {
        let mut bench = Bench::new();
        let mut out = Vec::new();
        for chunk in bytes.chunks(60) {
            for &byte in chunk {
                bench.firmware.receive(byte, bench.now_s);
            }
            bench.firmware.step(bench.now_s, &mut out);
        }
        for seconds in waits {
            bench.wait(seconds);
        }
    }

    #[test]
    fn no_commands_take_the_tool_head_out_of_its_frame_or_tear_its_path(
        commands in prop::collection::vec(
            "(G0|G1|G28|G91|G90|G92|M84|M410|M400|G4)( ?[XYZFSP]-?[0-9]{1,4}(\\.[0-9])?){0,3}", 1..20),
    ) {
        let mut bench = Bench::new();
        let mut last_mm = bench.head_mm();
        for command in commands {
            bench.send(&format!("{command}\n"));
            for _ in 0..20 {
                bench.wait(0.05);
                let now_mm = bench.head_mm();
                prop_assert!((now_mm - last_mm).norm() < 400.0 * 0.05, "{command}: {last_mm} {now_mm}");
                for (axis, most) in [300.0, 300.0, 250.0].into_iter().enumerate() {
                    prop_assert!((-1e-9..=most + 1e-9).contains(&now_mm[axis]));
                }
                last_mm = now_mm;
            }
        }
    }
}
