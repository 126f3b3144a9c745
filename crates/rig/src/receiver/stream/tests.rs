//! The receiver on a line: faults of the line, and answers that are held back.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader, DuplexStream, duplex};

use super::super::binary::tests::frame;
use super::super::held_link::held_link;
use super::*;

/// What goes wrong with one run of samples.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// The byte at this place of the run is damaged.
    Damage(usize),
    /// The end mark is lost.
    NoEnd,
    /// The question is lost.
    Deaf,
    /// Samples with these places are lost.
    Lose(u32, u32),
    /// The value at this place cannot be.
    Impossible(u32),
    /// The converter clips at this place.
    Clip(u32),
    /// The cable is pulled in mid-run.
    Unplug,
}

/// A receiver written from the protocol's page; the value of a sample is its time in seconds.
struct Firmware {
    link: BufReader<DuplexStream>,
    binary: bool,
    t_us: u64,
    seq: u32,
    faults: Vec<Fault>,
    endless: bool,
    /// Its clock, for the tests to look at.
    clock: Arc<AtomicU64>,
}

impl Firmware {
    fn on(link: DuplexStream) -> Self {
        Self {
            link: BufReader::new(link),
            binary: false,
            t_us: 3_000_000,
            seq: 100,
            faults: Vec::new(),
            endless: false,
            clock: Arc::default(),
        }
    }

    async fn run(mut self, greeting: &[u8]) {
        if self.link.get_mut().write_all(greeting).await.is_err() {
            return;
        }
        let mut line = String::new();
        while self.link.read_line(&mut line).await.is_ok_and(|count| count > 0) {
            self.t_us += 250;
            let answer = match line.trim() {
                "?" => b"receiver 1 rate_hz=1000 full_scale=5.000000 unit=V\n".to_vec(),
                "E binary" => {
                    self.binary = true;
                    b"ok\n".to_vec()
                }
                "E text" => {
                    self.binary = false;
                    b"ok\n".to_vec()
                }
                // The samples taken in between are sent at once.
                "X" if std::mem::take(&mut self.endless) => self.sample(40),
                "X" => self.end(),
                "S 0" => {
                    self.endless = true;
                    Vec::new()
                }
                "T" => format!("time {}\n", self.t_us).into_bytes(),
                sample if sample.starts_with("S ") => {
                    self.sample(sample[2..].parse().expect("a number"))
                }
                unknown => format!("error unknown {unknown}\n").into_bytes(),
            };
            line.clear();
            self.clock.store(self.t_us, Ordering::Relaxed);
            if self.link.get_mut().write_all(&answer).await.is_err() {
                return;
            }
            if self.faults.first() == Some(&Fault::Unplug) && answer.len() > 100 {
                return;
            }
        }
    }

    fn end(&self) -> Vec<u8> {
        if self.binary {
            frame(2, 0, self.seq, self.t_us, 0.0)
        } else {
            format!("end {} {}\n", self.seq, self.t_us).into_bytes()
        }
    }

    fn sample(&mut self, count: u32) -> Vec<u8> {
        let fault = (!self.faults.is_empty() && self.faults[0] != Fault::Unplug)
            .then(|| self.faults.remove(0));
        if fault == Some(Fault::Deaf) {
            return Vec::new();
        }
        let mut bytes = Vec::new();
        for place in 0..count {
            let clipped = fault == Some(Fault::Clip(place));
            let value = match fault == Some(Fault::Impossible(place)) {
                true => 1e30,
                false => self.t_us as f64 * 1e-6,
            };
            let lost = matches!(fault, Some(Fault::Lose(from, to)) if (from..to).contains(&place));
            if lost {
            } else if self.binary {
                bytes.extend(frame(1, u8::from(clipped), self.seq, self.t_us, value as f32));
            } else {
                let mark = if clipped { " !" } else { "" };
                bytes.extend(format!("{} {} {value}{mark}\n", self.seq, self.t_us).into_bytes());
            }
            self.seq += 1;
            self.t_us += 1000;
        }
        if fault != Some(Fault::NoEnd) {
            bytes.extend(self.end());
        }
        if let Some(Fault::Damage(place)) = fault {
            bytes[place] ^= 0x10;
        }
        bytes
    }
}

async fn bench(
    encoding: Encoding,
    greeting: &[u8],
    faults: &[Fault],
) -> StreamReceiver<DuplexStream> {
    let (near, far) = duplex(64 * 1024);
    let firmware = Firmware { faults: faults.to_vec(), ..Firmware::on(far) };
    let greeting = greeting.to_vec();
    tokio::spawn(async move { firmware.run(&greeting).await });
    let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
    StreamReceiver::begin(wire, encoding).await.expect("opens")
}

