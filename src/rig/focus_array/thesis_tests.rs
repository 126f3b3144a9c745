//! The driver against a controller that garbles, refuses and falls silent.

use std::sync::{Arc, Mutex};

use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, DuplexStream, duplex};

use super::ElementDelay;
use super::protocol::encode;
use super::thesis::{Modulation, ThesisArray};
use crate::rig::FocusArray;
use crate::rig::device::{Device, Role};
use crate::rig::error::{Cause, RigError};
use crate::rig::link::Wire;

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
            "hello" => "ok thesis-array 1 elements=4 clock_hz=10240000 period_steps=256",
            _ => "ok",
        };
        let mut answer = encode(seq, answer).into_bytes();
        match fault {
            Some(Fault::Silence) => continue,
            Some(Fault::GarbleAnswer) => answer[0] ^= 1,
            _ => {}
        }
        let _ = link.get_mut().write_all(&answer).await;
    }
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

fn heard(obeyed: &Obeyed) -> Vec<String> {
    obeyed.lock().expect("not poisoned").clone()
}

#[tokio::test(start_paused = true)]
async fn it_is_silenced_first_and_told_its_modulation() {
    let (array, obeyed) = bench(&[]).await;
    let array = array.expect("opens");
    assert_eq!(heard(&obeyed), ["off", "hello", "modulate 200 50"]);
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
    assert_eq!(heard(&obeyed)[3], "delays 0 1 0 -");
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
    assert_eq!(heard(&obeyed).len(), 3);
}

#[tokio::test(start_paused = true)]
async fn damage_either_way_is_mended_by_sending_again() {
    for fault in [Fault::GarbleLine, Fault::GarbleAnswer, Fault::Silence] {
        let (array, obeyed) = bench(&[("on", fault), ("on", fault)]).await;
        array.expect("opens").emit().await.expect("acknowledged at last");
        assert_eq!(heard(&obeyed).last().map(String::as_str), Some("on"), "{fault:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn what_never_gets_through_is_given_up() {
    let (array, _) = bench(&[("on", Fault::GarbleLine); 3]).await;
    let error = array.expect("opens").emit().await.expect_err("garbled");
    assert!(matches!(error.cause(), Cause::KeepsGarbling { times: 3 }), "{error}");
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
    assert_eq!(heard(&obeyed).last().map(String::as_str), Some("off"));
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
    assert_eq!(heard(&obeyed)[3..], ["on", "off"]);
}
