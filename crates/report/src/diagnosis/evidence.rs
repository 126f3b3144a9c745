//! The probability of each candidate, as bars.

use super::super::picture::{Align, Bar, BarChart, Weight};
use fieldgap_diagnosis::{Candidate, Diagnosis, Standing};
use fieldgap_text::{fixed, raised};

/// More candidates than these are not drawn; the others are less probable.
pub(super) const MOST_BARS: usize = 12;
/// The least probability that is drawn, as a power of ten.
const LEAST_POWER: f64 = -12.0;

/// The bars of the ranked candidates on a scale of powers of ten; `None` without candidates.
pub(super) fn chart(diagnosis: &Diagnosis) -> Option<BarChart> {
    let best = diagnosis.best()?;
    let power = |candidate: &Candidate| {
        let ln_probability = best.probability.ln() - candidate.ln_odds_against(best);
        (ln_probability / std::f64::consts::LN_10).clamp(LEAST_POWER, 0.0)
    };
    let shown: Vec<&Candidate> = diagnosis.ranked.iter().take(MOST_BARS).collect();
    let least = shown.iter().map(|candidate| power(candidate)).fold(-3.0, f64::min);
    // To a whole number of thousands, so that the ticks come out round.
    let least = 3.0 * (least / 3.0).floor();
    let bars = shown.iter().map(|candidate| {
        let (standing, odds) = diagnosis.standing(candidate);
        Bar {
            name: candidate.name(),
            from: least,
            to: power(candidate),
            note: note(candidate, standing, &odds),
            weight: match standing {
                Standing::Best => Weight::Strong,
                Standing::Level | Standing::Behind => Weight::Plain,
                Standing::Unlikely | Standing::RuledOut => Weight::Faint,
            },
        }
    });
    let tick = |power: i32| {
        let label = match power {
            0 => "1".to_owned(),
            -3 => "0.001".to_owned(),
            power => raised(&format!("10^{power}")),
        };
        (f64::from(power), label)
    };
    let limit = |odds: f64| power(best) - odds.log10();
    Some(BarChart {
        bars: bars.collect(),
        range: (least, 0.0),
        ticks: (least as i32..=0).step_by(3).map(tick).collect(),
        label: "probability".to_owned(),
        guides: vec![
            (limit(150.0), "ruled out", Align::Left),
            (limit(20.0), "possible", Align::Right),
        ],
        description: description(diagnosis, &shown),
    })
}

fn note(candidate: &Candidate, standing: Standing, odds: &str) -> String {
    match standing {
        Standing::Best | Standing::Level | Standing::Behind => fixed(candidate.probability, 3),
        Standing::Unlikely | Standing::RuledOut => raised(odds),
    }
}

fn description(diagnosis: &Diagnosis, shown: &[&Candidate]) -> String {
    let of = |candidate: &&Candidate| {
        let (standing, odds) = diagnosis.standing(candidate);
        format!("{} {}", candidate.name(), note(candidate, standing, &odds))
    };
    let candidates: Vec<String> = shown.iter().map(of).collect();
    format!(
        "Bar chart of the probability of each candidate, or of its odds against the best if it is unlikely: {}.",
        candidates.join("; ")
    )
}
