//! Why a set-up was not corrected.

use std::io;
use std::path::{Path, PathBuf};

use super::not_correctable::Unwritten;
use fieldgap_diagnosis::Verdict;
use fieldgap_input::Fault;

/// Why a set-up was not corrected; nothing that was there before is changed.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum CorrectionError {
    /// The set-up to correct cannot be read.
    #[error(transparent)]
    #[diagnostic(transparent)]
    File(#[from] Fault),
    /// There is no one cause to correct for.
    #[error("nothing to correct: {}", found(.0))]
    #[diagnostic(help("{}", remedy(.0)))]
    NothingNamed(Verdict),
    /// None of the named effects has a key in such a file.
    #[error("{} has no place for what was found: {}", path.display(), listed(unwritten))]
    #[diagnostic(help("correct it where it arises, and scan again"))]
    NoHome {
        /// The set-up.
        path: PathBuf,
        /// The effects, and why.
        unwritten: Vec<Unwritten>,
    },
    /// The set-up describes another array than the scan's.
    #[error("{} describes another array than the scan that was diagnosed: {what}", path.display())]
    #[diagnostic(help(
        "give the rig file that the scan was made with; a copy stands in its folder as rig.toml"
    ))]
    OtherArray {
        /// The set-up.
        path: PathBuf,
        /// What differs.
        what: &'static str,
    },
    /// The diagnosis names an element that the array does not have.
    #[error("the diagnosis names element {element}; the array has {elements}, numbered from 0")]
    #[diagnostic(help("give the rig file that the scan was made with"))]
    NoSuchElement {
        /// Its number, from 0.
        element: usize,
        /// How many there are.
        elements: usize,
    },
    /// Something stands where the corrected set-up should go.
    #[error("{} is there already and stays as it is", .0.display())]
    #[diagnostic(help("choose another --out"))]
    Occupied(PathBuf),
    /// The file system refused.
    #[error("cannot write {}", path.display())]
    #[diagnostic(help("is there room, does the folder exist, and may you write there?"))]
    Write {
        /// What was being written.
        path: PathBuf,
        /// What was reported.
        source: io::Error,
    },
}

impl CorrectionError {
    pub(super) fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| match source.kind() {
            io::ErrorKind::AlreadyExists => Self::Occupied(path),
            _ => Self::Write { path, source },
        }
    }
}

fn found(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Explained => "the named cause is not among the candidates",
        Verdict::Ambiguous => "several causes explain the scan equally well",
        Verdict::Unexplained => "nothing in the catalogue explains the gap",
        Verdict::None => "scan and simulation differ by noise only",
    }
}

fn remedy(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Ambiguous => {
            "take the next measurement that the diagnosis proposes, and diagnose both scans together"
        }
        Verdict::None => "the set-up is right as far as this scan can tell",
        Verdict::Explained | Verdict::Unexplained => "the report shows where the gap lies",
    }
}

fn listed(unwritten: &[Unwritten]) -> String {
    unwritten.iter().map(Unwritten::to_string).collect::<Vec<_>>().join("; ")
}
