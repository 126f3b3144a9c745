//! The terminal, taken over and given back.

use std::io::{self, IsTerminal};

use ratatui::DefaultTerminal;
use ratatui::Frame;
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{Clear, ClearType};

/// The whole terminal, until it is dropped. A panic gives it back before it says what it has to say.
pub struct Screen {
    terminal: DefaultTerminal,
}

impl Screen {
    /// Whether there is a terminal to take over.
    pub fn is_possible() -> bool {
        io::stdin().is_terminal() && io::stdout().is_terminal()
    }

    /// Takes the terminal over: its other contents come back at the end, and keys arrive one by one.
    ///
    /// # Errors
    /// That the terminal refuses it.
    pub fn open() -> io::Result<Self> {
        let screen = Self { terminal: ratatui::try_init()? };
        // Some terminals show the same screen again. (Clearing through the backend would wait for an answer of the terminal.)
        execute!(io::stdout(), Clear(ClearType::All))?;
        Ok(screen)
    }

    /// Draws a picture of the whole screen.
    ///
    /// # Errors
    /// That the terminal cannot be written: it was closed.
    pub fn draw(&mut self, picture: impl FnOnce(&mut Frame<'_>)) -> io::Result<()> {
        self.terminal.draw(picture).map(drop)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A terminal that was closed cannot be given back, which is nobody's loss.
        let _ = ratatui::try_restore();
    }
}
