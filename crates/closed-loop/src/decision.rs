//! What follows after a round: another one, a verification, or the end.

use fieldgap_diagnosis::{EffectId, Findings, Verdict, joined};
use fieldgap_records::ClosedLoop;

use crate::batch::Batch;
use crate::cure::Cure;
use crate::round::{End, Purpose, Round, Verification};

/// Nats by which the rest of the budget must part two rivals to be worth measuring: what is expected of sets as they are fitted may be too
/// little by some. Three would exclude one of them at a probability of 0.95.
const WORTH_PARTING: f64 = 1.0;

/// Rounds in a row that must agree: the second chose its readings to contradict the first.
const AGREEING: usize = 2;

/// Rounds in a row without an explanation after which none is expected. Set by judgement.
const UNEXPLAINED: usize = 4;

/// Nats that the readings must give a cause before it is named: five for its parameters, three for the prior of no gap, and odds of twenty
/// to one; a margin of one.
const NAMED: f64 = 12.0;

/// Nats that they must give a further cause beside a named one: three for odds of twenty to one, the rest for its parameter. Set by
/// judgement: with the usual smallest gap it adds a round or two to most loops.
const NAMED_BESIDE: f64 = 5.5;

/// Readings that give so many nats by a gap of this size, in standard deviations of a reading. Each gives half its square, wherever it
/// stands.
fn readings_that_show(nats: f64, gap_sigma: f64) -> f64 {
    2.0 * nats / (gap_sigma * gap_sigma)
}

/// What the readings so far say.
pub(crate) struct Standing {
    pub verdict: Verdict,
    /// The named set, or the rivals.
    pub named: Vec<Vec<EffectId>>,
    pub probabilities: Vec<(Vec<EffectId>, f64)>,
    /// Probability that no set of the catalogue holds the cause.
    pub outside: f64,
}

impl Standing {
    pub fn of(findings: &Findings<'_>) -> Self {
        Self {
            verdict: findings.verdict(),
            named: findings.named(),
            probabilities: findings.probabilities(),
            outside: findings.outside_the_catalogue(),
        }
    }

    /// Probability that the named set is at work, whatever else is: that of all sets that hold it. Of no gap, that of the set-up as
    /// believed.
    fn support(&self) -> f64 {
        let named: &[EffectId] = self.named.first().map_or(&[], Vec::as_slice);
        let holds = |ids: &[EffectId]| match self.verdict {
            Verdict::None => ids.is_empty(),
            _ => named.iter().all(|id| ids.contains(id)),
        };
        let sets = self.probabilities.iter().filter(|(ids, _)| holds(ids));
        sets.map(|(_, probability)| probability).sum()
    }

    /// Whether it names one cause, or no gap, with the probability asked for.
    fn is_certain(&self, settings: &ClosedLoop) -> bool {
        let names = self.verdict.names_a_cause() || self.verdict == Verdict::None;
        names && self.support() >= settings.probability
    }

    /// How many rounds in a row said the same, this one included.
    fn agreeing(&self, earlier: &[Round]) -> usize {
        let same = |round: &&Round| {
            let kind = |verdict: Verdict| match verdict {
                Verdict::MostlyExplained => Verdict::Explained,
                other => other,
            };
            round.purpose == Purpose::Explore
                && round.verdict.map(kind) == Some(kind(self.verdict))
                && sorted(&round.named) == sorted(&self.named)
        };
        1 + earlier.iter().rev().take_while(same).count()
    }

    fn unexplained(&self, earlier: &[Round]) -> usize {
        let same = |round: &&Round| round.verdict == Some(Verdict::Unexplained);
        match self.verdict {
            Verdict::Unexplained => 1 + earlier.iter().rev().take_while(same).count(),
            _ => 0,
        }
    }

    /// In words.
    pub fn in_words(&self) -> String {
        let sets = |joint: &str| {
            let sets: Vec<String> = self.named.iter().map(|ids| joined(ids, " + ")).collect();
            sets.join(joint)
        };
        match self.verdict {
            Verdict::None => "no gap beyond noise".to_owned(),
            Verdict::Unexplained => "a gap that no set of effects explains".to_owned(),
            Verdict::Ambiguous => format!("{} are left", sets(" or ")),
            _ => format!("{} ({:.1} %)", sets(", "), 100.0 * self.support()),
        }
    }
}

fn sorted(sets: &[Vec<EffectId>]) -> Vec<Vec<EffectId>> {
    let mut sets = sets.to_vec();
    sets.iter_mut().for_each(|set| set.sort_unstable());
    sets.sort_unstable();
    sets
}

/// What follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Next {
    Explore,
    Verify,
    End(End),
}

