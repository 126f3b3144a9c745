//! One scan from its first move to its safe end, and the return to one that ended early.

mod attended;

use std::future::Future;
use std::path::{Path, PathBuf};

use jiff::Timestamp;
use serde::{Deserialize, Serialize};

use super::CampaignError;
use super::attendant::Attendant;
use super::clock::{ScanClock, begins, goes_on_at_s};
use super::conductor::{Conductor, Measurement, distance_mm};
use super::drift::Drift;
use super::dry_run::{DryRun, dry_run, room_for};
use super::event::{Event, Watch};
use super::lab::Lab;
use super::open::OpenRig;
use super::pause::Pause;
use super::plan_on_rig::Campaign;
use super::references::{compare, reference_rows};
use crate::input::{TomlSource, toml_file};
use crate::rig::ReceiverIdentity;
use crate::scan::{Columns, EventKind, Journal, Sample, ScanSetup, ScanState, Visit};

/// The plan and the rig file as they were when the scan was begun, kept beside it.
const PLAN_COPY: &str = "plan.toml";
const RIG_COPY: &str = "rig.toml";
/// Where the two were read from: what they name is looked for from there.
const ORIGIN: &str = "origin.toml";

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Origin {
    plan: PathBuf,
    rig: PathBuf,
}

/// A scan that is about to run.
pub struct Session {
    campaign: Campaign,
    open: OpenRig,
    journal: Journal,
    setup: ScanSetup,
    kept: Vec<Sample>,
    check: DryRun,
    pause: Pause,
}

/// How a scan ended; its record is on disk either way, and the rig is safe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// Every point of the plan is there.
    Complete,
    /// It ended before its plan; `resume` goes on with it.
    Partial {
        /// Why.
        reason: String,
    },
}

impl Session {
    /// Begins a new scan in `folder`: holds the plan against the rig and the disk, opens the rig, and lays out the
    /// record. Nothing moves yet.
    ///
    /// # Errors
    /// [`CampaignError`] if the plan cannot be done, the rig cannot be opened, or the folder holds a scan already or
    /// cannot be written.
    pub async fn begin(campaign: Campaign, folder: &Path) -> Result<Self, CampaignError> {
        let check = dry_run(&campaign.plan, &campaign.lab, &campaign.visits)?;
        room_for(check.bytes, folder)?;
        let mut open = OpenRig::open(&campaign.lab).await?;
        let (plan, lab) = (&campaign.plan, &campaign.lab);
        let setup = ScanSetup {
            name: plan.name.clone(),
            recorded: begins(lab.virtual_rig.is_some()),
            unit: open.rig().receiver().identity().unit.clone(),
            array: lab.array.clone(),
            medium: lab.medium,
            simulator: plan.simulator,
            foci: plan.foci.clone(),
        };
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let origin = Origin { plan: absolute(plan.path()), rig: absolute(lab.source().path()) };
        let origin = toml::to_string(&origin).expect("two paths are TOML");
        let copies = [
            (PLAN_COPY, plan.text().as_bytes()),
            (RIG_COPY, lab.source().text().as_bytes()),
            (ORIGIN, origin.as_bytes()),
        ];
        let columns = Columns::WithSpread;
        let journal = Journal::create(folder, &setup, columns, &copies, Timestamp::now())?;
        Ok(Self { campaign, open, journal, setup, kept: Vec::new(), check, pause: Pause::never() })
    }

    /// Takes up a scan that ended early, with the plan and the rig file that it was begun with, and opens the rig.
    ///
    /// # Errors
    /// [`CampaignError`] if the folder holds no scan, or a complete one, or one that another process is at; if what is left
    /// of the plan cannot be done; or if the rig cannot be opened. What was measured stays as it is.
    pub async fn resume(folder: &Path) -> Result<Self, CampaignError> {
        let resumed = Journal::resume(folder, Timestamp::now())?;
        let kept = |name: &str, origin: &Path| {
            let copy = TomlSource::read(&folder.join(name))?;
            Ok::<_, CampaignError>(TomlSource::new(origin, copy.text()))
        };
        let opened = async {
            let origin: Origin = toml_file(&folder.join(ORIGIN))?;
            let campaign =
                Campaign::parse(kept(PLAN_COPY, &origin.plan)?, kept(RIG_COPY, &origin.rig)?)?;
            same_set_up(&campaign.lab, &resumed.setup)?;
            let way = way_of_resume(&campaign, &resumed.samples);
            let check = dry_run(&campaign.plan, &campaign.lab, &way)?;
            room_for(check.bytes, folder)?;
            let open = OpenRig::open(&campaign.lab).await?;
            Ok((campaign, open, check))
        };
        match opened.await {
            Ok((campaign, open, check)) => Ok(Self {
                campaign,
                open,
                journal: resumed.journal,
                setup: resumed.setup,
                kept: resumed.samples,
                check,
                pause: Pause::never(),
            }),
            Err(error) => {
                end(resumed.journal, Some(&CampaignError::to_string(&error)))?;
                Err(error)
            }
        }
    }

