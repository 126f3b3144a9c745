//! The driver against instruments written from their makers' guides.

use std::f64::consts::TAU;

use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, DuplexStream, duplex};

use super::*;
use fieldgap_input::toml_text;

/// What the instrument does not do as it should.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    None,
    /// It does not know a command.
    Unknown(&'static str),
    /// It never reports that a record was taken.
    NeverTriggers,
    /// It answers no query once so many records were read.
    MuteAfter(u32),
    /// Its block is none.
    NoBlock,
    /// A block that is shorter than its header states.
    ShortBlock,
    /// Its block has no stated length.
    Indefinite,
    /// The signal is larger than its range.
    Overdriven,
    /// The record is shorter than three cycles.
    ShortRecord,
    /// It is armed this long after it was told to; until then it reports the end of the record before.
    ArmsAfter(Duration),
    /// It takes no new record, and reports an end.
    NeverArms,
    /// Its signal triggers at once, so that it is never seen to wait.
    TriggersAtOnce,
    /// Nothing hangs on the second channel.
    NoSync,
    /// What hangs there is two steps high.
    WeakSync,
    /// What hangs there is noise.
    NoisySync,
    /// The second channel's record is shorter than the first's.
    ShorterSync,
    /// The second channel's block ends early.
    ShortSyncBlock,
    /// The second channel's preamble has nine numbers.
    NoSyncScale,
}

/// An oscilloscope with 25 steps a division of 0.1 V, 1 µs apart, which sees a carrier of 0.8 V on 0.05 V.
struct Instrument {
    link: BufReader<DuplexStream>,
    fault: Fault,
    armed: bool,
    told_to_arm: Option<Instant>,
    /// The channel whose record is read.
    source: u8,
    /// Records that were taken.
    taken: u32,
    records: u32,
    errors: Vec<String>,
}

impl Instrument {
    /// What follows from the time since it was told to take a record.
    fn arm_if_due(&mut self) {
        let delay = match self.fault {
            Fault::ArmsAfter(delay) => delay,
            _ => Duration::ZERO,
        };
        if self.told_to_arm.is_some_and(|told| told.elapsed() >= delay) {
            self.told_to_arm = None;
            match self.fault {
                Fault::NeverArms => {}
                Fault::TriggersAtOnce => self.taken += 1,
                _ => self.armed = true,
            }
        }
    }

    async fn run(mut self) {
        let mut line = String::new();
        while self.link.read_line(&mut line).await.is_ok_and(|count| count > 0) {
            let answer = self.answer(line.trim());
            line.clear();
            if let Some(answer) = answer
                && self.link.get_mut().write_all(&answer).await.is_err()
            {
                return;
            }
        }
    }

    fn answer(&mut self, command: &str) -> Option<Vec<u8>> {
        let text = |answer: &str| Some(format!("{answer}\n").into_bytes());
        if self.fault == Fault::Unknown("*IDN?") {
            return None;
        }
        if matches!(self.fault, Fault::MuteAfter(records) if self.records >= records) {
            return None;
        }
        if matches!(self.fault, Fault::Unknown(unknown) if command == unknown) {
            self.errors.push("-113,\"Undefined header\"".to_owned());
            return None;
        }
        self.arm_if_due();
        match command {
            "*IDN?" => text("ACME,SCOPE,1,1.0"),
            "*CLS" => {
                self.errors.clear();
                None
            }
            ":SYST:ERR?" => text(&self.errors.pop().unwrap_or("0,\"No error\"".to_owned())),
            "CMR?" => text(if self.errors.pop().is_some() { "CMR 1" } else { "CMR 0" }),
            ":WAV:SOUR CHAN1" => {
                self.source = 1;
                None
            }
            ":WAV:SOUR CHAN2" => {
                self.source = 2;
                None
            }
            ":SING" | "ARM" | ":DIG CHAN1" | ":DIG CHAN1,CHAN2" => {
                self.told_to_arm = Some(Instant::now());
                self.arm_if_due();
                None
            }
            // Without a signal nothing triggers.
            ":TFOR" | "FRTR" if self.fault != Fault::NeverTriggers => {
                self.taken += u32::from(std::mem::take(&mut self.armed));
                None
            }
            ":TRIG:STAT?" => text(if self.armed { "WAIT" } else { "STOP" }),
            "SAST?" => text(if self.armed { "SAST Ready" } else { "SAST Stop" }),
            "*OPC?" => text("1"),
            ":WAV:PRE?" if self.source == 1 => {
                text(&format!("0,0,{},1,1e-6,0,0,0.004,10,127", self.points()))
            }
            ":WAV:PRE?" if self.fault == Fault::NoSyncScale => text("0,0,333,1,1e-6,0,0,0.04,0"),
            ":WAV:PRE?" => text("0,0,333,1,1e-6,0,0,0.04,0,127"),
            "C2:VDIV?" => text("1.00E+00V"),
            "C2:OFST?" => text("0.00E+00V"),
            "C2:WF? DAT2" => Some([b"DAT2,", &*self.sync(0.0), b"\n"].concat()),
            ":WAV:DATA?" if self.source == 2 => Some(self.sync(127.0)),
            "C1:VDIV?" => text("1.00E-01V"),
            "C1:OFST?" => text("-4.00E-02V"),
            "SARA?" => text("1.00MSa/s"),
            ":WAV:DATA?" => Some(self.block(137.0)),
            "C1:WF? DAT2" => Some([b"DAT2,", &*self.block(10.0 - 20.0), b"\n"].concat()),
            _ => None,
        }
    }

