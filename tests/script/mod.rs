//! Scripts that stand for other programs.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// Writes a script that can be run.
///
/// Another process writes it. What this process opens for writing, a child that another test starts meanwhile inherits, and as long as a file is open
/// for writing it cannot be run ("Text file busy").
pub fn write_script(path: &Path, text: &str) {
    let mut shell = Command::new("/bin/sh")
        .args(["-c", "cat >\"$0\" && chmod 755 \"$0\""])
        .arg(path)
        .stdin(Stdio::piped())
        .spawn()
        .expect("a shell");
    shell.stdin.take().expect("it is piped").write_all(text.as_bytes()).expect("it is read");
    assert!(shell.wait().expect("it ends").success(), "{}", path.display());
}
