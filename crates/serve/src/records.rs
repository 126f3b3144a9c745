//! The records of a folder: listed, and their files shown.

use std::fs;
use std::path::{Component, Path, PathBuf};

use axum::http::StatusCode;
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use jiff::Timestamp;
use serde::Serialize;

use fieldgap_records::{Note, ScanSetup, ScanState};

use crate::refusal::Refusal;

/// Most records that are listed, the newest first.
const MOST_LISTED: usize = 500;

/// Largest file that is shown, bytes: a report with 100,000 points has less than 64 MiB.
const LARGEST_FILE: u64 = 512 << 20;

/// Pages of a record run their own scripts, and come from files that other people may have sent. They are shown in an origin of their
/// own, where they reach neither this server's cookie nor any other address.
const PAGE_POLICY: &str = "sandbox allow-scripts allow-popups allow-downloads; default-src 'none'; img-src 'self' data: blob:; \
     style-src 'self' 'unsafe-inline'; script-src 'self' 'unsafe-inline' blob:; font-src data:; worker-src blob:; \
     frame-ancestors 'self'; base-uri 'none'; form-action 'none'";

/// A record in the list.
#[derive(Debug, Serialize)]
pub(crate) struct Listed {
    folder: String,
    name: String,
    recorded: Timestamp,
    /// The state, in words; `None` for a record of another program.
    state: Option<String>,
    complete: bool,
    foci: usize,
    report: bool,
    why: bool,
    notes: Vec<Note>,
    /// The first map of the report.
    map: Option<String>,
}

/// The records below a folder, the newest first.
pub(crate) fn list(records: &Path) -> Vec<Listed> {
    let folders = fs::read_dir(records)
        .into_iter()
        .flatten()
        .filter_map(Result::ok)
        .map(|entry| entry.path());
    let mut listed: Vec<Listed> = folders.filter_map(|folder| listed(&folder)).collect();
    listed.sort_by(|a, b| (b.recorded, &a.folder).cmp(&(a.recorded, &b.folder)));
    listed.truncate(MOST_LISTED);
    listed
}

fn listed(folder: &Path) -> Option<Listed> {
    let name = folder.file_name()?.to_str()?.to_owned();
    let setup = ScanSetup::read(&folder.join("scan.toml")).ok()?;
    let state = ScanState::of(folder).ok()?;
    Some(Listed {
        folder: name,
        name: setup.name,
        recorded: setup.recorded,
        complete: !matches!(state, Some(ScanState::Scanning | ScanState::Partial { .. })),
        state: state.map(|state| match state {
            ScanState::Complete => "complete".to_owned(),
            ScanState::Scanning => "scanning, or killed".to_owned(),
            ScanState::Partial { reason } => format!("ended early: {reason}"),
        }),
        foci: setup.foci.len(),
        report: folder.join("report/index.html").is_file(),
        why: folder.join("report/why/index.html").is_file(),
        notes: Note::all_of(folder).unwrap_or_default(),
        map: first_map(folder),
    })
}

fn first_map(folder: &Path) -> Option<String> {
    let files = fs::read_dir(folder.join("report")).ok()?.filter_map(Result::ok);
    let names = files.filter_map(|file| file.file_name().into_string().ok());
    names.filter(|name| name.starts_with("map-") && name.ends_with(".png")).min()
}

/// The folder of a record.
///
/// # Errors
/// There is none of this name.
pub(crate) fn folder(records: &Path, name: &str) -> Result<PathBuf, Refusal> {
    let setup = file(records, &format!("{name}/scan.toml"))?;
    let folder =
        setup.parent().filter(|folder| folder.file_name().is_some_and(|last| last == name));
    folder.map(Path::to_owned).ok_or_else(|| Refusal::missing("there is no such record"))
}

/// The file at `path` below the folder of the records.
///
/// # Errors
/// There is none, or the path leads out of the folder: by `..`, by a link, or by a hidden file.
pub(crate) fn file(records: &Path, path: &str) -> Result<PathBuf, Refusal> {
    let missing = || Refusal::missing("there is no such file in a record");
    let relative = Path::new(path);
    let plain = |part: Component<'_>| match part {
        Component::Normal(name) => !name.to_string_lossy().starts_with('.'),
        _ => false,
    };
    // At least the record and a file in it: what lies beside the records, such as the audit log, is not shown.
    if relative.components().count() < 2 || !relative.components().all(plain) || path.contains('\0')
    {
        return Err(missing());
    }
    let root = fs::canonicalize(records).map_err(|_| missing())?;
    let file = fs::canonicalize(root.join(relative)).map_err(|_| missing())?;
    let about = fs::metadata(&file).map_err(|_| missing())?;
    if !file.starts_with(&root) || !about.is_file() || about.len() > LARGEST_FILE {
        return Err(missing());
    }
    Ok(file)
}

/// The file as an answer, with the policy of a page that came from elsewhere.
pub(crate) fn shown(file: &Path) -> Result<Response, Refusal> {
    let bytes = fs::read(file)
        .map_err(|error| Refusal::missing(format!("the file cannot be read: {error}")))?;
    let headers = [
        (CONTENT_TYPE, kind(file)),
        (CONTENT_SECURITY_POLICY, PAGE_POLICY),
        (CACHE_CONTROL, "no-store"),
    ];
    Ok((StatusCode::OK, headers, bytes).into_response())
}

/// The media type of a file by its ending. What is not known is text, which no browser runs.
fn kind(file: &Path) -> &'static str {
    match file.extension().and_then(|ending| ending.to_str()).unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "json" => "application/json",
        "csv" => "text/csv; charset=utf-8",
        "gz" | "nc" | "h5" | "mat" | "npz" => "application/octet-stream",
        _ => "text/plain; charset=utf-8",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_records_are_shown() {
        let folder = tempfile::tempdir().expect("a folder");
        let records = folder.path().join("out");
        fs::create_dir_all(records.join("a/report")).expect("made");
        fs::write(records.join("a/report/index.html"), "a report").expect("written");
        fs::write(records.join("audit.jsonl"), "{}").expect("written");
        fs::write(records.join("a/.hidden"), "").expect("written");
        fs::write(folder.path().join("secret"), "").expect("written");
        std::os::unix::fs::symlink("../../secret", records.join("a/way-out")).expect("linked");
        assert!(file(&records, "a/report/index.html").is_ok());
        let bad = [
            "audit.jsonl",
            "a",
            "a/report",
            "a/.hidden",
            "a/way-out",
            "../secret",
            "a/../../secret",
            "/etc/passwd",
            "a//../audit.jsonl",
            "",
            "a/report/index.html\0",
            "./audit.jsonl",
        ];
        for path in bad {
            assert!(file(&records, path).is_err(), "{path}");
        }
    }
}
