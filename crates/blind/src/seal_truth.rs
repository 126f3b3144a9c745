//! Seals the truth file of a virtual rig, so that its cause is withheld.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::error::BlindError;
use fieldgap_input::TomlSource;
use fieldgap_virtual_rig::Truth;
use fieldgap_virtual_rig::cipher::Key;
use fieldgap_virtual_rig::sealed_truth::{is_sealed, key_path, sealed_bytes};

/// Seals the truth file `plain` as `out`, whose name ends in `.sealed`, and returns the path of its new key, beside it.
/// [`sealed_truth`](fieldgap_virtual_rig::sealed_truth) states what this protects against.
///
/// # Errors
/// [`BlindError`] if the truth file has a fault, which is shown at its line; if one of the two files exists already; or if they
/// cannot be written.
pub fn seal_truth(plain: &Path, out: &Path) -> Result<PathBuf, BlindError> {
    if !is_sealed(out) {
        return Err(BlindError::NotASealedName(out.to_owned()));
    }
    let source = TomlSource::read(plain)?;
    Truth::from_source(&source)?;
    seal_text(source.text(), out)
}

/// Seals the text of a valid truth file as `out`, and returns the path of its new key.
///
/// # Errors
/// [`BlindError`] if one of the two files exists already, or they cannot be written.
pub(super) fn seal_text(text: &str, out: &Path) -> Result<PathBuf, BlindError> {
    let key_path = key_path(out);
    if out.exists() {
        return Err(BlindError::SealedExists(out.to_owned()));
    }
    let key = Key::draw()?;
    let sealed = sealed_bytes(&key, text)?;
    write_new(&key_path, key.text().as_bytes(), BlindError::KeyExists)?;
    write_new(out, &sealed, BlindError::SealedExists)?;
    Ok(key_path)
}

fn write_new(
    path: &Path,
    bytes: &[u8],
    exists: impl FnOnce(PathBuf) -> BlindError,
) -> Result<(), BlindError> {
    let written = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(path)
        .and_then(|mut file| file.write_all(bytes));
    written.map_err(|source| match source.kind() {
        ErrorKind::AlreadyExists => exists(path.to_owned()),
        _ => BlindError::Write { path: path.to_owned(), source },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRUTH: &str = "[noise]\nmultiplicative = 0.02\n[effects.dead-elements]\nelements = [3]\n";

    struct Bench(tempfile::TempDir);

    impl Bench {
        fn new(truth: &str) -> Self {
            let bench = Self(tempfile::tempdir().expect("a folder"));
            std::fs::write(bench.path("plain.toml"), truth).expect("written");
            bench
        }

        fn sealed() -> Self {
            let bench = Self::new(TRUTH);
            let key = seal_truth(&bench.path("plain.toml"), &bench.path("a.sealed"));
            assert_eq!(key.expect("sealed"), bench.path("a.key"));
            std::fs::remove_file(bench.path("plain.toml")).expect("there");
            bench
        }

        fn path(&self, name: &str) -> PathBuf {
            self.0.path().join(name)
        }

        /// The message on reading the sealed file.
        fn refusal(&self) -> String {
            Truth::read(&self.path("a.sealed")).expect_err("not as it was sealed").to_string()
        }
    }

    #[test]
    fn a_sealed_truth_is_read_unchanged_and_is_not_plain_text() {
        let bench = Bench::sealed();
        let truth = Truth::read(&bench.path("a.sealed")).expect("its key lies beside it");
        assert_eq!(truth.noise.multiplicative.get(), 0.02);
        assert_eq!(truth.effects.iter().map(|(id, _)| *id).collect::<Vec<_>>(), ["dead-elements"]);
        let bytes = std::fs::read(bench.path("a.sealed")).expect("there");
        assert!(!bytes.windows(4).any(|four| four == b"dead" || four == b"nois"));
        // Nor does the message reveal it where it does not fit.
        let fault = truth.check(2).expect_err("there is no element 3").to_string();
        assert!(fault.contains("a.sealed") && !fault.contains("dead"), "{fault}");
    }

    #[test]
    fn a_wrong_key_a_flipped_bit_and_a_lost_key_are_errors_that_name_the_file() {
        let other = Bench::sealed();
        let bench = Bench::sealed();
        let sealed = std::fs::read(bench.path("a.sealed")).expect("there");
        for at in [0, 23, 24, sealed.len() / 2, sealed.len() - 1] {
            let mut changed = sealed.clone();
            changed[at] ^= 1;
            std::fs::write(bench.path("a.sealed"), changed).expect("written");
            let message = bench.refusal();
            assert!(message.contains("a.sealed: does not open"), "{message}");
        }
        for short in [0, 10, 24, sealed.len() - 1] {
            std::fs::write(bench.path("a.sealed"), &sealed[..short]).expect("written");
            assert!(bench.refusal().contains("a.sealed: does not open"));
        }
        std::fs::write(bench.path("a.sealed"), sealed).expect("written");
        std::fs::copy(other.path("a.key"), bench.path("a.key")).expect("copied");
        let message = bench.refusal();
        assert!(
            message.contains("a.sealed: does not open") && message.contains("a.key"),
            "{message}"
        );
        std::fs::write(bench.path("a.key"), "no key").expect("written");
        let message = bench.refusal();
        assert!(message.contains("a.key: holds no key"), "{message}");
        std::fs::remove_file(bench.path("a.key")).expect("there");
        let message = bench.refusal();
        assert!(message.contains("a.key: cannot be read"), "{message}");
    }

    #[test]
    fn nothing_is_written_over_and_no_fault_is_sealed_away() {
        let bench = Bench::new(TRUTH);
        let seal = |out: &str| seal_truth(&bench.path("plain.toml"), &bench.path(out));
        seal("a.sealed").expect("sealed");
        let kept = std::fs::read(bench.path("a.sealed")).expect("there");
        assert!(matches!(seal("a.sealed"), Err(BlindError::SealedExists(_))));
        std::fs::remove_file(bench.path("a.sealed")).expect("there");
        assert!(matches!(seal("a.sealed"), Err(BlindError::KeyExists(_))));
        std::fs::write(bench.path("a.sealed"), kept).expect("written");
        assert!(Truth::read(&bench.path("a.sealed")).is_ok());
        assert!(matches!(seal("b.toml"), Err(BlindError::NotASealedName(_))));
        let faulty = Bench::new("[effects.sound-sped]\nc_m_s = 347.1\n");
        let error = seal_truth(&faulty.path("plain.toml"), &faulty.path("a.sealed"));
        let message = error.expect_err("no such effect").to_string();
        assert!(message.contains("plain.toml:1:"), "{message}");
        assert!(!faulty.path("a.sealed").exists() && !faulty.path("a.key").exists());
    }
}
