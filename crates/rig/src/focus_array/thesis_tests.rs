//! The driver against a controller that garbles, refuses and falls silent.

use std::sync::{Arc, Mutex};

use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, DuplexStream, duplex};

use super::protocol::encode;
use super::thesis::{Modulation, ThesisArray};
use super::{ArrayIdentity, DriveFrame, DriveProgram, ElementDelay, Envelope, Sensed};
use crate::FocusArray;
use crate::device::{Device, Role};
use crate::error::{Cause, RigError};
use crate::link::Wire;

/// What goes wrong with one line.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// It arrives damaged.
    GarbleLine,
    /// Its answer arrives damaged.
    GarbleAnswer,
    /// It is obeyed and not answered.
    Silence,
    /// It is refused.
    Refuse,
}

const HELLO: &str =
    "ok thesis-array 1 elements=4 clock_hz=10240000 period_steps=256 frames=2 levels=600 sensors=2";

type Obeyed = Arc<Mutex<Vec<String>>>;

/// A controller written from the protocol's page.
async fn controller(far: DuplexStream, obeyed: Obeyed, mut faults: Vec<(&'static str, Fault)>) {
    let mut link = BufReader::new(far);
    let mut line = String::new();
    while link.read_line(&mut line).await.is_ok_and(|count| count > 0) {
        let received = std::mem::take(&mut line);
        let (body, crc) = received.trim_end().rsplit_once('*').expect("a checksum");
        assert_eq!(crc, format!("{:08x}", crc32fast::hash(body.as_bytes())), "{received}");
        let (seq, command) = body.split_once(' ').expect("a number");
        let seq: u16 = seq.parse().expect("a number");
        let fault = faults
            .first()
            .filter(|(begins, _)| command.starts_with(begins))
            .map(|(_, fault)| *fault);
        if fault.is_some() {
            faults.remove(0);
        }
        if fault == Some(Fault::GarbleLine) {
            let body = "- error 1 checksum";
            let answer = format!("{body}*{:08x}\n", crc32fast::hash(body.as_bytes()));
            let _ = link.get_mut().write_all(answer.as_bytes()).await;
            continue;
        }
        obeyed.lock().expect("not poisoned").push(command.to_owned());
        let answer = match command {
            _ if fault == Some(Fault::Refuse) => "error 3 not today",
            "hello" => HELLO,
            "state" => "ok playing",
            _ => "ok",
        };
        let mut answer = encode(seq, answer).into_bytes();
        match fault {
            Some(Fault::Silence) => continue,
            Some(Fault::GarbleAnswer) => answer[0] ^= 1,
            _ => {}
        }
        let _ = link.get_mut().write_all(&answer).await;
        if command.starts_with("sense ") {
            for number in 0..3 {
                let sample =
                    Sensed { number, t_us: 4000 * u64::from(number), volts: vec![0.25, 0.5] };
                let _ = link.get_mut().write_all(sample.encode().as_bytes()).await;
            }
        }
    }
}

/// A display of so many frames of one period under so many levels.
fn display(frames: usize, levels: usize) -> DriveProgram {
    let once = std::num::NonZeroU32::MIN;
    let controller = ArrayIdentity::of_thesis(4, 40e3);
    let frame = |n: usize| {
        let drives = (0..4).map(|element| ((n + element) as f64, 1.0));
        DriveFrame::nearest(&controller, drives, once).expect("fits")
    };
    let envelope = Envelope::new(vec![9; levels], once).expect("not empty");
    DriveProgram::new((0..frames).map(frame).collect(), envelope).expect("valid")
}

async fn bench(
    faults: &[(&'static str, Fault)],
) -> (Result<ThesisArray<DuplexStream>, RigError>, Obeyed) {
    let (near, far) = duplex(4096);
    let obeyed = Obeyed::default();
    tokio::spawn(controller(far, Arc::clone(&obeyed), faults.to_vec()));
    let wire = Wire::new(near, Device::new(Role::FocusArray, "memory"));
    let modulation = Modulation { frequency_hz: 200.0, duty_percent: 50.0 };
    (ThesisArray::begin(wire, modulation).await, obeyed)
}

fn received(obeyed: &Obeyed) -> Vec<String> {
    obeyed.lock().expect("not poisoned").clone()
}

#[tokio::test(start_paused = true)]
async fn it_is_silenced_first_and_told_its_modulation() {
    let (array, obeyed) = bench(&[]).await;
    let array = array.expect("opens");
    assert_eq!(received(&obeyed), ["off", "hello", "modulate 200 50"]);
    assert_eq!(array.identity().elements, 4);
}

#[tokio::test(start_paused = true)]
async fn delays_become_the_nearest_steps_within_a_period() {
    let (array, obeyed) = bench(&[]).await;
    let step_s = 1.0 / 10_240_000.0;
    let delays = [
        ElementDelay::Seconds(0.0),
        ElementDelay::Seconds(1.4 * step_s),
        ElementDelay::Seconds(255.6 * step_s),
        ElementDelay::Silent,
    ];
    array.expect("opens").set_delays(&delays).await.expect("acknowledged");
    assert_eq!(received(&obeyed)[3], "delays 0 1 0 -");
}

#[tokio::test(start_paused = true)]
async fn delays_that_do_not_fit_the_array_are_not_sent() {
    let (array, obeyed) = bench(&[]).await;
    let mut array = array.expect("opens");
    let error = array.set_delays(&[ElementDelay::Silent; 5]).await.expect_err("five for four");
    assert!(matches!(error.cause(), Cause::ElementCount { has: 4, given: 5 }), "{error}");
    for bad in [-1e-6, f64::NAN, f64::INFINITY] {
        let error = array.set_delays(&[ElementDelay::Seconds(bad); 4]).await.expect_err("no time");
        assert!(matches!(error.cause(), Cause::BadDelay { element: 0, .. }), "{error}");
    }
    assert_eq!(received(&obeyed).len(), 3);
}

#[tokio::test(start_paused = true)]
async fn damage_either_way_is_mended_by_sending_again() {
    for fault in [Fault::GarbleLine, Fault::GarbleAnswer, Fault::Silence] {
        let (array, obeyed) = bench(&[("on", fault), ("on", fault)]).await;
        array.expect("opens").emit().await.expect("acknowledged at last");
        assert_eq!(received(&obeyed).last().map(String::as_str), Some("on"), "{fault:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn what_never_gets_through_is_given_up() {
    let (array, _) = bench(&[("on", Fault::GarbleLine); 3]).await;
    let error = array.expect("opens").emit().await.expect_err("garbled");
    assert!(matches!(error.cause(), Cause::RepeatedlyDamaged { times: 3 }), "{error}");
    let (array, _) = bench(&[("off", Fault::Silence); 10]).await;
    let error = array.expect_err("silent");
    assert!(matches!(error.cause(), Cause::Silent { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_refusal_is_told_in_the_controllers_words() {
    let (array, _) = bench(&[("on", Fault::Refuse)]).await;
    let error = array.expect("opens").emit().await.expect_err("refused");
    assert!(error.to_string().contains("error 3 not today"), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_dropped_array_is_silenced() {
    let (array, obeyed) = bench(&[]).await;
    let mut array = array.expect("opens");
    array.emit().await.expect("acknowledged");
    drop(array);
    // The controller reads on until the pipe is empty.
    tokio::time::sleep(std::time::Duration::from_millis(1)).await;
    assert_eq!(received(&obeyed).last().map(String::as_str), Some("off"));
}

#[tokio::test(start_paused = true)]
async fn a_call_cancelled_in_its_middle_does_not_confuse_the_next() {
    let (array, obeyed) = bench(&[]).await;
    let mut array = array.expect("opens");
    {
        let mut emitting = Box::pin(array.emit());
        std::future::poll_fn(|context| {
            assert!(emitting.as_mut().poll(context).is_pending());
            std::task::Poll::Ready(())
        })
        .await;
    }
    array.silence().await.expect("acknowledged");
    assert_eq!(received(&obeyed)[3..], ["on", "off"]);
}

#[tokio::test(start_paused = true)]
async fn a_display_is_sent_frame_by_frame_to_an_array_that_is_silent() {
    let (array, obeyed) = bench(&[("frame 1", Fault::GarbleAnswer)]).await;
    let mut array = array.expect("opens");
    let display = display(2, 600);
    array.load(&display).await.expect("acknowledged");
    array.play(&display, 7, std::time::Duration::from_secs(2)).await.expect("acknowledged");
    assert!(array.is_playing().await.expect("acknowledged"));
    let received = received(&obeyed);
    let frame = display.frames()[1].encode();
    assert_eq!(received[3], "off");
    assert_eq!(received[5..7], [format!("frame 1 {frame}"), format!("frame 1 {frame}")]);
    assert!(
        received[7].starts_with("envelope 0 9 9 ") && received[9].starts_with("envelope 512 9 ")
    );
    assert_eq!(received[10..], ["play 2 600 1 7 2000", "state"]);
}

#[tokio::test(start_paused = true)]
async fn a_display_that_the_controller_cannot_hold_is_not_sent() {
    let (array, obeyed) = bench(&[]).await;
    let mut array = array.expect("opens");
    for too_much in [display(3, 1), display(1, 601)] {
        let error = array.load(&too_much).await.expect_err("too much");
        assert!(matches!(error.cause(), Cause::Display(_)), "{error}");
    }
    let error = array.listen(&[0, 1, 2], 250.0).await.expect_err("two converters");
    assert!(matches!(error.cause(), Cause::TooManySensors { most: 2, asked: 3 }), "{error}");
    assert_eq!(received(&obeyed).len(), 3);
}

#[tokio::test(start_paused = true)]
async fn samples_between_answers_are_kept() {
    let (array, obeyed) = bench(&[]).await;
    let mut array = array.expect("opens");
    array.listen(&[3, 0], 250.0).await.expect("acknowledged");
    array.emit().await.expect("acknowledged, with samples before the answer");
    assert_eq!(received(&obeyed)[3..], ["sense 250 3 0", "on"]);
    let soon = tokio::time::Instant::now() + std::time::Duration::from_secs(1);
    for number in 0..3 {
        let sample = array.next_sample(soon).await.expect("open").expect("it came");
        assert_eq!((sample.number, sample.volts), (number, vec![0.25, 0.5]));
    }
    assert_eq!(array.next_sample(soon).await.expect("open"), None);
}
