//! Replays a wire log. The present driver gets the recorded calls and receives the recorded bytes at the recorded times. The
//! bytes that it sends and the results that it returns are compared with the log.
//!
//! Time is virtual, so a night's log takes seconds. Call it within a Tokio runtime whose time is paused.

use std::fmt;
use std::pin::pin;
use std::time::Duration;

use serde::Serialize;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until, timeout, timeout_at};

use super::call::{Call, result_text};
use super::config::RigConfig;
use super::device::Role;
use super::link::replayed;
use super::safety::{Ports, open_motion};
use super::{ElementDelay, Feed, FocusArray, Motion, Receiver, RigError, RobotPosition};

/// What passes between driver and log at once, bytes.
const CAPACITY: usize = 1 << 20;

/// How much later than then a driver may come to its end.
const LATER: Duration = Duration::from_secs(60);

/// Latest entry of a log, seconds: a hundred days.
const LATEST_S: f64 = 1e7;

/// Most entries of a log: those of all the parts that are kept.
const MOST_ENTRIES: usize = 10_000_000;

/// The result of a call that does not end.
const NOTHING: &str = "no result";

/// How much of what differs is shown, bytes.
const SHOWN: usize = 100;

/// One device's sessions, run again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Replayed {
    /// Which device.
    pub device: Role,
    /// Times that it was opened in the log.
    pub sessions: usize,
    /// Calls that were made again.
    pub calls: usize,
    /// Bytes that were sent again as they were then.
    pub bytes: usize,
    /// Lines of the log before its first opening: their beginning was put aside long ago.
    pub skipped: usize,
    /// Sessions that were run again only up to something that cannot be asked for again: what was lost of the log, and rows
    /// that were flown.
    pub cut: usize,
    /// The first difference of each session that has one.
    pub differences: Vec<Difference>,
}

/// Where a driver's behaviour differs from the log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// The session, from 1.
    pub session: usize,
    /// Seconds on the log's clock.
    pub at_s: f64,
    /// What was being done.
    pub during: String,
    /// What the log has.
    pub then: String,
    /// What the driver does now.
    pub now: String,
}

impl fmt::Display for Replayed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { device, sessions, calls, bytes, skipped, cut, differences } = self;
        write!(f, "{device}: {sessions} sessions, {calls} calls, {bytes} bytes sent unchanged")?;
        if *skipped > 0 {
            write!(f, "; skipped {skipped} lines before the first opening")?;
        }
        if *cut > 0 {
            write!(f, "; {cut} in part only, because the rest cannot be repeated")?;
        }
        for Difference { session, at_s, during, then, now } in differences {
            write!(
                f,
                "\n  session {session} at {at_s:.3} s, {during}:\n    then: {then}\n    now:  {now}"
            )?;
        }
        Ok(())
    }
}

/// One line of a log.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    at_s: f64,
    kind: Kind,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Opened {
        port: String,
        opening: u16,
    },
    Call {
        call: Call,
    },
    Sent(Vec<u8>),
    Received(Vec<u8>),
    Outcome(String),
    /// What follows cannot be asked for: it was lost, or is no call.
    NotToBeAsked,
}

/// Runs the log of robot, receiver or array again, with the drivers that `config` names.
///
/// # Errors
/// The number, from 1, of the first line that is no entry of a log, or is beyond the ten million that are replayed.
pub async fn replay(config: &RigConfig, role: Role, log: &str) -> Result<Replayed, usize> {
    let mut entries = Vec::new();
    for (number, line) in log.split_inclusive('\n').enumerate() {
        // A program that was killed leaves its last line torn.
        let Some(line) = line.strip_suffix('\n') else { break };
        if number == MOST_ENTRIES {
            return Err(number + 1);
        }
        entries.push(parse(line).ok_or(number + 1)?);
    }
    let opened = |entry: &Entry| matches!(entry.kind, Kind::Opened { .. });
    let skipped = entries.iter().position(opened).unwrap_or(entries.len());
    let mut replayed = Replayed {
        device: role,
        sessions: 0,
        calls: 0,
        bytes: 0,
        skipped,
        cut: 0,
        differences: vec![],
    };
    let mut rest = &entries[skipped..];
    while let Some(((first, after), Kind::Opened { port, opening })) =
        rest.split_first().map(|(first, after)| ((first, after), &first.kind))
    {
        let (session, later) = after.split_at(after.iter().position(opened).unwrap_or(after.len()));
        replayed.sessions += 1;
        let whole = session.iter().position(|entry| entry.kind == Kind::NotToBeAsked);
        replayed.cut += usize::from(whole.is_some());
        let session = &session[..whole.unwrap_or(session.len())];
        let opened = Opened { port, opening: *opening, at_s: first.at_s };
        let difference = run_session(config, role, opened, session, &mut replayed).await;
        replayed.differences.extend(difference);
        rest = later;
    }
    Ok(replayed)
}

