//! The verdict: which set of effects, if any, is named.

use super::Verdict;
use super::observations::Observations;
use super::pursuit::Tried;
use super::residual_tests::in_slow_patterns;
use super::structure::{Kind, Left, Test};

/// Probability above which a set is named alone.
const CLEAR: f64 = 0.85;

/// Probability that a set must have itself to be named for what holds it and more.
const DOES_ALONE: f64 = 0.1;

/// Probability that rivals must reach together to be named as rivals.
const TOGETHER: f64 = 0.9;

/// Most rivals that are named.
const MOST_RIVALS: usize = 3;

/// Share of the believed set-up's excess chi-square that a set may leave and still explain a gap: no effect's formula is
/// better than that.
const LEFT_OVER: f64 = 3e-3;

/// The same for several effects, which together imitate much: what two leave more must be well below the noise, and of three there
/// is no more.
const LEFT_OVER_BY_SEVERAL: f64 = 3e-4;

/// Cost a reading of the believed set-up from which on a gap is so large that a formula's own error may show.
const LARGE: f64 = 4.0;

/// What is closed of a gap in chi-square a reading, 0.4 standard deviations squared, below which it is faint: thousands of readings
/// together tell it, and what two effects close of it one cause that nobody thought of mostly does. (Of faint gaps in a thousand
/// sealed scans thirteen were said to come of two effects or three, and none did.)
const FAINT: f64 = 0.16;

/// Share of a gap that rounding errors must make up to be what is not explained of it.
const SHARE_OF_STEPS: f64 = 0.1;

/// The verdict and what it rests on.
pub(super) struct Judgement {
    pub verdict: Verdict,
    /// Numbers of the named set, or of the rivals, best first.
    pub named: Vec<usize>,
    /// Probability of each set that was tried.
    pub probabilities: Vec<f64>,
    /// Whether several effects would be named but that the gap is faint.
    pub too_faint: bool,
}

/// Judges what was tried, the best first, by what that leaves.
pub(super) fn judge(
    observations: &Observations,
    tried: &[Tried],
    believed: &Tried,
    of_best: &Left,
) -> Judgement {
    let probabilities = probabilities(tried);
    let n = observations.len() as f64;
    let excess = |cost: f64| (cost - n).max(0.0);
    // A noise judged by what is left hides what is left of chi-square, and not its structure.
    let left = excess(tried[0].fit.cost).max(in_slow_patterns(observations, &of_best.residuals));
    let share = left / excess(believed.fit.cost);
    let many =
        tried[0].fit.physical_effects() > 2 || tried[0].fit.instances.len() > 1 && left > 0.5 * n;
    let imitates = many && share > LEFT_OVER_BY_SEVERAL;
    // Of a gap within the noise nothing may be left over.
    let left_over = if believed.fit.cost > LARGE * n && !imitates { share } else { 1.0 };
    let structured = |test: &Test| match test.kind {
        Kind::NoFlaw => test.fails(),
        Kind::Pattern => test.fails() && left_over > LEFT_OVER,
        Kind::Converter => {
            let of_gap = SHARE_OF_STEPS * excess(believed.fit.cost);
            test.fails() && test.z * test.z * n > of_gap
        }
    };
    let fails = of_best.tests.iter().any(structured);
    let judgement = |verdict, named| Judgement {
        verdict,
        named,
        probabilities: probabilities.clone(),
        too_faint: false,
    };
    if fails {
        return judgement(Verdict::Unexplained, Vec::new());
    }
    // Whoever names a set says that its effects are there, and not that there are no others: what holds it and more
    // supports it.
    let support = |number: usize| -> f64 {
        let ids = tried[number].fit.ids();
        let holds = |other: &Tried| {
            let others = other.fit.ids();
            ids.iter().all(|id| others.contains(id)) && (!ids.is_empty() || others.is_empty())
        };
        tried.iter().zip(&probabilities).filter(|(t, _)| holds(t)).map(|(_, p)| p).sum()
    };
    if tried[0].fit.instances.is_empty() {
        return judgement(Verdict::None, Vec::new());
    }
    // The largest set that is certain and does alone: rivals that hold it and differ in more only add what is doubtful.
    let does_alone = |number: &usize| probabilities[*number] >= DOES_ALONE;
    let certain = (0..tried.len())
        .filter(|number| !tried[*number].fit.instances.is_empty())
        .filter(does_alone)
        .filter(|number| support(*number) >= CLEAR)
        .max_by_key(|number| tried[*number].fit.instances.len());
    let named = |verdict, named: Vec<usize>| {
        let several = named.iter().all(|&number| {
            let fit = &tried[number].fit;
            // An offset is told by a shift that nobody leaves, however faint what is left beside it.
            let told_by_shifts = usize::from(fit.ids().contains(&"offset"));
            fit.physical_effects() - told_by_shifts > 1
        });
        if several && believed.fit.cost - tried[0].fit.cost.min(n) < FAINT * n {
            return Judgement { too_faint: true, ..judgement(Verdict::Unexplained, Vec::new()) };
        }
        judgement(verdict, named)
    };
    if let Some(number) = certain {
        return named(Verdict::Explained, vec![number]);
    }
    let mut rivals: Vec<usize> = Vec::new();
    let mut together = 0.0;
    for number in 0..tried.len() {
        let ids = tried[number].fit.ids();
        let holds_a_rival =
            rivals.iter().any(|&rival| tried[rival].fit.ids().iter().all(|id| ids.contains(id)));
        if !holds_a_rival {
            rivals.push(number);
        }
        together += probabilities[number];
        if together >= TOGETHER || rivals.len() > MOST_RIVALS {
            break;
        }
    }
    if rivals.iter().any(|&rival| tried[rival].fit.instances.is_empty()) {
        return judgement(Verdict::None, Vec::new());
    }
    if let Some(common) = common_part(tried, &rivals, excess(believed.fit.cost)) {
        return named(Verdict::Explained, vec![common]);
    }
    match rivals.len() {
        1 => named(Verdict::Explained, rivals),
        2..=MOST_RIVALS => named(Verdict::Ambiguous, rivals),
        _ => judgement(Verdict::Unexplained, Vec::new()),
    }
}

