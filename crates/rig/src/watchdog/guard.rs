//! The guard's own process.

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, Read, Write};
use std::os::fd::{FromRawFd, OwnedFd};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use jiff::Timestamp;
use rustix::process::{Pid, Signal, kill_process};
use serialport::TTYPort;

use super::orders::{Order, Orders};
use super::{BEAT, BEAT_LOST_AFTER, GOODBYE};

/// How often the command is sent to a device that does not answer.
const TIMES: usize = 4;

/// How often at least: a first answer may have been under way already.
const TIMES_AT_LEAST: usize = 2;

/// How long an answer is waited for each time.
const ANSWER_WITHIN: Duration = Duration::from_millis(300);

/// How long a port may take no bytes.
const TAKEN_WITHIN: Duration = Duration::from_millis(300);

/// Silence after which an answer is over.
const PAUSE: Duration = Duration::from_millis(20);

/// Time for a beat that waits in the pipe to be read, where this process itself was held up.
const CATCH_UP: Duration = Duration::from_millis(100);

/// Why the guard acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lost {
    /// The pipe closed: the program has ended.
    Gone,
    /// The beat stopped: the program does not respond.
    Still,
}

/// Guards a rig until the program at the other end of `pipe` says goodbye. Makes the rig safe if the program ends or stops
/// responding without one.
///
/// # Errors
/// That the pipe brought no orders, or that the log cannot be written.
pub fn guard(pipe: impl Read + Send + 'static) -> io::Result<()> {
    let mut lines = io::BufReader::new(pipe).lines();
    let orders = lines.next().transpose()?.as_deref().and_then(Orders::decode);
    let orders = orders.ok_or_else(|| {
        io::Error::new(io::ErrorKind::InvalidData, "the watchdog is started by fieldgap itself")
    })?;
    let (send, received) = channel();
    std::thread::spawn(move || {
        for line in lines.map_while(Result::ok) {
            if send.send(line).is_err() {
                return;
            }
        }
    });
    match watch(&received) {
        None => Ok(()),
        Some(lost) => act(orders, lost),
    }
}

/// Listens to the beat; `None` after a goodbye.
fn watch(received: &Receiver<String>) -> Option<Lost> {
    loop {
        let mut next = received.recv_timeout(BEAT_LOST_AFTER);
        if next == Err(RecvTimeoutError::Timeout) {
            next = received.recv_timeout(CATCH_UP);
        }
        match next {
            Ok(line) if line == GOODBYE => return None,
            Ok(line) if line == BEAT => {}
            Ok(_) | Err(RecvTimeoutError::Disconnected) => return Some(Lost::Gone),
            Err(RecvTimeoutError::Timeout) => return Some(Lost::Still),
        }
    }
}

fn act(orders: Orders, lost: Lost) -> io::Result<()> {
    let mut devices: Vec<GuardedDevice> =
        orders.devices.into_iter().map(GuardedDevice::new).collect();
    let program = orders.program;
    let mut done = vec![match lost {
        Lost::Gone => format!("the program (process {program}) ended without closing the rig"),
        Lost::Still => format!(
            "the program (process {program}) has not responded for {} s",
            BEAT_LOST_AFTER.as_secs()
        ),
    }];
    let mut results = send_to_all(&mut devices);
    if lost == Lost::Still {
        // It would go on to record a field that is no longer there.
        done.push(end_program(program));
        results.extend(send_to_all(&mut devices));
    }
    done.extend(results);
    // Whoever reads the log may open the ports again.
    drop(devices);
    let Some(log) = &orders.log else { return Ok(()) };
    let mut log = OpenOptions::new().create(true).append(true).open(log)?;
    let now = Timestamp::now();
    let text: String = done.iter().map(|line| format!("{now} {line}\n")).collect();
    log.write_all(text.as_bytes())?;
    log.sync_all()
}

fn send_to_all(devices: &mut [GuardedDevice]) -> Vec<String> {
    std::thread::scope(|scope| {
        let sending: Vec<_> = devices
            .iter_mut()
            .map(|device| scope.spawn(move || device.send_until_answered()))
            .collect();
        sending
            .into_iter()
            .map(|result| result.join().unwrap_or_else(|_| "the watchdog itself failed".to_owned()))
            .collect()
    })
}

