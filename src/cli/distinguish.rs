//! `fieldgap distinguish`: which effects a scan can separate, whatever its readings.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::IntoDiagnostic;

use super::output::{print, print_json};
use fieldgap_acoustics::Simulator;
use fieldgap_diagnosis::{AlikeEffects, alike_effects, alike_effects_by_amplitudes};
use fieldgap_records::RecordedScan;

/// The `distinguish` command.
#[derive(Debug, Args)]
pub(super) struct Distinguish {
    /// Folder of the recorded scan; its places, foci and noise count, not its readings
    folder: PathBuf,
    /// The simulator that the effects change (see `simulate --help`); without it the scan's own
    #[arg(long, value_name = "NAME")]
    simulator: Option<Simulator>,
    /// Show pairs whose residual share is at most this: 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = 0.2)]
    below: f64,
    /// Leave out the phases of readings that have one
    #[arg(long)]
    amplitude_only: bool,
    /// Print the pairs as JSON
    #[arg(long)]
    json: bool,
}

impl Distinguish {
    pub(super) fn run(self) -> miette::Result<ExitCode> {
        let scan = RecordedScan::open(&self.folder)?;
        let pairs = match self.amplitude_only {
            true => alike_effects_by_amplitudes(&scan, self.simulator),
            false => alike_effects(&scan, self.simulator),
        };
        let mut alike = pairs.into_diagnostic()?;
        alike.retain(|pair| pair.residual_share <= self.below);
        match self.json {
            true => print_json(&alike)?,
            false => print(&table(&alike))?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn table(alike: &[AlikeEffects]) -> String {
    let mut text =
        format!("{:22} {:22} {:>9}  {:>9}\n", "effect", "mistaken for", "residual", "separable");
    for AlikeEffects { effect, imitator, residual_share, separable_gap_sigma } in alike {
        let residual_share = format!("{residual_share:.3}");
        let sigma = format!("{separable_gap_sigma:.2} sigma");
        let _ = writeln!(text, "{effect:22} {imitator:22} {residual_share:>9}  {sigma:>10}");
    }
    text + "\nResidual: share of an effect's squared signature that the other cannot reproduce, gain and a small shift removed.\n\
            Separable: gap, rms over all readings in units of their noise, from which on the two differ by three standard deviations.\n"
}
