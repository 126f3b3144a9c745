//! A plan together with the rig that it is for.

use std::path::Path;

use super::AcquisitionError;
use super::dry_run::{DryRun, dry_run};
use super::rig_setup::RigSetup;
use fieldgap_input::{Fault, TomlSource};
use fieldgap_records::{Plan, PlanPart, Visit};

/// A plan and the rig that will scan it.
#[derive(Debug, Clone)]
pub struct PlannedScan {
    pub(super) plan: Plan,
    pub(super) rig_setup: RigSetup,
    pub(super) visits: Vec<Visit>,
}

impl PlannedScan {
    /// Reads a plan, and the rig file: the one given, else the one that the plan names.
    ///
    /// # Errors
    /// A [`Fault`] at the line of either file that does not fit.
    pub fn read(plan: &Path, rig: Option<&Path>) -> Result<Self, AcquisitionError> {
        let plan = Plan::read(plan)?;
        let rig_setup = match (rig, &plan.rig) {
            (Some(given), _) => RigSetup::read(given)?,
            (None, Some(named)) if named.is_file() => RigSetup::read(named)?,
            (None, Some(named)) => {
                return Err(plan
                    .fault(
                        PlanPart::Rig,
                        format!("there is no rig file {}", named.display()),
                        "correct the name (it is looked for from the plan's folder), or give the file with --rig",
                    )
                    .into());
            }
            (None, None) => {
                return Err(Fault::of_file(
                    plan.path(),
                    "names no rig",
                    "add `rig = \"…\"`, or give the rig file with --rig",
                )
                .into());
            }
        };
        Ok(Self::new(plan, rig_setup))
    }

    /// Reads a plan and a rig file from texts that were kept, as if they still stood where they were read from.
    pub(super) fn parse(plan: TomlSource, rig: TomlSource) -> Result<Self, AcquisitionError> {
        Ok(Self::new(Plan::parse(plan)?, RigSetup::parse(rig)?))
    }

    fn new(plan: Plan, rig_setup: RigSetup) -> Self {
        let visits = plan.visits();
        Self { plan, rig_setup, visits }
    }

    /// What the scan will be called.
    pub fn name(&self) -> &str {
        &self.plan.name
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The rig.
    pub fn rig_setup(&self) -> &RigSetup {
        &self.rig_setup
    }

    /// The readings to be taken, in their order.
    pub fn visits(&self) -> &[Visit] {
        &self.visits
    }

    /// Holds the plan against the rig; nothing moves.
    ///
    /// # Errors
    /// A [`Fault`] at the part of the plan that the robot cannot do.
    pub fn dry_run(&self) -> Result<DryRun, AcquisitionError> {
        Ok(dry_run(&self.plan, &self.rig_setup, &self.visits)?)
    }
}
