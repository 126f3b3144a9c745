//! One scan from its first move to its safe end, and the resumption of one that ended early.

mod pausing;
mod recording;
mod rounds;
mod sequence;
mod unguarded;
mod waking;

use std::any::Any;
use std::future::{Future, poll_fn};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::pin::pin;
use std::process::Command;
use std::sync::Arc;
use std::task::Poll;

use jiff::Timestamp;

use super::AcquisitionError;
use super::clock::begins;
use super::dry_run::{DryRun, dry_run, room_for};
use super::event::{Event, EventSink};
use super::monitor::Monitor;
use super::open::{OpenRig, OpenSimulated};
use super::origin::{self, Origin, PLAN_COPY, RIG_COPY};
use super::pause::Pause;
use super::planned_scan::PlannedScan;
use super::recorded_setup::{known_unit, phase_of, same_unit, setup_of};
use super::rig_setup::RigSetup;
use super::suspension::{SuspensionClock, Suspensions};
use super::watchdog::Notice;
use fieldgap_records::{
    Columns, Hooks, Journal, JournalError, RecordedSample, ScanSetup, ScanState,
};
use fieldgap_rig::ReceiverIdentity;

pub use self::rounds::{ChooseRounds, NextRound, NoNextRound};

/// Log of the watchdog; it exists only if the watchdog had to act.
const WATCHDOG_LOG: &str = "watchdog.log";

/// A scan that is ready to run.
pub struct ScanRun {
    scan: PlannedScan,
    open: OpenRig,
    journal: Journal,
    setup: ScanSetup,
    kept: Vec<RecordedSample>,
    check: DryRun,
    pause: Pause,
    suspensions: Suspensions,
    losses: u32,
    /// What chooses further rounds; `None` if the plan is all.
    rounds: Option<Arc<dyn ChooseRounds>>,
}

/// How a scan ended. In either case the record is on disk and the rig is safe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// Every point of the plan was measured.
    Complete,
    /// It ended early; [`ScanRun::resume`] completes it.
    Partial {
        /// Why.
        reason: String,
    },
}

impl ScanRun {
    /// Prepares a new scan in `folder`: checks the plan, opens the rig and creates the record. Nothing moves yet.
    ///
    /// # Errors
    /// [`AcquisitionError`] if the plan is not possible, the rig cannot be opened, or the folder already holds a scan or
    /// cannot be written.
    pub async fn begin(
        mut scan: PlannedScan,
        folder: &Path,
        open_simulated: OpenSimulated,
    ) -> Result<Self, AcquisitionError> {
        let check = dry_run(&scan.plan, &scan.rig_setup, &scan.visits, &[])?;
        room_for(check.bytes, folder)?;
        let mut open = OpenRig::open(&scan.rig_setup, open_simulated).await?;
        if let Some((air, config)) = open.air().zip(scan.rig_setup.rig.environment.as_ref())
            && config.sound_speed
        {
            scan.rig_setup.medium = air.medium(config).await?;
        }
        let unit = open.rig().receiver().identity().unit.clone();
        let (plan, rig_setup) = (&scan.plan, &scan.rig_setup);
        known_unit(rig_setup, &unit)?;
        let phase = phase_of(open.rig().receiver().identity());
        let setup = setup_of(plan, rig_setup, begins(rig_setup.is_virtual()), unit, phase);
        let origin = Origin::of(plan, rig_setup)?.to_toml();
        let copies = [
            (PLAN_COPY, plan.text().as_bytes()),
            (RIG_COPY, rig_setup.source().text().as_bytes()),
            (origin::FILE, origin.as_bytes()),
        ];
        let columns = match phase {
            Some(_) => Columns::WITH_SPREAD.with_phase(),
            None => Columns::WITH_SPREAD,
        };
        let journal = Journal::create(folder, &setup, columns, &copies, Timestamp::now())?;
        open.log_to(folder)?;
        Ok(Self {
            scan,
            open,
            journal,
            setup,
            kept: Vec::new(),
            check,
            pause: Pause::never(),
            suspensions: Suspensions::default(),
            losses: 0,
            rounds: None,
        })
    }

