//! The guard's own process.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::fd::{FromRawFd, OwnedFd};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use jiff::Timestamp;
use rustix::process::{Pid, Signal, kill_process};
use serialport::TTYPort;

use super::activity::Activity;
use super::orders::{Order, Orders};
use super::pipe::{Heard, LinePipe};
use super::vigil::{Lost, STEP, Vigil};
use super::{BEAT, GOODBYE, GUARDING};

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

/// How long the orders may take to come.
const ORDERS_WITHIN: Duration = Duration::from_secs(10);

/// Longest time for which the guard holds the ports after the program is lost: the command is sent twice to a program that has
/// to be ended, each time also by the port opened again.
pub(super) const ACTS_WITHIN: Duration = Duration::from_secs(10);

/// What the guard did about a lost program.
#[derive(Debug)]
pub struct Acted {
    /// What it saw and did, one thing a line.
    pub done: Vec<String>,
    /// The note in its [`Duties`](super::Duties).
    pub note: Option<String>,
    /// Where it wrote that; `None` if nowhere.
    log: Option<PathBuf>,
    /// Whether that could be written.
    pub logged: io::Result<()>,
}

impl Acted {
    /// Adds lines to the log.
    ///
    /// # Errors
    /// That they cannot be written.
    pub fn log(&self, lines: &[String]) -> io::Result<()> {
        let Some(log) = &self.log else { return Ok(()) };
        let mut log = OpenOptions::new().create(true).append(true).open(log)?;
        let now = Timestamp::now();
        let text: String = lines.iter().map(|line| format!("{now} {line}\n")).collect();
        log.write_all(text.as_bytes())?;
        log.sync_all()
    }
}

/// Guards a rig until the program at the other end of `pipe` says goodbye: then `None`. Makes the rig safe if that program is
/// lost. `answer` goes to the program, which waits for the guard to be ready.
///
/// # Errors
/// That the pipe brought no orders, or that the system refused to read it.
pub fn guard(pipe: OwnedFd, mut answer: impl Write) -> io::Result<Option<Acted>> {
    let mut pipe = LinePipe::new(pipe);
    let orders = match pipe.next_within(ORDERS_WITHIN)? {
        Heard::Line(line) => Orders::decode(&line),
        Heard::Quiet | Heard::Closed => None,
    };
    let orders = orders.ok_or_else(|| {
        io::Error::new(io::ErrorKind::InvalidData, "the watchdog is started by fieldgap itself")
    })?;
    // A program that does not listen has ended, which the pipe tells next.
    let _ = writeln!(answer, "{GUARDING}").and_then(|()| answer.flush());
    let activity = || Activity::of(orders.program, orders.thread);
    let lost = watch(&mut pipe, activity)?;
    Ok(lost.map(|lost| act(orders, lost)))
}

/// Listens to the beat; `None` after a goodbye.
fn watch(pipe: &mut LinePipe, activity: impl Fn() -> Activity) -> io::Result<Option<Lost>> {
    let mut vigil = Vigil::default();
    loop {
        let begun = Instant::now();
        let lost = match pipe.next_within(STEP)? {
            Heard::Line(line) if line == GOODBYE => return Ok(None),
            Heard::Line(line) => match unresponsive(&line) {
                Some(unresponsive) => vigil.beat(unresponsive),
                None => Some(Lost::Gone),
            },
            Heard::Closed => Some(Lost::Gone),
            Heard::Quiet => vigil.quiet(begun.elapsed(), &activity),
        };
        if lost.is_some() {
            return Ok(lost);
        }
    }
}

/// For how long the work has not responded, as a beat says.
fn unresponsive(line: &str) -> Option<Duration> {
    let milliseconds = line.strip_prefix(BEAT)?.trim_start().parse().ok()?;
    Some(Duration::from_millis(milliseconds))
}

fn act(orders: Orders, lost: Lost) -> Acted {
    let mut devices: Vec<GuardedDevice> =
        orders.devices.into_iter().map(GuardedDevice::new).collect();
    let program = orders.program;
    let mut done = vec![format!("the program (process {program}) {}", lost.text())];
    let mut results = send_to_all(&mut devices);
    if lost != Lost::Gone {
        // It would go on to record a field that is no longer there.
        done.push(end_program(program));
        results.extend(send_to_all(&mut devices));
    }
    done.extend(results);
    // Whoever reads the log may open the ports again.
    drop(devices);
    let mut acted = Acted { done, note: orders.note, log: orders.log, logged: Ok(()) };
    acted.logged = acted.log(&acted.done);
    acted
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

    fn watched(said: &str, activity: Activity) -> Option<Lost> {
        let (reader, mut writer) = io::pipe().expect("a pipe");
        writer.write_all(said.as_bytes()).expect("it takes it");
        drop(writer);
        watch(&mut LinePipe::new(reader.into()), || activity).expect("it reads")
    }

    #[test]
    fn a_goodbye_ends_the_watch_and_a_closed_pipe_does_not() {
        assert_eq!(watched("beat 0\nbeat 3\ngoodbye\n", Activity::Asleep), None);
        assert_eq!(watched("beat 0\n", Activity::Asleep), Some(Lost::Gone));
        assert_eq!(watched("beat 0\nbe", Activity::Asleep), Some(Lost::Gone));
        assert_eq!(watched("beat 0\nbeat 30000\nbeat 0\n", Activity::Asleep), Some(Lost::Stuck));
    }

    #[test]
    fn a_beat_that_stops_is_noticed_in_time() {
        let (reader, writer) = io::pipe().expect("a pipe");
        let begun = Instant::now();
        let lost = watch(&mut LinePipe::new(reader.into()), || Activity::Stopped);
        assert_eq!(lost.expect("it reads"), Some(Lost::Stopped));
        assert!(begun.elapsed() >= super::super::BEAT_LOST_AFTER - STEP);
        drop(writer);
    }

    #[test]
    fn without_orders_it_does_nothing() {
        for said in ["", "hello\n"] {
            let (reader, mut writer) = io::pipe().expect("a pipe");
            writer.write_all(said.as_bytes()).expect("it takes it");
            drop(writer);
            assert!(guard(reader.into(), io::sink()).is_err());
        }
    }
}