    fn points(&self) -> usize {
        if self.fault == Fault::ShortRecord { 60 } else { 333 }
    }

    /// The clock of the drives, a square wave of 2.5 V whose edges take 2 µs; the signal is 0.9 rad ahead of it.
    fn sync(&self, zero: f64) -> Vec<u8> {
        let samples: Vec<u8> = (0..if self.fault == Fault::ShorterSync { 300 } else { 333 })
            .map(|n| {
                let turn = TAU * 40e3 * 1e-6 * f64::from(n) + f64::from(self.taken) - 0.2;
                let volts = match self.fault {
                    Fault::NoSync => 0.0,
                    Fault::WeakSync => 0.08 * turn.sin(),
                    // A multiplicative sequence, without order at the carrier's frequency.
                    Fault::NoisySync => f64::from(n * n * 7919 % 251) / 50.0 - 2.5,
                    _ => 2.5 * (4.0 * turn.sin()).clamp(-1.0, 1.0),
                };
                ((volts / 0.04 + zero).round() as i16).to_le_bytes()[0]
            })
            .collect();
        let stated = samples.len() + if self.fault == Fault::ShortSyncBlock { 100 } else { 0 };
        [format!("#9{stated:09}").as_bytes(), &samples, b"\n"].concat()
    }

    /// 333 samples are 13.32 cycles.
    fn block(&mut self, zero: f64) -> Vec<u8> {
        self.records += 1;
        let amplitude_v = if self.fault == Fault::Overdriven { 3.0 } else { 0.4 };
        let sample = |n: usize| {
            // The phase of each record is another.
            let phase = 0.7 + f64::from(self.taken);
            let volts = 0.02 + amplitude_v * (TAU * 40e3 * 1e-6 * n as f64 + phase).sin();
            let steps = (volts / 0.004 + zero).round();
            if zero > 100.0 {
                steps.clamp(0.0, 255.0) as u8
            } else {
                (steps.clamp(-128.0, 127.0) as i8).cast_unsigned()
            }
        };
        let samples: Vec<u8> = (0..self.points()).map(sample).collect();
        let header = match self.fault {
            Fault::NoBlock => "#nothing".to_owned(),
            Fault::Indefinite => "#0".to_owned(),
            Fault::ShortBlock => "#41000".to_owned(),
            _ => format!("#9{:09}", samples.len()),
        };
        [header.as_bytes(), &samples, b"\n"].concat()
    }
}

async fn opened(fault: Fault, keys: &str) -> Result<ScpiReceiver<DuplexStream>, RigError> {
    let (near, far) = duplex(64 * 1024);
    let instrument = Instrument {
        link: BufReader::new(far),
        fault,
        armed: false,
        told_to_arm: None,
        source: 1,
        taken: 0,
        records: 0,
        errors: Vec::new(),
    };
    tokio::spawn(instrument.run());
    let config: ScpiConfig =
        toml_text(std::path::Path::new("rig.toml"), keys).expect("a valid table");
    ScpiReceiver::begin(Wire::new(near, Device::new(Role::Receiver, "memory")), &config).await
}

const SETTLE: Duration = Duration::from_millis(20);