    /// Resumes a scan that ended early, with its plan and rig file, and opens the rig. Ports may have changed; they are taken
    /// from the current rig file.
    ///
    /// # Errors
    /// [`AcquisitionError`] if the folder holds no scan, a complete scan, or one that another process is running; if the rest
    /// of the plan is not possible; or if the rig cannot be opened. Recorded readings are not changed.
    pub async fn resume(
        folder: &Path,
        open_simulated: OpenSimulated,
    ) -> Result<Self, AcquisitionError> {
        let resumed = Journal::resume(folder, Timestamp::now())?;
        let kept: Vec<RecordedSample> =
            resumed.records.iter().map(|record| record.sample).collect();
        let opened = async {
            let mut scan = PlannedScan::of_record(folder)?;
            same_set_up(&scan.rig_setup, &resumed.setup)?;
            let check = dry_run(&scan.plan, &scan.rig_setup, &scan.visits, &kept)?;
            room_for(check.bytes, folder)?;
            // The medium measured at the start of the scan, so that one scan has one medium.
            scan.rig_setup.medium = resumed.setup.medium;
            let mut open = OpenRig::open(&scan.rig_setup, open_simulated).await?;
            same_unit(&resumed.setup, open.rig().receiver().identity(), folder)?;
            open.log_to(folder)?;
            Ok((scan, open, check))
        };
        match opened.await {
            Ok((scan, open, check)) => Ok(Self {
                scan,
                open,
                journal: resumed.journal,
                setup: resumed.setup,
                kept,
                check,
                pause: Pause::never(),
                suspensions: Suspensions::default(),
                losses: 0,
                rounds: None,
            }),
            Err(error) => {
                end(resumed.journal, Some(&AcquisitionError::to_string(&error)))?;
                Err(error)
            }
        }
    }

    /// Number of readings in the whole plan.
    pub fn visits(&self) -> usize {
        self.scan.visits.len()
    }

    /// The folder of the record.
    pub fn folder(&self) -> &Path {
        self.journal.folder()
    }

    /// Number of readings already on disk.
    pub fn done(&self) -> usize {
        self.journal.visits_done()
    }

    /// The readings of earlier runs; sample k belongs to visit k of the plan.
    pub fn kept(&self) -> &[RecordedSample] {
        &self.kept
    }

    /// The plan and the rig set-up.
    pub fn scan(&self) -> &PlannedScan {
        &self.scan
    }

    /// Identity of the receiver.
    pub fn receiver(&mut self) -> &ReceiverIdentity {
        self.open.rig().receiver().identity()
    }

    /// A monitor for this scan, which starts `hooks`: those of [`PlannedScan::hooks`] that were agreed to.
    pub fn monitor(&self, hooks: Hooks) -> Monitor {
        Monitor::new(&self.scan, hooks, self.journal.folder(), self.check.slowest_s)
    }

    /// Lets `pause` control when the scan waits.
    pub fn paused_by(&mut self, pause: Pause) {
        self.pause = pause;
    }

    /// Takes `clock` for the one that tells suspensions of the computer.
    pub fn suspended_by(&mut self, clock: SuspensionClock) {
        self.suspensions = Suspensions::new(clock);
    }

    /// Starts a watchdog process, which makes the rig safe if this process dies, and then starts the failure hook of `hooks`:
    /// those of [`PlannedScan::hooks`] that were agreed to. `program` calls [`guard`](super::watchdog::guard). If it has to act
    /// it writes `watchdog.log` in the scan's folder. A simulated rig without a hook needs none.
    ///
    /// # Errors
    /// [`AcquisitionError::Watchdog`] if it does not start.
    pub fn guard(&mut self, program: Command, hooks: &Hooks) -> Result<(), AcquisitionError> {
        let folder = self.journal.folder();
        let note = Notice::of_failure(hooks, folder).map(|notice| notice.encode());
        self.open.guard(program, Some(&folder.join(WATCHDOG_LOG)), note)
    }

