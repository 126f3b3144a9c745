//! The loop itself: after each round a search, a decision, and the readings of the next round.
//!
//! A decision depends on the plan, the readings and the earlier decisions alone. A loop that was interrupted therefore goes on as it would
//! have, and a record shows offline why it went as it did.

use std::path::{Path, PathBuf};

use fieldgap_acoustics::Vec3;
use fieldgap_acquisition::{ChooseRounds, NextRound, NoNextRound, RigSetup};
use fieldgap_correction::CorrectionError;
use fieldgap_diagnosis::{Findings, PossibleReading, Verdict};
use fieldgap_input::{Fault, TomlSource};
use fieldgap_records::{ClosedLoop, Plan, RecordedSample, RecordedScan};

use crate::again::again;
use crate::batch::{Batch, Chooser, MOST_SETS};
use crate::budget::{Budget, Spent};
use crate::cure::PlannedCure;
use crate::decision::{Next, Standing, going_on, in_words, is_inseparable, next, taken_back};
use crate::drives::further_drives;
use crate::flights::Flying;
use crate::log::{RoundsError, write_log};
use crate::plan_text::{with_course, with_drives};
use crate::robot::Robot;
use crate::round::{End, Likely, Purpose, Round, Verification, read_rounds};
use crate::searches::{Searches, up_to};

/// Sets that a round keeps in its log: those that the next round is to tell apart.
const MOST_LOGGED: usize = MOST_SETS;

/// A rig that chooses its readings until the cause is known.
pub struct Inquiry {
    settings: ClosedLoop,
    robot: Robot,
    flying: Option<Flying>,
    folder: PathBuf,
    rig: PathBuf,
    searches: Searches,
}

/// What follows after a round.
pub struct Decision {
    /// The decision.
    pub round: Round,
    /// The plan with its readings; `None` at the end.
    pub plan: Option<String>,
    /// The corrected set-up that its readings test.
    cure: Option<PlannedCure>,
}