#[tokio::test(start_paused = true)]
async fn the_carrier_is_read_in_every_makers_words() {
    for dialect in ["rigol", "siglent", "keysight"] {
        // Keysight's ninth number is in volts: the same signal stands 10 V higher there, which the lock-in takes off.
        let mut receiver =
            opened(Fault::None, &format!("dialect = \"{dialect}\"")).await.expect(dialect);
        let started = Instant::now();
        let reading = receiver.read_point(SETTLE, 3).await.expect("it answers");
        assert!(started.elapsed() >= SETTLE);
        assert!((reading.mean - 0.4).abs() < 1e-3, "{dialect}: {reading:?}");
        assert_eq!((reading.count, reading.clipped, reading.gaps), (3, false, 0));
        assert!(!receiver.identity().own_clock);
    }
}

#[tokio::test(start_paused = true)]
async fn the_phase_is_read_against_the_drives_clock_in_every_makers_words() {
    for dialect in ["rigol", "siglent", "keysight"] {
        let keys = format!("dialect = \"{dialect}\"\nsync_channel = 2");
        let mut receiver = opened(Fault::None, &keys).await.expect(dialect);
        assert!(receiver.identity().phase && receiver.identity().unit == "V");
        assert!((receiver.identity().full_scale - receiver_full_scale(dialect)).abs() < 1e-9);
        for _ in 0..3 {
            // Each record begins at another phase of the clock.
            let reading = receiver.read_point(SETTLE, 2).await.expect("it answers");
            assert!((reading.mean - 0.4).abs() < 2e-3, "{dialect}: {reading:?}");
            // Ahead in time is less in exp(-iωt).
            let phase_rad = reading.phase_rad.expect("a phase");
            assert!((phase_rad + 0.9).abs() < 0.01, "{dialect}: {reading:?}");
            assert_eq!((reading.count, reading.clipped), (2, false));
        }
    }
}

/// That of the signal's channel, not of the clock's.
fn receiver_full_scale(dialect: &str) -> f64 {
    match dialect {
        "rigol" => 118.0 * 0.004,
        "siglent" => 128.0 * 0.004 - 0.04,
        // The ninth number, 10, is in volts there.
        _ => (1.0f64 - 127.0) * 0.004 + 10.0,
    }
}

#[tokio::test(start_paused = true)]
async fn a_clock_that_is_none_is_told() {
    for (fault, words) in [
        (Fault::NoSync, "shows no clock"),
        (Fault::WeakSync, "2.0 steps"),
        (Fault::NoisySync, "shows no clock"),
        (Fault::ShorterSync, "of the sync 300 samples"),
    ] {
        let error = opened(fault, "sync_channel = 2").await.expect_err("no clock");
        assert!(matches!(error.cause(), Cause::Record(_)), "{fault:?}: {error}");
        assert!(error.to_string().contains(words), "{fault:?}: {error}");
        assert!(error.remedy().contains("sync_channel"), "{}", error.remedy());
        // Without the key nobody asks for it.
        opened(fault, "").await.expect("the signal is there");
    }
    let error = opened(Fault::NoSyncScale, "sync_channel = 2").await.expect_err("nine numbers");
    assert!(matches!(error.cause(), Cause::Unreadable { .. }), "{error}");
    let keys = "sync_channel = 2\nanswer_within_s = 2.0";
    let error = opened(Fault::ShortSyncBlock, keys).await.expect_err("a block cut short");
    assert!(matches!(error.cause(), Cause::Silent { .. }), "{error}");
}

