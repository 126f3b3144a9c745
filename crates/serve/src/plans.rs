//! The plans of a folder: listed, checked against the rig, written.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use fieldgap_acquisition::{DryRun, PlannedScan};
use fieldgap_input::{read_text, visible_line};
use fieldgap_records::HookKind;

use crate::access::secret::fingerprint;
use crate::exposure::{Exposing, Foresight};
use crate::refusal::Refusal;

/// Longest name of a plan.
const LONGEST_NAME: usize = 80;

/// Largest file that is looked at, bytes.
const LARGEST_PLAN: u64 = 4 << 20;

/// A plan in the list.
#[derive(Debug, Serialize)]
pub(crate) struct Listed {
    /// File name without `.toml`.
    name: String,
    /// Why it cannot be run on this rig.
    fault: Option<String>,
}

/// A plan, and what its scan would do on the rig.
#[derive(Debug, Serialize)]
pub(crate) struct Checked {
    name: String,
    text: String,
    check: DryRun,
    /// Of the plan and the rig file: a start repeats it, so that nothing runs that was not shown.
    digest: String,
    /// Programs that the plan or the rig file would run; a scan started here runs none of them.
    programs: Vec<String>,
    /// The exposure of people; `None` if neither plan nor rig file states where they are.
    exposure: Option<Foresight>,
}

/// The file of a plan, from its name.
///
/// # Errors
/// The name could lead out of the folder.
pub(crate) fn file_of(folder: &Path, name: &str) -> Result<PathBuf, Refusal> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if name.is_empty()
        || name.len() > LONGEST_NAME
        || name.starts_with('.')
        || !name.chars().all(plain)
    {
        return Err(Refusal::bad(
            "this is no name of a plan",
            format!(
                "use 1 to {LONGEST_NAME} letters, digits, `-`, `_` and `.`, the first not a `.`"
            ),
        ));
    }
    Ok(folder.join(format!("{name}.toml")))
}

/// The plans of a folder, by name.
pub(crate) fn list(folder: &Path, rig: &Path) -> Vec<Listed> {
    let files = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    let mut names: Vec<String> = files
        .filter_map(|file| Some(file.file_name().to_str()?.strip_suffix(".toml")?.to_owned()))
        .filter(|name| file_of(folder, name).is_ok_and(|path| is_scan(&path)))
        .collect();
    names.sort();
    let listed = |name: String| {
        let read = PlannedScan::read(&folder.join(format!("{name}.toml")), Some(rig));
        Listed { fault: read.err().map(|error| error.to_string()), name }
    };
    names.into_iter().map(listed).collect()
}

/// Whether a file is the plan of a scan, and not a display or something else; also one that has errors.
fn is_scan(path: &Path) -> bool {
    let Ok(text) = read_text(path, LARGEST_PLAN) else { return false };
    text.lines()
        .any(|line| ["[[plane]]", "[[volume]]", "[[line]]", "[[points]]"].contains(&line.trim()))
}

/// Checks a plan of the folder.
///
/// # Errors
/// There is none of this name, or the rig cannot carry it out.
pub(crate) fn check(
    folder: &Path,
    name: &str,
    rig: &Path,
    exposing: &dyn Exposing,
) -> Result<Checked, Refusal> {
    let path = file_of(folder, name)?;
    if !path.is_file() {
        return Err(Refusal::missing(format!("there is no plan `{name}`")));
    }
    check_file(&path, name, rig, exposing)
}

fn check_file(
    path: &Path,
    name: &str,
    rig: &Path,
    exposing: &dyn Exposing,
) -> Result<Checked, Refusal> {
    let refused = |error: String| Refusal::bad(error, "change the plan, or the rig file");
    let scan = PlannedScan::read(path, Some(rig)).map_err(|error| refused(error.to_string()))?;
    let check = scan.dry_run().map_err(|error| refused(error.to_string()))?;
    let text = fs::read_to_string(path).map_err(|error| refused(error.to_string()))?;
    let digest = fingerprint(format!("{text}\0{}", scan.rig_setup().source().text()).as_bytes());
    let hooks = scan.hooks();
    let kinds = [HookKind::Failure, HookKind::Finish, HookKind::Question];
    let commands = kinds.into_iter().filter_map(|kind| hooks.command(kind));
    let programs = commands.map(|command| visible_line(command.program()).into_owned()).collect();
    let exposure = exposing.by_scan(&scan).map_err(refused)?;
    Ok(Checked { name: name.to_owned(), text, check, digest, programs, exposure })
}

impl Checked {
    /// The digest of plan and rig file.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The exposure of people.
    pub fn exposure(&self) -> Option<&Foresight> {
        self.exposure.as_ref()
    }
}

/// Checks the text of a plan without keeping it.
///
/// # Errors
/// The text is no plan, or the rig cannot carry it out.
pub(crate) fn check_text(
    name: &str,
    text: &str,
    rig: &Path,
    exposing: &dyn Exposing,
) -> Result<Checked, Refusal> {
    let written = written(&std::env::temp_dir(), text)?;
    check_file(written.path(), name, rig, exposing)
        .map_err(|refusal| named(refusal, written.path(), name))
}

/// Writes a new plan, or replaces one whose text is still `replaces`.
///
/// # Errors
/// The text is no plan for this rig, or another person has changed or made the plan.
pub(crate) fn write(
    folder: &Path,
    name: &str,
    text: &str,
    replaces: Option<&str>,
    rig: &Path,
    exposing: &dyn Exposing,
) -> Result<Checked, Refusal> {
    let path = file_of(folder, name)?;
    let written = written(folder, text)?;
    check_file(written.path(), name, rig, exposing)
        .map_err(|refusal| named(refusal, written.path(), name))?;
    let failed = |error: std::io::Error| {
        Refusal::failed(
            format!("the plan cannot be written: {error}"),
            "check the folder of the plans",
        )
    };
    match replaces {
        None => written.persist_noclobber(&path).map(drop).map_err(|error| {
            if error.error.kind() == std::io::ErrorKind::AlreadyExists {
                Refusal::conflict(
                    format!("there is a plan `{name}`"),
                    "choose another name, or open that plan",
                )
            } else {
                failed(error.error)
            }
        })?,
        Some(before) => {
            let there = fs::read_to_string(&path).map_err(failed)?;
            if there != before {
                return Err(Refusal::conflict(
                    format!("`{name}` was changed since you opened it"),
                    "open it again and repeat your change",
                ));
            }
            written.persist(&path).map(drop).map_err(|error| failed(error.error))?;
        }
    }
    check(folder, name, rig, exposing)
}

fn written(folder: &Path, text: &str) -> Result<tempfile::NamedTempFile, Refusal> {
    let write = || {
        let mut file =
            tempfile::Builder::new().prefix(".plan-").suffix(".toml").tempfile_in(folder)?;
        file.write_all(text.as_bytes())?;
        file.as_file().sync_all()?;
        Ok(file)
    };
    write().map_err(|error: std::io::Error| {
        Refusal::failed(
            format!("the plan cannot be written: {error}"),
            "check the folder of the plans",
        )
    })
}

/// A refusal that names the plan in place of the file in which it was checked.
fn named(refusal: Refusal, path: &Path, name: &str) -> Refusal {
    let problem = refusal.problem.replace(&*path.to_string_lossy(), name);
    Refusal { problem, ..refusal }
}
