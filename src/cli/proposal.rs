//! What a report proposes to do about a named cause.

use std::path::{Path, PathBuf};

use fieldgap_acquisition::original_rig;
use fieldgap_correction::{
    CorrectionError, PlannedCorrection, Unwritten, plan_recorded_scan, plan_rig_file,
};
use fieldgap_diagnosis::Diagnosis;
use fieldgap_records::RecordedScan;
use fieldgap_report::{ProposedChange, ProposedCorrection};

/// Name of the corrected rig file in the proposed command.
const CORRECTED_RIG: &str = "corrected-rig.toml";

/// The correction of the rig file in the record, or of the record's set-up where the rig file has no key for the cause or is missing.
/// `None` if the diagnosis names no cause.
pub(super) fn proposed_correction(
    folder: &Path,
    scan: &RecordedScan,
    diagnosis: &Diagnosis,
) -> Option<ProposedCorrection> {
    if !diagnosis.verdict.names_a_cause() {
        return None;
    }
    let rig = original_rig(folder).map_or_else(|| folder.join("rig.toml"), |rig| from_here(&rig));
    if rig.is_file() {
        let out = rig.with_file_name(CORRECTED_RIG);
        if let Ok(planned) = plan_rig_file(diagnosis, &scan.setup, &rig, &out) {
            let file = rig.file_name().unwrap_or_default().to_string_lossy();
            return Some(proposal(&file, planned, command(folder, &rig, &out)));
        }
    }
    match plan_recorded_scan(diagnosis, &scan.setup, folder, &folder.join("corrected")) {
        Ok(planned) => {
            let command = command(folder, folder, Path::new("corrected"));
            Some(proposal("scan.toml", planned, command))
        }
        Err(CorrectionError::NoKey { unwritten, .. }) => {
            Some(ProposedCorrection { manual: in_words(&unwritten), ..Default::default() })
        }
        Err(_) => None,
    }
}

fn proposal(file: &str, planned: PlannedCorrection, command: String) -> ProposedCorrection {
    let changes = planned.changes.into_iter().map(|change| ProposedChange {
        key: change.key,
        before: change.before,
        after: change.after,
    });
    ProposedCorrection {
        file: file.to_owned(),
        changes: changes.collect(),
        // An effect without parameters is named by its id alone.
        fitted: planned.written.into_iter().filter(|found| found.contains('=')).collect(),
        manual: in_words(&planned.unwritten),
        command,
    }
}

fn in_words(unwritten: &[Unwritten]) -> Vec<String> {
    unwritten
        .iter()
        .map(|effect| format!("{}: {}.", effect.effect.as_cause(), effect.why))
        .collect()
}

fn command(folder: &Path, apply: &Path, out: &Path) -> String {
    let [folder, apply, out] = [folder, apply, out].map(quoted);
    format!("fieldgap diagnose {folder} --apply {apply} --out {out}")
}

/// A path relative to the working folder, where it lies below it.
fn from_here(path: &Path) -> PathBuf {
    let here = std::env::current_dir().unwrap_or_default();
    path.strip_prefix(&here).unwrap_or(path).to_owned()
}

/// A path as one word of a shell.
fn quoted(path: &Path) -> String {
    let path = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || matches!(c, '/' | '.' | '_' | '-' | '+');
    match path.chars().all(plain) && !path.starts_with('-') {
        true => path,
        false => format!("'{}'", path.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_one_word_of_a_shell() {
        assert_eq!(quoted(Path::new("out/thesis-focus")), "out/thesis-focus");
        assert_eq!(quoted(Path::new("my scans/it's")), "'my scans/it'\\''s'");
    }
}