#[test]
fn the_clock_has_a_channel_of_its_own() {
    let read = |keys: &str| {
        toml_text::<ScpiConfig>(std::path::Path::new("rig.toml"), keys).map_err(|e| e.to_string())
    };
    assert!(read("channel = 2\nsync_channel = 1").is_ok());
    for keys in ["sync_channel = 1", "channel = 3\nsync_channel = 3"] {
        let error = read(keys).expect_err("one channel");
        assert!(error.contains("sync_channel"), "{error}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_record_before_is_not_taken_for_a_new_one() {
    for dialect in ["rigol", "siglent"] {
        let keys = format!("dialect = \"{dialect}\"");
        let fault = Fault::ArmsAfter(Duration::from_millis(30));
        let mut receiver = opened(fault, &keys).await.expect(dialect);
        for _ in 0..5 {
            let before = receiver.before.clone();
            receiver.read_point(SETTLE, 1).await.expect("it answers");
            assert_ne!(receiver.before, before, "{dialect}: the record before was read again");
        }
        // An instrument that was not seen to wait, and has a new record.
        let mut receiver = opened(Fault::TriggersAtOnce, &keys).await.expect(dialect);
        receiver.read_point(SETTLE, 3).await.expect("it answers");
        let mut receiver = opened(Fault::NeverArms, &keys).await.expect("the first may be any");
        let error = receiver.read_point(SETTLE, 1).await.expect_err("always the same");
        assert!(error.to_string().contains("the same record 3 times"), "{error}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_block_without_length_is_read_to_its_messages_end() {
    let mut receiver = opened(Fault::Indefinite, "").await.expect("opens");
    let reading = receiver.read_point(SETTLE, 2).await.expect("it answers");
    assert!((reading.mean - 0.4).abs() < 1e-3, "{reading:?}");
}

#[tokio::test(start_paused = true)]
async fn a_signal_beyond_the_range_is_told() {
    let mut receiver = opened(Fault::Overdriven, "").await.expect("opens");
    assert!(receiver.read_point(SETTLE, 1).await.expect("it answers").clipped);
    // 255 - 137 steps of 4 mV on one side, 137 on the other.
    assert!((receiver.identity().full_scale - 118.0 * 0.004).abs() < 1e-12);
}

#[tokio::test(start_paused = true)]
async fn what_the_instrument_refuses_is_told_in_its_words() {
    let keys = "setup = [\":TIM:MAIN:SCAL fast\"]";
    let error =
        opened(Fault::Unknown(":TIM:MAIN:SCAL fast"), keys).await.expect_err("it is refused");
    assert!(matches!(error.cause(), Cause::Refused { .. }));
    let text = error.to_string();
    for words in ["receiver on memory", ":TIM:MAIN:SCAL fast", "-113,\"Undefined header\""] {
        assert!(text.contains(words), "{text}");
    }
    // A question that is not known is not answered either: the instrument's word goes before its silence.
    let error = opened(Fault::Unknown(":WAV:PRE?"), "").await.expect_err("no scale");
    assert!(matches!(error.cause(), Cause::Refused { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn each_wait_ends() {
    for fault in [Fault::Unknown("*IDN?"), Fault::NeverTriggers, Fault::ShortBlock] {
        let started = Instant::now();
        let error = opened(fault, "answer_within_s = 2.0").await.expect_err("it fails");
        assert!(matches!(error.cause(), Cause::Silent { .. }), "{fault:?}: {error}");
        assert!(started.elapsed() < Duration::from_secs(12), "{fault:?} {:?}", started.elapsed());
    }
    let mut receiver = opened(Fault::MuteAfter(2), "").await.expect("the first record comes");
    let error = receiver.read_point(SETTLE, 3).await.expect_err("the third does not");
    assert!(matches!(error.cause(), Cause::Silent { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn what_is_no_block_and_a_record_that_shows_no_carrier_are_told() {
    let error = opened(Fault::NoBlock, "").await.expect_err("no block");
    assert!(matches!(error.cause(), Cause::Unreadable { .. }), "{error}");
    let error = opened(Fault::ShortRecord, "").await.expect_err("2.4 cycles");
    assert!(matches!(error.cause(), Cause::Record(_)), "{error}");
    assert!(error.remedy().contains("time base"));
}

#[tokio::test(start_paused = true)]
async fn a_call_cancelled_in_its_middle_does_not_confuse_the_next() {
    let mut receiver = opened(Fault::None, "").await.expect("opens");
    for steps in 1..12 {
        let mut point = Box::pin(receiver.read_point(Duration::ZERO, 2));
        for _ in 0..steps {
            let pending = std::future::poll_fn(|context| {
                std::task::Poll::Ready(point.as_mut().poll(context).is_pending())
            });
            if !pending.await {
                break;
            }
            tokio::time::sleep(Duration::from_millis(3)).await;
        }
        drop(point);
        let reading = receiver.read_point(Duration::ZERO, 1).await.expect("it is in step again");
        assert!((reading.mean - 0.4).abs() < 1e-3, "{reading:?}");
    }
}

#[test]
fn an_address_is_told_from_a_port() {
    assert!(is_address("192.168.1.20:5555") && is_address("scope.lab:5025"));
    assert!(!is_address("/dev/ttyUSB0") && !is_address("COM3") && !is_address("/dev/x:1"));
}
