//! A device: its firmware behind its pseudo-terminal, in virtual time, with the faults that are injected.

use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::sync::mpsc::UnboundedReceiver;
use tokio_util::sync::CancellationToken;

use super::clock::Clock;
use super::faults::{Fault, LineFaults};
use super::firmware::Firmware;
use super::pty::PseudoTerminal;

/// How long an answer that nobody reads holds the device up, wall time. A board's own buffer would overflow too.
const UNREAD_PATIENCE: Duration = Duration::from_secs(1);

/// Interval at which a port that a dead client kept for itself is freed, wall time.
const FREE_PORT_EVERY: Duration = Duration::from_secs(1);

/// Something done to a device from outside; the sender is told when it is done.
pub(super) struct Order {
    pub fault: Fault,
    pub done: SyncSender<()>,
}

/// Runs a device until it is stopped or unplugged.
pub(super) async fn run(
    mut firmware: impl Firmware,
    mut wire: PseudoTerminal,
    clock: Arc<Clock>,
    mut orders: UnboundedReceiver<Order>,
    stop: CancellationToken,
) {
    let mut faults = LineFaults::default();
    let mut out = Vec::new();
    let mut received = [0; 512];
    firmware.power_up(clock.now_s(), &mut out);
    loop {
        work(&mut firmware, &clock, &mut out);
        faults.apply(&mut out);
        tokio::select! {
            () = stop.cancelled() => return,
            () = send(&mut wire, &mut out, &clock) => {}
        }
        let next = async {
            match firmware.wake() {
                Some(wake) => clock.reached(wake.at_s).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            biased;
            () = stop.cancelled() => return,
            Some(order) = orders.recv() => {
                match order.fault {
                    Fault::Unplug => {
                        drop(wire);
                        let _ = order.done.send(());
                        // The carriage and the air do not care: only the wire is gone.
                        return stop.cancelled().await;
                    }
                    Fault::Reset => firmware.power_up(clock.now_s(), &mut out),
                    Fault::OnLines(fault) => faults.add(fault),
                }
                let _ = order.done.send(());
            }
            read = wire.stream.read(&mut received) => match read {
                Ok(count) if count > 0 => {
                    for &byte in &received[..count] {
                        firmware.receive(byte, clock.now_s());
                        if byte == b'\n' {
                            work(&mut firmware, &clock, &mut out);
                        }
                    }
                }
                // With a handle of the client's end kept open this is not seen; if it is, do not spin on it.
                _ => tokio::time::sleep(Duration::from_millis(20)).await,
            },
            () = next => {}
            () = tokio::time::sleep(FREE_PORT_EVERY) => wire.forget_dead_client(),
        }
    }
}

/// Lets the firmware do all it can now; in lockstep, makes the time pass that its answers need.
///
/// Called after each line, so that in lockstep the answers depend on the order of the lines and not on how
/// the system happened to cut the stream into reads.
fn work(firmware: &mut impl Firmware, clock: &Clock, out: &mut Vec<u8>) {
    loop {
        firmware.step(clock.now_s(), out);
        match firmware.wake() {
            Some(wake) if wake.answer_needs_it && clock.is_lockstep() => clock.jump_to(wake.at_s),
            _ => return,
        }
    }
}

async fn send(wire: &mut PseudoTerminal, out: &mut Vec<u8>, clock: &Clock) {
    while !out.is_empty() {
        let written = wire.stream.write(out);
        let written = match clock.is_lockstep() {
            true => Ok(written.await),
            false => tokio::time::timeout(UNREAD_PATIENCE, written).await,
        };
        match written {
            Ok(Ok(count)) => drop(out.drain(..count)),
            _ => out.clear(),
        }
    }
}
