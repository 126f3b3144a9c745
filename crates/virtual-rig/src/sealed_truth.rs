//! A truth file that nobody reads by accident.
//!
//! `NAME.sealed` is a truth file encrypted under the key in `NAME.key`, which lies beside it, because the virtual rig has to
//! open it to play the laboratory. It is thus sealed against eyes, and against the diagnosis, which gets the recorded scan and
//! nothing else; it is not sealed against somebody who takes the key to cheat. (The answers of a set of the `blind` crate are: their
//! key can be kept elsewhere.)

use std::path::{Path, PathBuf};

use crate::cipher::{Key, NoChance};
use fieldgap_input::Fault;

/// What the name of a sealed file ends in.
const SEALED: &str = "sealed";

/// Stands readable for what is sealed, so that nothing else opens as a truth file.
const BOUND: &[u8] = b"fieldgap truth 1";

/// Whether a truth file of this name is sealed: it ends in `.sealed`.
pub fn is_sealed(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == SEALED)
}

/// Where the key to a sealed truth file lies.
pub fn key_path(sealed: &Path) -> PathBuf {
    sealed.with_extension("key")
}

/// What stands in a sealed file.
pub fn sealed_bytes(key: &Key, text: &str) -> Result<Vec<u8>, NoChance> {
    key.seal(text.as_bytes(), BOUND)
}

/// The text that is sealed in a file.
pub(super) fn open(path: &Path) -> Result<String, Fault> {
    let read = |path: &Path, remedy: &str| {
        std::fs::read(path)
            .map_err(|error| Fault::of_file(path, format!("cannot be read: {error}"), remedy))
    };
    let sealed = read(path, "check the `truth` of the rig file; it is looked for from there")?;
    let key_path = key_path(path);
    let remedy = format!(
        "the key to {} lies beside it; take both from where they were made",
        path.display()
    );
    let key = Key::parse(&read(&key_path, &remedy)?).ok_or_else(|| {
        let problem = "holds no key: 64 hexadecimal digits are expected";
        Fault::of_file(&key_path, problem, remedy.as_str())
    })?;
    key.open(&sealed, BOUND).and_then(|plain| String::from_utf8(plain).ok()).ok_or_else(|| {
        let problem = format!(
            "does not open: the key in {} is not its own, or its bytes were changed",
            key_path.display()
        );
        Fault::of_file(path, problem, "take both files from where they were made, or seal anew")
    })
}
