//! What a thread of another process does, as the kernel tells.

use std::fs;

/// What a thread does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Activity {
    /// It was stopped by a signal or a debugger.
    Stopped,
    /// It runs, or waits for a processor, for memory or for a disk: it does what it can.
    Busy,
    /// It waits for something else, such as a lock or a timer; or nothing is known.
    Asleep,
    /// It has ended.
    Ended,
}

impl Activity {
    /// Of a thread of a process.
    pub fn of(process: u32, thread: i32) -> Self {
        match fs::read_to_string(format!("/proc/{process}/task/{thread}/stat")) {
            Ok(stat) => state_letter(&stat).map_or(Self::Asleep, Self::of_letter),
            Err(_) if fs::exists("/proc/self/stat").unwrap_or(false) => Self::Ended,
            Err(_) => Self::Asleep,
        }
    }

    /// The letters of proc_pid_stat(5).
    fn of_letter(letter: char) -> Self {
        match letter {
            'T' | 't' => Self::Stopped,
            'R' | 'D' => Self::Busy,
            'Z' | 'X' | 'x' => Self::Ended,
            _ => Self::Asleep,
        }
    }
}

/// The process that started a process.
pub(super) fn parent_of(process: u32) -> Option<u32> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    after_name(&stat)?.split_ascii_whitespace().nth(1)?.parse().ok()
}

fn state_letter(stat: &str) -> Option<char> {
    after_name(stat)?.chars().next()
}

/// What follows the name, which stands in parentheses and may itself contain some: `4 (a) b) S 1 ...`.
fn after_name(stat: &str) -> Option<&str> {
    Some(stat.rsplit_once(')')?.1.trim_start())
}

#[cfg(test)]
mod tests {
    use std::process::{Child, Command};

    use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, waitid};

    use super::*;

    /// A process that sleeps; killed on drop.
    struct Sleeper(Child);

    impl Sleeper {
        fn activity(&self) -> Activity {
            Activity::of(self.0.id(), i32::try_from(self.0.id()).expect("a number"))
        }
    }

    impl Drop for Sleeper {
        fn drop(&mut self) {
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }

    #[test]
    fn a_stopped_an_ended_and_a_running_thread_are_told_apart() {
        let mut child = Sleeper(Command::new("sleep").arg("600").spawn().expect("it starts"));
        let pid = Pid::from_child(&child.0);
        kill_process(pid, Signal::STOP).expect("the signal is sent");
        waitid(WaitId::Pid(pid), WaitIdOptions::STOPPED).expect("it is stopped");
        assert_eq!(child.activity(), Activity::Stopped);
        kill_process(pid, Signal::KILL).expect("the signal is sent");
        waitid(WaitId::Pid(pid), WaitIdOptions::EXITED | WaitIdOptions::NOWAIT).expect("it ended");
        assert_eq!(child.activity(), Activity::Ended);
        assert_eq!(parent_of(child.0.id()), Some(std::process::id()));
        child.0.wait().expect("it ended");
        assert_eq!(child.activity(), Activity::Ended);
        let this = rustix::thread::gettid().as_raw_pid();
        assert_eq!(Activity::of(std::process::id(), this), Activity::Busy);
    }

    #[test]
    fn the_state_follows_the_last_parenthesis() {
        assert_eq!(state_letter("4 (a) R (b) S 1 2"), Some('S'));
        assert_eq!(state_letter("4 nothing"), None);
        assert_eq!(Activity::of_letter('D'), Activity::Busy);
        assert_eq!(Activity::of_letter('S'), Activity::Asleep);
    }
}
