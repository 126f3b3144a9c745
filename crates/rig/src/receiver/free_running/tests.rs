//! The receiver read under delays, losses and starvation.

use proptest::prelude::*;
use tokio::io::{AsyncWriteExt, duplex};

use super::*;
use fieldgap_input::{NonNegative, Positive};

pub(super) fn config() -> FreeRunningConfig {
    FreeRunningConfig {
        port: None,
        baud: 115_200,
        lines: Lines::TimeAndValue,
        column: std::num::NonZeroUsize::MIN,
        rate_hz: Positive::new(1000.0).expect("positive"),
        unit: "V".into(),
        full_scale: Positive::new(5.0).expect("positive"),
        latency_ms: NonNegative::new(10.0).expect("not negative"),
    }
}

/// Streams a sample each millisecond whose value is its own number; skips those in `lost`.
async fn bench(first_us: u64, lost: std::ops::Range<u64>) -> FreeRunningReceiver {
    let (near, mut far) = duplex(64 * 1024);
    tokio::spawn(async move {
        for k in 0.. {
            tokio::time::sleep(Duration::from_millis(1)).await;
            let t_us = (first_us + k * 1000) % (1 << 32);
            let line = format!("{t_us} {k}{}\n", if k > 4 { "" } else { " !" });
            if !lost.contains(&k) && far.write_all(line.as_bytes()).await.is_err() {
                return;
            }
        }
    });
    let mut config = config();
    config.full_scale = Positive::new(1e9).expect("positive");
    FreeRunningReceiver::begin(Wire::new(near, Device::new(Role::Receiver, "memory")), &config)
        .await
        .expect("samples come")
}

#[tokio::test(start_paused = true)]
async fn what_is_heard_during_a_move_is_recorded_though_the_clock_wraps() {
    let mut receiver = bench((1 << 32) - 800_000, 700..710).await;
    let going = async { tokio::time::sleep(Duration::from_millis(500)).await };
    let recording = receiver.record(Box::pin(going)).await.expect("samples come");
    let lasted_s = recording.ended_s - recording.began_s;
    assert!((lasted_s - 0.5).abs() < 5e-3, "{lasted_s}");
    let (first, last) = (&recording.samples[0], &recording.samples[recording.samples.len() - 1]);
    assert!((last.t_s - recording.ended_s - 0.010).abs() < 2e-3, "{last:?} {}", recording.ended_s);
    // A value is a sample's number: as many milliseconds have passed.
    assert!(((last.t_s - first.t_s) * 1e3 - (last.value - first.value)).abs() < 1e-6);
    assert_eq!(recording.samples.len(), (last.value - first.value) as usize + 1 - 10);
}

#[tokio::test(start_paused = true)]
async fn what_arrived_before_the_question_is_thrown_away() {
    let mut receiver = bench(0, 0..0).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    let reading = receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
    // 500 ms have gone by, and 30 ms of latency and settling follow.
    assert!(reading.mean >= 530.0, "{reading:?}");
    assert_eq!((reading.count, reading.gaps, reading.clipped), (16, 0, false));
    assert!((reading.std - (16.0_f64 * 17.0 / 12.0).sqrt()).abs() < 1e-9, "16 numbers in a row");
}

/// Streams what `sample` makes of each number, one each millisecond.
async fn logger(
    lines: Lines,
    column: usize,
    sample: impl Fn(u64) -> Vec<u8> + Send + 'static,
) -> FreeRunningReceiver {
    let (near, mut far) = duplex(64 * 1024);
    tokio::spawn(async move {
        for k in 0.. {
            tokio::time::sleep(Duration::from_millis(1)).await;
            if far.write_all(&sample(k)).await.is_err() {
                return;
            }
        }
    });
    let column = std::num::NonZeroUsize::new(column).expect("from 1");
    let full_scale = Positive::new(1e9).expect("positive");
    let config = FreeRunningConfig { lines, column, full_scale, ..config() };
    FreeRunningReceiver::begin(Wire::new(near, Device::new(Role::Receiver, "memory")), &config)
        .await
        .expect("samples come")
}

#[tokio::test(start_paused = true)]
async fn a_logger_that_only_prints_numbers_is_read() {
    let line = |k: u64| format!("A0: {k}, A1: 7\r\n").into_bytes();
    let mut receiver = logger(Lines::Value, 1, line).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    let reading = receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
    assert!(reading.mean >= 530.0, "{reading:?}");
    assert!((reading.last_t_s - reading.first_t_s - 0.015).abs() < 1e-9);
    assert_eq!((reading.count, receiver.identity().own_clock), (16, false));
    let refused = receiver.record(Box::pin(std::future::ready(()))).await;
    assert!(matches!(refused.expect_err("it has no times").cause(), Cause::NoRecording));
    let mut second = logger(Lines::Value, 2, line).await;
    assert_eq!(second.read_point(Duration::ZERO, 3).await.expect("samples come").mean, 7.0);
}

