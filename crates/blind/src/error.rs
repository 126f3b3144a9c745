//! What can go wrong with a set.

use std::io;
use std::path::{Path, PathBuf};

use fieldgap_comparison::Incomparable;
use fieldgap_input::Fault;
use fieldgap_records::RecordError;

/// Why a set was not made, run or scored.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum BlindError {
    /// There is something in the folder that a set is to be made in.
    #[error("{} is not empty; a set is made in a folder of its own", .0.display())]
    #[diagnostic(help("name a folder that does not exist yet"))]
    Occupied(PathBuf),
    /// A key would be written over another.
    #[error("{} exists already; it may be the only key to another set", .0.display())]
    #[diagnostic(help("name another file with --key, or take that one away"))]
    KeyExists(PathBuf),
    /// A sealed file would be written over another.
    #[error("{} exists already and stays as it is", .0.display())]
    #[diagnostic(help("name another file with --out, or take that one away"))]
    SealedExists(PathBuf),
    /// A name that is not read as that of a sealed file.
    #[error("{} would not be known for a sealed file by its name", .0.display())]
    #[diagnostic(help("let the name end in .sealed"))]
    NotASealedName(PathBuf),
    /// A scan could not be kept.
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
        /// Which.
        path: PathBuf,
        /// What was reported.
        source: io::Error,
        /// What to do.
        help: &'static str,
    },
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    #[diagnostic(help("check that the disk has room and that the folder may be written"))]
    Write {
        /// Which.
        path: PathBuf,
        /// What was reported.
        source: io::Error,
    },
    /// The system gave no random numbers for a key.
    #[error("no key could be drawn: {0}")]
    #[diagnostic(help("without one nothing can be sealed; try again"))]
    NoKey(String),
    /// A key file that holds no key.
    #[error("{} holds no key: 64 hexadecimal digits are expected", .0.display())]
    #[diagnostic(help("name the file that `blind make` wrote with --key"))]
    BadKey(PathBuf),
    /// A scan is not as it was when the answers were sealed.
    #[error("{} is not as it was when the answers were sealed", .0.display())]
    #[diagnostic(help(
        "the set counts for nothing any more; take it from where it was made, or make another"
    ))]
    ScanChanged(PathBuf),
    /// Scans, list or sealed answers are not those of the commitment.
    #[error("the set is not the one of the commitment {expected}: its own is {found}")]
    #[diagnostic(help(
        "scans, answers or key were exchanged after the set was made; take them from where they were made"
    ))]
    NotCommitted {
        /// What was written down when the set was made.
        expected: String,
        /// What the files give now.
        found: String,
    },
    /// The answers do not open.
    #[error("{} does not open: the key is not its own, or its bytes were changed", .0.display())]
    #[diagnostic(help("name the key that was written with it (--key)"))]
    DoesNotOpen(PathBuf),
    /// A file that should be JSON of some form is not.
    #[error("{} is not what is expected there: {source}", path.display())]
    #[diagnostic(help("{help}"))]
    Json {
        /// Which.
        path: PathBuf,
        /// What was reported.
        source: serde_json::Error,
        /// What to do.
        help: &'static str,
    },
    /// No scans at all.
    #[error("no folder in {} holds a scan.toml", .0.display())]
    #[diagnostic(help("name the folder whose folders are recorded scans"))]
    NoScans(PathBuf),
    /// A name that no scan has.
    #[error("{} has no scan called {name}", folder.display())]
    #[diagnostic(help("its folders are the names of its scans"))]
    UnknownScan {
        /// Where it was looked for.
        folder: PathBuf,
        /// What was asked for.
        name: String,
    },
    /// A scan that cannot be compared with anything.
    #[error("{name} cannot be diagnosed: {source}")]
    Incomparable {
        /// The scan.
        name: String,
        /// Why.
        source: Incomparable,
    },
    /// There is nothing to score.
    #[error("{} holds no diagnosis", .0.display())]
    #[diagnostic(help("run `fieldgap blind run` first, or name its folder with --diagnoses"))]
    NothingToScore(PathBuf),
}

impl BlindError {
    /// For [`Result::map_err`] of what reads `path`.
    pub(super) fn reading(
        path: &Path,
        help: &'static str,
    ) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Read { path, source, help }
    }

    /// For [`Result::map_err`] of what writes `path`.
    pub(super) fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Write { path, source }
    }
}
