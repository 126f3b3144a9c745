//! The firmware's behaviour as seen by a host.

use proptest::prelude::*;

use super::*;
use fieldgap_input::literal;

/// A robot on the bench: input goes to its firmware, and time passes on demand.
struct Bench {
    firmware: GrblFirmware,
    trajectory: Arc<Mutex<Trajectory>>,
    jam: Arc<AtomicBool>,
    now_s: f64,
}

impl Bench {
    fn with(dialect: Dialect, settings: GrblSettings) -> (Self, String) {
        let parked_mm = Vector3::from(settings.parked_mm.map(f64::from));
        let travel_mm = Vector3::from(settings.travel_mm.map(f64::from));
        let trajectory = Arc::new(Mutex::new(Trajectory::new(parked_mm, travel_mm)));
        let jam = Arc::new(AtomicBool::new(false));
        let firmware = GrblFirmware::new(settings, dialect, trajectory.clone(), jam.clone());
        let mut bench = Self { firmware, trajectory, jam, now_s: 0.0 };
        let greeting = bench.power_up();
        (bench, greeting)
    }

    fn homed(dialect: Dialect) -> Self {
        let (mut bench, _) =
            Self::with(dialect, GrblSettings { idle_ms: 255, ..Default::default() });
        bench.send("$H\n");
        let output = bench.wait(120.0);
        assert!(output.ends_with("ok\r\n"), "{output}");
        // Two reports with rare fields.
        bench.send("?");
        bench.send("?");
        bench
    }

    fn power_up(&mut self) -> String {
        let mut out = Vec::new();
        self.firmware.power_up(self.now_s, &mut out);
        String::from_utf8(out).expect("the firmware sends text")
    }

    /// Sends input and returns the immediate answer.
    fn send(&mut self, text: &str) -> String {
        self.send_bytes(text.as_bytes())
    }

    fn send_bytes(&mut self, bytes: &[u8]) -> String {
        let mut out = Vec::new();
        for &byte in bytes {
            self.firmware.receive(byte, self.now_s);
        }
        self.firmware.step(self.now_s, &mut out);
        String::from_utf8(out).expect("the firmware sends text")
    }

    /// Lets time pass and returns the output of that time.
    fn wait(&mut self, seconds: f64) -> String {
        let until_s = self.now_s + seconds;
        let mut out = Vec::new();
        while let Some(wake) =
            self.firmware.wake().filter(|w| w.at_s <= until_s && w.at_s > self.now_s)
        {
            self.now_s = wake.at_s;
            self.firmware.step(self.now_s, &mut out);
        }
        self.now_s = until_s;
        self.firmware.step(self.now_s, &mut out);
        String::from_utf8(out).expect("the firmware sends text")
    }

    fn head_mm(&self) -> Vector3<f64> {
        self.trajectory.lock().expect("no test panics with it").at(self.now_s).position_mm
    }
}

const GREETING: &str = "\r\nGrbl 1.1h ['$' for help]\r\n";
const LOCK: &str = "[MSG:'$H'|'$X' to unlock]\r\n";

#[test]
fn it_greets_and_is_locked_until_it_is_homed() {
    let (mut bench, greeting) = Bench::with(Dialect::Grbl, GrblSettings::default());
    assert_eq!(greeting, format!("{GREETING}{LOCK}"));
    assert_eq!(bench.send("?"), "<Alarm|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n");
    assert_eq!(bench.send("?"), "<Alarm|MPos:0.000,0.000,0.000|FS:0,0|Ov:100,100,100>\r\n");
    assert_eq!(bench.send("G1X1F600\n"), "error:9\r\n");
    let (mut hal, greeting) = Bench::with(Dialect::GrblHal, GrblSettings::default());
    assert_eq!(greeting, "\r\nGrblHAL 1.1f ['$' or '$HELP' for help]\r\n", "it does not lock");
    assert!(hal.send("?").starts_with("<Idle|MPos:0.000,0.000,0.000|Bf:100,1024|FS:0,0|WCO:"));
}

