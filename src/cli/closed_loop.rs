//! A scan whose plan leaves the choice of readings to the rig.

use std::path::Path;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::output::{print, print_json};
use crate::rig_file::simulated_devices;
use fieldgap_acquisition::{AcquisitionError, PlannedScan, RigSetup, ScanRun, original_rig};
use fieldgap_closed_loop::{Inquiry, Round, in_closed_loop, read_rounds};
use fieldgap_input::{Time, TomlSource};
use fieldgap_records::{Plan, RecordedScan};

/// Whether and how long a rig chooses its own readings.
#[derive(Debug, Default, Args)]
pub(super) struct LoopArgs {
    /// Let the rig choose its readings, in rounds, until the cause of the gap is known; the regions of the plan only bound where it
    /// measures. A plan with [closed_loop] does so in any case
    #[arg(long)]
    until_explained: bool,
    /// End the choosing after so many minutes on the rig's clock [default: as in the plan]
    #[arg(long, value_name = "MINUTES")]
    minutes: Option<f64>,
}

/// A closed loop that is ready to begin.
pub(super) struct Opening {
    inquiry: Inquiry,
    first: Round,
}

impl LoopArgs {
    /// The scan of the first round, with the loop that goes on from there, if the rig chooses its readings; otherwise the scan as it is.
    pub(super) fn opened(
        &self,
        scan: PlannedScan,
        folder: &Path,
    ) -> miette::Result<(PlannedScan, Option<Opening>)> {
        if !self.until_explained && scan.plan().closed_loop.is_none() {
            if self.minutes.is_some() {
                return Err(miette!(
                    help = "add --until-explained, or [closed_loop] to the plan",
                    "--minutes is for a rig that chooses its readings; this plan gives them"
                ));
            }
            return Ok((scan, None));
        }
        let minutes = self.minutes.map(Time::new).transpose().into_diagnostic()?;
        let plan = in_closed_loop(scan.plan(), minutes.map(Time::get))?;
        let inquiry = Inquiry::new(&plan, scan.rig_setup(), folder).into_diagnostic()?;
        let (plan, first) = inquiry.first_plan(&plan, scan.rig_setup()).into_diagnostic()?;
        let plan = TomlSource::new(plan.path(), plan.text());
        let scan = PlannedScan::parse(plan, scan.rig_setup().source().clone())?;
        Ok((scan, Some(Opening { inquiry, first })))
    }
}

/// Begins a scan in a folder, and its loop if it has one.
pub(super) async fn begun(
    scan: PlannedScan,
    folder: &Path,
    opening: Option<Opening>,
) -> Result<ScanRun, AcquisitionError> {
    let mut scan_run = ScanRun::begin(scan, folder, simulated_devices).await?;
    if let Some(Opening { inquiry, first }) = opening {
        inquiry.begin(first).map_err(|error| AcquisitionError::NoNextRound(error.into()))?;
        scan_run.in_rounds(Box::new(inquiry));
    }
    Ok(scan_run)
}

/// Resumes a scan, and its loop if it has one.
pub(super) async fn resumed(folder: &Path) -> Result<ScanRun, AcquisitionError> {
    let mut scan_run = ScanRun::resume(folder, simulated_devices).await?;
    let scan = scan_run.scan();
    if scan.plan().closed_loop.is_some() {
        let inquiry = Inquiry::new(scan.plan(), scan.rig_setup(), folder)
            .map_err(|error| AcquisitionError::NoNextRound(error.into()))?;
        scan_run.in_rounds(Box::new(inquiry));
    }
    Ok(scan_run)
}

/// Makes every decision of a recorded loop again, and prints which are the same.
pub(super) fn replay_rounds(folder: &Path, as_json: bool) -> miette::Result<ExitCode> {
    let record = RecordedScan::open(folder)?;
    let plan = Plan::read(&folder.join("plan.toml"))?;
    let rig = original_rig(folder).unwrap_or_else(|| folder.join("rig.toml"));
    let inquiry = Inquiry::new(&plan, &RigSetup::read(&rig)?, folder).into_diagnostic()?;
    let rounds = read_rounds(folder).into_diagnostic()?;
    let again = inquiry.again(&plan, &record, &rounds).into_diagnostic()?;
    let same = again.iter().zip(&rounds).all(|(again, logged)| again == logged);
    if as_json {
        print_json(&again)?;
    } else {
        let lines = again.iter().zip(&rounds).map(|(again, logged)| match again == logged {
            true => format!("round {}: the same. {}", logged.round, logged.reason),
            false => format!(
                "round {}: another. Then: {} Now: {}",
                logged.round, logged.reason, again.reason
            ),
        });
        print(&(lines.collect::<Vec<_>>().join("\n") + "\n"))?;
    }
    Ok(if same { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
