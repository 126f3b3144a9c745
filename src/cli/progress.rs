//! A scan that is running, shown to whoever waits: a bar on a terminal, a line an event as JSON.

use std::io::Write;

use indicatif::{ProgressBar, ProgressStyle};

use crate::campaign::Event;

/// How a running scan is shown.
pub(super) enum Progress {
    /// A bar with the time left and what is being measured; on standard error.
    Bar(ProgressBar),
    /// One JSON object a line, on standard output, each written out before the scan goes on.
    Json,
}

impl Progress {
    pub(super) fn new(rows: usize, done: usize, json: bool) -> Self {
        if json {
            return Self::Json;
        }
        let bar = ProgressBar::new(rows as u64).with_position(done as u64);
        let style = ProgressStyle::with_template(
            "{elapsed_precise} [{bar:30}] {pos}/{len} points, {eta} left  {msg}",
        )
        .expect("the template is well formed");
        bar.set_style(style.progress_chars("=> "));
        bar.reset_eta();
        Self::Bar(bar)
    }

    /// Shows an event.
    pub(super) fn show(&mut self, event: &Event) {
        match self {
            Self::Bar(bar) => show_on_bar(bar, event),
            Self::Json => {
                let mut out = std::io::stdout().lock();
                // Whoever reads along may have gone away; the scan goes on without them.
                let _ = serde_json::to_writer(&mut out, event)
                    .map_err(std::io::Error::from)
                    .and_then(|()| out.write_all(b"\n"))
                    .and_then(|()| out.flush());
            }
        }
    }
}

fn show_on_bar(bar: &ProgressBar, event: &Event) {
    match event {
        Event::Opened { robot, receiver, array } => {
            bar.suspend(|| eprintln!("robot:    {robot}\nreceiver: {receiver}\narray:    {array}"));
            bar.set_message("homing");
        }
        Event::Homed => bar.set_message("homed"),
        Event::ReferenceChecked { row, kept, now, moved_mm } => {
            bar.suspend(|| {
                eprintln!(
                    "row {row} measured again: {now:.5} where {kept:.5} was kept ({:+.2} %), {moved_mm:.3} mm apart",
                    (now / kept - 1.0) * 100.0
                )
            });
        }
        Event::Measured { row, focus, at_mm: [x, y, z], reading, clipped, .. } => {
            bar.set_position(*row as u64 + 1);
            let what = if *focus < 0 { "silent".to_owned() } else { format!("focus {focus}") };
            let clip = if *clipped { ", clipped" } else { "" };
            bar.set_message(format!("{what} at ({x:.1}, {y:.1}, {z:.1}) mm: {reading:.4}{clip}"));
        }
        Event::Ended { rows, of, reason } => {
            bar.finish_and_clear();
            match reason {
                None => eprintln!("complete: {rows} points"),
                Some(reason) => eprintln!("ended with {rows} of {of} points: {reason}"),
            }
        }
    }
}
