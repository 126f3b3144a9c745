//! Where each candidate stands against the best one.

use fieldgap_text::significant;

use crate::effect_id::joined;
use crate::result::{Candidate, Diagnosis};

/// How far a candidate is behind the best, by its odds; the limits and what they are worth are those of R. E. Kass and
/// A. E. Raftery, "Bayes factors", J. Am. Stat. Assoc. 90, 773 (1995), sec. 3.2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// It is the best.
    Best,
    /// Odds up to 1 : 3, not worth more than a bare mention.
    Level,
    /// Odds up to 1 : 20.
    Behind,
    /// Odds up to 1 : 150.
    Unlikely,
    /// Beyond.
    RuledOut,
}

impl std::fmt::Display for Standing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Best => "best",
            Self::Level => "as good",
            Self::Behind => "less likely",
            Self::Unlikely => "unlikely",
            Self::RuledOut => "ruled out",
        })
    }
}

impl Candidate {
    /// What it is called: its effects, or `no effect`.
    pub fn name(&self) -> String {
        if self.effects.is_empty() { "no effect".to_owned() } else { joined(&self.effects, " + ") }
    }

    /// Natural logarithm of the odds of `best` against this one: 0 where they are level, large where this one is out of the
    /// question.
    pub fn ln_odds_against(&self, best: &Candidate) -> f64 {
        if self.probability > 0.0 && best.probability > 0.0 {
            (best.probability / self.probability).ln()
        } else {
            // Too improbable for a probability; the evidence still tells how much.
            best.log_evidence - self.log_evidence
        }
    }
}

impl Diagnosis {
    /// The candidate that the diagnosis stands for: the named one, else the most probable.
    pub fn best(&self) -> Option<&Candidate> {
        let named = || self.ranked.iter().find(|candidate| candidate.effects == self.effects);
        let named = if self.verdict.names_a_cause() { named() } else { None };
        named.or_else(|| self.ranked.first())
    }

    /// Where one of the ranked candidates stands, and its odds against the best as a reader writes them: `1 : 42`.
    pub fn standing(&self, candidate: &Candidate) -> (Standing, String) {
        let Some(best) = self.best().filter(|best| *best != candidate) else {
            return (Standing::Best, "best".to_owned());
        };
        let ln_odds = candidate.ln_odds_against(best);
        let standing = match ln_odds.exp() {
            ..=3.0 => Standing::Level,
            ..=20.0 => Standing::Behind,
            ..=150.0 => Standing::Unlikely,
            _ => Standing::RuledOut,
        };
        (standing, odds(ln_odds))
    }

    /// The candidates that are still in question, the best among them.
    pub fn contenders(&self) -> Vec<&Candidate> {
        self.ranked.iter().filter(|candidate| !self.is_out(candidate)).collect()
    }

    /// The candidates that these readings speak strongly against, the most probable first.
    pub fn ruled_out(&self) -> Vec<&Candidate> {
        self.ranked.iter().filter(|candidate| self.is_out(candidate)).collect()
    }

    fn is_out(&self, candidate: &Candidate) -> bool {
        matches!(self.standing(candidate).0, Standing::Unlikely | Standing::RuledOut)
    }
}

/// Odds as one writes them, the smaller number first. Beyond some power no model is right enough to tell more.
fn odds(ln_odds: f64) -> String {
    const LARGEST_POWER: f64 = 12.0;
    let power = ln_odds / std::f64::consts::LN_10;
    if power > LARGEST_POWER {
        format!("beyond 1 : 10^{LARGEST_POWER}")
    } else if power < 4.0 {
        format!("1 : {}", significant(ln_odds.exp(), 2))
    } else {
        format!("1 : 10^{power:.0}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odds_are_written_as_people_do() {
        assert_eq!(odds(0.0), "1 : 1.0");
        assert_eq!(odds(42f64.ln()), "1 : 42");
        assert_eq!(odds(1234f64.ln()), "1 : 1234");
        assert_eq!(odds(1e5f64.ln()), "1 : 10^5");
        assert_eq!(odds(f64::INFINITY), "beyond 1 : 10^12");
    }
}
