//! The verdict in one sentence, and the gaps that it states.

use fieldgap_text::{listed, percent};

use crate::effect_id::EffectId;
use crate::residual_structure::ResidualStructure;
use crate::residual_structure::test::Test;
use crate::result::{Candidate, Remainder, Verdict, WithinUncertainty};
use crate::verdict::judgement::Judgement;

/// Gaps relative to the scan's root mean square.
pub(crate) struct Gaps {
    /// Of the nominal simulation.
    pub before: f64,
    /// The same over readings kept out of the fit.
    pub before_held_out: f64,
    /// Of noise alone.
    pub noise: f64,
}

impl Gaps {
    /// Share of the squared gap beyond noise that a candidate explains, 0 to 1, over readings kept out of the fit; `after_held_out` is
    /// the gap that it leaves there.
    pub fn explained_fraction(&self, after_held_out: f64) -> f64 {
        let beyond_noise = |gap: f64| gap * gap - self.noise * self.noise;
        let before = beyond_noise(self.before_held_out);
        match before > 0.0 {
            true => (1.0 - beyond_noise(after_held_out) / before).clamp(0.0, 1.0),
            false => 0.0,
        }
    }

    /// Whether the gap is hardly larger than noise alone, so that it does not tell how much of it an effect explains.
    fn is_faint(&self) -> bool {
        self.before < FAINT_GAP * self.noise
    }
}

/// Gaps below this, relative to noise alone, are faint: their square exceeds the noise's by a fifth, about what the noise itself is
/// uncertain by.
const FAINT_GAP: f64 = 1.1;

/// What the sentence rests on.
pub(crate) struct Basis<'b> {
    /// Which set is named.
    pub judgement: &'b Judgement,
    /// What the best set leaves.
    pub structure: &'b ResidualStructure,
    /// The candidates, the best first; those that are named among them.
    pub ranked: &'b [Candidate],
    /// What noise and the scatter of each candidate's own effects leave.
    pub noise_beside: &'b [f64],
    /// The gaps.
    pub gaps: &'b Gaps,
    /// What the best candidate leaves beyond noise.
    pub remainder: Option<&'b Remainder>,
    /// Whether all effects of the catalogue were tried.
    pub all_tried: bool,
    /// What the stated uncertainty of the set-up explains, where it is stated.
    pub uncertainty: Option<&'b WithinUncertainty>,
}

