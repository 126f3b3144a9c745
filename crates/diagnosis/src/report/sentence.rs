//! The verdict in one sentence, and the gaps that it states.

use crate::effect_id::{EffectId, joined};
use crate::residual_structure::ResidualStructure;
use crate::result::{Candidate, Verdict};
use crate::verdict::judgement::Judgement;

/// Gaps relative to the scan's root mean square.
pub(crate) struct Gaps {
    /// Of the nominal simulation.
    pub before: f64,
    /// The same over readings kept out of the fit.
    pub before_held_out: f64,
    /// With the best candidate added, over readings kept out of the fit.
    pub after_held_out: f64,
    /// Of noise alone.
    pub noise: f64,
}

impl Gaps {
    /// Share of the squared gap beyond noise that the best candidate explains, 0 to 1, over readings kept out of the fit.
    pub fn explained_fraction(&self) -> f64 {
        let beyond_noise = |gap: f64| gap * gap - self.noise * self.noise;
        let before = beyond_noise(self.before_held_out);
        match before > 0.0 {
            true => (1.0 - beyond_noise(self.after_held_out) / before).clamp(0.0, 1.0),
            false => 0.0,
        }
    }
}

/// What the sentence rests on.
pub(crate) struct Basis<'b> {
    /// Which set is named.
    pub judgement: &'b Judgement,
    /// What the best set leaves.
    pub structure: &'b ResidualStructure,
    /// The candidates, the best first; those that are named among them.
    pub ranked: &'b [Candidate],
    /// The gaps.
    pub gaps: &'b Gaps,
}

impl Basis<'_> {
    /// The verdict in one sentence.
    pub fn sentence(&self) -> String {
        let Self { judgement, ranked, gaps, .. } = self;
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let gap =
            format!("The gap of {} (noise alone: {})", percent(gaps.before), percent(gaps.noise));
        match judgement.verdict {
            Verdict::Explained => {
                let best = &ranked[judgement.named[0]];
                format!(
                    "{gap} is explained by {}, which {} {} of it beyond noise: {}.",
                    names(&best.effects),
                    if best.effects.len() == 1 { "explains" } else { "explain" },
                    percent(gaps.explained_fraction()),
                    best.readings.join("; ")
                )
            }
            Verdict::Ambiguous => {
                let rivals = judgement.named.iter().map(|&n| names(&ranked[n].effects));
                format!(
                    "{gap} is explained equally well by {}; these data cannot distinguish them.",
                    rivals.collect::<Vec<_>>().join(", or by ")
                )
            }
            Verdict::Unexplained => self.unexplained(&gap, &ranked[0]),
            Verdict::None => {
                format!("{gap} is no gap beyond noise: the nominal set-up explains the scan.")
            }
        }
    }

    fn unexplained(&self, gap: &str, best: &Candidate) -> String {
        let tests = self.structure.tests.iter().filter(|test| test.fails());
        let failed: Vec<String> = tests
            .map(|test| {
                let sign = test.sign_of.as_ref().map(|sign| format!(", {sign}"));
                let digits = if test.z < 1.0 { 1 } else { 0 };
                format!("{}: {:.digits$} σ{}", test.name, test.z, sign.unwrap_or_default())
            })
            .collect();
        let why = match failed.is_empty() {
            false => format!("the residual is not noise ({})", failed.join("; ")),
            true if self.judgement.too_faint => {
                "so faint a gap seldom comes from several effects at once".to_owned()
            }
            true => "many sets of effects fit equally well".to_owned(),
        };
        let nearest = match &best.effects[..] {
            [] => "no effect fits better than the nominal set-up,".to_owned(),
            [one] => format!("{one} comes nearest"),
            several => format!("{} come nearest", names(several)),
        };
        format!("{gap} is not explained by the catalogue: {nearest} and {why}.")
    }
}

/// Effects as a sentence lists them.
fn names(effects: &[EffectId]) -> String {
    match effects.split_last() {
        Some((last, [])) => last.to_string(),
        Some((last, rest)) => format!("{} and {last}", joined(rest, ", ")),
        None => "no effect".to_owned(),
    }
}
