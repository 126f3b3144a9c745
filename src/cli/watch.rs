//! The full-screen view of a running scan. A thread of its own draws it, so that a stalled terminal cannot stall the scan.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use ratatui::crossterm::event::{self, Event as Input, KeyEventKind};
use tokio::sync::mpsc::UnboundedSender;

use super::stop::STOPPED_AT_ONCE;
use crate::terminal::Screen;
use crate::terminal::watch::{Palette, Request, ScanView, Stage, draw};
use fieldgap_acquisition::{Event, PauseSwitch};
use fieldgap_closed_loop::read_rounds;

/// Time between two frames.
const EVERY: Duration = Duration::from_millis(100);

/// Time limit for closing the view. If the terminal was closed, its thread never ends.
const CLOSED_WITHIN: Duration = Duration::from_secs(1);

/// What a person at the view can do to the scan.
pub(super) struct Controls {
    /// Pauses it and lets it continue.
    pub(super) pause: PauseSwitch,
    /// Ends it.
    pub(super) abort: UnboundedSender<&'static str>,
}

/// The view; it ends when it is closed or dropped.
pub(super) struct Watching {
    tell: Option<Sender<Event>>,
    thread: Option<JoinHandle<()>>,
    /// Closed by the thread when it ends.
    over: Receiver<()>,
}

impl Watching {
    /// Opens the view of a scan whose record is in `folder`.
    ///
    /// # Errors
    /// The terminal cannot be switched to full screen.
    pub(super) fn begin(
        view: ScanView,
        controls: Controls,
        folder: PathBuf,
    ) -> std::io::Result<Self> {
        let screen = Screen::open()?;
        let (tell, told) = channel();
        let (lives, over) = channel();
        let thread = std::thread::Builder::new().name("view".to_owned()).spawn(move || {
            let _lives: Sender<()> = lives;
            show(view, screen, &controls, &told, &folder);
        })?;
        Ok(Self { tell: Some(tell), thread: Some(thread), over })
    }

    /// Passes it an event.
    pub(super) fn tell(&self, event: &Event) {
        if let Some(tell) = &self.tell {
            // A view that has ended, with its terminal, must not affect the scan.
            let _ = tell.send(event.clone());
        }
    }

    /// Closes the view and restores the terminal.
    pub(super) fn close(&mut self) {
        drop(self.tell.take());
        let ended = self.over.recv_timeout(CLOSED_WITHIN) == Err(RecvTimeoutError::Disconnected);
        if let Some(thread) = self.thread.take()
            && ended
        {
            let _ = thread.join();
        }
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        self.close();
    }
}

fn show(
    mut view: ScanView,
    mut screen: Screen,
    controls: &Controls,
    told: &Receiver<Event>,
    folder: &Path,
) {
    let begun = Instant::now();
    take_rounds(&mut view, folder);
    let palette = Palette::of_environment(|name| std::env::var(name).ok());
    let mut waits = false;
    loop {
        let next = Instant::now() + EVERY;
        if !take_events(&mut view, told, begun, next, folder) {
            return;
        }
        while let Ok(true) = event::poll(Duration::ZERO) {
            let request = match event::read() {
                Ok(Input::Key(key)) if key.kind != KeyEventKind::Release => view.key(key),
                Ok(_) => None,
                Err(_) => return,
            };
            match request {
                Some(Request::Pause) => waits = true,
                Some(Request::Continue) => waits = false,
                Some(Request::Abort) => {
                    let _ = controls.abort.send("aborted from the keyboard");
                }
                Some(Request::Quit) => {
                    drop(screen);
                    std::process::exit(STOPPED_AT_ONCE);
                }
                None => {}
            }
            controls.pause.set(waits);
        }
        if screen.draw(|frame| draw(&view, begun.elapsed(), palette, frame)).is_err() {
            return;
        }
    }
}

/// The decisions of a closed loop, which are logged before they are told. Without the log the view goes on.
fn take_rounds(view: &mut ScanView, folder: &Path) {
    if let Ok(rounds) = read_rounds(folder) {
        view.decided(rounds);
    }
}

/// Handles events until an instant; false when there will be no more.
fn take_events(
    view: &mut ScanView,
    told: &Receiver<Event>,
    begun: Instant,
    until: Instant,
    folder: &Path,
) -> bool {
    loop {
        match told.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(event) => {
                view.take(&event, begun.elapsed());
                if matches!(event, Event::RoundChosen { .. }) {
                    take_rounds(view, folder);
                }
                if matches!(view.stage(), Stage::Ended(_)) {
                    return false;
                }
            }
            Err(RecvTimeoutError::Timeout) => return true,
            Err(RecvTimeoutError::Disconnected) => return false,
        }
        if Instant::now() >= until {
            return true;
        }
    }
}
