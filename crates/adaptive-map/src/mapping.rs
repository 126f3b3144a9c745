//! The rounds of a map: after each, how certain the map is, and where the next readings are taken.
//!
//! A decision depends on the plan, the readings and the earlier decisions alone, so that a map that was interrupted goes on as it would have.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use fieldgap_acoustics::Vec3;
use fieldgap_acquisition::{ChooseRounds, NextRound, NoNextRound, RigSetup};
use fieldgap_closed_loop::{
    Budget, Planned, Robot, RoundsError, Spent, again, read_log, with_readings, write_log,
};
use fieldgap_diagnosis::{Options, PossibleReading};
use fieldgap_input::{Fault, TomlSource};
use fieldgap_records::{AdaptiveMap, Plan, RecordedSample, RecordedScan};

use crate::batch::{Chooser, Chosen};
use crate::checks::{Checks, checks};
use crate::estimate::{FieldEstimate, Foretold};
use crate::even::evenly;
use crate::field_map::{Learnt, MapError, MapErrors, estimates, on_the_way, possible};
use crate::normal::two_sided;
use crate::round::{MapEnd, MapRound};
use crate::words::{in_percent, why};

/// Places at which a decision looks at the errors of the map at most, spread evenly.
const LOOKED_AT: usize = 1500;

/// The catalogue is searched again when the readings have grown by this factor since the last search, or when checks depart by this many
/// standard deviations. Otherwise the effects of the last search are fitted again. Set by judgement.
const SEARCHED_AGAIN: f64 = 1.6;
const DEPARTED: f64 = 1.25;

/// Foretold readings by which the errors are judged: the last so many.
const CHECKED: usize = 192;

/// Fewest of them for the stated error to be met: they tell errors of twice their size.
const LEAST_CHECKED: usize = 32;

/// A round that lowers the rms error by less than this share gains nothing. Set by judgement: thirty such rounds would lower it by a quarter.
const LEAST_GAIN: f64 = 0.01;

/// A rig that chooses its readings for a map.
pub struct Mapping {
    settings: AdaptiveMap,
    simulator: fieldgap_acoustics::Simulator,
    robot: Robot,
    folder: PathBuf,
    /// The places of the map that the robot reaches, each with its drive; every beginning is spread evenly.
    places: Vec<PossibleReading>,
}

