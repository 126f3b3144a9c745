//! Key presses.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ratatui::crossterm::event::{self, Event, KeyEvent, KeyEventKind};
use tokio::sync::mpsc::{Receiver, channel};

/// Interval at which the reading thread checks whether to end.
const LOOK: Duration = Duration::from_millis(50);

/// Buffered presses; further repeats of a key that is held down are dropped.
const KEPT: usize = 16;

/// An input event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Press {
    /// A key.
    Key(KeyEvent),
    /// The terminal was resized: draw again.
    Resized,
}

/// The keys pressed from now on, read by a thread until this is dropped.
#[derive(Debug)]
pub struct KeyPresses {
    presses: Receiver<Press>,
    over: Arc<AtomicBool>,
}

impl KeyPresses {
    /// Starts to read. A [`Screen`](super::Screen) must be open; otherwise keys arrive line by line.
    pub fn listen() -> Self {
        let (tell, presses) = channel(KEPT);
        let over = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&over);
        std::thread::spawn(move || {
            while !ended.load(Ordering::Relaxed) {
                let press = match event::poll(LOOK) {
                    Ok(false) => continue,
                    Ok(true) => event::read(),
                    // The terminal was closed; a signal ends the program.
                    Err(_) => return,
                };
                let press = match press {
                    Ok(Event::Key(key)) if key.kind != KeyEventKind::Release => Press::Key(key),
                    Ok(Event::Resize(..)) => Press::Resized,
                    Ok(_) => continue,
                    Err(_) => return,
                };
                let _ = tell.try_send(press);
            }
        });
        Self { presses, over }
    }

    /// The next press. Never resolves once the terminal was closed.
    pub async fn next(&mut self) -> Press {
        match self.presses.recv().await {
            Some(press) => press,
            None => std::future::pending().await,
        }
    }
}

impl Drop for KeyPresses {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}
