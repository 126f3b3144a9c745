//! The sealed answers of a set: unreadable without the key. Any change of answers or scans is detected.
//!
//! | file | what it holds |
//! |---|---|
//! | `scans.sha256` | the digest of every file of every scan, as `sha256sum -c` reads it |
//! | `answers.sealed` | the answers, encrypted (XChaCha20-Poly1305) together with that list |
//! | `answers.key` | the key, unless it was written elsewhere |
//! | `commitment` | the digest of all three; it is also printed, to be noted before any diagnosis |
//!
//! The commitment includes the key's digest, because a ciphertext alone does not determine its plaintext: with a second key it
//! could be made to open to other answers.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::answer::Answers;
use super::error::BlindError;
use fieldgap_input::{MOST_TABLE, read_bytes};
use fieldgap_virtual_rig::cipher::{Key, NoRandomness, fresh_number, hex};

const LIST: &str = "scans.sha256";
const SEALED: &str = "answers.sealed";
const KEY: &str = "answers.key";
const COMMITMENT: &str = "commitment";

const NOT_A_SET: &str = "name a folder that `fieldgap blind make` made";

/// A random seed from the system.
///
/// # Errors
/// [`BlindError::NoKey`] if the system gives no random numbers.
pub fn fresh_seed() -> Result<u64, BlindError> {
    Ok(fresh_number()?)
}

impl From<NoRandomness> for BlindError {
    fn from(none: NoRandomness) -> Self {
        Self::NoKey(none.to_string())
    }
}

/// The seal of a set: its folder and its key file.
#[derive(Debug, Clone)]
pub struct Seal {
    set: PathBuf,
    key: PathBuf,
}

impl Seal {
    /// The seal of a set. By default the key is in the set's folder.
    pub fn of(set: &Path, key: Option<&Path>) -> Self {
        let key = key.map_or_else(|| set.join(KEY), Path::to_owned);
        Self { set: set.to_owned(), key }
    }

    /// Checks that neither a set nor a key exists yet.
    ///
    /// # Errors
    /// [`BlindError::Occupied`], [`BlindError::KeyExists`].
    pub fn is_free(&self) -> Result<(), BlindError> {
        if std::fs::read_dir(&self.set).is_ok_and(|mut entries| entries.next().is_some()) {
            return Err(BlindError::Occupied(self.set.clone()));
        }
        self.has_no_key()
    }

    /// Checks that the scans of the folder are not sealed yet.
    ///
    /// # Errors
    /// [`BlindError::AlreadySealed`], [`BlindError::KeyExists`].
    pub fn is_open(&self) -> Result<(), BlindError> {
        let sealed = self.set.join(SEALED);
        if sealed.exists() {
            return Err(BlindError::AlreadySealed(sealed));
        }
        self.has_no_key()
    }

    fn has_no_key(&self) -> Result<(), BlindError> {
        match self.key.exists() {
            true => Err(BlindError::KeyExists(self.key.clone())),
            false => Ok(()),
        }
    }

    /// Seals the answers to the scans in the set's folder under a new key, and returns the commitment.
    ///
    /// # Errors
    /// [`BlindError`] if a scan cannot be read or the seal cannot be written.
    pub fn close(&self, answers: &Answers) -> Result<String, BlindError> {
        let names: Vec<&str> = answers.answers.iter().map(|answer| answer.name.as_str()).collect();
        let list = list(&self.set, &names)?;
        let key = Key::draw()?;
        let plain = serde_json::to_vec(answers).expect("answers are plain data");
        let sealed = key.seal(&plain, list.as_bytes())?;
        let commitment = commitment(&list, &sealed, &key);
        self.write(&self.set.join(LIST), list.as_bytes())?;
        self.write(&self.set.join(SEALED), &sealed)?;
        self.write(&self.key, key.text().as_bytes())?;
        self.write(&self.set.join(COMMITMENT), (commitment.clone() + "\n").as_bytes())?;
        Ok(commitment)
    }

    /// Opens the answers if scans, answers and key match the commitment: the given one, or else the one in the set's folder.
    ///
    /// # Errors
    /// [`BlindError`] that says what was changed.
    pub fn open(&self, commitment_noted: Option<&str>) -> Result<Answers, BlindError> {
        let list = String::from_utf8_lossy(&self.read(&self.set.join(LIST))?).into_owned();
        for line in list.lines() {
            let (digest, file) = line.split_once("  ").unwrap_or((line, ""));
            let path = self.set.join(file);
            let same =
                read_bytes(&path, MOST_TABLE).is_ok_and(|bytes| sha256_hex(&bytes) == digest);
            if !same {
                return Err(BlindError::ScanChanged(path));
            }
        }
        let sealed_path = self.set.join(SEALED);
        let sealed = self.read(&sealed_path)?;
        let key = self.key()?;
        let expected = match commitment_noted {
            Some(commitment) => commitment.trim().to_lowercase(),
            None => {
                String::from_utf8_lossy(&self.read(&self.set.join(COMMITMENT))?).trim().to_owned()
            }
        };
        let found = commitment(&list, &sealed, &key);
        if found != expected {
            return Err(BlindError::NotCommitted { expected, found });
        }
        let plain = key
            .open(&sealed, list.as_bytes())
            .ok_or_else(|| BlindError::DoesNotOpen(sealed_path.clone()))?;
        serde_json::from_slice(&plain).map_err(|source| BlindError::Json {
            path: sealed_path,
            source,
            help: "the set was made by another version of this program; open it with that one",
        })
    }

