//! Lines from a pipe, each awaited for a limited time, without a thread that could itself be held up.

use std::fs::File;
use std::io::{self, Read};
use std::os::fd::OwnedFd;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

/// What came within the time.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Heard {
    /// A line, without its end.
    Line(String),
    /// Nothing.
    Quiet,
    /// The other end was closed.
    Closed,
}

/// The end of a pipe from which lines are read.
#[derive(Debug)]
pub(super) struct LinePipe {
    pipe: File,
    bytes: Vec<u8>,
}

impl LinePipe {
    pub fn new(pipe: OwnedFd) -> Self {
        Self { pipe: File::from(pipe), bytes: Vec::new() }
    }

    /// The next line, if one comes within the time. Lines that have come already are read even if no time is left.
    ///
    /// # Errors
    /// What the system reports.
    pub fn next_within(&mut self, within: Duration) -> io::Result<Heard> {
        let until = Instant::now() + within;
        loop {
            if let Some(end) = self.bytes.iter().position(|&byte| byte == b'\n') {
                let line: Vec<u8> = self.bytes.drain(..=end).collect();
                return Ok(Heard::Line(String::from_utf8_lossy(&line[..end]).into_owned()));
            }
            if !self.ready_within(until.saturating_duration_since(Instant::now()))? {
                return Ok(Heard::Quiet);
            }
            let mut chunk = [0; 4096];
            match self.pipe.read(&mut chunk)? {
                0 => return Ok(Heard::Closed),
                count => self.bytes.extend_from_slice(&chunk[..count]),
            }
        }
    }

    fn ready_within(&self, within: Duration) -> io::Result<bool> {
        let limit = Timespec::try_from(within).map_err(io::Error::other)?;
        let mut ends = [PollFd::new(&self.pipe, PollFlags::IN)];
        match poll(&mut ends, Some(&limit)) {
            Ok(ready) => Ok(ready > 0),
            Err(Errno::INTR) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn lines_are_given_one_by_one_also_those_that_came_together() {
        let (reader, mut writer) = io::pipe().expect("a pipe");
        let mut pipe = LinePipe::new(reader.into());
        writer.write_all(b"one\ntwo\nthr").expect("it takes them");
        let mut next = || pipe.next_within(Duration::ZERO).expect("it reads");
        assert_eq!(next(), Heard::Line("one".to_owned()));
        assert_eq!(next(), Heard::Line("two".to_owned()));
        assert_eq!(next(), Heard::Quiet);
        writer.write_all(b"ee\n").expect("it takes it");
        drop(writer);
        assert_eq!(next(), Heard::Line("three".to_owned()));
        assert_eq!(next(), Heard::Closed);
    }
}