#[test]
fn without_homing_it_starts_idle_at_a_zero_that_means_nothing() {
    let settings = GrblSettings { homing: false, soft_limits: false, ..GrblSettings::default() };
    let (mut bench, greeting) = Bench::with(Dialect::Grbl, settings);
    assert_eq!(greeting, GREETING);
    assert!(bench.send("?").starts_with("<Idle|MPos:0.000,0.000,0.000|"));
    assert!(bench.head_mm().norm() > 100.0);
    assert_eq!(bench.send("$H\n"), "error:5\r\n");
}

#[test]
fn build_and_settings_are_told() {
    let (mut bench, _) = Bench::with(Dialect::Grbl, GrblSettings::default());
    assert_eq!(bench.send("$I\n"), "[VER:1.1h.20190830:]\r\n[OPT:V,15,128]\r\nok\r\n");
    let dump = bench.send("$$\n");
    assert!(
        dump.contains("$22=1\r\n$23=7\r\n") && dump.ends_with("$132=250.000\r\nok\r\n"),
        "{dump}"
    );
    let (mut hal, _) = Bench::with(Dialect::GrblHal, GrblSettings::default());
    assert!(hal.send("$I\n").contains("[OPT:VNML+,100,1024,3,0]\r\n"));
}

#[test]
fn homing_backs_off_the_switches_and_zero_is_at_the_far_end() {
    let (mut bench, _) =
        Bench::with(Dialect::Grbl, GrblSettings { idle_ms: 255, ..Default::default() });
    assert_eq!(bench.send("$H\n"), "");
    assert_eq!(bench.send("?"), "", "it is deaf to queries while it homes");
    let output = bench.wait(120.0);
    assert!(
        output.starts_with("ok\r\n<Idle|MPos:-298.000,-298.000,-248.000|"),
        "answered behind it: {output}"
    );
    assert_eq!(bench.head_mm(), Vector3::new(2.0, 2.0, 2.0));
    let (mut hal, _) = Bench::with(
        Dialect::GrblHal,
        GrblSettings { origin_at_switches: true, ..Default::default() },
    );
    assert!(hal.send("$H\n").starts_with("<Home|"), "it reports by itself");
    assert!(hal.send("?").starts_with("<Home|"), "it is not deaf");
    assert!(hal.wait(120.0).ends_with("[MSG:]\r\nok\r\n"));
    let output = hal.send("?");
    assert!(
        output.starts_with("<Idle|MPos:0.000,0.000,0.000|") && output.contains("|H:1"),
        "{output}"
    );
}

#[test]
fn a_homing_that_fails_is_alarm_ok_and_greeting() {
    let (mut bench, _) = Bench::with(Dialect::Grbl, GrblSettings::default());
    bench.jam.store(true, Ordering::Relaxed);
    bench.send("$H\n");
    assert_eq!(bench.wait(120.0), format!("ALARM:9\r\nok\r\n{GREETING}{LOCK}"));
    let (mut hal, _) = Bench::with(Dialect::GrblHal, GrblSettings::default());
    hal.jam.store(true, Ordering::Relaxed);
    hal.send("$H\n");
    assert!(hal.wait(120.0).starts_with("ALARM:9\r\n\r\nGrblHAL"), "without an ok");
}

#[test]
fn ok_comes_when_a_move_is_planned_and_that_of_a_dwell_when_it_is_done() {
    let mut bench = Bench::homed(Dialect::Grbl);
    assert_eq!(bench.send("G53G1X-200F6000\nG4P0\n"), "ok\r\n");
    assert!(bench.send("?").starts_with("<Run|MPos:-298.000"));
    assert_eq!(bench.wait(1.0), "");
    assert!(bench.send("?").starts_with("<Run|MPos:-20"), "nearly there");
    assert_eq!(bench.wait(0.5), "ok\r\n");
    assert!(bench.send("?").starts_with("<Idle|MPos:-200.000,-298.000,-248.000|"));
    assert!((bench.head_mm().x - 100.0).abs() < 1e-9);
}

