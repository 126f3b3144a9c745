//! Transcripts of rig checks, replayed to the present drivers.
//!
//! Each folder in `transcripts` was written by `rig check --record` on devices that no one here wrote. Its file `about.txt` says which.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::repository::here;

fn fieldgap(arguments: &[&str], folder: &Path) -> (bool, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
    let output = command.stdin(Stdio::null()).args(arguments).arg(folder).output();
    let output = output.expect("the program runs");
    let said = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8_lossy(&said).into_owned())
}

#[test]
fn a_check_leaves_a_transcript_that_replays() {
    let home = tempfile::tempdir().expect("a folder");
    for rig in ["rigs/virtual.toml", "rigs/virtual-grbl.toml"] {
        let rig = here(rig).to_string_lossy().into_owned();
        let folder = home.path().join(Path::new(&rig).file_stem().expect("a name"));
        let (well, said) = fieldgap(&["rig", "check", &rig, "--record"], &folder);
        assert!(well && said.contains("transcript:"), "{said}");
        let (same, said) = fieldgap(&["replay", "--wire"], &folder);
        assert!(same && said.contains("robot: 1 sessions, 101 calls"), "{said}");
        let result = std::fs::read_to_string(folder.join("check.json")).expect("the result");
        assert!(result.contains("\"firmware\""), "{result}");
        let (again, said) = fieldgap(&["rig", "check", &rig, "--record"], &folder);
        assert!(!again && said.contains("give a new folder"), "{said}");
    }
}

#[test]
fn drivers_behave_as_on_the_recorded_devices() {
    let folders = std::fs::read_dir(here("tests/transcripts")).expect("transcripts");
    let mut replayed = 0;
    for folder in folders.map(|entry| entry.expect("an entry").path()).filter(|path| path.is_dir())
    {
        assert!(folder.join("about.txt").exists(), "{} does not say what it is", folder.display());
        let (same, said) = fieldgap(&["replay", "--wire"], &folder);
        assert!(same && said.contains("robot: 1 sessions"), "{}: {said}", folder.display());
        replayed += 1;
    }
    assert!(replayed >= 3, "{replayed}");
}
