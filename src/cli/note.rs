//! `fieldgap note`: what people noted about a record.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use jiff::Timestamp;
use jiff::tz::TimeZone;
use miette::{IntoDiagnostic, miette};

use super::output::{print, print_json, say};
use fieldgap_records::{Note, NoteKind, ScanSetup};

/// The `note` command.
#[derive(Debug, Args)]
pub(super) struct NoteCommand {
    /// Folder of the record
    record: PathBuf,
    /// What to note, such as "swapped the preamplifier" [default: print the notes]
    text: Option<String>,
    /// Who notes it [default: the user's name]
    #[arg(long, value_name = "NAME", requires = "text")]
    by: Option<String>,
    /// What it is about
    #[arg(long, value_enum, default_value = "note", requires = "text")]
    kind: Kind,
    /// Print the notes as JSON
    #[arg(long, conflicts_with = "text")]
    json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Kind {
    /// Anything
    Note,
    /// Something was repaired or exchanged
    Repair,
    /// Something was calibrated
    Calibration,
    /// A figure left its limits, or a device failed
    Alarm,
}

impl From<Kind> for NoteKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Note => Self::Note,
            Kind::Repair => Self::Repair,
            Kind::Calibration => Self::Calibration,
            Kind::Alarm => Self::Alarm,
        }
    }
}

impl NoteCommand {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        // A note goes to a record, not to any folder.
        ScanSetup::read(&self.record.join("scan.toml"))?;
        let Some(text) = self.text else {
            let notes = Note::all_of(&self.record)?;
            if self.json {
                print_json(&notes)?;
                return Ok(ExitCode::SUCCESS);
            }
            for note in notes {
                let at = note.at.to_zoned(TimeZone::UTC).strftime("%Y-%m-%d %H:%M UTC").to_string();
                let kind = match note.kind {
                    NoteKind::Note => String::new(),
                    kind => format!(" ({})", kind.as_str()),
                };
                print(&format!("{at}  {}{kind}: {}\n", note.who(), note.text()))?;
            }
            return Ok(ExitCode::SUCCESS);
        };
        let by = self.by.or_else(|| std::env::var("USER").ok()).ok_or_else(|| {
            miette!(help = "give --by NAME", "it is not known who notes this: USER is not set")
        })?;
        let note = Note::new(Timestamp::now(), &by, &text).into_diagnostic()?;
        let note = note.of_kind(self.kind.into());
        note.add_to(&self.record).into_diagnostic()?;
        say(format!("noted about {}", self.record.display()));
        Ok(ExitCode::SUCCESS)
    }
}
