//! Who holds a port that cannot be opened.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// A program that holds a port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    /// Its number.
    pub pid: i32,
    /// Its name; empty where the system does not give it.
    pub program: String,
}

/// The program that has locked a port for itself, as serial libraries do. Known on Linux only.
pub fn holder_of(port: &str) -> Option<Holder> {
    let about = fs::metadata(port).ok()?;
    let locks = fs::read_to_string("/proc/locks").ok()?;
    let pid = locking_pid(&locks, about.dev(), about.ino())?;
    let program = fs::read_link(format!("/proc/{pid}/exe")).ok();
    let name = program.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy());
    Some(Holder { pid, program: name.unwrap_or_default().into_owned() })
}

/// Who holds the lock of a file in the lines of `/proc/locks` (proc_locks(5)): `1: FLOCK ADVISORY WRITE 708 08:03:259 0 EOF`.
fn locking_pid(locks: &str, device: u64, inode: u64) -> Option<i32> {
    let file = format!("{:02x}:{:02x}:{inode}", device >> 8 & 0xfff, device & 0xff);
    locks.lines().find_map(|line| {
        let mut words = line.split_ascii_whitespace().skip(1);
        let (kind, _, _, pid, locked) =
            (words.next()?, words.next()?, words.next()?, words.next()?, words.next()?);
        // A line with `->` is of one who waits for it.
        (kind != "->" && locked == file).then(|| pid.parse().ok()).flatten()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_holder_is_named_and_those_who_wait_are_not() {
        let locks = "1: POSIX  ADVISORY  READ 5433 08:01:7864448 128 128\n\
                     2: -> FLOCK  ADVISORY  WRITE 12 00:18:5 0 EOF\n\
                     3: FLOCK  ADVISORY  WRITE 2001 00:18:5 0 EOF\n";
        assert_eq!(locking_pid(locks, 0x18, 5), Some(2001));
        assert_eq!(locking_pid(locks, 0x18, 6), None);
        assert_eq!(locking_pid(locks, 0x801, 7_864_448), Some(5433));
        assert_eq!(locking_pid("", 0, 0), None);
    }

    #[test]
    fn a_lock_of_this_program_is_found_where_the_system_tells() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        file.as_file().lock().expect("it is locked");
        let holder = holder_of(&file.path().to_string_lossy());
        // Some systems hide /proc/locks; then nobody is named, and never somebody else.
        let me = i32::try_from(std::process::id()).expect("a process number");
        assert!(holder.is_none_or(|holder| holder.pid == me));
    }
}
