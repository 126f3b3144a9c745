//! `fieldgap resume`: a scan that ended early, finished.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::scan::{conduct, told};
use crate::campaign::Session;

/// The `resume` command.
#[derive(Debug, Args)]
pub(super) struct Resume {
    /// The folder of the scan
    folder: PathBuf,
    /// Tell every event as a line of JSON
    #[arg(long)]
    json: bool,
}

impl Resume {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let ending = conduct(Session::resume(&self.folder), self.json)?;
        Ok(told(&self.folder, &ending))
    }
}
