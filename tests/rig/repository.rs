//! The program, and the files of the repository that it is run on.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A path of the repository.
pub fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The program, all of whose text can be read.
pub fn fieldgap() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// `rigs/virtual.toml` for a rig file in any folder, at a pace.
pub fn virtual_rig(pace: &str) -> String {
    let text = std::fs::read_to_string(here("rigs/virtual.toml")).expect("the rig file is there");
    let truth = here("rigs/truth/thesis-lab.toml");
    text.replace("pace = \"lockstep\"", &format!("pace = {pace}"))
        .replace("truth/thesis-lab.toml", &truth.to_string_lossy())
}