/// A driver, whichever it is.
enum Driver {
    Motion(Box<dyn Motion>),
    Receiver(Box<dyn Receiver>),
    Array(Box<dyn FocusArray>),
}

impl Driver {
    async fn open(config: &RigConfig, role: Role, port: &str) -> Result<Self, RigError> {
        match role {
            Role::Robot => {
                let ports = Ports { motion: Some(port.to_owned()), ..Ports::default() };
                open_motion(&config.motion, &ports).await.map(Self::Motion)
            }
            Role::Receiver => config.receiver.open(Some(port)).await.map(Self::Receiver),
            Role::FocusArray | Role::Environment => {
                config.focus_array.open(Some(port)).await.map(Self::Array)
            }
        }
    }

    /// Makes a call again; its outcome as the log has it.
    async fn perform(&mut self, call: &Call) -> String {
        match (self, call) {
            (Self::Motion(robot), Call::Home) => result_text(&robot.home().await),
            (Self::Motion(robot), Call::MoveTo { target_m, feed_mm_s }) => {
                let target = RobotPosition::from_axes_m(*target_m);
                result_text(&robot.move_to(target, Feed::from_mm_s(*feed_mm_s)).await)
            }
            (Self::Motion(robot), Call::Stop) => result_text(&robot.stop().await),
            (Self::Motion(robot), Call::Position) => result_text(&robot.position().await),
            (Self::Receiver(receiver), Call::ReadPoint { settle, count }) => {
                result_text(&receiver.read_point(*settle, *count).await)
            }
            (Self::Array(array), Call::Silence) => result_text(&array.silence().await),
            (Self::Array(array), Call::ContinuousWave) => {
                result_text(&array.continuous_wave().await)
            }
            (Self::Array(array), Call::SetDelays(delays_s)) => {
                let delay = |seconds: &Option<f64>| {
                    seconds.map_or(ElementDelay::Silent, ElementDelay::Seconds)
                };
                let delays: Vec<ElementDelay> = delays_s.iter().map(delay).collect();
                result_text(&array.set_delays(&delays).await)
            }
            (Self::Array(array), Call::Emit) => result_text(&array.emit().await),
            (Self::Array(array), Call::Refresh) => result_text(&array.refresh().await),
            (Self::Array(array), Call::Confirm { emits }) => {
                result_text(&array.confirm(*emits).await)
            }
            (_, call) => format!("this device has no call {}", call.encode()),
        }
    }
}

/// How far player and caller are, in entries of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Progress {
    /// All entries before this one have been played.
    reached: usize,
    /// All calls before this entry were begun.
    begun: usize,
    /// All calls with an outcome before this entry have ended.
    ended: usize,
}

/// One session under way. Entries are gone through in their order, and none before its time.
#[derive(Clone, Copy)]
struct RecordedSession<'a> {
    entries: &'a [Entry],
    opened_s: f64,
    begun: Instant,
    progress: &'a watch::Sender<Progress>,
}

/// How a session was opened.
struct Opened<'a> {
    port: &'a str,
    opening: u16,
    at_s: f64,
}

