//! The rig file corrected by the cause that a record shows: first its lines, then the file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use serde::Serialize;
use similar::{ChangeTag, TextDiff};
use tokio::process::Command;

use fieldgap_input::visible_line;

use crate::refusal::Refusal;

/// A line of the rig file that the correction removes (`-`) or adds (`+`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct Line {
    sign: char,
    text: String,
}

/// What a correction is.
#[derive(Debug, Serialize)]
pub(crate) struct Correction {
    /// What is corrected, and what a rig file has no key for.
    said: Vec<String>,
    lines: Vec<Line>,
    /// Name of the new file, if it was kept.
    file: Option<String>,
}

/// A corrected file that is removed again, with the files beside it that it names.
struct Preview(PathBuf);

impl Drop for Preview {
    fn drop(&mut self) {
        let Some(stem) = self.0.file_stem().map(|stem| stem.to_string_lossy().into_owned()) else {
            return;
        };
        // The parent of a bare name is the empty path, which is no folder to be read.
        let folder = self.0.parent().filter(|folder| *folder != Path::new(""));
        let files = fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter().flatten();
        let of_preview =
            |file: &fs::DirEntry| file.file_name().to_string_lossy().starts_with(&stem);
        for file in files.filter_map(Result::ok).filter(of_preview) {
            let _ = fs::remove_file(file.path());
        }
    }
}

/// Corrects the rig file by the cause that the record in `folder` shows. The file itself is not changed: with `keep`, a new one is written beside it.
///
/// # Errors
/// The record shows no cause that a rig file can hold, or the file cannot be written.
pub(crate) async fn correct(
    program: &Path,
    folder: &Path,
    rig: &Path,
    keep: bool,
) -> Result<Correction, Refusal> {
    let failed = |problem: String| {
        Refusal::failed(problem, "run `fieldgap diagnose RECORD --apply RIG` in a terminal")
    };
    let stem = rig.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let out = if keep {
        fresh(rig, &stem)
    } else {
        rig.with_file_name(format!(".{stem}-preview-{}.toml", std::process::id()))
    };
    let preview = (!keep).then(|| Preview(out.clone()));
    let mut command = Command::new(program);
    command
        .arg("diagnose")
        .arg(folder)
        .arg("--apply")
        .arg(rig)
        .arg("--out")
        .arg(&out)
        .stdin(Stdio::null());
    let done = command.output().await.map_err(|error| failed(error.to_string()))?;
    let words =
        String::from_utf8_lossy(&done.stderr).into_owned() + &String::from_utf8_lossy(&done.stdout);
    if !done.status.success() {
        let problem = visible_line(String::from_utf8_lossy(&done.stderr).trim()).into_owned();
        return Err(Refusal::conflict(problem, "look at the page that says why they differ"));
    }
    let read = |path: &Path| fs::read_to_string(path).map_err(|error| failed(error.to_string()));
    let lines = changed(&read(rig)?, &read(&out)?);
    drop(preview);
    let said = words
        .lines()
        .filter(|line| line.starts_with("corrected for") || line.starts_with("not corrected"));
    Ok(Correction {
        said: said.map(|line| visible_line(line).into_owned()).collect(),
        lines,
        file: out.file_name().filter(|_| keep).map(|name| name.to_string_lossy().into_owned()),
    })
}

fn fresh(rig: &Path, stem: &str) -> PathBuf {
    let named = |n: u32| match n {
        1 => rig.with_file_name(format!("{stem}-corrected.toml")),
        n => rig.with_file_name(format!("{stem}-corrected-{n}.toml")),
    };
    (1..).map(named).find(|path| !path.exists()).unwrap_or_else(|| named(1))
}

fn changed(old: &str, new: &str) -> Vec<Line> {
    let diff = TextDiff::from_lines(old, new);
    let line = |change: similar::Change<&str>| {
        let sign = match change.tag() {
            ChangeTag::Delete => '-',
            ChangeTag::Insert => '+',
            ChangeTag::Equal => return None,
        };
        Some(Line { sign, text: visible_line(change.value().trim_end()).into_owned() })
    };
    diff.iter_all_changes().filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_changed_lines_are_shown() {
        let line = |sign, text: &str| Line { sign, text: text.to_owned() };
        let shown = changed(
            "a = 1\nspacing_mm = 0.0\nb = 2\n",
            "a = 1\n# before 0\nspacing_mm = 0.27\nb = 2\n",
        );
        assert_eq!(
            shown,
            [
                line('-', "spacing_mm = 0.0"),
                line('+', "# before 0"),
                line('+', "spacing_mm = 0.27")
            ]
        );
    }

    #[test]
    fn a_preview_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let names = ["rig.toml", ".rig-preview-1.toml", ".rig-preview-1-elements.csv"];
        names.iter().for_each(|name| fs::write(folder.path().join(name), "").expect("written"));
        drop(Preview(folder.path().join(".rig-preview-1.toml")));
        let left: Vec<_> = fs::read_dir(folder.path())
            .expect("a folder")
            .map(|file| file.expect("a file").file_name())
            .collect();
        assert_eq!(left, ["rig.toml"]);
    }
}
