//! Errors of corrections.

use std::io;
use std::path::{Path, PathBuf};

use super::not_correctable::Unwritten;
use fieldgap_diagnosis::Verdict;
use fieldgap_input::Fault;

/// Why a set-up was not corrected. Existing files are unchanged.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum CorrectionError {
    /// The set-up to correct cannot be read.
    #[error(transparent)]
    #[diagnostic(transparent)]
    File(#[from] Fault),
    /// The diagnosis names no single cause.
    #[error("nothing to correct: {}", found(.0))]
    #[diagnostic(help("{}", remedy(.0)))]
    NothingNamed(Verdict),
    /// None of the named effects has a key in the file.
    #[error("{} has no key for the cause: {}", path.display(), listed(unwritten))]
    #[diagnostic(help("correct the cause on the rig, and scan again"))]
    NoKey {
        /// The set-up.
        path: PathBuf,
        /// The effects, and why.
        unwritten: Vec<Unwritten>,
    },
    /// The set-up describes another array than that of the scan.
    #[error("the array in {} differs from that of the diagnosed scan: {what}", path.display())]
    #[diagnostic(help("give the rig file of the scan; its folder has a copy, rig.toml"))]
    OtherArray {
        /// The set-up.
        path: PathBuf,
        /// What differs.
        what: &'static str,
    },
    /// The diagnosis names an element that the array does not have.
    #[error("the diagnosis names element {element}; the array has {elements}, numbered from 0")]
    #[diagnostic(help("give the rig file of the scan"))]
    NoSuchElement {
        /// Number of the element, from 0.
        element: usize,
        /// Number of elements of the array.
        elements: usize,
    },
    /// The output exists already.
    #[error("{} exists already and is not overwritten", .0.display())]
    #[diagnostic(help("choose another --out"))]
    Exists(PathBuf),
    /// A file cannot be written.
    #[error("cannot write {}", path.display())]
    #[diagnostic(help("check free space, the folder and its permissions"))]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
}

impl CorrectionError {
    pub(super) fn writing(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| match source.kind() {
            io::ErrorKind::AlreadyExists => Self::Exists(path),
            _ => Self::Write { path, source },
        }
    }
}

fn found(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Explained | Verdict::MostlyExplained => {
            "the named cause is not the best candidate"
        }
        Verdict::Ambiguous => "several causes explain the scan equally well",
        Verdict::Unexplained => "nothing in the catalogue explains the gap",
        Verdict::None => "scan and simulation differ by noise only",
    }
}

fn remedy(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Ambiguous => {
            "make the next measurement that the diagnosis proposes, and diagnose both scans together"
        }
        Verdict::None => "this scan shows no error of the set-up",
        Verdict::Explained | Verdict::MostlyExplained | Verdict::Unexplained => {
            "the report shows where the gap is"
        }
    }
}

fn listed(unwritten: &[Unwritten]) -> String {
    unwritten.iter().map(Unwritten::to_string).collect::<Vec<_>>().join("; ")
}