/// Why a map cannot begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum MappingError {
    /// A file is wrong.
    #[error(transparent)]
    File(#[from] Fault),
    /// The log of the rounds.
    #[error(transparent)]
    Rounds(#[from] RoundsError),
    /// The plan has no `[adaptive]`.
    #[error("the plan has no [adaptive]")]
    NoMap,
    /// Too little of the map can be reached.
    #[error("the robot reaches {reached} of the {places} places of the map of [adaptive]")]
    OutOfReach {
        /// Places that it reaches.
        reached: usize,
        /// Places of the map.
        places: usize,
    },
    /// The map cannot be made.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The log of the rounds is not that of the plan.
    #[error("{planned} rounds are planned, but map-rounds.jsonl has {logged}")]
    OtherRounds {
        /// Lists of readings in the plan.
        planned: usize,
        /// Rounds in the log.
        logged: usize,
    },
}

/// A decision and the readings that follow; none at the end.
struct Decided {
    round: MapRound,
    readings: Option<Vec<Planned>>,
}

impl From<fieldgap_comparison::Incomparable> for MappingError {
    fn from(error: fieldgap_comparison::Incomparable) -> Self {
        Self::Map(error.into())
    }
}

impl Mapping {
    /// The map of a plan on a rig, whose record is or will be in `folder`.
    ///
    /// # Errors
    /// [`MappingError::NoMap`]; [`MappingError::OutOfReach`] if the robot reaches less than half of the map.
    pub fn new(plan: &Plan, rig_setup: &RigSetup, folder: &Path) -> Result<Self, MappingError> {
        let settings = plan.adaptive.clone().ok_or(MappingError::NoMap)?;
        let robot = Robot::of(rig_setup);
        let all = places_of(&settings, plan.foci.len());
        let evenly = evenly(&settings.grid, plan.foci.len()).into_iter().map(|number| all[number]);
        let reached: Vec<_> = evenly.filter(|(at_m, _)| robot.reaches(*at_m)).collect();
        if 2 * reached.len() < all.len() {
            return Err(MappingError::OutOfReach { reached: reached.len(), places: all.len() });
        }
        let places = possible(&reached);
        let folder = folder.to_owned();
        Ok(Self { settings, simulator: plan.simulator, robot, folder, places })
    }

    /// The plan of the first round: the given one with its first readings. The decision is logged when the scan has begun; see
    /// [`Mapping::begin`].
    ///
    /// # Errors
    /// A [`Fault`] if the plan does not fit the rig.
    pub fn first_plan(
        &self,
        plan: &Plan,
        rig_setup: &RigSetup,
    ) -> Result<(Plan, MapRound), MappingError> {
        plan.fits_array(rig_setup.nominal_array().len())?;
        let home_m = self.robot.home_m();
        let readings = self.chooser(home_m, 0).first(self.settings.first_readings);
        let reason = format!("A first look: {} readings spread evenly.", readings.len());
        let text = with_readings(plan.text(), &reason, &readings);
        let round = MapRound {
            round: 0,
            before: 0,
            readings: readings.len(),
            spread: readings.len(),
            searched: false,
            effects: Vec::new(),
            rms_error: None,
            largest_error: None,
            checks: None,
            foretold: Vec::new(),
            expected_s: self.robot.duration_s(home_m, &readings),
            end: None,
            reason,
        };
        Ok((Plan::parse(TomlSource::new(plan.path(), text))?, round))
    }

    /// Logs the first round in the folder of the record.
    ///
    /// # Errors
    /// [`RoundsError`].
    pub fn begin(&self, first: MapRound) -> Result<(), RoundsError> {
        write_log(&self.folder, &[first])
    }

    /// The decision after the readings of a record, by the rounds before it; and the longer plan.
    ///
    /// # Errors
    /// [`MappingError`] if no map can be made of the readings, or if the earlier rounds are not those of the plan.
    pub fn decide(
        &self,
        plan: &Plan,
        record: &RecordedScan,
        earlier: &[MapRound],
    ) -> Result<(MapRound, Option<String>), MappingError> {
        let planned = plan.readings.len();
        let (Some(last), true) = (earlier.last(), earlier.len() == planned) else {
            return Err(MappingError::OtherRounds { planned, logged: earlier.len() });
        };
        let before = record.samples.len();
        let checks = checks_of(record, earlier);
        let due = earlier
            .iter()
            .rev()
            .find(|round| round.searched)
            .is_none_or(|searched| before as f64 >= SEARCHED_AGAIN * searched.before as f64);
        let departs = checks.is_some_and(|checks| checks.rms > DEPARTED);
        let mut decided = self.decided(record, last, checks, earlier.len(), due || departs)?;
        // A map ends on a whole search, which the map itself is made by.
        if decided.readings.is_none() && !decided.round.searched {
            decided = self.decided(record, last, checks, earlier.len(), true)?;
        }
        let Decided { mut round, readings } = decided;
        let Some(readings) = readings else { return Ok((round, None)) };
        round.readings = readings.len();
        let text = with_readings(plan.text(), &round.reason, &readings);
        Ok((round, Some(text)))
    }

    /// Decides by a whole search, or by the effects of the last round.
    fn decided(
        &self,
        record: &RecordedScan,
        last: &MapRound,
        checks: Option<Checks>,
        number: usize,
        searched: bool,
    ) -> Result<Decided, MappingError> {
        let known: BTreeSet<_> = last.effects.iter().copied().collect();
        let options = Options {
            simulator: Some(self.simulator),
            effects: (!searched).then_some(known),
            few_causes: true,
            ..Options::default()
        };
        let learnt = Learnt::of(record, self.settings.prior, &options)?;
        let decided = learnt.field(|effects, _, field| -> Result<_, MapError> {
            let factor = checks.map_or(1.0, |checks| checks.factor);
            let looked_at = &self.places[..self.places.len().min(LOOKED_AT)];
            let errors = MapErrors::of(&estimates(field, looked_at, factor)?);
            let mut round = MapRound {
                round: number,
                before: record.samples.len(),
                readings: 0,
                spread: last.spread,
                searched,
                effects: effects.to_vec(),
                rms_error: Some(errors.rms / errors.peak),
                largest_error: Some(errors.largest / errors.peak),
                checks: checks.map(Into::into),
                foretold: Vec::new(),
                expected_s: 0.0,
                end: self.is_met(&errors, checks).then_some(MapEnd::Met),
                reason: String::new(),
            };
            let readings = match round.end {
                Some(_) => None,
                None => self.next_readings(&mut round, record, field),
            };
            Ok(Decided { round, readings })
        })?;
        let Decided { mut round, readings } = decided?;
        round.reason = self.words(&round, readings.as_ref().map(Vec::len));
        Ok(Decided { round, readings })
    }

    /// Whether the stated error is met everywhere, and readings that were foretold have borne the errors out.
    fn is_met(&self, errors: &MapErrors, checks: Option<Checks>) -> bool {
        let AdaptiveMap { error, confidence, .. } = self.settings;
        checks.is_some_and(|checks| checks.readings >= LEAST_CHECKED)
            && two_sided(confidence) * errors.largest <= error * errors.peak
    }

    /// The readings of a round, with what is foretold of them; `None`, with the reason in the round, if none follow.
    fn next_readings(
        &self,
        round: &mut MapRound,
        record: &RecordedScan,
        field: &dyn FieldEstimate,
    ) -> Option<Vec<Planned>> {
        let at_m = record.samples.last().map_or(self.robot.home_m(), RecordedSample::position_m);
        let Chosen { readings, spread, gain } =
            self.chooser(at_m, round.spread).next(field, self.settings.round_readings);
        let expected_s = self.robot.duration_s(at_m, &readings);
        let spent = Spent::of(&record.samples);
        round.end = match self.budget().used_up(spent, readings.len(), expected_s) {
            Some(used_up) => Some(used_up.into()),
            None => (gain < LEAST_GAIN).then_some(MapEnd::NoGain),
        };
        if round.end.is_some() {
            return None;
        }
        let driven: Vec<_> =
            readings.iter().filter_map(|(at_m, focus)| Some((*at_m, (*focus)?))).collect();
        // The middle of the round, for a rig that drifts.
        let moment = 1.0 + 0.5 * expected_s / spent.time_s.max(expected_s);
        let foretold = field.foretold(&on_the_way(at_m, &driven), moment);
        round.foretold = foretold.iter().map(|f| [f.reading, f.standard_error, f.noise]).collect();
        round.spread += spread;
        round.expected_s = expected_s;
        Some(readings)
    }

    /// Every decision made again from a finished record and its plan, the first round as it was logged. A round whose readings are not those of
    /// the plan has none.
    ///
    /// # Errors
    /// As [`Mapping::decide`].
    pub fn again(
        &self,
        plan: &Plan,
        record: &RecordedScan,
        rounds: &[MapRound],
    ) -> Result<Vec<MapRound>, MappingError> {
        again(plan, record, rounds, |plan, record, earlier| self.decide(plan, record, earlier))
    }

    fn words(&self, round: &MapRound, next: Option<usize>) -> String {
        let percent = |share: Option<f64>| 100.0 * share.unwrap_or(0.0);
        let scaled = match round.checks {
            Some(checks) if checks.factor > 1.0 => format!(
                " (made {:.2} times larger, as the last {} readings departed by {:.2} of their stated deviations)",
                checks.factor, checks.readings, checks.rms
            ),
            _ => String::new(),
        };
        let then = match (round.end, next) {
            (None, Some(next)) => format!("Next {next} readings where it is least certain."),
            (end, _) => self.end_in_words(end.unwrap_or(MapEnd::Readings)),
        };
        format!(
            "After {} readings: standard errors of {:.2} % of the peak rms, {:.2} % at most{scaled}. {then}",
            round.before,
            percent(round.rms_error),
            percent(round.largest_error)
        )
    }

    fn end_in_words(&self, end: MapEnd) -> String {
        let stated = in_percent(&self.settings);
        match end {
            MapEnd::Met => format!("The stated error of {stated} is met everywhere."),
            end => format!("The stated error of {stated} is not met: {}.", why(Some(end))),
        }
    }

    fn budget(&self) -> Budget {
        let AdaptiveMap { most_readings, longest_s, longest_sounding_s, .. } = self.settings;
        Budget { readings: most_readings, longest_s, longest_sounding_s }
    }

    fn chooser(&self, at_m: Vec3, spread: usize) -> Chooser<'_> {
        Chooser { robot: &self.robot, map: &self.places, at_m, spread }
    }
}