/// Decides by what the readings say. `earlier` are the rounds that were measured, the last of which was not a verification that holds.
pub(crate) fn next(
    standing: &Standing,
    earlier: &[Round],
    readings: usize,
    settings: &ClosedLoop,
) -> Next {
    // What is not there, no gap or no further cause beside the named one, is said where it would have shown.
    let nats = if standing.verdict == Verdict::None { NAMED } else { NAMED_BESIDE };
    let is_early = (readings as f64) < readings_that_show(nats, settings.smallest_gap_sigma);
    if !is_early && standing.is_certain(settings) && standing.agreeing(earlier) >= AGREEING {
        return match (standing.verdict, settings.verify_readings) {
            (Verdict::None, _) => Next::End(End::NoGap),
            (_, 0) => Next::End(End::Explained),
            _ => Next::Verify,
        };
    }
    if standing.unexplained(earlier) >= UNEXPLAINED {
        return Next::End(End::Unexplained);
    }
    Next::Explore
}

/// Whether no readings that are left in the budget would tell the rivals apart: as many rounds like this one would not.
pub(crate) fn is_inseparable(
    standing: &Standing,
    batch: &Batch,
    earlier: &[Round],
    readings: usize,
    settings: &ClosedLoop,
) -> bool {
    if standing.verdict != Verdict::Ambiguous || standing.agreeing(earlier) < AGREEING {
        return false;
    }
    let left = settings.most_readings.saturating_sub(readings) as f64;
    let rounds = left / settings.round_readings as f64;
    let rivals = standing.named.iter().skip(1);
    let apart = |rival: &Vec<EffectId>| {
        let place = standing.probabilities.iter().position(|(ids, _)| ids == rival)?;
        batch.apart.get(place.checked_sub(1)?).copied()
    };
    let apart: Vec<f64> = rivals.filter_map(apart).collect();
    !apart.is_empty() && apart.iter().all(|nats| nats * rounds < WORTH_PARTING)
}

/// A round that goes on, in words.
pub(crate) fn going_on(standing: &Standing, round: &Round) -> String {
    let taken_back = taken_back(round.verification.as_ref());
    let next = match (round.purpose, &round.cure) {
        (Purpose::Verify, Some(Cure { folder: Some(folder), .. })) => {
            format!("fresh readings to test it with the set-up corrected in {folder}")
        }
        (Purpose::Verify, _) => "fresh readings to test it".to_owned(),
        _ => "readings to tell the rest apart".to_owned(),
    };
    format!(
        "After {} readings: {}.{taken_back} Next {} {next}.",
        round.before,
        standing.in_words(),
        round.readings
    )
}

/// That a cause did not hold, and why; nothing where none failed.
pub(crate) fn taken_back(tested: Option<&Verification>) -> String {
    match tested {
        Some(failed) if !failed.holds => {
            format!(" {} The cause is taken back.", why_it_failed(failed))
        }
        _ => String::new(),
    }
}

fn why_it_failed(failed: &Verification) -> String {
    let noise = |chi_square: f64| format!("{:.2} times the noise", chi_square.sqrt());
    match failed.corrected {
        Some(file) if failed.chi_square <= Verification::MOST_CHI_SQUARE => format!(
            "The corrected set-up did not hold on fresh readings: it leaves {}, and its simulation is {:.2} standard deviations of a \
             reading away from the fit.",
            noise(file.chi_square),
            file.departure
        ),
        _ => format!("It did not hold on fresh readings ({}).", noise(failed.chi_square)),
    }
}

/// A cause that held, in words.
fn held(test: &Verification, cure: &Cure) -> String {
    let percent = |(gap, error): (f64, f64)| format!("{:.1} ± {:.1} %", 100.0 * gap, 100.0 * error);
    let by = match &cure.folder {
        Some(folder) => format!("simulated with the corrected set-up ({folder})"),
        None => "with the cause as it was fitted".to_owned(),
    };
    let accounted = match joined(&cure.accounted(), " and ") {
        none if none.is_empty() => String::new(),
        effects => format!(" No set-up file holds {effects}: accounted for as fitted."),
    };
    format!(
        "It holds on {} fresh readings: {by}, their gap falls from {} to {}, and noise alone leaves {:.1} %.{accounted}",
        test.readings,
        percent((test.gap_before, test.gap_before_error)),
        percent(test.left()),
        100.0 * test.noise
    )
}