/// As [`bench`], behind a line that passes a byte from the receiver every 10 ms.
async fn slow_bench(encoding: Encoding) -> StreamReceiver<DuplexStream> {
    let ((near, host_end), (device_end, far)) = (duplex(64 * 1024), duplex(64 * 1024));
    tokio::spawn(Firmware::on(far).run(b""));
    let (mut from_host, mut to_host) = tokio::io::split(host_end);
    let (mut from_device, mut to_device) = tokio::io::split(device_end);
    tokio::spawn(async move { tokio::io::copy(&mut from_host, &mut to_device).await });
    tokio::spawn(async move {
        while let Ok(byte) = from_device.read_u8().await {
            tokio::time::sleep(Duration::from_millis(10)).await;
            if to_host.write_u8(byte).await.is_err() {
                return;
            }
        }
    });
    let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
    StreamReceiver::begin(wire, encoding).await.expect("opens")
}

const SETTLE: Duration = Duration::from_millis(20);

#[tokio::test(start_paused = true)]
async fn a_point_is_read_in_both_encodings() {
    for encoding in [Encoding::Text, Encoding::Binary] {
        let mut receiver = bench(encoding, b"", &[]).await;
        assert_eq!(receiver.identity().unit, "V");
        for _ in 0..3 {
            let reading = receiver.read_point(SETTLE, 16).await.expect("reads");
            assert_eq!((reading.count, reading.gaps, reading.clipped), (16, 0, false));
            let middle_s = (reading.first_t_s + reading.last_t_s) / 2.0;
            assert!((reading.mean - middle_s).abs() < 1e-4, "{encoding:?}: {reading:?}");
            assert!((reading.last_t_s - reading.first_t_s - 0.015).abs() < 1e-9);
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_receiver_found_in_mid_run_is_stopped_and_understood() {
    let old =
        [&frame(1, 0, 7, 1000, 9.0)[3..], &frame(1, 0, 8, 2000, 9.0), b"12 3000 9.0\n"].concat();
    for encoding in [Encoding::Text, Encoding::Binary] {
        let mut receiver = bench(encoding, &old, &[]).await;
        let reading = receiver.read_point(SETTLE, 16).await.expect("reads");
        assert!(reading.first_t_s > 3.0 && reading.mean < 9.0, "{reading:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn nothing_of_a_cancelled_run_reaches_the_next_point() {
    for encoding in [Encoding::Text, Encoding::Binary] {
        let mut receiver = bench(encoding, b"", &[]).await;
        let before = receiver.read_point(SETTLE, 16).await.expect("reads");
        // Cancelled with the question sent and no answer read.
        let cancelled = {
            let mut point = Box::pin(receiver.read_point(SETTLE, 16));
            std::future::poll_fn(|context| {
                std::task::Poll::Ready(point.as_mut().poll(context).is_pending())
            })
            .await
        };
        assert!(cancelled);
        tokio::time::sleep(Duration::from_millis(1)).await;
        let reading = receiver.read_point(SETTLE, 16).await.expect("reads");
        // The cancelled run took 37 ms of the receiver's time.
        let since_s = reading.first_t_s - before.last_t_s;
        assert!(since_s > 0.037 + 0.020, "{encoding:?}: {reading:?}");
        assert_eq!((reading.count, reading.gaps), (16, 0));
    }
}

#[tokio::test(start_paused = true)]
async fn what_is_heard_during_a_move_is_recorded_and_a_point_read_after_it() {
    for encoding in [Encoding::Text, Encoding::Binary] {
        let mut receiver = bench(encoding, b"", &[Fault::Lose(5, 8)]).await;
        let mut moved = false;
        let moving = async {
            tokio::time::sleep(Duration::from_secs(30)).await;
            moved = true;
        };
        let recording = receiver.record(Box::pin(moving)).await.expect("it samples");
        assert!(moved);
        assert_eq!(recording.samples.len(), 37);
        assert!(recording.began_s <= recording.samples[0].t_s);
        assert!(recording.samples[36].t_s <= recording.ended_s);
        for sample in &recording.samples {
            assert!((sample.value - sample.t_s).abs() < 1e-6, "{encoding:?}: {sample:?}");
        }
        let reading = receiver.read_point(SETTLE, 16).await.expect("reads");
        assert_eq!((reading.count, reading.gaps), (16, 0));
    }
}

#[tokio::test(start_paused = true)]
async fn a_damaged_frame_is_a_gap() {
    let mut receiver = bench(Encoding::Binary, b"", &[Fault::Damage(25 * 24 + 9)]).await;
    let reading = receiver.read_point(SETTLE, 16).await.expect("reads");
    assert_eq!((reading.count, reading.gaps), (16, 1), "one is asked for to spare");
}

#[tokio::test(start_paused = true)]
async fn a_value_that_the_converter_cannot_give_is_a_gap() {
    for encoding in [Encoding::Text, Encoding::Binary] {
        let mut receiver = bench(encoding, b"", &[Fault::Impossible(25)]).await;
        let reading = receiver.read_point(SETTLE, 16).await.expect("reads");
        assert_eq!((reading.count, reading.gaps, reading.clipped), (16, 1, false), "{encoding:?}");
        assert!(reading.mean < 5.0, "{encoding:?}: {reading:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn lost_samples_are_counted_and_a_clipped_one_is_told() {
    let faults = [Fault::Lose(30, 34), Fault::Clip(25), Fault::Clip(5)];
    let mut receiver = bench(Encoding::Binary, b"", &faults).await;
    let lossy = receiver.read_point(SETTLE, 16).await.expect("reads");
    assert_eq!((lossy.count, lossy.gaps, lossy.clipped), (13, 4, false));
    assert!(receiver.read_point(SETTLE, 16).await.expect("reads").clipped);
    let settled = receiver.read_point(SETTLE, 16).await.expect("reads");
    assert!(!settled.clipped, "it clipped while settling");
}

#[tokio::test(start_paused = true)]
async fn a_lost_end_mark_costs_nothing_and_a_lost_question_a_retry() {
    for fault in [Fault::NoEnd, Fault::Deaf, Fault::Lose(0, 40)] {
        let mut receiver = bench(Encoding::Binary, b"", &[fault]).await;
        let reading = receiver.read_point(SETTLE, 16).await.expect("reads");
        assert_eq!((reading.count, reading.gaps), (16, 0), "{fault:?}");
        assert!(receiver.read_point(SETTLE, 16).await.is_ok());
    }
}

#[tokio::test(start_paused = true)]
async fn a_receiver_that_never_samples_is_given_up() {
    let mut receiver = bench(Encoding::Binary, b"", &[Fault::Deaf; 3]).await;
    let error = receiver.read_point(SETTLE, 16).await.expect_err("deaf");
    assert!(matches!(error.cause(), Cause::NoReadings { asked: 16 }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_pulled_cable_is_a_disconnection() {
    let mut receiver = bench(Encoding::Binary, b"", &[Fault::Unplug]).await;
    receiver.read_point(SETTLE, 16).await.expect("the first run was sent whole");
    let error = receiver.read_point(SETTLE, 16).await.expect_err("pulled");
    assert!(matches!(error.cause(), Cause::Disconnected), "{error}");
}

/// The robot moves while answers are held back, a reading is given up, and the answers then come in slices.
async fn reads_only_what_is_new(held: Duration, pause: Duration) {
    for encoding in [Encoding::Text, Encoding::Binary] {
        let (near, far) = duplex(64 * 1024);
        let firmware = Firmware::on(far);
        let clock = Arc::clone(&firmware.clock);
        tokio::spawn(async move { firmware.run(b"").await });
        let (near, hold) = held_link(near, 400, pause);
        let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
        let mut receiver = StreamReceiver::begin(wire, encoding).await.expect("opens");
        receiver.read_point(SETTLE, 16).await.expect("reads");
        hold.send_replace(true);
        let given_up = tokio::time::timeout(held, receiver.read_point(SETTLE, 16)).await;
        assert!(!matches!(given_up, Ok(Ok(_))), "nothing came");
        hold.send_replace(false);
        for _ in 0..20 {
            // Here the robot moves.
            let asked_at_s = clock.load(Ordering::Relaxed) as f64 * 1e-6;
            if let Ok(reading) = receiver.read_point(SETTLE, 16).await {
                assert!(
                    reading.first_t_s >= asked_at_s + SETTLE.as_secs_f64(),
                    "{encoding:?}: taken {:.4} s before it was asked for",
                    asked_at_s - reading.first_t_s
                );
            }
        }
        let soon = pause < Duration::from_secs(1);
        assert!(!soon || receiver.read_point(SETTLE, 16).await.is_ok(), "it catches up in the end");
    }
}

#[tokio::test(start_paused = true)]
async fn no_sample_from_before_the_question_is_taken_however_late_the_answers_come() {
    for held_s in [1, 3, 5, 9, 60] {
        for pause_ms in [10, 300, 2500, 7000] {
            let (held, pause) = (Duration::from_secs(held_s), Duration::from_millis(pause_ms));
            reads_only_what_is_new(held, pause).await;
        }
    }
}

/// 984 bytes take ten seconds: longer than a silent receiver is waited for.
#[tokio::test(start_paused = true)]
async fn a_recording_that_a_slow_line_holds_back_is_waited_for() {
    let mut receiver = slow_bench(Encoding::Binary).await;
    for _ in 0..2 {
        let moving = tokio::time::sleep(Duration::from_secs(1));
        let recording = receiver.record(Box::pin(moving)).await.expect("it comes");
        assert_eq!(recording.samples.len(), 40);
        for sample in &recording.samples {
            assert!((sample.value - sample.t_s).abs() < 1e-6, "{sample:?}");
        }
        let reading = receiver.read_point(Duration::ZERO, 4).await.expect("it reads");
        assert!(reading.first_t_s > recording.ended_s - 1e-3, "{reading:?}");
    }
}