    /// Readings that the whole plan has.
    pub fn visits(&self) -> usize {
        self.campaign.visits.len()
    }

    /// Readings that are on disk already.
    pub fn done(&self) -> usize {
        self.journal.visits_done()
    }

    /// What was measured before, sample k of visit k of the plan.
    pub fn kept(&self) -> &[Sample] {
        &self.kept
    }

    /// The plan and the rig.
    pub fn campaign(&self) -> &Campaign {
        &self.campaign
    }

    /// What the receiver says of itself.
    pub fn receiver(&mut self) -> &ReceiverIdentity {
        self.open.rig().receiver().identity()
    }

    /// Somebody to stay with the scan.
    pub fn attendant(&self) -> Attendant {
        Attendant::new(&self.campaign, self.journal.folder(), self.check.slowest_s)
    }

    /// Lets `pause` say when the scan waits.
    pub fn paused_by(&mut self, pause: Pause) {
        self.pause = pause;
    }

    /// Runs the scan to its end. Each reading is on disk, and synced, before the next move.
    ///
    /// When `stop` resolves (with who asked), when a device fails or the disk refuses: the array is silenced, the robot
    /// stopped, the record closed as partial.
    ///
    /// # Errors
    /// [`CampaignError::Moved`] if, on resuming, the rig is not as it was; [`CampaignError::Journal`] if the end could not be
    /// kept. What was measured is on disk.
    pub async fn run(
        mut self,
        watch: Watch<'_>,
        stop: impl Future<Output = &'static str>,
    ) -> Result<Ending, CampaignError> {
        let stopped = tokio::select! {
            biased;
            who = stop => Err(Stopped::Asked(who)),
            ended = self.conduct(&mut *watch) => ended,
        };
        let reason = match &stopped {
            Ok(()) => self.open.rig().array().silence().await.err().map(|error| error.to_string()),
            Err(stopped) => Some(stopped.to_string()),
        };
        let reason = match reason {
            Some(reason) => Some(self.open.rig().make_safe(reason).await.to_string()),
            None => None,
        };
        let (rows, of) = (self.journal.visits_done(), self.campaign.visits.len());
        let ended = end(self.journal, reason.as_deref());
        let reason = match (reason, ended) {
            // A scan that failed has failed, also where the disk has no room left to say so.
            (Some(reason), Err(error)) => Some(format!("{reason}; {error}")),
            (reason, ended) => {
                ended?;
                reason
            }
        };
        watch(&Event::Ended { rows, of, reason: reason.clone() });
        match stopped {
            Err(Stopped::Failed(error @ CampaignError::Moved(_))) => Err(error),
            _ => Ok(reason.map_or(Ending::Complete, |reason| Ending::Partial { reason })),
        }
    }

