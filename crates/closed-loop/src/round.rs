//! What a closed loop decided, round by round: `rounds.jsonl` in the folder of the record.

use std::path::Path;

use fieldgap_diagnosis::{CorrectedTest, EffectId, FreshTest, Verdict};
use serde::{Deserialize, Serialize};

use crate::budget::UsedUp;
use crate::cure::Cure;
use crate::log::{LoggedRound, RoundsError, parse_log, read_log};

/// The file.
pub const FILE: &str = "rounds.jsonl";

/// What the readings of a round are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Purpose {
    /// A first look, spread evenly.
    First,
    /// To tell the sets apart.
    Explore,
    /// Fresh readings that test the named cause.
    Verify,
    /// None: the loop has ended.
    End,
}

/// Why a loop ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// One cause explains the gap, and it holds on fresh readings.
    Verified,
    /// One cause explains the gap; the plan wanted no verification.
    Explained,
    /// There is no gap.
    NoGap,
    /// Rivals are left that no reading of this rig would tell apart within its budget.
    Inseparable,
    /// No set of the catalogue explains the gap.
    Unexplained,
    /// The readings of the plan are used up.
    Readings,
    /// The time of the plan is used up.
    Time,
    /// The time with the array driven is used up.
    Sounding,
}

/// A set of effects and its probability.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Likely {
    /// The set; empty for the set-up as believed.
    pub effects: Vec<EffectId>,
    /// Its probability.
    pub probability: f64,
}

/// A cause held against fresh readings; see [`FreshTest`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// Fresh readings.
    pub readings: usize,
    /// Gap of the simulation as believed.
    pub gap_before: f64,
    /// Its standard error.
    pub gap_before_error: f64,
    /// Gap with the cause accounted for as it was fitted to the earlier readings.
    pub gap_after: f64,
    /// Its standard error.
    pub gap_after_error: f64,
    /// What noise alone leaves.
    pub noise: f64,
    /// Mean square of the standardized residuals, with the cause as fitted.
    pub chi_square: f64,
    /// The simulation with the corrected set-up; `None` where no file holds any of the cause.
    pub corrected: Option<Corrected>,
    /// Whether the cause holds: as fitted and, where there is one, in the corrected set-up.
    pub holds: bool,
}

/// Fresh readings simulated with the corrected set-up; see [`CorrectedTest`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Corrected {
    /// Gap of its simulation.
    pub gap: f64,
    /// Its standard error.
    pub gap_error: f64,
    /// Mean square of the standardized residuals.
    pub chi_square: f64,
    /// Departure of its simulation from that of the fit, in standard deviations of a reading.
    pub departure: f64,
}

/// One decision: what was known, and what is measured next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Round {
    /// Its number, from 0.
    pub round: usize,
    /// What its readings are for.
    pub purpose: Purpose,
    /// Readings before it.
    pub before: usize,
    /// Readings that it takes.
    pub readings: usize,
    /// Drives of the plan, and all drives with those that the loop added.
    pub drives: [usize; 2],
    /// The verdict on the readings before it; `None` before the first.
    pub verdict: Option<Verdict>,
    /// The named set, or the rivals.
    pub named: Vec<Vec<EffectId>>,
    /// The most probable sets.
    pub probabilities: Vec<Likely>,
    /// Probability that no set of the catalogue holds the cause; those of the sets are within the rest.
    pub outside: f64,
    /// Information about the cause that its readings are expected to give, bits.
    pub expected_bits: Option<f64>,
    /// Time that its readings are expected to take, s.
    pub expected_s: f64,
    /// What was corrected for its readings to test; `None` but in a verification.
    pub cure: Option<Cure>,
    /// How the cause did on the fresh readings of the round before.
    pub verification: Option<Verification>,
    /// Why the loop ended; `None` while it goes on.
    pub end: Option<End>,
    /// The decision in a sentence.
    pub reason: String,
}

impl LoggedRound for Round {
    const FILE: &'static str = FILE;

    fn number(&self) -> usize {
        self.round
    }

    fn before(&self) -> usize {
        self.before
    }

    fn forget_readings(&mut self) {
        self.readings = 0;
    }
}

impl From<UsedUp> for End {
    fn from(used_up: UsedUp) -> Self {
        match used_up {
            UsedUp::Readings => Self::Readings,
            UsedUp::Time => Self::Time,
            UsedUp::Sounding => Self::Sounding,
        }
    }
}

impl Verification {
    /// The limit of the mean square: 1.2 times the noise.
    pub const MOST_CHI_SQUARE: f64 = 1.44;

    /// The limit of the departure of the corrected set-up from the fit, in standard deviations of a reading. Both simulate one cause with the
    /// same numbers but for their rounding, which is a tenth of their errors. Set by judgement: it would add a quarter to the mean square.
    pub const MOST_DEPARTURE: f64 = 0.5;

