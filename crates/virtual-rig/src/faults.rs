//! Faults that tests and curious people inject into the virtual rig.

/// A fault of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The device restarts: its state is lost, and it says what it says at power-up.
    Reset,
    /// The wire is pulled out: whoever has the port open sees it end. There is no plugging in again.
    Unplug,
    /// Something happens to what the device says.
    OnLines(LineFault),
}

/// A fault of one line on its way from the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFault {
    /// The next line that starts with `ok` is lost.
    LoseOk,
    /// One byte of the next piece of output is changed.
    Garble,
    /// The next piece of output is lost.
    LoseAll,
}

/// The faults that wait for their line.
#[derive(Debug, Default)]
pub(super) struct LineFaults {
    waiting: Vec<LineFault>,
}

impl LineFaults {
    /// Adds a fault to those that wait.
    pub fn add(&mut self, fault: LineFault) {
        self.waiting.push(fault);
    }

    /// Lets those happen that fit this output.
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
                    // Never into a line end, which would make two lines of one.
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
