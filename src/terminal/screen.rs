//! Switching the terminal to full screen and back.

use std::io::{self, IsTerminal};

use ratatui::DefaultTerminal;
use ratatui::Frame;
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{Clear, ClearType};

/// The terminal in full-screen mode, until this is dropped. A panic restores it before it prints its message.
pub struct Screen {
    terminal: DefaultTerminal,
}

impl Screen {
    /// Whether there is a terminal.
    pub fn is_possible() -> bool {
        io::stdin().is_terminal() && io::stdout().is_terminal()
    }

    /// Switches to full screen. Keys arrive one by one, and the previous contents return at the end.
    ///
    /// # Errors
    /// The terminal cannot be switched to full screen.
    pub fn open() -> io::Result<Self> {
        let screen = Self { terminal: ratatui::try_init()? };
        // Some terminals show the same screen again. (Clearing through the backend would wait for an answer of the terminal.)
        execute!(io::stdout(), Clear(ClearType::All))?;
        Ok(screen)
    }

    /// Draws the whole screen.
    ///
    /// # Errors
    /// The terminal was closed.
    pub fn draw(&mut self, picture: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        self.terminal.draw(picture).map(drop)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A closed terminal cannot be restored.
        let _ = ratatui::try_restore();
    }
}
