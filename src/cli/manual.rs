//! `fieldgap manual`: man pages and shell completions, for those who package the program.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Command};
use clap_complete::Shell;
use miette::{IntoDiagnostic, WrapErr};

use super::output::say;

/// The `manual` command.
#[derive(Debug, Args)]
pub(super) struct Manual {
    /// The folder; it gets `man` with a page for each command, and `completions` with a script for each shell
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl Manual {
    pub(super) fn run(self, program: Command) -> miette::Result<ExitCode> {
        let written = || format!("the manual cannot be written into {}", self.folder.display());
        let [man, completions] = ["man", "completions"].map(|part| self.folder.join(part));
        for folder in [&man, &completions] {
            std::fs::create_dir_all(folder).into_diagnostic().wrap_err_with(written)?;
        }
        clap_mangen::generate_to(program.clone(), &man).into_diagnostic().wrap_err_with(written)?;
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            clap_complete::generate_to(shell, &mut program.clone(), "fieldgap", &completions)
                .into_diagnostic()
                .wrap_err_with(written)?;
        }
        say(format!("man pages: {}; completions: {}", man.display(), completions.display()));
        Ok(ExitCode::SUCCESS)
    }
}
