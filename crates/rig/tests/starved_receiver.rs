//! A free-running receiver on a pseudo-terminal, on a computer whose processors are all busy and which stands still for up to
//! a second here and there: no reading holds a sample from before the question.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fieldgap_input::toml_text;
use fieldgap_rig::link::open_serial;
use fieldgap_rig::receiver::{FreeRunningConfig, FreeRunningReceiver};
use fieldgap_rig::{Cause, Receiver, Role};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SETTLE: Duration = Duration::from_millis(5);
const SAMPLES: usize = 4;

/// Opens a pseudo-terminal: the device's end, and the path of the computer's.
fn terminal() -> (File, String) {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
    let device = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
    grantpt(&device).expect("it may be used");
    unlockpt(&device).expect("it may be opened");
    let path = ptsname(&device, Vec::new()).expect("it has a name");
    (File::from(device), path.into_string().expect("text"))
}

/// Reads so many points; how many of them gave a reading.
fn read_points(points: usize) -> usize {
    let (mut device, path) = terminal();
    let over = Arc::new(AtomicBool::new(false));
    let origin = Instant::now();
    let mut threads = Vec::new();
    let ended = Arc::clone(&over);
    threads.push(std::thread::spawn(move || {
        // Each sample's value is its true time in ms.
        for number in 1u64.. {
            let due = origin + Duration::from_millis(number);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            let line = format!("{} {number}\n", number * 1000);
            if ended.load(Ordering::Relaxed) || device.write_all(line.as_bytes()).is_err() {
                return;
            }
        }
    }));
    for _ in 0..2 * std::thread::available_parallelism().map_or(2, usize::from) {
        let ended = Arc::clone(&over);
        threads.push(std::thread::spawn(move || {
            while !ended.load(Ordering::Relaxed) {
                std::hint::spin_loop();
            }
        }));
    }
    let keys = "rate_hz = 1000.0\nunit = \"ms\"\nfull_scale = 1e9\nlatency_ms = 10.0\n";
    let config: FreeRunningConfig = toml_text(Path::new("rig.toml"), keys).expect("valid");
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("one");
    let read = runtime.block_on(async {
        let wire = open_serial(Role::Receiver, Some(&path), None, 115_200).expect("it opens");
        let mut receiver = FreeRunningReceiver::begin(wire, &config).await.expect("samples come");
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut read = 0;
        for _ in 0..points {
            tokio::time::sleep(Duration::from_millis(random.random_range(0..30))).await;
            if random.random_bool(0.02) {
                // Nothing of this program runs meanwhile.
                std::thread::sleep(Duration::from_millis(random.random_range(100..1000)));
            }
            let asked_ms = origin.elapsed().as_secs_f64() * 1e3;
            match receiver.read_point(SETTLE, SAMPLES).await {
                Ok(reading) => {
                    // The receiver's own time of its first sample is the true one.
                    let first_ms = reading.first_t_s * 1e3;
                    assert!(first_ms >= asked_ms + 5.0, "{reading:?}, asked at {asked_ms} ms");
                    read += 1;
                }
                Err(error) => {
                    assert!(matches!(error.cause(), Cause::FallenBehind { .. }), "{error}");
                }
            }
        }
        read
    });
    over.store(true, Ordering::Relaxed);
    drop(runtime);
    for thread in threads {
        thread.join().expect("no panic");
    }
    read
}

#[test]
fn no_sample_is_from_before_the_question() {
    assert!(read_points(150) >= 100);
}

/// Some ten minutes: `cargo test --release --package fieldgap-rig --test starved_receiver -- --ignored`.
#[test]
#[ignore = "takes some ten minutes"]
fn no_sample_of_ten_thousand_points_is_from_before_the_question() {
    assert!(read_points(10_000) >= 9_900);
}
