//! A scan that goes on in rounds: after the last reading of its plan, more readings are chosen by what was read.

use std::sync::Arc;

use jiff::Timestamp;

use super::sequence::Progress;
use super::{ScanRun, Stopped};
use crate::AcquisitionError;
use crate::dry_run::dry_run;
use crate::event::{Event, EventSink};
use crate::itinerary::Itinerary;
use crate::origin::PLAN_COPY;
use crate::planned_scan::PlannedScan;
use fieldgap_input::TomlSource;
use fieldgap_records::{EventKind, JournalError, Plan, RecordedScan, write_whole};

/// What follows after the readings of a plan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NextRound {
    /// The decision in words.
    pub decision: String,
    /// The plan with the readings of the next round added at its end; `None` if the scan is complete.
    pub plan: Option<String>,
}

/// A next round cannot be chosen.
pub type NoNextRound = Box<dyn std::error::Error + Send + Sync>;

/// Chooses the readings of the next round of a scan.
pub trait ChooseRounds: Send + Sync {
    /// Chooses from the plan so far and the record of all its readings. The robot stands still and the array is silent meanwhile.
    ///
    /// # Errors
    /// [`NoNextRound`] ends the scan as partial.
    fn next(&self, plan: &Plan, record: &RecordedScan) -> Result<NextRound, NoNextRound>;

    /// Works on the record so far while the robot measures the round that was chosen: what the next choice may need and the new readings
    /// will not change. The next choice must not depend on whether it was called. By default it does nothing.
    fn meanwhile(&self, record: &RecordedScan) {
        let _ = record;
    }
}

impl ScanRun {
    /// Lets `choose` add rounds after the last reading of the plan, until it chooses none.
    pub fn in_rounds(&mut self, choose: Box<dyn ChooseRounds>) {
        self.rounds = Some(choose.into());
    }

    /// Chooses and measures rounds until none follows. The array is silent while the next one is chosen. What can be worked out before its
    /// readings are there is worked out while they are measured.
    pub(super) async fn measure_rounds(
        &mut self,
        progress: &mut Progress,
        watch: EventSink<'_>,
    ) -> Result<(), Stopped> {
        if self.rounds.is_none() && self.scan.plan.chooses_readings() {
            return Err(AcquisitionError::NoNextRound(
                "the plan leaves its readings to the rig, and nothing here chooses them".into(),
            )
            .into());
        }
        while let Some(choose) = self.rounds.clone() {
            progress.sequencer.silence(self.open.rig()).await?;
            let plan = self.scan.plan.clone();
            let record = RecordedScan { setup: self.setup.clone(), samples: self.kept.clone() };
            let record = Arc::new(record);
            let next =
                in_background((&choose, &record), move |choose, record| choose.next(&plan, record));
            let NextRound { decision, plan } =
                next.await?.map_err(AcquisitionError::NoNextRound)?;
            self.journal.record(Timestamp::now(), EventKind::RoundChosen, &decision)?;
            watch(&Event::RoundChosen { text: decision });
            let Some(text) = plan else { return Ok(()) };
            self.go_on_with(text)?;
            let (plan, visits) = (&self.scan.plan, &self.scan.visits);
            let itinerary = Itinerary::of(plan, &self.scan.rig_setup, visits, &self.kept);
            let meanwhile =
                in_background((&choose, &record), |choose, record| choose.meanwhile(record));
            self.measure_legs(&itinerary, progress, &mut *watch).await?;
            meanwhile.await?;
        }
        Ok(())
    }

    /// Takes a longer plan, of which all readings so far are the beginning, and keeps it in the record before anything of it is measured.
    fn go_on_with(&mut self, text: String) -> Result<(), AcquisitionError> {
        let source = TomlSource::new(self.scan.plan.path(), text);
        let longer = PlannedScan::new(Plan::parse(source)?, self.scan.rig_setup.clone())?;
        let done = self.scan.visits.len();
        if longer.visits.get(..done) != Some(&self.scan.visits[..])
            || longer.plan.foci != self.setup.foci
        {
            return Err(AcquisitionError::NoNextRound(
                "the plan of the next round does not begin with the readings so far".into(),
            ));
        }
        dry_run(&longer.plan, &longer.rig_setup, &longer.visits, &self.kept)?;
        let path = self.journal.folder().join(PLAN_COPY);
        write_whole(&path, |file| std::io::Write::write_all(file, longer.plan.text().as_bytes()))
            .map_err(|source| JournalError::Write { path, source })?;
        self.scan = longer;
        Ok(())
    }
}

/// Works on a thread of its own, at once: it takes seconds, and the watchdog and the requests to stop must be heard meanwhile.
fn in_background<T: Send + 'static>(
    (choose, record): (&Arc<dyn ChooseRounds>, &Arc<RecordedScan>),
    work: impl FnOnce(&dyn ChooseRounds, &RecordedScan) -> T + Send + 'static,
) -> impl Future<Output = Result<T, Stopped>> {
    let (choose, record) = (choose.clone(), record.clone());
    let working = tokio::task::spawn_blocking(move || work(&*choose, &record));
    async {
        working.await.map_err(|error| match error.try_into_panic() {
            Ok(panic) => Stopped::Panicked(super::panic_message(&*panic)),
            Err(error) => Stopped::Panicked(error.to_string()),
        })
    }
}
