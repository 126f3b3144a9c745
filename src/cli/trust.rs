//! Trust in the programs that a plan or a rig file names: files from other people run nothing unasked.
//!
//! A hook runs only after a person has seen its command and agreed. The agreement is remembered by a hash of the commands, and of
//! the programs' contents where they are files beside the plan.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use miette::IntoDiagnostic;
use sha2::{Digest, Sha256};

use super::question::agree;
use super::settings::settings_folder;
use fieldgap_acquisition::PlannedScan;
use fieldgap_input::{MOST_TEXT, read_bytes, read_text};
use fieldgap_records::{HookCommand, HookKind, Hooks};

/// The argument that trusts the programs in advance.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct Trust {
    /// Run the programs that [hooks] of the plan or the rig file names, without asking
    #[arg(long)]
    trust: bool,
}

/// The programs that may run at events of a scan: what was shown and agreed to, also if the files have changed since.
#[derive(Debug, Clone)]
pub(super) struct AgreedHooks(Hooks);

impl AgreedHooks {
    /// The programs.
    pub(super) fn hooks(&self) -> &Hooks {
        &self.0
    }
}

const KINDS: [(HookKind, &str); 3] = [
    (HookKind::Failure, "on_failure"),
    (HookKind::Finish, "on_finish"),
    (HookKind::Question, "on_question"),
];

/// Largest program whose contents are hashed; of larger ones the length is.
const LARGEST_HASHED: u64 = 1 << 20;

impl Trust {
    /// Asks whether the programs of a scan may run, unless that was agreed before.
    ///
    /// # Errors
    /// It was refused, or nobody can be asked.
    pub(super) fn in_hooks_of(self, scan: &PlannedScan) -> miette::Result<AgreedHooks> {
        let hooks = scan.hooks();
        self.in_programs(&programs(&hooks), "the plan or the rig file")?;
        Ok(AgreedHooks(hooks))
    }

    /// Asks whether programs may run that `files` name, each with its key, unless that was agreed before.
    ///
    /// # Errors
    /// As [`Trust::in_hooks_of`].
    pub(super) fn in_programs(
        self,
        programs: &[(String, HookCommand)],
        files: &str,
    ) -> miette::Result<()> {
        let Some(commands) = listed(programs) else { return Ok(()) };
        let hash = hash_of(programs);
        if self.trust || remembered().is_some_and(|file| has_line(&file, &hash)) {
            return Ok(());
        }
        agree(
            &format!("{files} names programs to run:\n{commands}"),
            "May they run, now and later?",
            "read the commands; then answer y, give --trust, or remove them from the files",
        )?;
        if let Some(file) = remembered() {
            remember(&file, &hash).into_diagnostic()?;
        }
        Ok(())
    }
}

/// The programs of a scan, each with its key.
pub(super) fn programs(hooks: &Hooks) -> Vec<(String, HookCommand)> {
    let one =
        |(kind, name): (HookKind, &str)| Some((name.to_owned(), hooks.command(kind)?.clone()));
    KINDS.into_iter().filter_map(one).collect()
}

/// The commands, one a line; `None` if there are none.
pub(super) fn listed(programs: &[(String, HookCommand)]) -> Option<String> {
    let line = |(name, command): &(String, HookCommand)| format!("  {name}: {}", shown(command));
    let lines: Vec<String> = programs.iter().map(line).collect();
    (!lines.is_empty()).then(|| lines.join("\n"))
}

/// A command as a shell would take it, with control characters made visible.
fn shown(command: &HookCommand) -> String {
    let words = std::iter::once(command.program())
        .chain(command.arguments().iter().map(String::as_str))
        .map(|word| format!("{word:?}"));
    words.collect::<Vec<_>>().join(" ")
}

fn hash_of(programs: &[(String, HookCommand)]) -> String {
    let mut hasher = Sha256::new();
    for (name, command) in programs {
        hasher.update(format!("{name} {}\n", shown(command)));
        if command.program().contains('/') {
            let length = fs::metadata(command.program()).map_or(0, |file| file.len());
            hasher.update(length.to_le_bytes());
            if length <= LARGEST_HASHED {
                hasher.update(
                    read_bytes(Path::new(command.program()), LARGEST_HASHED).unwrap_or_default(),
                );
            }
        }
    }
    hasher.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The file of the agreed commands; `None` where there are no settings.
fn remembered() -> Option<PathBuf> {
    Some(settings_folder()?.join("trusted-hooks"))
}

fn has_line(file: &Path, hash: &str) -> bool {
    read_text(file, MOST_TEXT).is_ok_and(|text| text.lines().any(|line| line == hash))
}

fn remember(file: &Path, hash: &str) -> std::io::Result<()> {
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder)?;
    }
    let mut file = fs::OpenOptions::new().append(true).create(true).open(file)?;
    writeln!(file, "{hash}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_input::toml_text;

    fn hooks(text: &str) -> Vec<(String, HookCommand)> {
        programs(&toml_text(Path::new("plan.toml"), text).expect("valid"))
    }

    #[test]
    fn commands_are_shown_with_their_control_characters() {
        let hooks = hooks("on_finish = [\"sh\", \"-c\", \"\\u001b[2J; rm x\"]\n");
        assert_eq!(listed(&hooks).expect("one"), "  on_finish: \"sh\" \"-c\" \"\\u{1b}[2J; rm x\"");
        assert_eq!(listed(&[]), None);
    }

    #[test]
    fn another_command_and_another_script_have_another_hash() {
        let folder = tempfile::tempdir().expect("a folder");
        let script = folder.path().join("tell");
        let text = format!("on_finish = [\"{}\"]\n", script.display());
        fs::write(&script, "echo 1").expect("written");
        let first = hash_of(&hooks(&text));
        assert_eq!(first, hash_of(&hooks(&text)));
        fs::write(&script, "echo 2").expect("written");
        assert_ne!(first, hash_of(&hooks(&text)));
        assert_ne!(hash_of(&hooks("on_finish = \"a\"\n")), hash_of(&hooks("on_failure = \"a\"\n")));
    }

    #[test]
    fn an_agreement_is_remembered() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("fieldgap/trusted-hooks");
        assert!(!has_line(&file, "ab"));
        remember(&file, "ab").expect("written");
        remember(&file, "cd").expect("written");
        assert!(has_line(&file, "ab") && has_line(&file, "cd") && !has_line(&file, "a"));
    }
}