/// The end in words.
pub(crate) fn in_words(end: End, tested: Option<(&Verification, &Cure)>) -> String {
    match (end, tested) {
        (End::Verified, Some((test, cure))) => held(test, cure),
        (End::Verified | End::Explained, _) => "The cause is known.".to_owned(),
        (End::NoGap, _) => "Scan and simulation agree within the noise.".to_owned(),
        (End::Inseparable, _) => {
            "No readings of this rig within its budget would tell them apart.".to_owned()
        }
        (End::Unexplained, _) => {
            format!(
                "It has been so for {UNEXPLAINED} rounds: the cause is outside of the catalogue."
            )
        }
        (End::Readings, _) => "The readings of the plan are used up.".to_owned(),
        (End::Time, _) => "The time of the plan is used up.".to_owned(),
        (End::Sounding, _) => "The sounding time of the plan is used up.".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flights::Course;
    use fieldgap_acoustics::Vec3;
    use fieldgap_records::BoxMm;

    /// Enough to show the smallest gap.
    const N: usize = 1100;

    fn settings() -> ClosedLoop {
        ClosedLoop::within(BoxMm { least: Vec3::zeros(), most: Vec3::repeat(100.0) })
    }

    fn standing(verdict: Verdict, named: &[EffectId], probability: f64) -> Standing {
        Standing {
            verdict,
            named: if named.is_empty() { Vec::new() } else { vec![named.to_vec()] },
            probabilities: vec![
                (named.to_vec(), probability),
                (vec![EffectId::Lag], 1.0 - probability),
            ],
            outside: 0.02,
        }
    }

    fn round(verdict: Verdict, named: &[EffectId]) -> Round {
        Round {
            round: 0,
            purpose: Purpose::Explore,
            before: 0,
            readings: 96,
            drives: [1, 11],
            verdict: Some(verdict),
            named: if named.is_empty() { Vec::new() } else { vec![named.to_vec()] },
            probabilities: Vec::new(),
            outside: 0.02,
            expected_bits: None,
            expected_s: 10.0,
            cure: None,
            verification: None,
            end: None,
            reason: String::new(),
        }
    }

    #[test]
    fn a_cause_is_verified_when_two_rounds_agree() {
        let now = standing(Verdict::Explained, &[EffectId::Pitch], 0.99);
        let same = round(Verdict::Explained, &[EffectId::Pitch]);
        let other = round(Verdict::Explained, &[EffectId::Skew]);
        assert_eq!(next(&now, &[], N, &settings()), Next::Explore);
        assert_eq!(next(&now, std::slice::from_ref(&other), N, &settings()), Next::Explore);
        assert_eq!(next(&now, std::slice::from_ref(&same), N, &settings()), Next::Verify);
        let unverified = ClosedLoop { verify_readings: 0, ..settings() };
        assert_eq!(
            next(&now, std::slice::from_ref(&same), N, &unverified),
            Next::End(End::Explained)
        );
        // A further cause beside it would not have shown in so few.
        assert_eq!(next(&now, std::slice::from_ref(&same), 480, &settings()), Next::Explore);
        // A probability below the one asked for is not enough, however many rounds agree.
        let doubtful = standing(Verdict::Explained, &[EffectId::Pitch], 0.9);
        assert_eq!(next(&doubtful, &[same.clone(), same], N, &settings()), Next::Explore);
    }

    #[test]
    fn a_verification_that_failed_does_not_count_as_agreement() {
        let now = standing(Verdict::Explained, &[EffectId::Pitch], 0.99);
        let same = round(Verdict::Explained, &[EffectId::Pitch]);
        let failed = Round { purpose: Purpose::Verify, ..same.clone() };
        assert_eq!(next(&now, &[same, failed], N, &settings()), Next::Explore);
    }

    #[test]
    fn no_gap_and_no_explanation_end_the_loop() {
        let none = standing(Verdict::None, &[], 0.97);
        assert_eq!(
            next(&none, &[round(Verdict::None, &[])], N, &settings()),
            Next::End(End::NoGap)
        );
        let few = next(&none, &[round(Verdict::None, &[])], 1000, &settings());
        assert_eq!(few, Next::Explore);
        let unexplained = standing(Verdict::Unexplained, &[], 0.5);
        let rounds = vec![round(Verdict::Unexplained, &[]); UNEXPLAINED - 1];
        assert_eq!(next(&unexplained, &rounds[1..], N, &settings()), Next::Explore);
        assert_eq!(next(&unexplained, &rounds, N, &settings()), Next::End(End::Unexplained));
    }

    #[test]
    fn rivals_that_the_budget_cannot_part_are_inseparable() {
        let rivals = Standing {
            verdict: Verdict::Ambiguous,
            named: vec![vec![EffectId::Pitch], vec![EffectId::SoundSpeed]],
            probabilities: vec![(vec![EffectId::Pitch], 0.5), (vec![EffectId::SoundSpeed], 0.5)],
            outside: 0.02,
        };
        let before = Round { named: rivals.named.clone(), ..round(Verdict::Ambiguous, &[]) };
        let batch =
            |nats| Batch { course: Course::default(), information: None, apart: vec![nats] };
        let is = |nats, earlier: &[Round]| {
            is_inseparable(&rivals, &batch(nats), earlier, 840, &settings())
        };
        // Ten rounds are left, and a nat is wanted.
        assert!(is(0.08, std::slice::from_ref(&before)));
        assert!(!is(0.12, std::slice::from_ref(&before)));
        assert!(!is(0.08, &[]));
    }
}
