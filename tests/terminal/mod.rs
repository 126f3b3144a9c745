//! A pseudo-terminal on which a program runs.

use std::fs::File;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::sync::mpsc::{Receiver, channel};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

/// A terminal, seen from its keys and its screen.
pub struct Terminal {
    /// What is written here is typed, and what is read here is shown.
    pub face: File,
    path: String,
}

impl Terminal {
    /// Of 24 rows of so many columns.
    pub fn of_width(columns: u16) -> Self {
        let terminal = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal");
        grantpt(&terminal).expect("it is ours");
        unlockpt(&terminal).expect("it opens");
        let size = Winsize { ws_row: 24, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&terminal, size).expect("it has a size");
        let path = ptsname(&terminal, Vec::new()).expect("it has a name");
        Self { face: File::from(terminal), path: path.to_str().expect("plain").to_owned() }
    }

    /// The end that a program reads and writes.
    pub fn end(&self) -> OwnedFd {
        File::options().read(true).write(true).open(&self.path).expect("it opens").into()
    }
}

/// What a terminal shows, as it comes.
pub fn shown(face: &File) -> Receiver<Vec<u8>> {
    let mut screen = face.try_clone().expect("a second handle");
    let (show, shown) = channel();
    std::thread::spawn(move || {
        let mut bytes = [0; 4096];
        // The terminal's end reads as an error.
        while let Ok(count @ 1..) = screen.read(&mut bytes) {
            if show.send(bytes[..count].to_vec()).is_err() {
                return;
            }
        }
    });
    shown
}
