//! One scan from its first move to its safe end, and the return to one that ended early.

use std::any::Any;
use std::future::{Future, poll_fn};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::pin::pin;
use std::process::Command;
use std::task::Poll;
use std::time::Duration;

use jiff::Timestamp;
use tokio::time::{Instant, sleep};

use super::CampaignError;
use super::air_log::Polled;
use super::clock::{ScanClock, begins, goes_on_at_s};
use super::conductor::{Conductor, Measurement, distance_mm};
use super::dry_run::{dry_run, room_for};
use super::event::{Event, Watch};
use super::fly::{Flight, Flights};
use super::lab::Lab;
use super::open::OpenRig;
use super::origin::{self, Origin};
use super::plan_on_rig::Campaign;
use super::references::{Moved, compare, reference_rows};
use super::rows::{Leg, Line, legs};
use crate::input::{TomlSource, toml_file};
use crate::scan::{Columns, EventKind, Journal, JournalError, Sample, ScanSetup, ScanState, Visit};

/// The plan and the rig file as they were when the scan was begun, kept beside it.
const PLAN_COPY: &str = "plan.toml";
const RIG_COPY: &str = "rig.toml";

/// How often it is looked whether there is room again.
const LOOK_FOR_ROOM_EVERY: Duration = Duration::from_secs(1);

/// Where the watchdog writes what it did, where it had to.
const WATCHDOG_LOG: &str = "watchdog.log";

/// A scan that is about to run.
pub struct Session {
    campaign: Campaign,
    open: OpenRig,
    journal: Journal,
    setup: ScanSetup,
    kept: Vec<Sample>,
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
    pub async fn begin(mut campaign: Campaign, folder: &Path) -> Result<Self, CampaignError> {
        let check = dry_run(&campaign.plan, &campaign.lab, &campaign.visits)?;
        room_for(check.bytes, folder)?;
        let mut open = OpenRig::open(&campaign.lab).await?;
        if let Some((air, config)) = open.air().zip(campaign.lab.rig.environment.as_ref())
            && config.sound_speed
        {
            campaign.lab.medium = air.medium(config).await?;
        }
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
        let origin = Origin::of(plan, lab)?.to_toml();
        let copies = [
            (PLAN_COPY, plan.text().as_bytes()),
            (RIG_COPY, lab.source().text().as_bytes()),
            (origin::FILE, origin.as_bytes()),
        ];
        let columns = Columns::WithSpread;
        let journal = Journal::create(folder, &setup, columns, &copies, Timestamp::now())?;
        if let Some(air) = open.air() {
            air.write_to(folder)?;
        }
        Ok(Self { campaign, open, journal, setup, kept: Vec::new() })
    }