/// Why a closed loop cannot begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum InquiryError {
    /// A file is wrong.
    #[error(transparent)]
    File(#[from] Fault),
    /// The log of the rounds.
    #[error(transparent)]
    Rounds(#[from] RoundsError),
    /// The plan has no `[closed_loop]`.
    #[error("the plan has no [closed_loop]")]
    NoClosedLoop,
    /// Nothing in the box can be reached.
    #[error(
        "the robot reaches too little of the box of [closed_loop]: {reached} of {wanted} readings"
    )]
    OutOfReach {
        /// Readings that it reaches.
        reached: usize,
        /// Readings of the round.
        wanted: usize,
    },
    /// The corrected set-up cannot be written.
    #[error(transparent)]
    Correction(#[from] CorrectionError),
    /// The readings cannot be compared with a simulation.
    #[error(transparent)]
    Incomparable(#[from] fieldgap_comparison::Incomparable),
    /// The log of the rounds is not that of the plan.
    #[error("{} rounds are planned, but rounds.jsonl has {}", .planned, .logged)]
    OtherRounds {
        /// Lists of readings in the plan.
        planned: usize,
        /// Rounds in the log.
        logged: usize,
    },
}

impl Inquiry {
    /// The loop of a plan on a rig, whose record is or will be in `folder`.
    ///
    /// # Errors
    /// [`InquiryError::NoClosedLoop`].
    pub fn new(plan: &Plan, rig_setup: &RigSetup, folder: &Path) -> Result<Self, InquiryError> {
        let settings = plan.closed_loop.clone().ok_or(InquiryError::NoClosedLoop)?;
        Ok(Self {
            settings,
            robot: Robot::of(rig_setup),
            flying: Flying::of(plan, rig_setup),
            folder: folder.to_owned(),
            rig: rig_setup.source().path().to_owned(),
            searches: Searches::of(plan.simulator),
        })
    }

    /// The plan of the first round: the given one with further drives and its first readings. The decision is logged in the folder when the
    /// scan has begun; see [`Inquiry::begin`].
    ///
    /// # Errors
    /// [`InquiryError::OutOfReach`]; a [`Fault`] if the plan does not fit the rig.
    pub fn first_plan(
        &self,
        plan: &Plan,
        rig_setup: &RigSetup,
    ) -> Result<(Plan, Round), InquiryError> {
        plan.fits_array(rig_setup.nominal_array().len())?;
        let further = further_drives(
            &plan.foci,
            rig_setup.nominal_array(),
            &rig_setup.nominal_medium(),
            rig_setup.array.frequency_hz(),
            &self.settings.within,
        );
        let drives = [plan.foci.len(), plan.foci.len() + further.len()];
        let batch = self.chooser(drives, self.robot.home_m(), &[]).first();
        self.is_enough(&batch, self.settings.first_readings)?;
        let reason = format!("A first look: {} readings spread evenly.", batch.len());
        let text = with_drives(plan.text(), &further);
        let text = with_course(&text, &reason, &batch.course);
        let round = Round {
            round: 0,
            purpose: Purpose::First,
            before: 0,
            readings: batch.len(),
            drives,
            verdict: None,
            named: Vec::new(),
            probabilities: Vec::new(),
            outside: 0.0,
            expected_bits: None,
            expected_s: self.duration_s(&batch, self.robot.home_m()),
            cure: None,
            verification: None,
            end: None,
            reason,
        };
        Ok((Plan::parse(TomlSource::new(plan.path(), text))?, round))
    }

    /// Logs the first round in the folder of the record.
    ///
    /// # Errors
    /// [`RoundsError`].
    pub fn begin(&self, first: Round) -> Result<(), RoundsError> {
        write_log(&self.folder, &[first])
    }

    /// The decision after the readings of a record, by the rounds before it.
    ///
    /// # Errors
    /// [`InquiryError`] if the readings cannot be compared, if the earlier rounds are not those of the plan, or if the corrected set-up that
    /// the last of them tested cannot be read.
    pub fn decide(
        &self,
        plan: &Plan,
        record: &RecordedScan,
        earlier: &[Round],
    ) -> Result<Decision, InquiryError> {
        let planned = plan.readings.len();
        let (Some(last), true) = (earlier.last(), earlier.len() == planned) else {
            return Err(InquiryError::OtherRounds { planned, logged: earlier.len() });
        };
        let mut verification = None;
        if last.purpose == Purpose::Verify {
            let (standing, tested) = self.tested(last, record)?;
            if tested.holds {
                let round =
                    self.round(&standing, earlier, record, Some(tested), Some(End::Verified));
                return Ok(Decision { round, plan: None, cure: None });
            }
            verification = Some(tested);
        }
        let scans = std::array::from_ref(record);
        // The sets that a search of the readings before this round left in question choose the next readings. Whatever else is decided, and
        // what none of these sets explains, is decided after a search.
        if last.purpose == Purpose::Explore {
            let findings = self.searches.among_live(scans, last.before)?;
            let decision = self.by(&findings, plan, record, earlier, verification)?;
            let Round { purpose, verdict, .. } = decision.round;
            if purpose == Purpose::Explore && verdict != Some(Verdict::Unexplained) {
                return Ok(decision);
            }
        }
        let findings = self.searches.among_all(scans)?;
        self.by(&findings, plan, record, earlier, verification)
    }

    /// What these findings decide.
    fn by(
        &self,
        findings: &Findings<'_>,
        plan: &Plan,
        record: &RecordedScan,
        earlier: &[Round],
        verification: Option<Verification>,
    ) -> Result<Decision, InquiryError> {
        let last = earlier.last().expect("a first round");
        let standing = Standing::of(findings);
        let end = |end| {
            let round = self.round(&standing, earlier, record, verification, Some(end));
            Ok(Decision { round, plan: None, cure: None })
        };
        let at_m = record.samples.last().map_or(self.robot.home_m(), RecordedSample::position_m);
        let chooser = self.chooser(last.drives, at_m, earlier);
        let (purpose, batch) = match next(&standing, earlier, record.samples.len(), &self.settings)
        {
            Next::End(reason) => return end(reason),
            Next::Verify => (Purpose::Verify, chooser.fresh(earlier.len())),
            Next::Explore => {
                let outlooks =
                    |possible: &[PossibleReading]| findings.outlooks(possible, MOST_SETS);
                let batch = chooser.next(outlooks, self.settings.round_readings);
                let readings = record.samples.len();
                if is_inseparable(&standing, &batch, earlier, readings, &self.settings) {
                    return end(End::Inseparable);
                }
                (Purpose::Explore, batch)
            }
        };
        let expected_s = self.duration_s(&batch, at_m);
        let spent = Spent::of(&record.samples);
        if let Some(used_up) = self.budget().used_up(spent, batch.len(), expected_s) {
            return end(End::from(used_up));
        }
        self.is_enough(&batch, batch.len().max(1))?;
        let cure = match purpose {
            Purpose::Verify => {
                let diagnosis = findings.diagnosis();
                let (scanned, number) = (&record.setup, earlier.len());
                Some(PlannedCure::of(&diagnosis, scanned, &self.folder, &self.rig, number)?)
            }
            _ => None,
        };
        let mut round = self.round(&standing, earlier, record, verification, None);
        round.purpose = purpose;
        round.readings = batch.len();
        round.expected_bits = batch.information.map(|nats| nats / std::f64::consts::LN_2);
        round.expected_s = expected_s;
        round.cure = cure.as_ref().map(|planned| planned.cure.clone());
        round.reason = going_on(&standing, &round);
        let plan = with_course(plan.text(), &round.reason, &batch.course);
        Ok(Decision { round, plan: Some(plan), cure })
    }

    /// The cause that a round tested, found again from the readings before it, and how it did on those of the round.
    fn tested(
        &self,
        tested: &Round,
        record: &RecordedScan,
    ) -> Result<(Standing, Verification), InquiryError> {
        let seen = [up_to(record, tested.before)];
        let findings = self.searches.among_live(&seen, tested.before)?;
        let corrected = match &tested.cure {
            Some(cure) => cure
                .set_up(&self.folder)?
                .map(|set_up| findings.on_fresh_corrected(record, &set_up, &cure.accounted())),
            None => None,
        };
        let verification = Verification::of(findings.on_fresh(record), corrected);
        Ok((Standing::of(&findings), verification))
    }

    /// Every decision made again from a finished record and its plan, the first round as it was logged. A round whose readings are not those of
    /// the plan has none.
    ///
    /// # Errors
    /// As [`Inquiry::decide`].
    pub fn again(
        &self,
        plan: &Plan,
        record: &RecordedScan,
        rounds: &[Round],
    ) -> Result<Vec<Round>, InquiryError> {
        again(plan, record, rounds, |plan, record, earlier| {
            let Decision { round, plan, .. } = self.decide(plan, record, earlier)?;
            Ok((round, plan))
        })
    }

    fn budget(&self) -> Budget {
        let ClosedLoop { most_readings, longest_s, longest_sounding_s, .. } = self.settings;
        Budget { readings: most_readings, longest_s, longest_sounding_s }
    }

    /// A round without readings.
    fn round(
        &self,
        standing: &Standing,
        earlier: &[Round],
        record: &RecordedScan,
        verification: Option<Verification>,
        end: Option<End>,
    ) -> Round {
        let before = record.samples.len();
        let likely = standing.probabilities.iter().take(MOST_LOGGED);
        let reason = end.map_or(String::new(), |end| {
            let cure = earlier.last().and_then(|tested| tested.cure.as_ref());
            let back = taken_back(verification.as_ref());
            let words = in_words(end, verification.as_ref().zip(cure));
            format!("After {before} readings: {}.{back} {words}", standing.in_words())
        });
        Round {
            round: earlier.len(),
            purpose: Purpose::End,
            before,
            readings: 0,
            drives: earlier[0].drives,
            verdict: Some(standing.verdict),
            named: standing.named.clone(),
            probabilities: likely
                .map(|(effects, probability)| Likely {
                    effects: effects.clone(),
                    probability: *probability,
                })
                .collect(),
            outside: standing.outside,
            expected_bits: None,
            expected_s: 0.0,
            cure: None,
            verification,
            end,
            reason,
        }
    }

    fn chooser(&self, [planned, all]: [usize; 2], at_m: Vec3, earlier: &[Round]) -> Chooser<'_> {
        Chooser {
            settings: &self.settings,
            robot: &self.robot,
            flying: self.flying.as_ref(),
            rounds: earlier.len(),
            planned_drives: planned,
            drives: all,
            at_m,
            places_used: self.places_used(earlier),
        }
    }

    /// Places of the even sequence that rounds have used: as many as their readings at most, so that none comes twice.
    fn places_used(&self, earlier: &[Round]) -> usize {
        let spread = earlier.iter().filter(|round| round.purpose != Purpose::Verify);
        spread.map(|round| round.readings).sum()
    }

    fn duration_s(&self, batch: &Batch, from_m: Vec3) -> f64 {
        batch.course.duration_s(from_m, &self.robot)
    }

    fn is_enough(&self, batch: &Batch, wanted: usize) -> Result<(), InquiryError> {
        let reached = batch.len();
        // Half of a box behind a keep-out box still tells a cause; less would be another box.
        if 2 * reached >= wanted && reached > 0 {
            return Ok(());
        }
        Err(InquiryError::OutOfReach { reached, wanted })
    }
}

impl ChooseRounds for Inquiry {
    fn next(&self, plan: &Plan, record: &RecordedScan) -> Result<NextRound, NoNextRound> {
        // A decision that was logged, and its plan not yet written, is made again.
        let mut rounds = read_rounds(&self.folder)?;
        rounds.truncate(plan.readings.len());
        let Decision { round, plan, cure } = self.decide(plan, record, &rounds)?;
        if let Some(cure) = cure {
            cure.write(&self.folder)?;
        }
        let decision = round.reason.clone();
        rounds.push(round);
        write_log(&self.folder, &rounds)?;
        Ok(NextRound { decision, plan })
    }

    fn meanwhile(&self, record: &RecordedScan) {
        // Why it cannot be compared is said when the next round is chosen.
        let _ = self.searches.live_sets(std::array::from_ref(record));
    }
}