#[test]
fn the_sixteenth_move_waits_for_room_in_the_planner() {
    let mut bench = Bench::homed(Dialect::Grbl);
    for n in 1..=15 {
        assert_eq!(bench.send(&format!("G53G1X{}F600\n", -298 + n)), "ok\r\n", "move {n}");
    }
    assert_eq!(bench.send("G53G1X-280\n"), "");
    assert_eq!(bench.wait(0.2), "ok\r\n");
}

#[test]
fn lines_sent_blind_overrun_the_buffer_and_nothing_is_said() {
    let mut bench = Bench::homed(Dialect::Grbl);
    let output = bench.send(&"G4P0.1\n".repeat(100)) + &bench.wait(60.0);
    // 18 whole lines fit in 128 bytes; two bytes of the next one merge with what comes then.
    assert!((18..=20).contains(&output.matches("ok\r\n").count()), "{output}");
}

#[test]
fn a_hard_limit_silences_it_until_a_reset_and_loses_the_position() {
    let settings = GrblSettings { soft_limits: false, idle_ms: 255, ..GrblSettings::default() };
    let (mut bench, _) = Bench::with(Dialect::Grbl, settings);
    bench.send("$X\nG53G1X-100F3000\n");
    assert_eq!(bench.wait(5.0), "ALARM:1\r\n[MSG:Reset to continue]\r\n");
    assert_eq!(bench.send("?$X\n$H\nG4P0\n"), "");
    assert_eq!(bench.send("\x18"), format!("ok\r\n{GREETING}[MSG:Check Limits]\r\n{LOCK}"));
    assert!(bench.send("?").contains("|Pn:X|"));
    let (mut hal, _) = Bench::with(Dialect::GrblHal, settings);
    hal.send("G53G1X-100F3000\n");
    hal.wait(5.0);
    assert!(hal.send("?").starts_with("<Alarm|MPos:-42.000"), "it answers queries");
    assert_eq!(hal.send("$X\nG4P0\n"), "error:79\r\nerror:9\r\n");
}

#[test]
fn a_soft_limit_keeps_the_position_and_needs_a_reset_too() {
    let mut bench = Bench::homed(Dialect::Grbl);
    assert_eq!(bench.send("G53G1X5F3000\n"), "ALARM:2\r\n[MSG:Reset to continue]\r\n");
    assert_eq!(bench.send("?"), "");
    assert_eq!(bench.send("\x18"), format!("ok\r\n{GREETING}{LOCK}"));
    assert!(bench.send("?").starts_with("<Alarm|MPos:-298.000,"));
    let mut hal = Bench::homed(Dialect::GrblHal);
    assert_eq!(hal.send("G53G1X5F3000\n"), "ALARM:2\r\n[MSG:Reset to continue]\r\n");
    assert!(hal.send("?").starts_with("<Alarm|"));
    let (mut fresh, _) = Bench::with(Dialect::GrblHal, GrblSettings::default());
    assert_eq!(fresh.send("G53G1X5F3000\n"), "ok\r\n", "it holds to none before it is homed");
}

#[test]
fn a_reset_in_motion_loses_the_position_and_one_at_rest_keeps_it() {
    let mut bench = Bench::homed(Dialect::Grbl);
    bench.send("G53G1X-100F6000\n");
    bench.wait(1.0);
    assert_eq!(bench.send("\x18"), format!("ALARM:3\r\n{GREETING}{LOCK}"));
    bench.wait(1.0);
    let output = bench.send("?");
    assert!(output.starts_with("<Alarm|MPos:-2"), "{output}");
    let believed_mm: f64 =
        output[12..].split(',').next().and_then(|x| x.parse().ok()).expect("a number");
    assert!(
        (bench.head_mm().x - 300.0 - believed_mm).abs() > 1.0,
        "it coasted uncounted: {output}"
    );
    let mut bench = Bench::homed(Dialect::Grbl);
    assert_eq!(bench.send("G4P5\x18\n"), format!("{GREETING}ok\r\n"), "neither alarm nor lock");
    assert!(bench.send("?").starts_with("<Idle|MPos:-298.000,"));
}