    async fn conduct(&mut self, watch: Watch<'_>) -> Result<(), Stopped> {
        watch(&self.open.greeting());
        self.open.rig().array().continuous_wave().await?;
        self.open.rig().motion().home().await?;
        self.journal.record(Timestamp::now(), EventKind::Homed, "")?;
        watch(&Event::Homed);
        let clock = match self.kept.last() {
            None => ScanClock::from_start(),
            Some(last) => ScanClock::from(goes_on_at_s(
                self.setup.recorded,
                last.time_s,
                self.campaign.lab.virtual_rig.is_some(),
            )),
        };
        let mut conductor = Conductor::new(&self.campaign.lab, &self.campaign.plan.foci, clock);
        self.check_references(&mut conductor, &mut *watch).await?;
        let (plan, visits) = (&self.campaign.plan, &self.campaign.visits);
        let mut drift = Drift::of(plan, visits, self.check.about_s, &self.kept);
        let mut last = self.kept.last().copied();
        for row in self.journal.visits_done()..self.campaign.visits.len() {
            let visit = self.campaign.visits[row];
            self.revisit(&mut conductor, drift.as_mut(), last.as_ref(), &visit, &mut *watch)
                .await?;
            let Measurement { sample, clipped, lost } =
                self.measure(&mut conductor, &visit, &mut *watch).await?;
            last = Some(sample);
            if clipped || lost > 0 {
                // Kept before the row: a row without a word about it is a good one, whenever the process dies.
                let text = spoilt(row, clipped, lost);
                self.journal.record(Timestamp::now(), EventKind::DeviceFault, &text)?;
                watch(&Event::Spoilt { row, text });
            }
            self.journal.append(&sample)?;
            if let Some(drifted) = drift.as_mut().and_then(|drift| drift.measured(&visit, &sample))
            {
                self.tell_drift(drifted, &mut *watch)?;
            }
            watch(&Event::Measured {
                row,
                of: self.campaign.visits.len(),
                focus: sample.focus.map_or(-1, |focus| focus as i64),
                at_mm: sample.position_mm.into(),
                reading: sample.reading,
                clipped,
            });
        }
        Ok(())
    }

    /// Measures kept points again, and refuses to go on where the rig is not as it was.
    async fn check_references(
        &mut self,
        conductor: &mut Conductor,
        watch: Watch<'_>,
    ) -> Result<(), Stopped> {
        for row in reference_rows(&self.kept, &self.campaign.visits) {
            let kept = &self.kept[row];
            let now = conductor.measure(self.open.rig(), &self.campaign.visits[row]).await?.sample;
            watch(&Event::ReferenceChecked {
                row,
                kept: kept.reading,
                now: now.reading,
                moved_mm: distance_mm(kept.position_m(), now.position_m()),
            });
            let verdict = compare(row, kept, &now);
            let text = match &verdict {
                Ok(()) => format!("row {row}: {} where {} was kept", now.reading, kept.reading),
                Err(moved) => moved.to_string(),
            };
            self.journal.record(Timestamp::now(), EventKind::ReferenceChecked, &text)?;
            verdict.map_err(CampaignError::from)?;
        }
        Ok(())
    }
}

fn end(journal: Journal, reason: Option<&str>) -> Result<(), CampaignError> {
    let state = match reason {
        None => ScanState::Complete,
        Some(reason) => ScanState::Partial { reason: reason.to_owned() },
    };
    Ok(journal.end(Timestamp::now(), &state)?)
}

/// The visits of a resumed scan: those that are made again, then those that are left.
fn way_of_resume(campaign: &Campaign, kept: &[Sample]) -> Vec<Visit> {
    let again = reference_rows(kept, &campaign.visits);
    let again = again.into_iter().map(|row| campaign.visits[row]);
    again.chain(campaign.visits[kept.len()..].iter().copied()).collect()
}

/// Makes sure that files which the rig file names have not been changed since the scan was begun.
fn same_set_up(lab: &Lab, setup: &ScanSetup) -> Result<(), CampaignError> {
    // Positions are written in millimetres, so the last bits may differ.
    const SAME_M: f64 = 1e-9;
    let (now, then) = (lab.believed_array().elements(), setup.array.array().elements());
    let same = now.len() == then.len()
        && now.iter().zip(then).all(|(now, then)| (now.centre_m - then.centre_m).norm() < SAME_M);
    if same { Ok(()) } else { Err(CampaignError::OtherSetUp) }
}

/// What is not as it should be with the readings behind a row.
fn spoilt(row: usize, clipped: bool, lost: u32) -> String {
    let clipped = if clipped { ", the converter was at its limit" } else { "" };
    let lost =
        if lost > 0 { format!(", {lost} samples were lost on their way") } else { String::new() };
    format!("row {row}{clipped}{lost}")
}

/// Why a running scan stopped.
#[derive(Debug, thiserror::Error)]
enum Stopped {
    #[error("{0}")]
    Asked(&'static str),
    #[error("{0}")]
    Failed(CampaignError),
}

impl<E: Into<CampaignError>> From<E> for Stopped {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}
