//! Where results go.

use std::path::{Path, PathBuf};

/// The folder for a new record where none is named: `out/NAME`, or the first of `out/NAME-2`, `out/NAME-3`, ... that
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
    use miette::IntoDiagnostic;
    println!("{}", serde_json::to_string_pretty(value).into_diagnostic()?);
    Ok(())
}