#[test]
fn a_hold_slows_down_and_a_resume_goes_on_to_the_target() {
    let mut bench = Bench::homed(Dialect::Grbl);
    bench.send("G53G1X-100F6000\nG4P0\n");
    bench.wait(1.0);
    bench.send("!");
    assert!(bench.send("?").starts_with("<Hold:1|"));
    assert_eq!(bench.wait(2.0), "", "the dwell waits for the end of the motion");
    let output = bench.send("?");
    assert!(
        output.starts_with("<Hold:0|MPos:-198.352,"),
        "it began 3.5 ms after the line, and slows down over ten millimetres: {output}"
    );
    bench.send("~");
    assert_eq!(bench.wait(5.0), "ok\r\n");
    assert!(bench.send("?").starts_with("<Idle|MPos:-100.000,"));
    bench.send("G53G1X-200F6000\n");
    bench.wait(0.5);
    bench.send("!");
    bench.wait(2.0);
    assert_eq!(bench.send("\x18"), GREETING, "held and at rest: the position is kept");
    assert!(bench.send("?").starts_with("<Idle|MPos:-1"));
    let head_mm = bench.head_mm();
    assert!(
        (bench.firmware.machine.at_mm(bench.now_s).x - (head_mm.x - 300.0)).abs() < 1e-9 + 0.002
    );
}

#[test]
fn a_jog_is_refused_out_of_travel_and_can_be_cancelled() {
    let mut bench = Bench::homed(Dialect::Grbl);
    assert_eq!(bench.send("$J=G91X-500F1000\n"), "error:15\r\n");
    assert_eq!(bench.send("$J=G1X5F100\n"), "error:16\r\n");
    assert_eq!(bench.send("$J=G91X50\n"), "error:22\r\n");
    assert_eq!(bench.send("$J=G91X50F1000\n"), "ok\r\n");
    bench.wait(1.0);
    assert_eq!(bench.send("G4P0\n"), "error:9\r\n");
    bench.send_bytes(&[0x85]);
    bench.wait(0.3);
    let output = bench.send("?");
    assert!(
        output.starts_with("<Jog|") && output.contains("|FS:0,0"),
        "the state stays for a while: {output}"
    );
    bench.wait(0.5);
    assert!(bench.send("?").starts_with("<Idle|"));
}

#[test]
fn errors_have_their_codes() {
    let mut bench = Bench::homed(Dialect::Grbl);
    for (line, code) in [
        ("M114", 20),
        ("M400", 23),
        ("N1 G4P0*33", 1),
        ("G1 X", 2),
        ("G1 X-200", 22),
        ("G0 G1 X1", 24),
        ("$J", 3),
        ("$99=1", 3),
        ("$20=x", 2),
        ("$HZ", 3),
    ] {
        assert_eq!(bench.send(&format!("{line}\n")), format!("error:{code}\r\n"), "{line}");
    }
    assert_eq!(bench.send(&format!("G1{}\n", "X1".repeat(45))), "error:11\r\n");
    assert_eq!(bench.send("\n"), "ok\r\n", "a blank line has an answer");
    assert_eq!(bench.send("g4p0\n"), "ok\r\n", "small letters will do");
}

#[test]
fn grblhal_repeats_its_error_until_a_blank_line_or_a_good_command() {
    let mut hal = Bench::homed(Dialect::GrblHal);
    assert_eq!(hal.send("M400\nG4P0\nG21\n"), "error:20\r\n".repeat(3));
    assert_eq!(hal.send("\nG4P0\n"), "ok\r\nok\r\n");
    assert_eq!(hal.send("G1X1\nG4P0\n"), "error:22\r\nerror:22\r\n");
    assert!(hal.send("$G\nG4P0\n").ends_with("ok\r\nok\r\n"));
    let mut bench = Bench::homed(Dialect::Grbl);
    assert_eq!(bench.send("M114\nG4P0\n"), "error:20\r\nok\r\n");
}

