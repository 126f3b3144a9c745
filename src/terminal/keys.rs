//! Keys as they are pressed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ratatui::crossterm::event::{self, Event, KeyEvent, KeyEventKind};
use tokio::sync::mpsc::{Receiver, channel};

/// How often the reading thread looks whether it is still wanted.
const LOOK: Duration = Duration::from_millis(50);

/// Presses that are kept until they are asked for; of a key that is held down longer, the rest is dropped.
const KEPT: usize = 16;

/// What comes from the keyboard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Press {
    /// A key.
    Key(KeyEvent),
    /// The terminal has another size: draw again.
    Resized,
}

/// The keys pressed from now on, read by a thread of their own until this is dropped.
#[derive(Debug)]
pub struct KeyPresses {
    presses: Receiver<Press>,
    over: Arc<AtomicBool>,
}

impl KeyPresses {
    /// Begins to read. A [`Screen`](super::Screen) must be open, or keys come only with their line.
    pub fn listen() -> Self {
        let (tell, presses) = channel(KEPT);
        let over = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&over);
        std::thread::spawn(move || {
            while !ended.load(Ordering::Relaxed) {
                let press = match event::poll(LOOK) {
                    Ok(false) => continue,
                    Ok(true) => event::read(),
                    // The terminal is gone; the signal that comes with it ends the program.
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

    /// The next one. Waits for ever once the terminal is gone.
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
