//! The probability of a candidate, and how it compares with the best, in words and numbers.

use fieldgap_diagnosis::{Candidate, Diagnosis};
use fieldgap_text::{fixed, raised, significant};

/// Probabilities below this one are not told: no model is right enough.
const LEAST_PROBABILITY: f64 = 1e-6;
/// The same of odds.
const LARGEST_ODDS: f64 = 1e12;
/// Odds from which on their power of ten says enough.
const LARGE_ODDS: f64 = 9.95e5;

/// A probability between 0 and 1.
pub(super) fn probability(probability: f64) -> String {
    match probability {
        above if above > 0.9995 => "above 0.999".to_owned(),
        common if common >= 1e-3 => fixed(common, 3),
        rare if rare >= LEAST_PROBABILITY => significant(rare, 1),
        _ => raised("below 10^-6"),
    }
}

/// How many times less likely a candidate is than the best account.
pub(super) fn against_best(diagnosis: &Diagnosis, candidate: &Candidate) -> String {
    let Some(best) = diagnosis.best().filter(|best| *best != candidate) else {
        return "the best account".to_owned();
    };
    let odds = candidate.ln_odds_against(best).exp();
    match odds {
        odds if odds > LARGEST_ODDS => {
            raised("more than 10^12 times less likely than the best account")
        }
        odds if odds >= LARGE_ODDS => raised(&format!(
            "about 10^{} times less likely than the best account",
            odds.log10().round()
        )),
        odds if odds >= 1.05 => format!("{} times less likely than the best account", times(odds)),
        odds if odds > 0.95 => "as likely as the best account".to_owned(),
        odds => format!("{} times more likely than the best account", times(1.0 / odds)),
    }
}

/// A factor of one to a million: two digits, thousands set apart.
fn times(factor: f64) -> String {
    let power = 10f64.powf(factor.log10().floor() - 1.0);
    let rounded = (factor / power).round() * power;
    if rounded < 10.0 {
        return fixed(rounded, 1);
    }
    let digits = fixed(rounded, 0);
    match digits.len() {
        ..=3 => digits,
        length => format!("{},{}", &digits[..length - 3], &digits[length - 3..]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_have_two_digits() {
        let pairs = [
            (1.06, "1.1"),
            (9.96, "10"),
            (42.4, "42"),
            (157.0, "160"),
            (999.0, "1,000"),
            (3241.0, "3,200"),
            (612_345.0, "610,000"),
        ];
        for (factor, words) in pairs {
            assert_eq!(times(factor), words);
        }
    }

    #[test]
    fn small_probabilities_are_told_as_far_as_a_model_goes() {
        assert_eq!(probability(0.99999), "above 0.999");
        assert_eq!(probability(0.9928), "0.993");
        assert_eq!(probability(0.00031), "0.0003");
        assert_eq!(probability(3e-5), "3 × 10⁻⁵");
        assert_eq!(probability(0.0), "below 10⁻⁶");
    }
}
