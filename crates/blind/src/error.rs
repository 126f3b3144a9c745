//! Errors of making, running and scoring a set.

use std::io;
use std::path::{Path, PathBuf};

use fieldgap_comparison::Incomparable;
use fieldgap_input::Fault;
use fieldgap_records::RecordError;

/// Why a set was not made, run or scored.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum BlindError {
    /// The folder for a new set is not empty.
    #[error("{} is not empty; a set needs a folder of its own", .0.display())]
    #[diagnostic(help("name a folder that does not exist yet"))]
    Occupied(PathBuf),
    /// A key would be written over another.
    #[error("{} exists already; it may be the only key to another set", .0.display())]
    #[diagnostic(help("name another file with --key, or move that one away"))]
    KeyExists(PathBuf),
    /// A sealed file would be written over another.
    #[error("{} exists already and is not overwritten", .0.display())]
    #[diagnostic(help("name another file with --out, or move that one away"))]
    SealedExists(PathBuf),
    /// A set is sealed already.
    #[error("{} exists already: the answers to these scans are sealed", .0.display())]
    #[diagnostic(help("open them with their key, or copy the scans into a folder of their own"))]
    AlreadySealed(PathBuf),
    /// A name without the ending of a sealed file.
    #[error("{} does not have the name of a sealed file", .0.display())]
    #[diagnostic(help("let the name end in .sealed"))]
    NotASealedName(PathBuf),
    /// A scan could not be written.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A scan could not be read.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scan(#[from] Fault),
    /// A file could not be read.
    #[error("cannot read {}: {source}", path.display())]
    #[diagnostic(help("{help}"))]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's or parser's error.
        source: io::Error,
        /// The remedy.
        help: &'static str,
    },
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    #[diagnostic(help("check that the disk has room and that the folder may be written"))]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's or parser's error.
        source: io::Error,
    },
    /// The system gave no random numbers for a key.
    #[error("no key could be drawn: {0}")]
    #[diagnostic(help("nothing can be sealed without a key; try again"))]
    NoKey(String),
    /// A key file without a key.
    #[error("{} holds no key: 64 hexadecimal digits are expected", .0.display())]
    #[diagnostic(help("name the file that `blind make` wrote with --key"))]
    BadKey(PathBuf),
    /// A scan is not as it was when the answers were sealed.
    #[error("{} is not as it was when the answers were sealed", .0.display())]
    #[diagnostic(help(
        "its score would mean nothing; take the set from its source, or make another"
    ))]
    ScanChanged(PathBuf),
    /// Scans, list or sealed answers are not those of the commitment.
    #[error("the set does not match the commitment {expected}: its own is {found}")]
    #[diagnostic(help(
        "scans, answers or key were exchanged after the set was made; take them from their source"
    ))]
    NotCommitted {
        /// The commitment noted when the set was made.
        expected: String,
        /// The commitment of the present files.
        found: String,
    },
    /// The answers do not open.
    #[error("{} does not open: the key is not its key, or its bytes were changed", .0.display())]
    #[diagnostic(help("name the key that was written with the set (--key)"))]
    DoesNotOpen(PathBuf),
    /// A file is not the expected JSON.
    #[error("{} is not the expected JSON: {source}", path.display())]
    #[diagnostic(help("{help}"))]
    Json {
        /// The file.
        path: PathBuf,
        /// The system's or parser's error.
        source: serde_json::Error,
        /// The remedy.
        help: &'static str,
    },
    /// Answers that are not those of the scans.
    #[error("{}: {why}", path.display())]
    #[diagnostic(help(
        "each scan of the folder needs one answer, as `fieldgap blind open` prints them; correct the file and seal again"
    ))]
    WrongAnswers {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the scan at fault.
        why: String,
    },
    /// A folder without scans.
    #[error("no folder in {} holds a scan.toml", .0.display())]
    #[diagnostic(help("name the folder that contains the folders of recorded scans"))]
    NoScans(PathBuf),
    /// An unknown scan.
    #[error("{} has no scan called {name}", folder.display())]
    #[diagnostic(help("the names of the scans are those of its folders"))]
    UnknownScan {
        /// The folder.
        folder: PathBuf,
        /// The requested name.
        name: String,
    },
    /// A scan that cannot be compared with a simulation.
    #[error("{name} cannot be diagnosed: {source}")]
    Incomparable {
        /// The scan.
        name: String,
        /// The reason.
        source: Incomparable,
    },
    /// There is no diagnosis to score.
    #[error("{} holds no diagnosis", .0.display())]
    #[diagnostic(help("run `fieldgap blind run` first, or name its folder with --diagnoses"))]
    NothingToScore(PathBuf),
}

impl BlindError {
    /// Wraps an error of reading `path`, for [`Result::map_err`].
    pub(super) fn reading(
        path: &Path,
        help: &'static str,
    ) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Read { path, source, help }
    }

    /// Wraps an error of writing `path`, for [`Result::map_err`].
    pub(super) fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Write { path, source }
    }
}
