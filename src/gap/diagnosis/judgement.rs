//! The verdict: which set of effects, if any, is named.

use super::Verdict;
use super::element_order::order_of_elements;
use super::observations::Observations;
use super::pursuit::Tried;
use super::residual_tests::{in_slow_patterns, z_scores};

/// Probability above which a set is named alone.
const CLEAR: f64 = 0.85;

/// Probability that a set must have itself to be named for what holds it and more.
const DOES_ALONE: f64 = 0.1;

/// Probability that rivals must reach together to be named as rivals.
const TOGETHER: f64 = 0.9;

/// Most rivals that are named.
const MOST_RIVALS: usize = 3;

/// Standard deviations at which a test says that there is structure.
pub(super) const LIMIT: f64 = 4.0;

/// Share of the believed set-up's excess chi-square that a set may leave and still explain a gap: no effect's formula is
/// better than that.
const LEFT_OVER: f64 = 3e-3;

/// The same for several effects, which together imitate much: what two leave more must be well below the noise, and of three there
/// is no more.
const LEFT_OVER_BY_SEVERAL: f64 = 3e-4;

/// Cost a reading of the believed set-up from which on a gap is so large that a formula's own error may show.
const LARGE: f64 = 4.0;

/// Excess chi-square a reading, 0.4 standard deviations squared, below which a gap is faint: thousands of readings together tell it, and
/// what two effects close of it one cause that nobody thought of mostly does. (Of faint gaps in a thousand sealed scans thirteen were
/// said to come of two effects or three, and none did.)
const FAINT: f64 = 0.16;

/// The verdict and what it rests on.
pub(super) struct Judgement {
    pub verdict: Verdict,
    /// Numbers of the named set, or of the rivals, best first.
    pub named: Vec<usize>,
    /// Probability of each set that was tried.
    pub probabilities: Vec<f64>,
    /// Names and z-scores of the tests of the best set.
    pub tests: Vec<(&'static str, f64)>,
    /// Whether several effects would be named but that the gap is faint.
    pub too_faint: bool,
}

/// Judges what was tried, the best first.
pub(super) fn judge(
    observations: &Observations,
    tried: &[Tried],
    believed: &Tried,
    residuals_of: impl Fn(&Tried) -> Vec<f64>,
) -> Judgement {
    let probabilities = probabilities(tried);
    let residuals = residuals_of(&tried[0]);
    let mut tests = z_scores(observations, &residuals);
    if let Some(z) = order_of_elements(observations, &tried[0].fit) {
        tests.push(("order among the elements", z));
    }
    let n = observations.len() as f64;
    let excess = |cost: f64| (cost - n).max(0.0);
    // A noise judged by what is left hides what is left of chi-square, and not its structure.
    let left = excess(tried[0].fit.cost).max(in_slow_patterns(observations, &residuals));
    let share = left / excess(believed.fit.cost);
    let many =
        tried[0].fit.physical_effects() > 2 || tried[0].fit.instances.len() > 1 && left > 0.5 * n;
    let imitates = many && share > LEFT_OVER_BY_SEVERAL;
    // Of a gap within the noise nothing may be left over.
    let left_over = if believed.fit.cost > LARGE * n && !imitates { share } else { 1.0 };
    let structured = |name: &str, z: f64| match name {
        "more scatter than the noise" => z > LIMIT,
        "order among the elements" => z > LIMIT,
        _ => z > LIMIT && left_over > LEFT_OVER,
    };
    let fails = tests.iter().any(|(name, z)| structured(name, *z));
    let judgement = |verdict, named| Judgement {
        verdict,
        named,
        probabilities: probabilities.clone(),
        tests: tests.clone(),
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
    if let Some(number) = certain {
        let several = tried[number].fit.physical_effects() > 1;
        if several && excess(believed.fit.cost) < FAINT * n {
            return Judgement { too_faint: true, ..judgement(Verdict::Unexplained, Vec::new()) };
        }
        return judgement(Verdict::Explained, vec![number]);
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
    match rivals.len() {
        1 => judgement(Verdict::Explained, rivals),
        2..=MOST_RIVALS => judgement(Verdict::Ambiguous, rivals),
        _ => judgement(Verdict::Unexplained, Vec::new()),
    }
}

/// Evidence over the sum of all evidence.
fn probabilities(tried: &[Tried]) -> Vec<f64> {
    let best = tried[0].log_evidence;
    let weights: Vec<f64> = tried.iter().map(|t| (t.log_evidence - best).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}