impl Basis<'_> {
    /// The verdict in one sentence, or two where not all is explained.
    pub fn sentence(&self) -> String {
        let Self { judgement, ranked, gaps, .. } = self;
        let within = self.uncertainty.map_or(String::new(), |within| {
            format!("within the stated uncertainty of the set-up: {}; ", percent(within.gap))
        });
        let gap = format!(
            "The gap of {} ({}noise alone: {})",
            percent(gaps.before),
            within,
            percent(gaps.noise)
        );
        match judgement.verdict {
            Verdict::Explained => {
                let number = judgement.named[0];
                let meaning = ranked[number].readings.join("; ");
                if gaps.is_faint() {
                    let names = names(&ranked[number].effects);
                    return format!(
                        "{gap} is hardly larger than noise. What exceeds noise is explained by {names}: {meaning}."
                    );
                }
                format!("{gap} is explained by {}: {meaning}.", self.reduced(number))
            }
            Verdict::MostlyExplained => {
                let number = judgement.named[0];
                let meaning = ranked[number].readings.join("; ");
                let rest = self.remainder.map_or(String::new(), |remainder| {
                    if !remainder.left_to.is_empty() {
                        return left_to(remainder);
                    }
                    let looks_like = first_few(&remainder.looks_like);
                    match remainder.gap > 0.0 {
                        true => format!(
                            " The remaining {} is not noise ({looks_like}).",
                            percent(remainder.gap)
                        ),
                        // The noise is known to some percent, and tests find patterns far below it.
                        false => format!(
                            " What is left is no larger than noise, but has structure ({looks_like})."
                        ),
                    }
                });
                format!("{gap} is mostly explained by {}: {meaning}.{rest}", self.reduced(number))
            }
            Verdict::Ambiguous => {
                let rivals = judgement.named.iter().map(|&n| names(&ranked[n].effects));
                let named = rivals.collect::<Vec<_>>().join(", or by ");
                match judgement.rivals > judgement.named.len() {
                    false => format!(
                        "{gap} is explained equally well by {named}; these data cannot distinguish them."
                    ),
                    true => format!(
                        "{gap} is explained about equally well by {} sets of effects, which these data cannot distinguish; the likeliest: by {named}.",
                        judgement.rivals
                    ),
                }
            }
            Verdict::Unexplained => self.unexplained(&gap, &ranked[0]),
            Verdict::None => match self.uncertainty {
                Some(_) => format!("{gap} is no gap beyond noise and that uncertainty."),
                None => {
                    format!("{gap} is no gap beyond noise: the nominal set-up explains the scan.")
                }
            },
        }
    }

    /// The effects of a candidate, and what they reduce the gap to. Effects that scatter the readings do not predict them, so that what
    /// they leave is compared with their own scatter.
    fn reduced(&self, number: usize) -> String {
        let Candidate { effects, gap_after, .. } = &self.ranked[number];
        let verb = if effects.len() == 1 { "reduces" } else { "reduce" };
        let reduced = format!("{}, which {verb} it to {}", names(effects), percent(*gap_after));
        let scatter = self.noise_beside[number];
        match scatter > FAINT_GAP * self.gaps.noise {
            true => format!("{reduced} (noise and their scatter: {})", percent(scatter)),
            false => reduced,
        }
    }

    fn unexplained(&self, gap: &str, best: &Candidate) -> String {
        let failed = self.structure.tests.iter().filter(|test| test.fails());
        let failed: Vec<String> = failed.map(Test::in_words).collect();
        let why = match self.judgement.too_faint {
            true => "so faint a gap seldom comes from several effects at once".to_owned(),
            false => format!("the residual is not noise ({})", failed.join("; ")),
        };
        let nearest = match &best.effects[..] {
            [] => "no effect fits better than the nominal set-up,".to_owned(),
            [one] => format!("{one} comes nearest"),
            several => format!("{} come nearest", names(several)),
        };
        let tried = if self.all_tried { "the catalogue" } else { "the effects that were tried" };
        format!("{gap} is not explained by {tried}: {nearest} and {why}.")
    }
}

/// That others explain what a part of many effects leaves.
fn left_to(remainder: &Remainder) -> String {
    let left = match remainder.gap > 0.0 {
        true => format!("The remaining {}", percent(remainder.gap)),
        false => "What is left, no larger than noise,".to_owned(),
    };
    let sets: Vec<String> = remainder.left_to.iter().map(|set| names(set)).collect();
    match &sets[..] {
        [one] => format!(" {left} may be due to {one}, or to noise."),
        several => format!(
            " {left} is explained equally well by {}; these data cannot distinguish them.",
            several.join(", or by ")
        ),
    }
}

/// The first of a list, with how many more there are; a sentence has room for three.
fn first_few(all: &[String]) -> String {
    const FEW: usize = 3;
    match all.len() {
        0..=FEW => all.join("; "),
        more => format!("{}; and {} more tests", all[..FEW].join("; "), more - FEW),
    }
}

/// Effects as a sentence lists them.
fn names(effects: &[EffectId]) -> String {
    match effects {
        [] => "no effect".to_owned(),
        _ => listed(&effects.iter().map(EffectId::to_string).collect::<Vec<_>>()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_part_leaves_is_left_to_others() {
        let remainder = |gap: f64, left_to: &[&[EffectId]]| Remainder {
            share: 0.01,
            gap,
            looks_like: vec!["neighbours alike: 5 σ".to_owned()],
            left_to: left_to.iter().map(|set| set.to_vec()).collect(),
        };
        assert_eq!(
            left_to(&remainder(0.02, &[&[EffectId::Flow, EffectId::Lag], &[EffectId::Pitch]])),
            format!(
                " The remaining {} is explained equally well by flow and lag, or by pitch; these data cannot distinguish them.",
                percent(0.02)
            )
        );
        assert_eq!(
            left_to(&remainder(0.0, &[&[EffectId::Pitch]])),
            " What is left, no larger than noise, may be due to pitch, or to noise."
        );
    }
}