    fn key(&self) -> Result<Key, BlindError> {
        let bytes = self.read(&self.key)?;
        Key::parse(&bytes).ok_or_else(|| BlindError::BadKey(self.key.clone()))
    }

    fn read(&self, path: &Path) -> Result<Vec<u8>, BlindError> {
        read_bytes(path, MOST_TABLE).map_err(BlindError::reading(path, NOT_A_SET))
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), BlindError> {
        std::fs::write(path, bytes).map_err(BlindError::writing(path))
    }
}

/// The digest of every file of the scans, with its name.
fn list(set: &Path, names: &[&str]) -> Result<String, BlindError> {
    let mut lines = String::new();
    for name in names {
        let folder = set.join(name);
        let failed = |error| BlindError::reading(&folder, NOT_A_SET)(error);
        let entries = std::fs::read_dir(&folder).map_err(failed)?;
        let files: BTreeSet<_> = entries
            .map(|entry| entry.map(|entry| entry.file_name().to_string_lossy().into_owned()))
            .collect::<Result<_, _>>()
            .map_err(failed)?;
        for file in files {
            let path = folder.join(&file);
            let bytes =
                read_bytes(&path, MOST_TABLE).map_err(BlindError::reading(&path, NOT_A_SET))?;
            lines += &format!("{}  {name}/{file}\n", sha256_hex(&bytes));
        }
    }
    Ok(lines)
}

fn commitment(list: &str, sealed: &[u8], key: &Key) -> String {
    let mut digest = Sha256::new();
    for part in [list.as_bytes(), sealed, key.bytes()] {
        digest.update(Sha256::digest(part));
    }
    hex(&digest.finalize())
}

fn sha256_hex(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sealed_set(folder: &Path) -> (Seal, Answers, String) {
        let scan = folder.join("0000");
        std::fs::create_dir(&scan).expect("a fresh folder");
        std::fs::write(scan.join("scan.toml"), "format = 1\n").expect("written");
        std::fs::write(scan.join("samples.csv"), "time_s\n0.0\n").expect("written");
        let answer = super::super::answer::Answer {
            name: "0000".to_owned(),
            category: super::super::Category::None,
            effects: Vec::new(),
            parameters: std::collections::BTreeMap::new(),
            gap_sigma: 0.0,
            gaps_alone_sigma: Vec::new(),
            elements: None,
            noise: [0.02, 0.005],
            peak_v: 1.0,
            dominant: None,
            imperfections: None,
            strata: std::collections::BTreeMap::new(),
        };
        let answers = Answers { format: 1, seed: 7, answers: vec![answer] };
        let seal = Seal::of(folder, None);
        let commitment = seal.close(&answers).expect("sealed");
        (seal, answers, commitment)
    }

    #[test]
    fn sealed_answers_open_unchanged_and_are_unreadable_until_then() {
        let folder = tempfile::tempdir().expect("a folder");
        let (seal, answers, commitment) = sealed_set(folder.path());
        assert_eq!(seal.open(None).expect("untouched"), answers);
        assert_eq!(seal.open(Some(&commitment)).expect("untouched"), answers);
        let sealed = std::fs::read(folder.path().join(SEALED)).expect("there");
        assert!(!sealed.windows(4).any(|bytes| bytes == b"0000"));
        assert!(matches!(seal.is_free(), Err(BlindError::Occupied(_))));
    }

    #[test]
    fn any_later_change_is_detected() {
        for changed in ["0000/samples.csv", LIST, SEALED, KEY, COMMITMENT] {
            let folder = tempfile::tempdir().expect("a folder");
            let (seal, _, commitment) = sealed_set(folder.path());
            let path = folder.path().join(changed);
            let mut bytes = std::fs::read(&path).expect("there");
            // Another character that is valid in text, in hexadecimal, and in a name.
            let last = bytes.len() - 2;
            bytes[last] = if bytes[last] == b'0' { b'1' } else { b'0' };
            std::fs::write(&path, bytes).expect("written");
            assert!(seal.open(None).is_err(), "{changed}");
            // With the commitment noted elsewhere, its file does not matter.
            assert_eq!(seal.open(Some(&commitment)).is_ok(), changed == COMMITMENT, "{changed}");
        }
    }

    #[test]
    fn a_changed_scan_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let (seal, ..) = sealed_set(folder.path());
        std::fs::write(folder.path().join("0000/samples.csv"), "time_s\n0.5\n").expect("written");
        let error = seal.open(None).expect_err("changed");
        assert!(error.to_string().contains("0000/samples.csv"), "{error}");
    }

    #[test]
    fn a_set_sealed_again_with_other_answers_does_not_match_the_commitment() {
        let folder = tempfile::tempdir().expect("a folder");
        let (seal, mut answers, commitment) = sealed_set(folder.path());
        answers.answers[0].gap_sigma = 3.0;
        seal.close(&answers).expect("sealed again");
        assert!(seal.open(None).is_ok());
        let refused = seal.open(Some(&commitment));
        assert!(matches!(refused, Err(BlindError::NotCommitted { .. })));
    }
}