impl ChooseRounds for Mapping {
    fn next(&self, plan: &Plan, record: &RecordedScan) -> Result<NextRound, NoNextRound> {
        // A decision that was logged, and its plan not yet written, is made again.
        let mut rounds: Vec<MapRound> = read_log(&self.folder)?;
        rounds.truncate(plan.readings.len());
        let (round, plan) = self.decide(plan, record, &rounds)?;
        let decision = round.reason.clone();
        rounds.push(round);
        write_log(&self.folder, &rounds)?;
        Ok(NextRound { decision, plan })
    }
}

/// The places of a map, m, for each of so many drives.
pub fn places_of(settings: &AdaptiveMap, foci: usize) -> Vec<(Vec3, usize)> {
    let places = |focus| settings.grid.places_mm().map(move |at_mm| (at_mm / 1e3, focus));
    (0..foci).flat_map(places).collect()
}

/// How the last readings of a record turned out, against what its rounds foretold of them; `None` where none was foretold.
pub fn checks_of(record: &RecordedScan, rounds: &[MapRound]) -> Option<Checks> {
    let mut pairs = Vec::new();
    for round in rounds.iter().filter(|round| !round.foretold.is_empty()) {
        let taken = record.samples.iter().skip(round.before).take(round.readings);
        let driven = taken.filter(|sample| sample.focus.is_some());
        pairs.extend(driven.zip(&round.foretold).map(
            |(sample, &[reading, standard_error, noise])| {
                (sample.reading, Foretold { reading, standard_error, noise })
            },
        ));
    }
    let last = &pairs[pairs.len().saturating_sub(CHECKED)..];
    (!last.is_empty()).then(|| checks(last))
}
