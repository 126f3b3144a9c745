//! The traffic on the wires of a rig, kept in files: one for each device, in parts of bounded size.
//!
//! Each line is `<seconds> <mark> <text>`, the seconds monotonic since the program opened the rig, the marks
//!
//! | mark | text |
//! |---|---|
//! | `@` | the device was opened: its port, the calendar's time, the number of the opening |
//! | `=` | the call that the program made (a call of a driver, JSON) |
//! | `>` | bytes sent, unprintable ones escaped |
//! | `<` | bytes received, the same |
//! | `:` | the result of the call: `ok` and a value, or `error` and its message; none where it was cancelled |
//! | `~` | what follows cannot be repeated by calls |
//! | `!` | so many entries were lost, for want of room on the disk |

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use jiff::Timestamp;

use crate::device::{Device, Role};
use fieldgap_input::{MOST_TABLE, read_text};

/// Bytes after which a part is full.
const PART: u64 = 16 << 20;

/// Full parts that are kept of a device; the oldest goes first.
const PARTS_KEPT: u32 = 16;

/// Bytes that wait in memory while there is no folder yet.
const WAITING: usize = 1 << 20;

tokio::task_local! {
    static LOGS: WireLogs;
}

/// The logs of a rig's wires.
#[derive(Debug, Clone)]
pub struct WireLogs {
    origin: Instant,
    logs: [Arc<Mutex<Log>>; Role::ALL.len()],
}

/// The log of one wire.
#[derive(Debug, Clone)]
pub(super) struct WireLog {
    origin: Instant,
    log: Arc<Mutex<Log>>,
}

#[derive(Debug)]
struct Log {
    place: Place,
    part: u64,
    lost: u64,
}

#[derive(Debug)]
enum Place {
    Memory(Vec<u8>),
    Folder { folder: PathBuf, name: &'static str, file: File, length: u64 },
}

impl Default for WireLogs {
    fn default() -> Self {
        Self::in_parts_of(PART)
    }
}

impl WireLogs {
    /// Logs in parts of so many bytes.
    pub fn in_parts_of(part: u64) -> Self {
        let log = || Log { place: Place::Memory(Vec::new()), part, lost: 0 };
        Self { origin: Instant::now(), logs: Role::ALL.map(|_| Arc::new(Mutex::new(log()))) }
    }

    /// Does some work, in which the wires that are opened are logged.
    pub async fn around<T>(&self, work: impl Future<Output = T>) -> T {
        LOGS.scope(self.clone(), work).await
    }

    /// Keeps the logs in a folder, behind what stands there.
    ///
    /// # Errors
    /// What the file system refused.
    pub fn keep_in(&self, folder: &Path) -> io::Result<()> {
        fs::create_dir_all(folder)?;
        for role in Role::ALL {
            lock(&self.logs[role as usize]).keep_in(folder, file_stem(role))?;
        }
        Ok(())
    }

    /// Notes something other than bytes.
    pub(crate) fn note(&self, role: Role, mark: char, text: &str) {
        self.of(role).entry(mark, text);
    }

    fn of(&self, role: Role) -> WireLog {
        WireLog { origin: self.origin, log: Arc::clone(&self.logs[role as usize]) }
    }
}

impl WireLog {
    /// The log for a wire that is being opened, where it is to be logged.
    pub(super) fn opened(device: &Device, opening: u16) -> Option<Self> {
        let log = LOGS.try_with(|logs| logs.of(device.role)).ok()?;
        log.entry('@', &format!("{} {} {opening}", device.port, Timestamp::now()));
        Some(log)
    }

    /// Bytes that were sent.
    pub(super) fn sent(&self, bytes: &[u8]) {
        self.entry('>', &bytes.escape_ascii().to_string());
    }

    /// Bytes that were received.
    pub(super) fn received(&self, bytes: &[u8]) {
        self.entry('<', &bytes.escape_ascii().to_string());
    }

    fn entry(&self, mark: char, text: &str) {
        let seconds = self.origin.elapsed().as_secs_f64();
        lock(&self.log).write(&format!("{seconds:.6} {mark} {text}\n"), seconds);
    }
}

impl Log {
    fn keep_in(&mut self, folder: &Path, name: &'static str) -> io::Result<()> {
        let mut file = append_to(folder, name)?;
        if let Place::Memory(waiting) = &self.place {
            file.write_all(waiting)?;
        }
        let length = file.metadata()?.len();
        self.place = Place::Folder { folder: folder.to_owned(), name, file, length };
        Ok(())
    }

    /// Writes an entry; a log must not end a scan, so one that finds no room is counted as lost.
    fn write(&mut self, line: &str, seconds: f64) {
        let lost = match self.lost {
            0 => String::new(),
            lost => format!("{seconds:.6} ! {lost}\n"),
        };
        match self.append(&(lost + line)) {
            Ok(()) => self.lost = 0,
            Err(_) => self.lost += 1,
        }
    }