    /// The result of a test on fresh readings. The cause holds if the residual is within 1.2 times the noise, or within two
    /// standard errors of it where the readings are few, with the cause as fitted and with the corrected set-up, and if both agree.
    pub fn of(test: FreshTest, corrected: Option<CorrectedTest>) -> Self {
        let most = Self::MOST_CHI_SQUARE.max(1.0 + 2.0 * test.standard_error());
        let file_holds = |file: &CorrectedTest| {
            file.chi_square <= most && file.departure <= Self::MOST_DEPARTURE
        };
        Self {
            readings: test.readings,
            gap_before: test.gap_before,
            gap_before_error: test.gap_before_error,
            gap_after: test.gap_after,
            gap_after_error: test.gap_after_error,
            noise: test.noise,
            chi_square: test.chi_square,
            holds: test.chi_square <= most && corrected.as_ref().is_none_or(file_holds),
            corrected: corrected.map(|file| Corrected {
                gap: file.gap,
                gap_error: file.gap_error,
                chi_square: file.chi_square,
                departure: file.departure,
            }),
        }
    }

    /// What is left once the cause is corrected, with its standard error: by the corrected set-up where there is one.
    pub fn left(&self) -> (f64, f64) {
        match self.corrected {
            Some(file) => (file.gap, file.gap_error),
            None => (self.gap_after, self.gap_after_error),
        }
    }
}

/// The correction that held on fresh readings, of a loop that ended with one.
pub fn verified(rounds: &[Round]) -> Option<&Cure> {
    match rounds {
        [.., tested, end] if end.end == Some(End::Verified) => tested.cure.as_ref(),
        _ => None,
    }
}

/// Reads the rounds of the record in `folder`; none without the file.
///
/// # Errors
/// [`RoundsError`] if the file cannot be read or a line of it is no round.
pub fn read_rounds(folder: &Path) -> Result<Vec<Round>, RoundsError> {
    read_log(folder)
}

/// Reads the text of a `rounds.jsonl`.
///
/// # Errors
/// [`RoundsError::Line`] at the first line that is no round, or that is out of order.
pub fn parse_rounds(path: &Path, text: &str) -> Result<Vec<Round>, RoundsError> {
    parse_log(path, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round(number: usize) -> Round {
        Round {
            round: number,
            purpose: Purpose::Explore,
            before: 240,
            readings: 96,
            drives: [1, 11],
            verdict: Some(Verdict::Ambiguous),
            named: vec![vec![EffectId::Pitch], vec![EffectId::SoundSpeed]],
            probabilities: vec![Likely { effects: vec![EffectId::Pitch], probability: 0.5 }],
            outside: 0.02,
            expected_bits: Some(0.7),
            expected_s: 21.0,
            cure: None,
            verification: None,
            end: None,
            reason: "two sets are left".to_owned(),
        }
    }

    #[test]
    fn rounds_are_read_as_written() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(read_rounds(folder.path()).expect("none"), []);
        let rounds = [round(0), round(1)];
        crate::log::write_log(folder.path(), &rounds).expect("written");
        assert_eq!(read_rounds(folder.path()).expect("there"), rounds);
    }

    #[test]
    fn a_line_that_is_no_round_is_named() {
        let line = |number| serde_json::to_string(&round(number)).expect("JSON");
        let text = format!("{}\n{{}}\n", line(0));
        let error = parse_rounds(Path::new("rounds.jsonl"), &text).expect_err("no round");
        assert!(error.to_string().starts_with("rounds.jsonl, line 2: "), "{error}");
        let text = format!("{}\n{}\n", line(0), line(2));
        let error = parse_rounds(Path::new("rounds.jsonl"), &text).expect_err("one is missing");
        assert!(error.to_string().contains("round 2 stands where 1 is due"), "{error}");
    }

    #[test]
    fn a_cause_holds_within_a_fifth_of_the_noise() {
        let fresh = |readings, chi_square| FreshTest {
            readings,
            gap_before: 0.1,
            gap_before_error: 0.01,
            gap_after: 0.02,
            gap_after_error: 0.002,
            noise: 0.02,
            chi_square,
        };
        let test = |readings, chi_square| Verification::of(fresh(readings, chi_square), None).holds;
        assert!(test(64, 1.4) && !test(64, 1.5));
        // Sixteen readings scatter by a third.
        assert!(test(16, 1.7) && !test(16, 1.75));
        // Neither may the corrected set-up leave more, nor be another than the fit.
        let file = |chi_square, departure| {
            let file = CorrectedTest { gap: 0.02, gap_error: 0.002, chi_square, departure };
            Verification::of(fresh(64, 1.0), Some(file)).holds
        };
        assert!(file(1.4, 0.1) && !file(1.5, 0.1) && !file(1.4, 0.6));
    }
}
