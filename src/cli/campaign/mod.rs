//! `fieldgap campaign`: many scans against many simulations, by a schedule.

mod acknowledge;
mod laboratory;
mod news;
mod person;
mod programs;
mod report;
mod run;
mod status;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};

use self::acknowledge::Acknowledge;
use self::report::Report;
use self::run::{Resume, Run};
use self::status::Status;

/// The `campaign` command.
#[derive(Debug, Args)]
pub(super) struct CampaignCommand {
    #[command(subcommand)]
    step: Step,
}

#[derive(Debug, Subcommand)]
enum Step {
    /// Begin a campaign
    Run(Run),
    /// Show how far a campaign is, and its alarms
    Status(Status),
    /// Continue a campaign that was ended or killed
    Resume(Resume),
    /// Write the page of a campaign again and print a table of its cells
    Report(Report),
    /// Acknowledge alarms: control charts begin anew
    Acknowledge(Acknowledge),
    /// Answer the question that a campaign waits for
    Answer(Answer),
}

/// An answer to a question.
#[derive(Debug, Args)]
struct Answer {
    /// Folder of the campaign
    folder: PathBuf,
    /// The answer
    #[arg(value_enum)]
    answer: YesOrNo,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum YesOrNo {
    /// It is done
    Yes,
    /// It cannot be done; the cells that need it are left out
    No,
}

impl CampaignCommand {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        match self.step {
            Step::Run(run) => run.run(),
            Step::Status(status) => status.run(),
            Step::Resume(resume) => resume.run(),
            Step::Report(report) => report.run(),
            Step::Acknowledge(acknowledge) => acknowledge.run(),
            Step::Answer(Answer { folder, answer }) => {
                person::answer(&folder, answer == YesOrNo::Yes)?;
                Ok(ExitCode::SUCCESS)
            }
        }
    }
}
