//! A plan together with the rig set-up that it is for.

use std::path::{Path, PathBuf};

use super::AcquisitionError;
use super::dry_run::{DryRun, dry_run};
use super::origin::{self, Origin, PLAN_COPY, RIG_COPY};
use super::recorded_setup::same_record;
use super::rig_setup::RigSetup;
use fieldgap_exposure::Exposure;
use fieldgap_input::{Fault, TomlSource, toml_file};
use fieldgap_records::{Hooks, Journal, Plan, PlanPart, Visit, without_ways_out};

/// The rig file of a plan: the given one, or else the one that the plan names.
///
/// # Errors
/// A [`Fault`] where the plan names none, or one that is not there.
pub fn rig_of(plan: &Plan, given: Option<&Path>) -> Result<PathBuf, Fault> {
    match (given, &plan.rig) {
        (Some(given), _) => Ok(given.to_owned()),
        (None, Some(named)) if named.is_file() => Ok(named.clone()),
        (None, Some(named)) => Err(plan.fault(
            PlanPart::Rig,
            format!("there is no rig file {}", named.display()),
            "correct `rig` in the plan (it is relative to the plan's folder), or give the file with --rig",
        )),
        (None, None) => Err(Fault::of_file(
            plan.path(),
            "the plan names no rig file",
            "add `rig = \"…\"` to the plan, or give the rig file with --rig",
        )),
    }
}

/// A plan and the rig set-up that will run it.
#[derive(Debug, Clone)]
pub struct PlannedScan {
    pub(super) plan: Plan,
    pub(super) rig_setup: RigSetup,
    pub(super) visits: Vec<Visit>,
}

impl PlannedScan {
    /// Reads a plan and a rig file: the given one, or else the one that the plan names.
    ///
    /// # Errors
    /// A [`Fault`] at the line of either file that is wrong.
    pub fn read(plan: &Path, rig: Option<&Path>) -> Result<Self, AcquisitionError> {
        let plan = Plan::read(plan)?;
        let rig_setup = RigSetup::read(&rig_of(&plan, rig)?)?;
        Ok(Self::new(plan, rig_setup)?)
    }

    /// Reads the plan and the rig file of a recorded scan that is not complete, as `resume` will use them. Nothing is opened or
    /// written.
    ///
    /// # Errors
    /// The folder holds no scan or a complete one; its files are wrong or contradict each other; or the rig file or the virtual
    /// rig's truth has changed.
    pub fn of_record(folder: &Path) -> Result<Self, AcquisitionError> {
        Journal::resumable(folder)?;
        without_ways_out(folder)?;
        let origin: Origin = toml_file(&folder.join(origin::FILE))?;
        let copy = |name: &str| TomlSource::read(&folder.join(name));
        let rig = origin.rig(&copy(RIG_COPY)?)?;
        let scan = Self::parse(origin.plan(&copy(PLAN_COPY)?), rig)?;
        origin.same_truth(&scan.rig_setup)?;
        same_record(&scan.plan, &scan.rig_setup, folder)?;
        Ok(scan)
    }

    /// Reads the texts of a plan and a rig file.
    ///
    /// # Errors
    /// As [`PlannedScan::read`].
    pub fn parse(plan: TomlSource, rig: TomlSource) -> Result<Self, AcquisitionError> {
        Ok(Self::new(Plan::parse(plan)?, RigSetup::parse(rig)?)?)
    }

    /// # Errors
    /// A [`Fault`] at the part of the plan that does not go together with the rig set-up.
    pub(super) fn new(plan: Plan, mut rig_setup: RigSetup) -> Result<Self, Fault> {
        if let Some(people) = &plan.people {
            let joined = match &rig_setup.exposure {
                Some(exposure) => Some(exposure.with(people)),
                None => Exposure::of(people.clone()),
            };
            let nobody = || {
                plan.fault(
                    PlanPart::Exposure,
                    "neither the plan nor its rig file states a place where people are",
                    "add [[exposure.place]] with `name`, `at_mm` and `within_mm`",
                )
            };
            rig_setup.exposure = Some(joined.ok_or_else(nobody)?);
        }
        let visits = plan.visits();
        Ok(Self { plan, rig_setup, visits })
    }

    /// Name of the scan.
    pub fn name(&self) -> &str {
        &self.plan.name
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The rig set-up, with the people and limits of the plan.
    pub fn rig_setup(&self) -> &RigSetup {
        &self.rig_setup
    }

    /// The readings to take, in order.
    pub fn visits(&self) -> &[Visit] {
        &self.visits
    }

    /// The programs that run at events of the scan: those of the plan, and of the rig file where the plan names none.
    pub fn hooks(&self) -> Hooks {
        let beside = |path: &Path| path.parent().unwrap_or(Path::new("")).to_owned();
        let of_rig = self.rig_setup.hooks.beside(&beside(self.rig_setup.source().path()));
        self.plan.hooks.beside(&beside(self.plan.path())).or(&of_rig)
    }

    /// Checks the plan against the rig set-up. No device is opened.
    ///
    /// # Errors
    /// A [`Fault`] at the part of the plan that the robot cannot carry out.
    pub fn dry_run(&self) -> Result<DryRun, AcquisitionError> {
        Ok(dry_run(&self.plan, &self.rig_setup, &self.visits, &[])?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLAN: &str = "name = \"p\"\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0\ny_mm = 0\nz_mm = 100\n\
                        [[points]]\nat_mm = [[0, 0, 100]]\n";

    fn scan(rig: &str, more: &str) -> Result<PlannedScan, AcquisitionError> {
        let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs").join(rig);
        let plan = TomlSource::new(Path::new("plan.toml"), format!("{PLAN}{more}"));
        PlannedScan::parse(plan, TomlSource::read(&rig)?)
    }

    #[test]
    fn people_of_a_plan_join_those_of_its_rig() {
        let visitor =
            "[[exposure.place]]\nname = \"visitor\"\nat_mm = [0, -900, 1200]\nwithin_mm = 50\n";
        let limit = "[[exposure.limit]]\nknown = \"howard-2004\"\nminutes_a_day = 30\n";
        let joined = scan("levels.toml", &format!("{visitor}{limit}")).expect("good");
        let exposure = joined.rig_setup().exposure.as_ref().expect("there");
        let names: Vec<&str> =
            exposure.people.places.iter().map(|place| place.name.as_str()).collect();
        assert_eq!(names, ["operator's head", "visitor"]);
        assert_eq!(exposure.people.limits.len(), 1);
        assert_eq!(exposure.minutes_a_day().map(|(minutes, _)| minutes), Some(30.0));
        assert!(exposure.source.is_some(), "the level of the elements is that of the rig");

        // A rig file without the section.
        let alone = scan("virtual.toml", visitor).expect("good");
        let exposure = alone.rig_setup().exposure.as_ref().expect("there");
        assert!(exposure.source.is_none() && exposure.people.limits.is_empty());
        let Err(AcquisitionError::File(fault)) = scan("virtual.toml", limit) else {
            panic!("nobody is there")
        };
        assert_eq!(fault.line_column().map(|place| place.0), Some(10), "{fault}");
        assert!(fault.problem().contains("neither the plan nor its rig file"), "{fault}");
    }
}
