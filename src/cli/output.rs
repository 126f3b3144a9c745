//! Output of results and messages. Control characters of texts from files and devices are made visible, so that a terminal obeys none
//! of them; a reader that has gone is no error. All output of the commands goes through here.

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, WrapErr};

use super::error_message::error_message;
use fieldgap_input::{visible, visible_json};

/// The default folder for a new record: `out/NAME`, or the first of `out/NAME-2`, `out/NAME-3`, ... that
/// does not exist yet.
pub(super) fn fresh_folder(name: &str) -> PathBuf {
    let named = |number: usize| match number {
        1 => Path::new("out").join(name),
        more => Path::new("out").join(format!("{name}-{more}")),
    };
    (1..).map(named).find(|folder| !folder.exists()).expect("there are more numbers than folders")
}

/// Writes a value as indented JSON to standard output.
pub(super) fn print_json(value: &impl serde::Serialize) -> miette::Result<()> {
    let json = serde_json::to_string_pretty(value).into_diagnostic()? + "\n";
    write_out(&visible_json(&json))
}

/// A value as one line of JSON.
pub(super) fn json_line(value: &impl serde::Serialize) -> serde_json::Result<String> {
    Ok(visible_json(&serde_json::to_string(value)?).into_owned() + "\n")
}

/// Writes a text to standard output. It is no error if the reader has gone.
pub(super) fn print(text: &str) -> miette::Result<()> {
    write_out(&visible(text))
}

thread_local! {
    /// Whether messages of this thread are left out.
    static SILENT: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// Does `work` and leaves its messages out: those of a single scan, where there are a thousand.
pub(super) fn silently<T>(work: impl FnOnce() -> T) -> T {
    let before = SILENT.replace(true);
    let done = work();
    SILENT.set(before);
    done
}

/// Writes a line to standard error. A closed terminal must not end a scan in a panic, so errors are ignored.
pub(super) fn say(line: impl Display) {
    if SILENT.get() {
        return;
    }
    ask(format!("{line}\n"));
}

/// Writes a text without a line end to standard error.
pub(super) fn ask(text: impl Display) {
    let text = text.to_string();
    let mut error = std::io::stderr().lock();
    let _ = error.write_all(visible(&text).as_bytes()).and_then(|()| error.flush());
}

/// Writes an error to standard error, with its causes, its place and its remedy.
pub(super) fn report_error(report: &miette::Report) {
    // Its texts are visible already; what a terminal obeys in it are its colours.
    let message = error_message(report) + "\n";
    let _ = std::io::stderr().lock().write_all(message.as_bytes());
}

/// Standard error for the log: what the devices say is in it.
#[derive(Debug, Default)]
pub(super) struct VisibleLog;

impl Write for VisibleLog {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        ask(String::from_utf8_lossy(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn write_out(text: &str) -> miette::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).into_diagnostic().wrap_err("standard output cannot be written")
        }
        _ => Ok(()),
    }
}