/// Runs one session again; its first difference, if there is one.
async fn run_session(
    config: &RigConfig,
    role: Role,
    opened: Opened<'_>,
    entries: &[Entry],
    replayed: &mut Replayed,
) -> Option<Difference> {
    let (near, far) = duplex(CAPACITY);
    let progress = watch::Sender::new(Progress::default());
    let Opened { port, opening, at_s: opened_s } = opened;
    let session = RecordedSession { entries, opened_s, begun: Instant::now(), progress: &progress };
    let driver = replayed::through(near, opening, Driver::open(config, role, port));
    let calling = async {
        let found = session.call(driver, &mut replayed.calls).await;
        // The driver is dropped by now, and has sent its final bytes.
        progress
            .send_modify(|progress| (progress.begun, progress.ended) = (usize::MAX, usize::MAX));
        found
    };
    let (mut playing, mut calling) = (pin!(session.play(far)), pin!(calling));
    let ((matched, of_bytes), of_outcome) = tokio::select! {
        biased;
        // Where the bytes differ, the calls are awaited no longer than an answer would be.
        played = &mut playing => (played, timeout(LATER, &mut calling).await.unwrap_or_default()),
        outcome = &mut calling => (playing.await, outcome),
    };
    replayed.bytes += matched;
    // What came first is the cause of the other.
    let (at_s, then, now) = [of_bytes, of_outcome]
        .into_iter()
        .flatten()
        .min_by(|one, other| one.0.total_cmp(&other.0))?;
    let during = call_at(entries, at_s).unwrap_or_else(|| "opening".to_owned());
    Some(Difference { session: replayed.sessions, at_s, during, then, now })
}

/// The call under way at a time of the log.
fn call_at(session: &[Entry], at_s: f64) -> Option<String> {
    session.iter().rev().filter(|entry| entry.at_s <= at_s).find_map(|entry| match &entry.kind {
        Kind::Call { call } => Some(call.encode()),
        _ => None,
    })
}

/// When, what was then, and what is now.
type Apart = (f64, String, String);

impl RecordedSession<'_> {
    /// When an instant of the log is now.
    fn at(&self, at_s: f64) -> Instant {
        self.begun + Duration::from_secs_f64((at_s - self.opened_s).max(0.0))
    }

    /// Returns when `met`, with true, or when that is given up.
    async fn wait(&self, at_s: f64, met: impl Fn(&Progress) -> bool) -> bool {
        let mut progress = self.progress.subscribe();
        let waiting = progress.wait_for(|progress| met(progress));
        timeout_at(self.at(at_s) + LATER, waiting).await.is_ok()
    }

    /// Makes the calls of the session; the first whose outcome differs.
    async fn call(
        &self,
        opening: impl Future<Output = Result<Driver, RigError>>,
        calls: &mut usize,
    ) -> Option<Apart> {
        let is_call = |entry: &Entry| matches!(entry.kind, Kind::Call { .. });
        let first = self.entries.iter().position(is_call);
        let before = self.entries[..first.unwrap_or(self.entries.len())].last();
        let until = self.at(before.map_or(self.opened_s, |entry| entry.at_s)) + LATER;
        let opened = match timeout_at(until, opening).await {
            Ok(opened) => opened.map_err(|error| error.to_string()),
            Err(_) => Err(NOTHING.to_owned()),
        };
        let mut driver = match (opened, first) {
            (Ok(driver), _) => driver,
            (Err(now), Some(_)) => return Some((self.opened_s, "it was opened".to_owned(), now)),
            // It could not be opened then either.
            (Err(_), None) => return None,
        };
        for (index, entry) in self.entries.iter().enumerate() {
            let Kind::Call { call } = &entry.kind else { continue };
            if !self.wait(entry.at_s, |progress| progress.reached >= index).await {
                return None;
            }
            // Not before its time: a driver that asked earlier would give up waiting for the answer earlier.
            sleep_until(self.at(entry.at_s)).await;
            self.progress.send_modify(|progress| progress.begun = progress.begun.max(index + 1));
            *calls += 1;
            let later = &self.entries[index + 1..];
            let next = later
                .iter()
                .position(|entry| matches!(entry.kind, Kind::Call { .. } | Kind::Outcome(_)))
                .map_or(self.entries.len(), |next| index + 1 + next);
            let work = driver.perform(call);
            if let Some(Entry { kind: Kind::Outcome(then), at_s }) = self.entries.get(next) {
                let now = match timeout_at(self.at(*at_s) + LATER, work).await {
                    Ok(outcome) => outcome,
                    Err(_) => NOTHING.to_owned(),
                };
                if *then != now {
                    return Some((*at_s, then.clone(), now));
                }
                self.progress.send_modify(|progress| progress.ended = progress.ended.max(next + 1));
            } else {
                // It was given up then, and is now.
                let at_s = self.entries.last().map_or(entry.at_s, |last| last.at_s);
                tokio::select! {
                    _ = work => {}
                    _ = self.wait(at_s, |progress| progress.reached >= next) => {}
                }
            }
        }
        None
    }

    /// Plays the device: sends what was received at its recorded time, and compares what comes with what was sent. Returns
    /// the number of equal bytes, and the first difference.
    async fn play(&self, mut link: DuplexStream) -> (usize, Option<Apart>) {
        let mut matched = 0;
        let mut apart = None;
        for (index, entry) in self.entries.iter().enumerate() {
            self.progress.send_modify(|progress| progress.reached = index);
            match &entry.kind {
                Kind::Call { .. } => {
                    self.wait(entry.at_s, |progress| progress.begun > index).await;
                }
                Kind::Outcome(_) => {
                    self.wait(entry.at_s, |progress| progress.ended > index).await;
                }
                Kind::Received(bytes) => {
                    sleep_until(self.at(entry.at_s)).await;
                    // A driver that is gone shows in what it did not send.
                    let _ = link.write_all(bytes).await;
                }
                Kind::Sent(bytes) => {
                    let now = read_up_to(&mut link, bytes.len(), self.at(entry.at_s) + LATER).await;
                    matched += now.iter().zip(bytes).take_while(|(now, then)| now == then).count();
                    if now != *bytes {
                        apart = Some((entry.at_s, shown(bytes), shown(&now)));
                        break;
                    }
                }
                Kind::Opened { .. } | Kind::NotToBeAsked => {}
            }
        }
        self.progress.send_modify(|progress| progress.reached = usize::MAX);
        let more = read_up_to(&mut link, SHOWN, Instant::now() + LATER).await;
        if apart.is_none() && !more.is_empty() {
            let at_s = self.entries.last().map_or(self.opened_s, |entry| entry.at_s);
            apart = Some((at_s, "nothing more was sent".to_owned(), shown(&more)));
        }
        (matched, apart)
    }
}