/// Ends the guarded program, as long as it is the process that started this one.
fn end_program(program: u32) -> String {
    let ended = match i32::try_from(program).ok().and_then(Pid::from_raw) {
        Some(pid) if std::os::unix::process::parent_id() == program => {
            kill_process(pid, Signal::KILL).map_err(|error| error.to_string())
        }
        _ => Err("it is no longer running".to_owned()),
    };
    match ended {
        Ok(()) => "the program was ended".to_owned(),
        Err(why) => format!("the program could not be ended: {why}"),
    }
}

/// A device that is guarded.
struct GuardedDevice {
    order: Order,
    handle: File,
}

impl GuardedDevice {
    fn new(order: Order) -> Self {
        // SAFETY: the program that started this one left this handle open for it, and names it once.
        let handle = unsafe { OwnedFd::from_raw_fd(order.handle) };
        Self { order, handle: File::from(handle) }
    }

    /// Sends the command until the device answers; the result for the log.
    fn send_until_answered(&mut self) -> String {
        let device = &self.order.device;
        let sent = format!("{device}: sent `{}`", self.order.bytes.escape_ascii());
        let outcome = match converse(&mut self.handle, &self.order.bytes) {
            // The handle is dead where the device was unplugged; it may be back.
            Err(lost) => self.reopened().and_then(|mut port| {
                converse(&mut port, &self.order.bytes)
                    .map_err(|error| format!("{lost}; after opening the port again: {error}"))
            }),
            Ok(answer) => Ok(answer),
        };
        match outcome {
            Ok(answer) if answer.is_empty() => format!("{sent}, {TIMES} times; no answer"),
            Ok(answer) => format!("{sent}; it answered `{}`", answer.trim_ascii().escape_ascii()),
            Err(why) => format!("{device}: NOT REACHED: {why}"),
        }
    }

    /// The port opened again, exclusively, so that a program that has opened it since is not disturbed.
    fn reopened(&self) -> Result<TTYPort, String> {
        let builder = serialport::new(&self.order.port, self.order.baud);
        TTYPort::open(&builder.timeout(PAUSE).exclusive(true)).map_err(|error| error.to_string())
    }
}

/// Sends `bytes` until something is answered, a few times; what was answered.
fn converse(port: &mut (impl Read + Write), bytes: &[u8]) -> Result<Vec<u8>, String> {
    let mut answer = Vec::new();
    for time in 1..=TIMES {
        answer.clear();
        send(port, bytes).map_err(|error| error.to_string())?;
        receive(port, &mut answer).map_err(|error| error.to_string())?;
        if !answer.is_empty() && time >= TIMES_AT_LEAST {
            break;
        }
    }
    Ok(answer)
}

fn send(port: &mut impl Write, mut bytes: &[u8]) -> io::Result<()> {
    let until = Instant::now() + TAKEN_WITHIN;
    while !bytes.is_empty() {
        match port.write(bytes) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(written) => bytes = &bytes[written..],
            Err(error) if !waits(&error) || Instant::now() >= until => return Err(error),
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    Ok(())
}

fn receive(port: &mut impl Read, answer: &mut Vec<u8>) -> io::Result<()> {
    let mut until = Instant::now() + ANSWER_WITHIN;
    let mut buffer = [0; 512];
    while Instant::now() < until && answer.len() < 4 * buffer.len() {
        match port.read(&mut buffer) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                answer.extend_from_slice(&buffer[..count]);
                until = until.min(Instant::now() + PAUSE);
            }
            Err(error) if !waits(&error) => return Err(error),
            Err(_) => std::thread::sleep(Duration::from_millis(2)),
        }
    }
    Ok(())
}

fn waits(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goodbye_ends_the_watch_and_a_closed_pipe_does_not() {
        let (send, received) = channel();
        for line in [BEAT, BEAT, GOODBYE] {
            send.send(line.to_owned()).expect("it listens");
        }
        assert_eq!(watch(&received), None);
        send.send(BEAT.to_owned()).expect("it listens");
        drop(send);
        assert_eq!(watch(&received), Some(Lost::Gone));
    }

    #[test]
    fn a_beat_that_stops_is_noticed_in_time() {
        let (_tell, received) = channel();
        let begun = Instant::now();
        assert_eq!(watch(&received), Some(Lost::Still));
        assert!(begun.elapsed() >= BEAT_LOST_AFTER);
    }

    #[test]
    fn without_orders_it_does_nothing() {
        assert!(guard(&b""[..]).is_err());
        assert!(guard(&b"hello\n"[..]).is_err());
    }
}
