//! `fieldgap campaign acknowledge`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use jiff::Timestamp;
use miette::miette;

use super::status::overview_of;
use crate::cli::output::say;
use fieldgap_campaign::{CampaignFolder, What};
use fieldgap_monitoring::{Acknowledgement, Expect};

/// The `acknowledge` command.
#[derive(Debug, Args)]
pub(super) struct Acknowledge {
    /// Folder of the campaign, which must not be running
    folder: PathBuf,
    /// What was found or done, such as "swapped the preamplifier"
    text: String,
    /// What figures are expected to be from now on
    #[arg(long, value_enum, default_value = "as-before")]
    expect: Expected,
    /// Only this figure, such as gap [default: all]
    #[arg(long, value_name = "NAME")]
    figure: Option<String>,
    /// Only cells of this setting, such as "focus=left" [default: all]
    #[arg(long, value_name = "SETTING")]
    setting: Option<String>,
    /// Who acknowledges [default: the user's name]
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Expected {
    /// What they were: the alarm was false
    Unchanged,
    /// What they were before the alarm: its cause is repaired
    AsBefore,
    /// Something new, which the runs that follow show
    Anew,
}

impl Acknowledge {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let (_, overview) = overview_of(&self.folder, None)?;
        if let Some(setting) = &self.setting
            && !overview.cells.iter().any(|cell| cell.setting == *setting)
        {
            return Err(miette!(
                help = "`fieldgap campaign report` lists the cells with their settings",
                "the campaign has no setting `{setting}`"
            ));
        }
        let by = self.by.or_else(|| std::env::var("USER").ok()).ok_or_else(|| {
            miette!(
                help = "give --by NAME",
                "it is not known who acknowledges this: USER is not set"
            )
        })?;
        let mut folder = CampaignFolder::open(&self.folder)?;
        let before = folder.state().open_alarms().count();
        let at = Timestamp::now();
        let expect = match self.expect {
            Expected::Unchanged => Expect::Unchanged,
            Expected::AsBefore => Expect::AsBefore,
            Expected::Anew => Expect::Anew,
        };
        let of = Acknowledgement { at, figure: self.figure, cell: self.setting, expect };
        folder.log(at, What::Acknowledged { of, who: by, text: self.text })?;
        let left = folder.state().open_alarms().count();
        say(format!("{} alarms acknowledged, {left} left", before - left));
        Ok(ExitCode::SUCCESS)
    }
}
