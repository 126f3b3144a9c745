//! Progress of a running scan: a bar on a terminal, or one line of JSON per event.

use std::io::Write;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::output::{json_line, say};
use super::watch::Watching;
use fieldgap_acquisition::Event;

/// A bar on standard error that counts things.
pub(super) fn counting_bar(count: usize, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(count as u64);
    let style =
        ProgressStyle::with_template("{elapsed_precise} [{bar:30}] {pos}/{len} {msg}, {eta} left")
            .expect("the template is well formed");
    bar.set_style(style.progress_chars("=> "));
    bar.set_message(what);
    bar
}

/// A progress display.
pub(super) enum Progress {
    /// A bar with the remaining time and the current point, on standard error.
    Bar(Bar),
    /// One JSON object per line, on standard output.
    Json(JsonLines),
    /// The full-screen view.
    Screen(Watching),
}

/// A bar on standard error, drawn by a thread of its own, so that a terminal that takes no more text cannot stall the scan.
pub(super) struct Bar {
    tell: Option<Sender<Event>>,
    /// Closed by the thread when it ends.
    over: Receiver<()>,
}

/// Time limit for the last text of the bar. If the terminal is blocked, its thread never ends.
const DRAWN_WITHIN: Duration = Duration::from_secs(1);

impl Bar {
    fn new(rows: usize, done: usize) -> Self {
        let (tell, told) = channel::<Event>();
        let (lives, over) = channel();
        std::thread::spawn(move || {
            let _lives: Sender<()> = lives;
            let bar = drawn_bar(rows, done);
            for event in told {
                show_on_bar(&bar, &event);
            }
        });
        Self { tell: Some(tell), over }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        drop(self.tell.take());
        let _ = self.over.recv_timeout(DRAWN_WITHIN);
    }
}

fn drawn_bar(rows: usize, done: usize) -> ProgressBar {
    let bar = ProgressBar::new(rows as u64).with_position(done as u64);
    let style = ProgressStyle::with_template(
        "{elapsed_precise} [{bar:30}] {pos}/{len} points, {eta} left  {msg}",
    )
    .expect("the template is well formed");
    bar.set_style(style.progress_chars("=> "));
    bar.reset_eta();
    bar
}

/// Lines on standard output, written by a thread of their own, so that a stalled reader cannot stall the scan.
pub(super) struct JsonLines {
    lines: Option<Sender<String>>,
    writer: Option<JoinHandle<()>>,
}

impl JsonLines {
    fn new() -> Self {
        let (lines, written) = channel::<String>();
        let writer = std::thread::spawn(move || {
            let mut out = std::io::stdout();
            for line in written {
                // If the reader has gone, the scan continues.
                if out.write_all(line.as_bytes()).and_then(|()| out.flush()).is_err() {
                    return;
                }
            }
        });
        Self { lines: Some(lines), writer: Some(writer) }
    }
}

impl Drop for JsonLines {
    fn drop(&mut self) {
        drop(self.lines.take());
        if let Some(writer) = self.writer.take() {
            let _ = writer.join();
        }
    }
}

impl Progress {
    /// Lines of JSON.
    pub(super) fn json() -> Self {
        Self::Json(JsonLines::new())
    }

    /// A bar with `done` of `rows` points completed.
    pub(super) fn bar(rows: usize, done: usize) -> Self {
        Self::Bar(Bar::new(rows, done))
    }

    /// Shows an event.
    pub(super) fn show(&mut self, event: &Event) {
        match self {
            Self::Bar(bar) => {
                if let Some(tell) = &bar.tell {
                    let _ = tell.send(event.clone());
                }
            }
            Self::Screen(watching) => {
                watching.tell(event);
                if let Event::Ended { rows, of, reason } = event {
                    watching.close();
                    say_end(*rows, *of, reason.as_deref());
                }
            }
            Self::Json(json) => {
                let line = json_line(event).expect("an event is plain data");
                if let Some(lines) = &json.lines {
                    let _ = lines.send(line);
                }
            }
        }
    }
}

fn show_on_bar(bar: &ProgressBar, event: &Event) {
    match event {
        Event::Opened { robot, receiver, array } => {
            let devices = format!("robot:    {robot}\nreceiver: {receiver}\narray:    {array}");
            bar.suspend(|| say(&devices));
            bar.set_message("homing");
        }
        Event::Homed => bar.set_message("homed"),
        Event::ReferenceChecked { row, kept, now, moved_mm } => {
            let again = format!(
                "row {row} measured again: {now:.5}, before {kept:.5} ({:+.2} %), {moved_mm:.3} mm apart",
                (now / kept - 1.0) * 100.0
            );
            bar.suspend(|| say(&again));
        }
        Event::LagFound { lag_ms, standard_error_ms } => {
            bar.suspend(|| {
                say(format!(
                    "lag of the readings behind the robot: {lag_ms:.2} ± {standard_error_ms:.2} ms"
                ))
            });
        }
        Event::RoundChosen { text } => bar.suspend(|| say(text)),
        Event::ReferenceRevisited { first, now, .. } => {
            let drift = (now / first - 1.0) * 100.0;
            bar.suspend(|| {
                say(format!("reference point: {now:.5}, {drift:+.2} % since the first"))
            });
        }
        Event::ImpairedReading { text, .. } => bar.suspend(|| say(text)),
        Event::Paused => bar.set_message("paused, the array is silent"),
        Event::Continued { waited_s } => {
            bar.suspend(|| say(format!("continued after {waited_s:.0} s")));
        }
        Event::Question { text } => bar.suspend(|| say(format!("ATTENTION: {text}"))),
        Event::HookFailed { text } => bar.suspend(|| say(text)),
        Event::Measured { row, of, focus, at_mm: [x, y, z], reading, clipped, .. } => {
            bar.set_length(*of as u64);
            bar.set_position(*row as u64 + 1);
            let what = if *focus < 0 { "silent".to_owned() } else { format!("focus {focus}") };
            let clip = if *clipped { ", clipped" } else { "" };
            bar.set_message(format!("{what} at ({x:.1}, {y:.1}, {z:.1}) mm: {reading:.4}{clip}"));
        }
        Event::DiskFull { reason } => {
            bar.suspend(|| say(format!("waiting, the array is silent: {reason}")));
            bar.set_message("waiting for disk space");
        }
        Event::WatchdogLost { reason } => {
            bar.suspend(|| say(format!("waiting, the array is silent: the watchdog {reason}")));
        }
        Event::WatchdogRestarted { waited_s } => {
            bar.suspend(|| say(format!("the watchdog was started again after {waited_s:.1} s")));
        }
        Event::Suspended { suspended_s } => {
            bar.suspend(|| {
                say(format!(
                    "ATTENTION: the computer was suspended for {suspended_s:.0} s; the robot reports the same place, and the \
                     point is measured again"
                ))
            });
        }
        Event::DiskSpaceFreed { waited_s } => {
            bar.suspend(|| say(format!("continued after {waited_s:.0} s")));
        }
        Event::Ended { rows, of, reason } => {
            bar.finish_and_clear();
            say_end(*rows, *of, reason.as_deref());
        }
    }
}

fn say_end(rows: usize, of: usize, reason: Option<&str>) {
    match reason {
        None => say(format!("complete: {rows} points")),
        Some(reason) => say(format!("ended with {rows} of {of} points: {reason}")),
    }
}