    /// Runs the scan to its end. Each reading is on disk, and synced, before the next move.
    ///
    /// If the disk is full, the array is silenced and the scan waits for free space.
    ///
    /// If `stop` resolves (with the reason), a device or the disk fails, or this program panics, the array is silenced, the
    /// robot is stopped, and the record is closed as partial.
    ///
    /// # Errors
    /// [`AcquisitionError::RigChange`] if, on resuming, the rig is not as it was; [`AcquisitionError::Journal`] if the end could not be
    /// recorded, or if the record was deleted or moved. Otherwise all readings are on disk.
    pub async fn run(
        self,
        watch: EventSink<'_>,
        stop: impl Future<Output = &'static str>,
    ) -> Result<Ending, AcquisitionError> {
        let follower = self.open.follower();
        let work = self.run_to_end(watch, stop);
        match follower {
            Some(follower) => follower.follow(work).await,
            None => work.await,
        }
    }

    async fn run_to_end(
        mut self,
        watch: EventSink<'_>,
        stop: impl Future<Output = &'static str>,
    ) -> Result<Ending, AcquisitionError> {
        let stopped = tokio::select! {
            biased;
            who = stop => Err(Stopped::Asked(who)),
            ended = unless_panicking(self.conduct(&mut *watch)) => ended.unwrap_or_else(Err),
        };
        let reason = match &stopped {
            Ok(()) => self.open.rig().silence().await.err().map(|error| error.to_string()),
            Err(stopped) => Some(stopped.to_string()),
        };
        let reason = match reason {
            Some(reason) => Some(self.open.rig().make_safe(reason).await.to_string()),
            None => None,
        };
        let (rows, of) = (self.journal.visits_done(), self.scan.visits.len());
        let ended = end(self.journal, reason.as_deref());
        let reason = match (reason, ended) {
            // A failed scan has failed even if the disk has no space to record it.
            (Some(reason), Err(error)) => Some(format!("{reason}; {error}")),
            (reason, ended) => {
                ended?;
                reason
            }
        };
        let ended = Event::Ended { rows, of, reason: reason.clone() };
        if matches!(stopped, Err(Stopped::Panicked(_))) {
            // The event sink itself may have panicked; the record is already closed.
            let _ = catch_unwind(AssertUnwindSafe(|| watch(&ended)));
        } else {
            watch(&ended);
        }
        match stopped {
            Err(Stopped::Failed(
                error @ (AcquisitionError::RigChange(_)
                | AcquisitionError::Journal(JournalError::Displaced { .. })),
            )) => Err(error),
            _ => Ok(reason.map_or(Ending::Complete, |reason| Ending::Partial { reason })),
        }
    }
}

fn end(journal: Journal, reason: Option<&str>) -> Result<(), AcquisitionError> {
    let state = match reason {
        None => ScanState::Complete,
        Some(reason) => ScanState::Partial { reason: reason.to_owned() },
    };
    Ok(journal.end(Timestamp::now(), &state)?)
}

/// Checks that the array is the one that the scan started with: files named by the rig file may have changed.
fn same_set_up(rig_setup: &RigSetup, setup: &ScanSetup) -> Result<(), AcquisitionError> {
    // Positions are written in millimetres, so the last bits may differ.
    const SAME_M: f64 = 1e-9;
    let (now, then) = (rig_setup.nominal_array().elements(), setup.array.array().elements());
    let same = now.len() == then.len()
        && now.iter().zip(then).all(|(now, then)| (now.centre_m - then.centre_m).norm() < SAME_M);
    if same { Ok(()) } else { Err(AcquisitionError::OtherSetUp) }
}

/// Why a running scan stopped.
#[derive(Debug, thiserror::Error)]
enum Stopped {
    #[error("{0}")]
    Asked(&'static str),
    #[error("{0}")]
    Failed(AcquisitionError),
    #[error("the program itself failed: {0}")]
    Panicked(String),
}

impl<E: Into<AcquisitionError>> From<E> for Stopped {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// Runs a future to its end, or to a panic within it, whose message is given.
async fn unless_panicking<T>(work: impl Future<Output = T>) -> Result<T, Stopped> {
    let mut work = pin!(work);
    poll_fn(|context| {
        let polled = catch_unwind(AssertUnwindSafe(|| work.as_mut().poll(context)));
        match polled {
            Ok(polled) => polled.map(Ok),
            Err(panic) => Poll::Ready(Err(Stopped::Panicked(panic_message(&*panic)))),
        }
    })
    .await
}

fn panic_message(panic: &(dyn Any + Send)) -> String {
    let literal = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    literal.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()
}