#[tokio::test(start_paused = true)]
async fn frames_that_nobody_asked_for_are_read() {
    use crate::receiver::binary::tests::frame;
    let sample = |k: u64| match k % 7 {
        // One in seven is damaged.
        3 => frame(1, 0, k as u32, k * 1000, k as f32)[5..].to_vec(),
        _ => frame(1, 0, k as u32, k * 1000, k as f32),
    };
    let mut receiver = logger(Lines::Frames, 1, sample).await;
    tokio::time::sleep(Duration::from_millis(500)).await;
    let reading = receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
    assert!(reading.mean >= 530.0 && reading.gaps > 3, "{reading:?}");
}

#[tokio::test(start_paused = true)]
async fn lost_lines_are_gaps() {
    let mut receiver = bench(0, 510..514).await;
    let reading = receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
    assert_eq!(reading.gaps, 4);
}

#[tokio::test(start_paused = true)]
async fn a_clock_of_32_bits_may_wrap() {
    let mut receiver = bench((1 << 32) - 510_000, 0..0).await;
    let reading = receiver.read_point(Duration::from_millis(20), 16).await.expect("samples come");
    assert_eq!((reading.count, reading.gaps), (16, 0));
}

#[tokio::test(start_paused = true)]
async fn a_silent_receiver_is_named() {
    let (near, _far) = duplex(64);
    let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
    let error = FreeRunningReceiver::begin(wire, &config()).await.expect_err("silent");
    assert!(
        error.to_string().starts_with("receiver on memory, waiting for the first sample"),
        "{error}"
    );
}

/// A device that takes a sample each millisecond, whose value is its true time in ms, and a computer that hands bytes over
/// late: during a stall nothing, and after it a backlog in slices of 4 KB each 5 ms. What does not fit into 64 KB is lost.
async fn starved(lines: Lines, stalls_ms: Vec<(u64, u64)>) -> (FreeRunningReceiver, Instant) {
    let (near, mut far) = duplex(4096);
    let origin = Instant::now();
    tokio::spawn(async move {
        let mut held: Vec<u8> = Vec::new();
        let mut ticks = tokio::time::interval(Duration::from_millis(1));
        loop {
            ticks.tick().await;
            let now_ms = origin.elapsed().as_millis() as u64;
            let line = match lines {
                // A clock that is 100 ppm fast.
                Lines::TimeAndValue => {
                    format!("{} {now_ms}\n", 7_000_000 + now_ms * 1000 + now_ms / 10)
                }
                _ => format!("{now_ms}\n"),
            };
            if held.len() + line.len() < 64 * 1024 {
                held.extend(line.bytes());
            }
            let stalled =
                stalls_ms.iter().any(|&(from, long)| (from..from + long).contains(&now_ms));
            if stalled || !now_ms.is_multiple_of(5) && held.len() > 100 {
                continue;
            }
            let slice: Vec<u8> = held.drain(..held.len().min(4096)).collect();
            if far.write_all(&slice).await.is_err() {
                return;
            }
        }
    });
    let full_scale = Positive::new(1e9).expect("positive");
    let config = FreeRunningConfig { lines, full_scale, ..config() };
    let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
    (FreeRunningReceiver::begin(wire, &config).await.expect("samples come"), origin)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn no_stall_lets_a_sample_from_before_the_question_in(
        stalls_ms in proptest::collection::vec((500u64..12_000, 1u64..1500), 0..8),
        timed in any::<bool>(),
        moves_ms in proptest::collection::vec(0u64..300, 30),
    ) {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .start_paused(true)
            .build()
            .expect("a runtime");
        let lines = if timed { Lines::TimeAndValue } else { Lines::Value };
        runtime.block_on(async {
            let (mut receiver, origin) = starved(lines, stalls_ms).await;
            for move_ms in moves_ms {
                tokio::time::sleep(Duration::from_millis(move_ms)).await;
                let asked_ms = origin.elapsed().as_millis() as f64;
                match receiver.read_point(Duration::from_millis(5), 4).await {
                    // Four samples in a row, the first of them not before the end of the settling time.
                    Ok(reading) => assert!(
                        reading.mean >= asked_ms + 5.0 + 1.5,
                        "{reading:?} asked at {asked_ms} ms"
                    ),
                    Err(error) => panic!("{error}"),
                }
            }
        });
    }
}

#[tokio::test(start_paused = true)]
async fn a_receiver_that_falls_behind_is_named() {
    let (near, mut far) = duplex(4096);
    tokio::spawn(async move {
        // After a second the samples that arrive are ever older.
        for number in 0u64.. {
            let slow = if number > 1000 { 10 } else { 1 };
            tokio::time::sleep(Duration::from_millis(slow)).await;
            if far.write_all(format!("{} 1.0\n", number * 1000).as_bytes()).await.is_err() {
                return;
            }
        }
    });
    let wire = Wire::new(near, Device::new(Role::Receiver, "memory"));
    let mut receiver = FreeRunningReceiver::begin(wire, &config()).await.expect("samples come");
    tokio::time::sleep(Duration::from_secs(8)).await;
    let error = receiver.read_point(Duration::ZERO, 4).await.expect_err("too old");
    assert!(matches!(error.cause(), Cause::FallenBehind { .. }), "{error}");
}
