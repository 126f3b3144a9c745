//! `fieldgap distinguish`: which effects a scan can tell apart, whatever its readings say.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::IntoDiagnostic;

use super::output::{print, print_json};
use fieldgap_acoustics::Simulator;
use fieldgap_diagnosis::{AlikeEffects, alike_effects};
use fieldgap_records::RecordedScan;

/// The `distinguish` command.
#[derive(Debug, Args)]
pub(super) struct Distinguish {
    /// The folder of the recorded scan: its places, foci and noise are what counts, not its readings
    folder: PathBuf,
    /// The simulator that the effects change (see `simulate --help`); without it the scan's own
    #[arg(long, value_name = "NAME")]
    simulator: Option<Simulator>,
    /// Pairs of which so much of the signature is left over, or less, are shown: 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.2)]
    below: f64,
    /// Print the pairs as JSON
    #[arg(long)]
    json: bool,
}

impl Distinguish {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let scan = RecordedScan::open(&self.folder)?;
        let mut alike = alike_effects(&scan, self.simulator).into_diagnostic()?;
        alike.retain(|pair| pair.left_over <= self.below);
        match self.json {
            true => print_json(&alike)?,
            false => print(&table(&alike))?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn table(alike: &[AlikeEffects]) -> String {
    let mut text =
        format!("{:22} {:22} {:>9}  {:>9}\n", "effect", "taken for", "left over", "told from");
    for AlikeEffects { effect, imitator, left_over, told_from_sigma } in alike {
        let left_over = format!("{left_over:.3}");
        let sigma = format!("{told_from_sigma:.2} sigma");
        let _ = writeln!(text, "{effect:22} {imitator:22} {left_over:>9}  {sigma:>10}");
    }
    text + "\nLeft over is the share of an effect's squared signature that the other cannot make, gain and a small shift taken out.\n\
            Told from is the gap, rms over all readings in their noise, from which three standard deviations part the two.\n"
}