    fn append(&mut self, text: &str) -> io::Result<()> {
        match &mut self.place {
            Place::Memory(waiting) if waiting.len() + text.len() > WAITING => {
                Err(io::ErrorKind::StorageFull.into())
            }
            Place::Memory(waiting) => {
                waiting.extend_from_slice(text.as_bytes());
                Ok(())
            }
            Place::Folder { folder, name, file, length } => {
                if *length >= self.part {
                    turn_over(folder, name)?;
                    (*file, *length) = (append_to(folder, name)?, 0);
                }
                if let Err(error) = file.write_all(text.as_bytes()) {
                    // Not half an entry.
                    let _ = file.set_len(*length);
                    return Err(error);
                }
                *length += text.len() as u64;
                Ok(())
            }
        }
    }
}

fn append_to(folder: &Path, name: &str) -> io::Result<File> {
    OpenOptions::new().create(true).append(true).open(folder.join(format!("{name}.log")))
}

/// Puts a full part aside under the next number, and drops the oldest beyond those that are kept.
fn turn_over(folder: &Path, name: &str) -> io::Result<()> {
    let aside = parts_aside(folder, name)?;
    let next = aside.last().map_or(1, |(number, _)| number + 1);
    fs::rename(folder.join(format!("{name}.log")), folder.join(format!("{name}.{next}.log")))?;
    for (number, path) in aside {
        if number + PARTS_KEPT <= next {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}

/// The full parts of a log with their numbers, oldest first.
fn parts_aside(folder: &Path, name: &str) -> io::Result<Vec<(u32, PathBuf)>> {
    let mut parts = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let file = path.file_name().and_then(|name| name.to_str()).unwrap_or("");
        let number = file.strip_prefix(name).and_then(|rest| rest.strip_prefix('.'));
        let number = number.and_then(|rest| rest.strip_suffix(".log")?.parse().ok());
        parts.extend(number.map(|number| (number, path.clone())));
    }
    parts.sort();
    Ok(parts)
}

/// The log of a device that is kept in a folder, all parts, oldest first; empty where there is none.
///
/// # Errors
/// What the file system refused.
pub fn read_wire_log(folder: &Path, role: Role) -> io::Result<String> {
    let name = file_stem(role);
    let mut parts: Vec<PathBuf> =
        parts_aside(folder, name)?.into_iter().map(|(_, path)| path).collect();
    parts.push(folder.join(format!("{name}.log")));
    let mut text = String::new();
    for path in parts {
        match read_text(&path, MOST_TABLE - text.len() as u64) {
            Ok(part) => text += &part,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
    }
    Ok(text)
}

fn file_stem(role: Role) -> &'static str {
    match role {
        Role::Robot => "robot",
        Role::Receiver => "receiver",
        Role::FocusArray => "focus-array",
        Role::Environment => "environment",
    }
}

fn lock(log: &Mutex<Log>) -> MutexGuard<'_, Log> {
    log.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncWriteExt, duplex};

    use super::*;
    use crate::link::Wire;

    #[tokio::test]
    async fn what_was_said_before_there_was_a_folder_stands_in_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let logs = WireLogs::default();
        let (near, mut far) = duplex(64);
        let device = Device::new(Role::Robot, "memory");
        let mut wire = logs.around(async { Wire::new(near, device) }).await;
        wire.send(b"M115\n").await.expect("open");
        logs.keep_in(folder.path()).expect("written");
        far.write_all(b"ok\xff\n").await.expect("open");
        wire.line(tokio::time::Instant::now()).await.expect("open");
        let text = read_wire_log(folder.path(), Role::Robot).expect("text");
        let entries: Vec<&str> =
            text.lines().map(|line| line.split_once(' ').expect("a time").1).collect();
        assert!(entries[0].starts_with("@ memory 20"), "{text}");
        assert_eq!(&entries[1..], [r"> M115\n", r"< ok\xff\n"]);
    }

    #[test]
    fn parts_are_put_aside_and_the_oldest_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let logs = WireLogs::in_parts_of(100);
        logs.keep_in(folder.path()).expect("written");
        for number in 0..200 {
            logs.note(Role::Receiver, '=', &format!("{number:050}"));
        }
        let files = fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(files, 4 + PARTS_KEPT as usize);
        let text = read_wire_log(folder.path(), Role::Receiver).expect("text");
        let numbers: Vec<u32> = text
            .lines()
            .map(|line| line.rsplit(' ').next().expect("a word").parse().expect("a number"))
            .collect();
        assert_eq!(numbers.last(), Some(&199));
        assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1) && numbers[0] > 0);
    }
}