    /// Takes up a scan that ended early, with the plan and the rig file that it was begun with, and opens the rig. Ports may be
    /// others by now: they are taken from the rig file as it stands.
    ///
    /// # Errors
    /// [`CampaignError`] if the folder holds no scan, or a complete one, or one that another process is at; if what is left
    /// of the plan cannot be done; or if the rig cannot be opened. What was measured stays as it is.
    pub async fn resume(folder: &Path) -> Result<Self, CampaignError> {
        let resumed = Journal::resume(folder, Timestamp::now())?;
        let kept: Vec<Sample> = resumed.records.iter().map(|record| record.sample).collect();
        let copy = |name: &str| TomlSource::read(&folder.join(name));
        let opened = async {
            let origin: Origin = toml_file(&folder.join(origin::FILE))?;
            let mut campaign =
                Campaign::parse(origin.plan(&copy(PLAN_COPY)?), origin.rig(&copy(RIG_COPY)?)?)?;
            origin.same_truth(&campaign.lab)?;
            same_set_up(&campaign.lab, &resumed.setup)?;
            let way = way_of_resume(&campaign, &kept);
            let check = dry_run(&campaign.plan, &campaign.lab, &way)?;
            room_for(check.bytes, folder)?;
            // What was measured at its beginning, where the rig file asks for that: one scan, one medium.
            campaign.lab.medium = resumed.setup.medium;
            let mut open = OpenRig::open(&campaign.lab).await?;
            if let Some(air) = open.air() {
                air.write_to(folder)?;
            }
            Ok((campaign, open))
        };
        match opened.await {
            Ok((campaign, open)) => {
                Ok(Self { campaign, open, journal: resumed.journal, setup: resumed.setup, kept })
            }
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

    /// Has the rig guarded from now on by a process of its own, which writes `watchdog.log` beside the record should it have to
    /// act: see [`OpenRig::guard`].
    ///
    /// # Errors
    /// [`CampaignError::Watchdog`] if it does not start.
    pub fn guard(&mut self, program: Command) -> Result<(), CampaignError> {
        let log = self.journal.folder().join(WATCHDOG_LOG);
        self.open.guard(program, Some(&log))
    }

    /// Runs the scan to its end. Each reading is on disk, and synced, before the next move.
    ///
    /// Where the disk has no room left, the array is silenced and the scan waits until there is.
    ///
    /// When `stop` resolves (with who asked), when a device fails, the disk fails or this program itself panics: the array
    /// is silenced, the robot stopped, the record closed as partial.
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
            ended = unless_panicking(self.conduct(&mut *watch)) => ended.unwrap_or_else(Err),
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
        let ended = Event::Ended { rows, of, reason: reason.clone() };
        if matches!(stopped, Err(Stopped::Panicked(_))) {
            // Whoever watches may be the one who panics; the record is closed already.
            let _ = catch_unwind(AssertUnwindSafe(|| watch(&ended)));
        } else {
            watch(&ended);
        }
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
        let plan = &self.campaign.plan;
        let mut flights = plan.fly.map(|fly| Flights::new(Flight::new(&fly, &self.campaign.lab)));
        let legs = legs(&self.campaign.visits, self.journal.visits_done(), flights.is_some());
        if let Some(flights) = flights.as_mut().filter(|flights| flights.want_lag()) {
            self.find_lag(flights, &mut conductor, &legs, &mut *watch).await?;
        }
        for leg in legs {
            match (leg, &mut flights) {
                (Leg::Row(row), Some(flights)) => {
                    let visits = &self.campaign.visits[row.clone()];
                    let measured = flights.measure(&mut conductor, self.open.rig(), visits).await?;
                    for (row, measurement) in row.zip(measured) {
                        self.keep_point(row, &measurement, &mut conductor, &mut *watch).await?;
                    }
                }
                (Leg::Row(row), None) => unreachable!("{row:?} is only flown by a plan that flies"),
                (Leg::Stop(row), _) => {
                    let visit = &self.campaign.visits[row];
                    let measurement = conductor.measure(self.open.rig(), visit).await?;
                    self.keep_point(row, &measurement, &mut conductor, &mut *watch).await?;
                }
            }
        }
        if let Some(text) = flights.and_then(|flights| flights.evenness()) {
            self.journal.record(Timestamp::now(), EventKind::Flown, &text)?;
        }
        Ok(())
    }

    /// Keeps what the environment sensor says; one that fails ends no scan, and is told of.
    async fn watch_the_air(&mut self, time_s: f64) {
        let Some(air) = self.open.air() else { return };
        let text = match air.poll(time_s).await {
            Polled::Kept => return,
            Polled::Lost(reason) => reason,
            Polled::Back => "the environment sensor is back".to_owned(),
        };
        tracing::warn!("{text}");
        // Where the disk is full, the next reading tells of it.
        let _ = self.journal.record(Timestamp::now(), EventKind::DeviceFault, &text);
    }

    /// Finds how far the readings of flown rows lag behind, from the row that passes nearest to its focus.
    async fn find_lag(
        &mut self,
        flights: &mut Flights,
        conductor: &mut Conductor,
        legs: &[Leg],
        watch: Watch<'_>,
    ) -> Result<(), Stopped> {
        let visits = &self.campaign.visits;
        let rows = legs.iter().filter_map(|leg| match leg {
            Leg::Row(row) => Some(&visits[row.clone()]),
            Leg::Stop(_) => None,
        });
        let from_focus_m = |row: &[Visit]| {
            let focus = row[0].focus.map(|focus| self.campaign.plan.foci[focus].excitation());
            let focus_m = focus.and_then(|excitation| excitation.focus_m());
            Line::of(row).distance_m(focus_m.unwrap_or_default())
        };
        let nearest = rows.min_by(|a, b| from_focus_m(a).total_cmp(&from_focus_m(b)));
        let Some(row) = nearest else { return Ok(()) };
        let lag = flights.find_lag(conductor, self.open.rig(), row).await?;
        let (lag_ms, standard_error_ms) = (lag.lag_s * 1e3, lag.standard_error_s * 1e3);
        let text = format!("readings lag {lag_ms:.3} ± {standard_error_ms:.3} ms behind the robot");
        self.journal.record(Timestamp::now(), EventKind::Flown, &text)?;
        watch(&Event::LagFound { lag_ms, standard_error_ms });
        Ok(())
    }

    /// Keeps a measurement, and tells of it.
    async fn keep_point(
        &mut self,
        row: usize,
        measurement: &Measurement,
        conductor: &mut Conductor,
        watch: Watch<'_>,
    ) -> Result<(), Stopped> {
        let Measurement { sample, clipped, lost } = measurement;
        if *clipped || *lost > 0 {
            // Kept before the row: a row without a word about it is a good one, whenever the process dies.
            let text = spoilt(row, *clipped, *lost);
            let fault = |journal: &mut Journal| {
                journal.record(Timestamp::now(), EventKind::DeviceFault, &text)
            };
            self.keep(fault, conductor, &mut *watch).await?;
        }
        let commanded_m = self.campaign.visits[row].position_m;
        let point = |journal: &mut Journal| journal.append(sample, commanded_m);
        self.keep(point, conductor, &mut *watch).await?;
        watch(&Event::Measured {
            row,
            of: self.campaign.visits.len(),
            focus: sample.focus.map_or(-1, |focus| focus as i64),
            at_mm: sample.position_mm.into(),
            reading: sample.reading,
            clipped: *clipped,
        });
        self.watch_the_air(sample.time_s).await;
        Ok(())
    }

    /// Keeps something; where there is no room for it, silences the array and waits until there is.
    async fn keep(
        &mut self,
        mut keep: impl FnMut(&mut Journal) -> Result<(), JournalError>,
        conductor: &mut Conductor,
        watch: Watch<'_>,
    ) -> Result<(), Stopped> {
        match keep(&mut self.journal) {
            Err(error) if error.is_no_room() => {
                conductor.silence(self.open.rig()).await?;
                watch(&Event::Waiting { reason: error.to_string() });
            }
            kept => return Ok(kept?),
        }
        let since = Instant::now();
        loop {
            sleep(LOOK_FOR_ROOM_EVERY).await;
            match keep(&mut self.journal) {
                Err(error) if error.is_no_room() => {}
                kept => {
                    kept?;
                    break;
                }
            }
        }
        let waited_s = since.elapsed().as_secs_f64();
        let text = format!("there was no room on the disk for {waited_s:.0} s");
        watch(&Event::WentOn { waited_s });
        // Where this finds no room again, the next reading waits.
        match self.journal.record(Timestamp::now(), EventKind::Waited, &text) {
            Err(error) if !error.is_no_room() => Err(error.into()),
            _ => Ok(()),
        }
    }

    /// Measures kept points again, and refuses to go on where the rig is not as it was.
    async fn check_references(
        &mut self,
        conductor: &mut Conductor,
        watch: Watch<'_>,
    ) -> Result<(), Stopped> {
        let mut found = Vec::new();
        for row in reference_rows(&self.kept, &self.campaign.visits) {
            let kept = &self.kept[row];
            let now = conductor.measure(self.open.rig(), &self.campaign.visits[row]).await?.sample;
            watch(&Event::ReferenceChecked {
                row,
                kept: kept.reading,
                now: now.reading,
                moved_mm: distance_mm(kept.position_m(), now.position_m()),
            });
            let verdict = compare(row, kept, &now, self.campaign.plan.resume);
            let text = match &verdict {
                Ok(()) => format!("row {row}: {} where {} was kept", now.reading, kept.reading),
                Err(moved) => moved.to_string(),
            };
            self.journal.record(Timestamp::now(), EventKind::ReferenceChecked, &text)?;
            found.extend(verdict.err());
        }
        Ok(Moved::of(found).map_err(CampaignError::from)?)
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
    #[error("the program itself failed: {0}")]
    Panicked(String),
}

impl<E: Into<CampaignError>> From<E> for Stopped {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// Runs a future to its end, or to a panic within it, whose words are given.
async fn unless_panicking<T>(work: impl Future<Output = T>) -> Result<T, Stopped> {
    let mut work = pin!(work);
    poll_fn(|context| {
        let polled = catch_unwind(AssertUnwindSafe(|| work.as_mut().poll(context)));
        match polled {
            Ok(polled) => polled.map(Ok),
            Err(panic) => Poll::Ready(Err(Stopped::Panicked(words_of(&*panic)))),
        }
    })
    .await
}

fn words_of(panic: &(dyn Any + Send)) -> String {
    let literal = panic.downcast_ref::<&str>().map(|words| (*words).to_owned());
    literal.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
}
