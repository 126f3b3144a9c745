//! A device: its firmware behind its wire, in virtual time, with injected faults.

use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::mpsc::UnboundedReceiver;
use tokio::time::{Instant, sleep_until};
use tokio_serial::SerialStream;
use tokio_util::sync::CancellationToken;

use super::answers::AnswersUnderWay;
use super::clock::Clock;
use super::config::VirtualConfig;
use super::faults::{Fault, LineFaults};
use super::firmware::Firmware;
use super::pty::PseudoTerminal;
use fieldgap_rig::link::fault_injection::{Delivery, FaultInjector};

/// How long an unread answer blocks the device, wall time. A real board's buffer would overflow too.
const UNREAD_PATIENCE: Duration = Duration::from_secs(1);

/// Interval at which a port that a killed client held exclusively is freed, wall time.
const FREE_PORT_EVERY: Duration = Duration::from_secs(1);

/// A fault to inject; `done` receives a message once it has happened.
pub(super) struct Order {
    pub fault: Fault,
    pub done: SyncSender<()>,
}

/// The device's end of its wire.
pub(super) trait DeviceEnd {
    /// The stream of bytes.
    type Stream: AsyncRead + AsyncWrite + Unpin;

    /// The stream of bytes.
    fn stream(&mut self) -> &mut Self::Stream;

    /// Frees the port after a client was killed.
    fn forget_dead_client(&self) {}
}

impl DeviceEnd for PseudoTerminal {
    type Stream = SerialStream;

    fn stream(&mut self) -> &mut SerialStream {
        &mut self.stream
    }

    fn forget_dead_client(&self) {
        PseudoTerminal::forget_dead_client(self);
    }
}

/// A device's wire as the configuration has it: random faults, to the device and from it, and how its answers come.
pub(super) struct WireFaults {
    to_device: FaultInjector,
    from_device: FaultInjector,
    answers: AnswersUnderWay,
}

impl WireFaults {
    /// Of the devices in this order: robot, receiver, array, air sensor.
    pub fn of(config: &VirtualConfig) -> [Self; 4] {
        let answers = &config.answers;
        let mut device = 0;
        [answers.robot, answers.receiver, answers.array, answers.environment].map(|timing| {
            let injector =
                |direction| FaultInjector::new(config.faults, config.seed, 2 * device + direction);
            let wire = Self {
                to_device: injector(0),
                from_device: injector(1),
                answers: AnswersUnderWay::new(timing, config.seed, device),
            };
            device += 1;
            wire
        })
    }
}

/// Runs a device until it is stopped or unplugged.
pub(super) async fn run(
    mut firmware: impl Firmware,
    mut wire: impl DeviceEnd,
    mut wire_faults: WireFaults,
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
        for delivery in wire_faults.from_device.apply(&std::mem::take(&mut out)) {
            match delivery {
                Delivery::Pass(bytes) => wire_faults.answers.push(&bytes, Instant::now()),
                Delivery::Wait(time) => tokio::time::sleep(time).await,
                Delivery::Reset => firmware.power_up(clock.now_s(), &mut out),
                Delivery::Cut => {
                    drop(wire);
                    return stop.cancelled().await;
                }
            }
            let mut slice = wire_faults.answers.take(Instant::now());
            tokio::select! {
                () = stop.cancelled() => return,
                () = send(wire.stream(), &mut slice, &clock) => {}
            }
        }
        if !out.is_empty() {
            continue;
        }
        let next = async {
            match firmware.wake() {
                Some(wake) => clock.reached(wake.at_s).await,
                None => std::future::pending().await,
            }
        };
        let due = wire_faults.answers.due();
        let due_reached = async {
            match due {
                // A sleep takes a millisecond, even one that is over.
                Some(due) if due > Instant::now() => sleep_until(due).await,
                Some(_) => {}
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            biased;
            () = stop.cancelled() => return,
            () = due_reached => {
                let mut slice = wire_faults.answers.take(Instant::now());
                tokio::select! {
                    () = stop.cancelled() => return,
                    () = send(wire.stream(), &mut slice, &clock) => {}
                }
            }
            Some(order) = orders.recv() => {
                match order.fault {
                    Fault::Unplug => {
                        drop(wire);
                        let _ = order.done.send(());
                        // Robot and air go on: only the wire is gone.
                        return stop.cancelled().await;
                    }
                    Fault::Reset => firmware.power_up(clock.now_s(), &mut out),
                    Fault::OnLines(fault) => faults.add(fault),
                }
                let _ = order.done.send(());
            }
            read = wire.stream().read(&mut received) => match read {
                Ok(count) if count > 0 => {
                    for delivery in wire_faults.to_device.apply(&received[..count]) {
                        match delivery {
                            Delivery::Pass(bytes) => take(&mut firmware, &bytes, &clock, &mut out),
                            Delivery::Wait(time) => tokio::time::sleep(time).await,
                            Delivery::Reset => firmware.power_up(clock.now_s(), &mut out),
                            Delivery::Cut => {
                                drop(wire);
                                return stop.cancelled().await;
                            }
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

fn take(firmware: &mut impl Firmware, bytes: &[u8], clock: &Clock, out: &mut Vec<u8>) {
    for &byte in bytes {
        firmware.receive(byte, clock.now_s());
        if byte == b'\n' {
            work(firmware, clock, out);
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

async fn send(stream: &mut (impl AsyncWrite + Unpin), out: &mut Vec<u8>, clock: &Clock) {
    while !out.is_empty() {
        let written = stream.write(out);
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
