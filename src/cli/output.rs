//! Output of results.

use std::io::Write;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, WrapErr};

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
    print(&(serde_json::to_string_pretty(value).into_diagnostic()? + "\n"))
}

/// Writes a text to standard output. It is no error if the reader has gone.
pub(super) fn print(text: &str) -> miette::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).into_diagnostic().wrap_err("standard output cannot be written")
        }
        _ => Ok(()),
    }
}