/// The next bytes, fewer where no more come until then.
async fn read_up_to(link: &mut DuplexStream, count: usize, until: Instant) -> Vec<u8> {
    let mut bytes = vec![0; count];
    let mut read = 0;
    while read < count {
        match timeout_at(until, link.read(&mut bytes[read..])).await {
            Ok(Ok(more @ 1..)) => read += more,
            _ => break,
        }
    }
    bytes.truncate(read);
    bytes
}

fn shown(bytes: &[u8]) -> String {
    match bytes {
        [] => "nothing was sent".to_owned(),
        bytes => format!("sent `{}`", bytes[..bytes.len().min(SHOWN)].escape_ascii()),
    }
}

fn parse(line: &str) -> Option<Entry> {
    let (seconds, rest) = line.split_once(' ')?;
    let at_s: f64 = seconds.parse().ok().filter(|at_s| (0.0..=LATEST_S).contains(at_s))?;
    let (mark, text) = rest.split_once(' ')?;
    let kind = match mark {
        "@" => {
            let mut words = text.rsplitn(3, ' ');
            let opening = words.next()?.parse().ok()?;
            Kind::Opened { port: words.nth(1)?.to_owned(), opening }
        }
        "=" => Kind::Call { call: serde_json::from_str(text).ok().filter(Call::can_be)? },
        ">" => Kind::Sent(unescape(text)?),
        "<" => Kind::Received(unescape(text)?),
        ":" => Kind::Outcome(text.to_owned()),
        "!" | "~" => Kind::NotToBeAsked,
        _ => return None,
    };
    Some(Entry { at_s, kind })
}

/// Bytes from what [`slice::escape_ascii`] made of them.
fn unescape(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'\\' => match rest.next()? {
                b'n' => b'\n',
                b'r' => b'\r',
                b't' => b'\t',
                b'x' => {
                    let digit = |digit: u8| char::from(digit).to_digit(16);
                    (digit(rest.next()?)? * 16 + digit(rest.next()?)?) as u8
                }
                other => other,
            },
            byte => byte,
        });
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_bytes_are_read_back_as_they_were_written(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
            prop_assert_eq!(unescape(&bytes.escape_ascii().to_string()), Some(bytes));
        }

        #[test]
        fn no_line_makes_the_parser_panic(line in "\\PC{0,60}") {
            let _ = parse(&line);
        }
    }
}
