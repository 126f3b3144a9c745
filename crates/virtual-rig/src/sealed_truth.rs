//! Encrypted truth files.
//!
//! `NAME.sealed` is a truth file encrypted under the key in `NAME.key`. The key lies beside it, because the virtual rig has to
//! open it. This hides the truth from a reader and from the diagnosis, which gets the recorded scan alone. It does not protect it
//! from somebody who uses the key. (The key to the answers of a blind set can be kept elsewhere.)

use std::path::{Path, PathBuf};

use crate::cipher::{Key, NoRandomness};
use fieldgap_input::{Fault, MOST_TEXT, read_bytes};

/// What the name of a sealed file ends in.
const SEALED: &str = "sealed";

/// Authenticated with the content, so that nothing else opens as a truth file.
const BOUND: &[u8] = b"fieldgap truth 1";

/// Whether a truth file of this name is sealed: it ends in `.sealed`.
pub fn is_sealed(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == SEALED)
}

/// The path of the key to a sealed truth file.
pub fn key_path(sealed: &Path) -> PathBuf {
    sealed.with_extension("key")
}

/// The bytes of a sealed file.
///
/// # Errors
/// [`NoRandomness`] if the system gives no random numbers.
pub fn sealed_bytes(key: &Key, text: &str) -> Result<Vec<u8>, NoRandomness> {
    key.seal(text.as_bytes(), BOUND)
}

/// The text sealed in a file.
pub(super) fn open(path: &Path) -> Result<String, Fault> {
    let read = |path: &Path, remedy: &str| {
        read_bytes(path, MOST_TEXT)
            .map_err(|error| Fault::of_file(path, format!("cannot be read: {error}"), remedy))
    };
    let sealed = read(path, "check the `truth` of the rig file; it is looked for from there")?;
    let key_path = key_path(path);
    let remedy =
        format!("the key to {} lies beside it; take both from their source", path.display());
    let key = Key::parse(&read(&key_path, &remedy)?).ok_or_else(|| {
        let problem = "holds no key: 64 hexadecimal digits are expected";
        Fault::of_file(&key_path, problem, remedy.as_str())
    })?;
    key.open(&sealed, BOUND).and_then(|plain| String::from_utf8(plain).ok()).ok_or_else(|| {
        let problem = format!(
            "does not open: the key in {} is not its key, or its bytes were changed",
            key_path.display()
        );
        Fault::of_file(path, problem, "take both files from their source, or seal the truth again")
    })
}