/// The set that all rivals of three effects hold, where what each adds closes next to nothing of the gap: it makes up for some
/// formula's own error, and the most that can be said of it is that something does.
fn common_part(tried: &[Tried], rivals: &[usize], gap: f64) -> Option<usize> {
    /// Share of the gap that is next to nothing.
    const NEXT_TO_NOTHING: f64 = 2e-3;
    let all_hold = |part: &Tried| {
        let ids = part.fit.ids();
        rivals.iter().all(|&rival| {
            let others = tried[rival].fit.ids();
            others.len() == ids.len() + 1 && ids.iter().all(|id| others.contains(id))
        })
    };
    let of_three = rivals.iter().all(|&rival| tried[rival].fit.physical_effects() > 2);
    let nearly_closes =
        |part: &Tried| part.fit.cost - tried[rivals[0]].fit.cost < NEXT_TO_NOTHING * gap;
    (of_three && rivals.len() > 1)
        .then(|| tried.iter().position(|part| all_hold(part) && nearly_closes(part)))
        .flatten()
}

/// Evidence over the sum of all evidence.
fn probabilities(tried: &[Tried]) -> Vec<f64> {
    let best = tried[0].log_evidence;
    let weights: Vec<f64> = tried.iter().map(|t| (t.log_evidence - best).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::super::effects::{CATALOGUE, Choice};
    use super::super::fit::{Fit, Instance};
    use super::*;

    fn tried(ids: &[&str], cost: f64) -> Tried {
        let instance = |id: &&str| Instance {
            effect: CATALOGUE.into_iter().find(|effect| effect.id() == *id).expect("an effect"),
            choice: Choice::None,
        };
        let instances = ids.iter().map(instance).collect();
        let fit = Fit { instances, cost, ..Fit::of_nothing(Vec::new()) };
        Tried { fit, log_evidence: -0.5 * cost }
    }

    #[test]
    fn rivals_of_three_effects_are_known_by_what_they_share() {
        let gap = 10_000.0;
        let sets = |cost_of_two: f64| {
            [
                tried(&["spreading", "lag", "gain-drift"], 5000.0),
                tried(&["spreading", "lag", "clipping"], 5001.0),
                tried(&["lag", "clipping"], 9000.0),
                tried(&["spreading", "lag"], cost_of_two),
            ]
        };
        assert_eq!(common_part(&sets(5015.0), &[0, 1], gap), Some(3));
        // What the third closes is no flaw of a formula.
        assert_eq!(common_part(&sets(5100.0), &[0, 1], gap), None);
        assert_eq!(common_part(&sets(5015.0), &[0], gap), None);
        let of_two = [
            tried(&["spreading", "aperture"], 5000.0),
            tried(&["spreading", "directivity"], 5001.0),
            tried(&["spreading"], 5010.0),
        ];
        assert_eq!(common_part(&of_two, &[0, 1], gap), None);
    }
}