#[test]
fn while_a_setting_is_written_nothing_is_received() {
    let mut bench = Bench::homed(Dialect::Grbl);
    assert_eq!(bench.send("$1=25\n"), "");
    bench.send("$22=0\n");
    assert_eq!(bench.wait(1.0), "ok\r\n", "the second line is lost");
    assert!(bench.send("$$\n").contains("$1=25\r\n") && bench.send("$$\n").contains("$22=1\r\n"));
}

#[test]
fn motors_let_go_between_moves_unless_told_not_to() {
    let settings = GrblSettings { sag_mm: literal(0.5), ..Default::default() };
    let (mut bench, _) = Bench::with(Dialect::Grbl, settings);
    bench.send("$H\n");
    bench.wait(120.0);
    let z_mm = bench.head_mm().z;
    assert!((z_mm - 1.5).abs() < 1e-9, "it fell after homing: {z_mm}");
    assert!(bench.send("?").contains(",-248.000|"), "and does not know");
    bench.send("$1=255\n");
    bench.wait(1.0);
    bench.send("G53G1Z-200F3000\n");
    bench.wait(100.0);
    assert!((bench.head_mm().z - 49.5).abs() < 1e-9);
}

#[test]
fn positions_may_be_the_works_or_in_inches() {
    let mut bench = Bench::homed(Dialect::Grbl);
    bench.send("G92X0\n");
    assert!(bench.send("?").ends_with("|WCO:-298.000,0.000,0.000>\r\n"));
    bench.send("$10=0\n");
    bench.wait(1.0);
    assert!(bench.send("?").starts_with("<Idle|WPos:0.000,-298.000,-248.000|"));
    bench.send("$10=1\n");
    bench.wait(1.0);
    bench.send("$13=1\n");
    bench.wait(1.0);
    assert!(bench.send("?").starts_with("<Idle|MPos:-11.7323,-11.7323,-9.7638|"));
}

#[test]
fn overrides_checking_and_sleep_are_states_that_a_host_must_see() {
    let mut bench = Bench::homed(Dialect::Grbl);
    bench.send_bytes(&[0x92, 0x92]);
    let output: String = (0..3).map(|_| bench.send("?")).collect();
    assert!(output.contains("|Ov:80,100,100"), "{output}");
    assert_eq!(bench.send("$C\n"), "[MSG:Enabled]\r\nok\r\n");
    assert_eq!(bench.send("G53G1X-100F600\n"), "ok\r\n");
    assert!(bench.send("?").starts_with("<Check|MPos:-298.000,"), "nothing moves");
    assert!(bench.send("$C\n").starts_with("[MSG:Disabled]\r\nok\r\n\r\nGrbl"));
    assert_eq!(bench.send("$SLP\n"), "[MSG:Sleeping]\r\nok\r\n");
    assert!(bench.send("?").starts_with("<Sleep|"));
    assert_eq!(bench.send("G4P0\n"), "error:9\r\n");
    assert!(bench.send("\x18").ends_with(LOCK));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Any input is answered or ignored without a panic, and a reset always gives the greeting.
    #[test]
    fn any_bytes_are_survived(
        pieces in prop::collection::vec(
            (
                prop::sample::select(vec![
                    "G53G1X-100F6000\n", "G4P0\n", "$H\n", "!", "~", "?", "\x18", "$J=G91X5F100\n", "$X\n", "$C\n",
                    "$1=255\n", "G92X0\n", "G1X500\n", "$SLP\n", "\n", "G91G1X1F100\n", "λ", "(",
                ]),
                0.0..2.0f64,
            ),
            0..40,
        ),
        hal in any::<bool>(),
    ) {
        let dialect = if hal { Dialect::GrblHal } else { Dialect::Grbl };
        let (mut bench, _) = Bench::with(dialect, GrblSettings::default());
        for (piece, seconds) in pieces {
            bench.send(piece);
            bench.wait(seconds);
        }
        bench.wait(1.0);
        prop_assert!(bench.send("\x18").contains(" ['$'"));
        let at_mm = bench.head_mm();
        prop_assert!(at_mm.iter().all(|&mm| (0.0..=300.0).contains(&mm)));
    }
}
