//! Fault injection: what tests and users can let go wrong on the virtual rig.

/// A fault of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The device restarts: its state is lost, and it sends its greeting.
    Reset,
    /// The wire is pulled out: the open port ends. It cannot be plugged in again.
    Unplug,
    /// One line from the device is damaged.
    OnLines(LineFault),
}

/// A fault of one line from the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFault {
    /// The next line that starts with `ok` is lost.
    LoseOk,
    /// One byte of the next piece of output is changed.
    Garble,
    /// The next piece of output is lost.
    LoseAll,
}

/// Injected faults that have not happened yet.
#[derive(Debug, Default)]
pub(super) struct LineFaults {
    waiting: Vec<LineFault>,
}

impl LineFaults {
    /// Adds a fault.
    pub fn add(&mut self, fault: LineFault) {
        self.waiting.push(fault);
    }

    /// Applies the faults that fit this output.
    pub fn apply(&mut self, out: &mut Vec<u8>) {
        if out.is_empty() {
            return;
        }
        self.waiting.retain(|fault| match fault {
            LineFault::LoseOk => match ok_line(out) {
                Some(line) => {
                    out.drain(line);
                    false
                }
                None => true,
            },
            LineFault::Garble => {
                let middle = out.len() / 2;
                if let Some(byte) = out.get_mut(middle) {
                    // Never a line end, which would split the line.
                    *byte = if *byte == b'#' { b'%' } else { b'#' };
                }
                false
            }
            LineFault::LoseAll => {
                out.clear();
                false
            }
        });
    }
}

fn ok_line(out: &[u8]) -> Option<std::ops::Range<usize>> {
    let mut start = 0;
    for line in out.split_inclusive(|&byte| byte == b'\n') {
        if line.starts_with(b"ok") {
            return Some(start..start + line.len());
        }
        start += line.len();
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_next_ok_is_lost() {
        let mut faults = LineFaults::default();
        faults.add(LineFault::LoseOk);
        let mut out = b"X:1.00\n".to_vec();
        faults.apply(&mut out);
        assert_eq!(out, b"X:1.00\n");
        let mut out = b"echo:hi\nok\nok\n".to_vec();
        faults.apply(&mut out);
        assert_eq!(out, b"echo:hi\nok\n");
        faults.apply(&mut out);
        assert_eq!(out, b"echo:hi\nok\n");
    }
}
