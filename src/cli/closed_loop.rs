//! A scan whose plan leaves the choice of readings to the rig: a closed loop or an adaptive map.

use std::path::Path;
use std::process::ExitCode;

use clap::Args;
use miette::{IntoDiagnostic, miette};

use super::output::{print, print_json};
use crate::rig_file::simulated_devices;
use fieldgap_acquisition::{
    AcquisitionError, ChooseRounds, NoNextRound, PlannedScan, RigSetup, ScanRun, original_rig,
};
use fieldgap_adaptive_map::{MapRound, Mapping};
use fieldgap_closed_loop::{Inquiry, LoggedRound, Round, in_closed_loop, read_log, read_rounds};
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

/// Rounds that are ready to begin.
pub(super) enum Opening {
    /// Of a closed loop.
    Loop { inquiry: Box<Inquiry>, first: Box<Round> },
    /// Of an adaptive map.
    Map { mapping: Box<Mapping>, first: Box<MapRound> },
}

impl LoopArgs {
    /// The scan of the first round, with the loop that goes on from there, if the rig chooses its readings; otherwise the scan as it is.
    pub(super) fn opened(
        &self,
        scan: PlannedScan,
        folder: &Path,
    ) -> miette::Result<(PlannedScan, Option<Opening>)> {
        if scan.plan().adaptive.is_some() {
            if self.until_explained || self.minutes.is_some() {
                return Err(miette!(
                    help =
                        "leave --until-explained and --minutes out; [adaptive] has a key `minutes`",
                    "the plan is that of an adaptive map, which seeks no cause"
                ));
            }
            let mapping = Mapping::new(scan.plan(), scan.rig_setup(), folder).into_diagnostic()?;
            let (plan, first) =
                mapping.first_plan(scan.plan(), scan.rig_setup()).into_diagnostic()?;
            let opening = Opening::Map { mapping: Box::new(mapping), first: Box::new(first) };
            return Ok((planned(&plan, &scan)?, Some(opening)));
        }
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
        let opening = Opening::Loop { inquiry: Box::new(inquiry), first: Box::new(first) };
        Ok((planned(&plan, &scan)?, Some(opening)))
    }
}

/// A plan with the rig of a scan.
fn planned(plan: &Plan, scan: &PlannedScan) -> miette::Result<PlannedScan> {
    let plan = TomlSource::new(plan.path(), plan.text());
    Ok(PlannedScan::parse(plan, scan.rig_setup().source().clone())?)
}

impl Opening {
    /// Readings at most of its plan.
    pub(super) fn most_readings(&self, plan: &Plan) -> Option<usize> {
        match self {
            Self::Loop { .. } => plan.closed_loop.as_ref().map(|settings| settings.most_readings),
            Self::Map { .. } => plan.adaptive.as_ref().map(|settings| settings.most_readings),
        }
    }

    /// Whether its record is to be diagnosed.
    pub(super) fn seeks_a_cause(&self) -> bool {
        matches!(self, Self::Loop { .. })
    }

    /// Logs the first round, and gives what chooses the next.
    fn begun(self) -> Result<Box<dyn ChooseRounds>, NoNextRound> {
        match self {
            Self::Loop { inquiry, first } => {
                inquiry.begin(*first)?;
                Ok(inquiry)
            }
            Self::Map { mapping, first } => {
                mapping.begin(*first)?;
                Ok(mapping)
            }
        }
    }
}

/// Begins a scan in a folder, and its loop if it has one.
pub(super) async fn begun(
    scan: PlannedScan,
    folder: &Path,
    opening: Option<Opening>,
) -> Result<ScanRun, AcquisitionError> {
    let mut scan_run = ScanRun::begin(scan, folder, simulated_devices).await?;
    if let Some(opening) = opening {
        scan_run.in_rounds(opening.begun().map_err(AcquisitionError::NoNextRound)?);
    }
    Ok(scan_run)
}

/// Resumes a scan, and its loop if it has one.
pub(super) async fn resumed(folder: &Path) -> Result<ScanRun, AcquisitionError> {
    let mut scan_run = ScanRun::resume(folder, simulated_devices).await?;
    let (plan, rig_setup) = (scan_run.scan().plan(), scan_run.scan().rig_setup());
    let no_next_round = |error: NoNextRound| AcquisitionError::NoNextRound(error);
    let choose: Option<Box<dyn ChooseRounds>> = if plan.closed_loop.is_some() {
        let inquiry = Inquiry::new(plan, rig_setup, folder);
        Some(Box::new(inquiry.map_err(|error| no_next_round(error.into()))?))
    } else if plan.adaptive.is_some() {
        let mapping = Mapping::new(plan, rig_setup, folder);
        Some(Box::new(mapping.map_err(|error| no_next_round(error.into()))?))
    } else {
        None
    };
    if let Some(choose) = choose {
        scan_run.in_rounds(choose);
    }
    Ok(scan_run)
}

/// Makes every decision of recorded rounds again, and prints which are the same.
pub(super) fn replay_rounds(folder: &Path, as_json: bool) -> miette::Result<ExitCode> {
    let record = RecordedScan::open(folder)?;
    let plan = Plan::read(&folder.join("plan.toml"))?;
    let rig = original_rig(folder).unwrap_or_else(|| folder.join("rig.toml"));
    let rig_setup = RigSetup::read(&rig)?;
    if plan.adaptive.is_some() {
        let mapping = Mapping::new(&plan, &rig_setup, folder).into_diagnostic()?;
        let rounds: Vec<MapRound> = read_log(folder).into_diagnostic()?;
        let again = mapping.again(&plan, &record, &rounds).into_diagnostic()?;
        return compared(&rounds, &again, |round| &round.reason, as_json);
    }
    let inquiry = Inquiry::new(&plan, &rig_setup, folder).into_diagnostic()?;
    let rounds = read_rounds(folder).into_diagnostic()?;
    let again = inquiry.again(&plan, &record, &rounds).into_diagnostic()?;
    compared(&rounds, &again, |round| &round.reason, as_json)
}

/// Prints which decisions are the same as those that were logged.
fn compared<R: LoggedRound + PartialEq>(
    rounds: &[R],
    again: &[R],
    reason: impl Fn(&R) -> &str,
    as_json: bool,
) -> miette::Result<ExitCode> {
    let same = again.iter().zip(rounds).all(|(again, logged)| again == logged);
    if as_json {
        print_json(&again)?;
    } else {
        let lines = again.iter().zip(rounds).map(|(again, logged)| match again == logged {
            true => format!("round {}: the same. {}", logged.number(), reason(logged)),
            false => format!(
                "round {}: another. Then: {} Now: {}",
                logged.number(),
                reason(logged),
                reason(again)
            ),
        });
        print(&(lines.collect::<Vec<_>>().join("\n") + "\n"))?;
    }
    Ok(if same { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
