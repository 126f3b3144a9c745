//! The course of a diagnosis: registration, noise, search, judgement, account.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::account::account;
use super::effects::{Context, Fitted};
use super::extension::is_near;
use super::fit::{Fit, SEARCH, refined};
use super::gap_size::{HeldOut, as_believed, expected, gap, noise_floor};
use super::judgement::{Judgement, judge};
use super::levels::settle_scatter;
use super::maps::{Drawn, maps};
use super::next_measurement::next_measurement;
use super::observations::Observations;
use super::preparation::Prepared;
use super::pursuit::{Pursuit, Tried, believed};
use super::structure::Left;
use super::supposed::Supposed;
use super::{Candidate, Diagnosis, FittedParameter, ResidualTest, Verdict, WaterfallStep};
use fieldgap_acoustics::Simulator;
use fieldgap_comparison::Incomparable;
use fieldgap_comparison::Registration;
use fieldgap_comparison::{Noise, NoiseSource};
use fieldgap_records::RecordedScan;

/// Pairs of reading and element that a search goes through at most: of a large array fewer readings are looked at.
const MOST_PAIRS: usize = 400_000;

/// Readings that are looked at whatever the array.
const FEWEST: usize = 1000;

/// Probability that the cause is none of those that were looked at, though nothing in the readings says so: of 273 sealed scans
/// whose first candidate had all the evidence for it, two had another cause, or one more that was too small to see.
const ANOTHER_CAUSE: f64 = 0.02;

/// Candidates that are told of.
const TOLD: usize = 12;

/// Diagnoses one scan, or several of one rig together. The same scans give the same bits.
///
/// `simulator` is the one whose gap is in question; without it, the first scan's own.
///
/// # Errors
/// [`Incomparable`] if there is nothing to compare.
pub fn diagnose(
    scans: &[RecordedScan],
    simulator: Option<Simulator>,
) -> Result<Diagnosis, Incomparable> {
    let Prepared { simulator, mut observations, context, mut registrations } =
        Prepared::of(scans, simulator)?;
    let few = (MOST_PAIRS / observations.elements()).max(FEWEST);
    observations = observations.thinned(few);
    let tried = searched(&mut observations, &context);
    let base = tried
        .iter()
        .find(|tried| tried.fit.instances.is_empty())
        .cloned()
        .unwrap_or_else(|| believed(&observations, &context));
    let left = Left::by(&tried[0].fit, &observations, &context);
    let judgement = judge(&observations, &tried, &base, &left);
    let registration = registrations.swap_remove(0);
    let told = Told { scans, simulator, observations, context, tried, base, left, judgement };
    Ok(told.tell(registration))
}

/// Searches with the noise that repeats and silence tell, and goes on with the noise that what was found tells of: first on some
/// of the readings, then from what is left there on all, until noise and what is found agree.
fn searched(observations: &mut Observations, context: &Context) -> Vec<Tried> {
    /// Readings of the first search.
    const FIRST: usize = 1500;
    /// Rounds in which noise and what is found settle together.
    const MORE_ROUNDS: usize = 2;
    let nothing = Fit::of_nothing(as_believed(observations));
    settle_scatter(observations, &nothing, context, false);
    let mut pursuit = Pursuit::begin(&observations.thinned(FIRST), context);
    let noise_is_told = observations.scans.iter().all(|scan| scan.scatter.is_told_by_repeats());
    let best = refined(pursuit.tried[0].fit.clone(), observations, context, SEARCH);
    if noise_is_told && !is_near(&best, observations) {
        // What is far from the readings says nothing of their noise.
        return pursuit.on_all(observations, context).found();
    }
    let mut noise = settled_by(&best, observations, context);
    if noise == Judged::Misled {
        pursuit.forget_what_was_given_up();
    }
    pursuit = pursuit.on_all(observations, context).and_on(observations, context);
    for _ in 0..MORE_ROUNDS {
        let best = pursuit.tried[0].fit.clone();
        if noise == Judged::Alike || !is_near(&best, observations) {
            break;
        }
        noise = settled_by(&best, observations, context);
        if noise != Judged::Alike {
            pursuit = pursuit.on_all(observations, context).and_on(observations, context);
        }
    }
    pursuit.found()
}

/// How the noise that a fit leaves compares with what was judged before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Judged {
    /// Alike.
    Alike,
    /// Otherwise, by no more than a search bears.
    Otherwise,
    /// So much otherwise that the search was misled.
    Misled,
}

/// Judges the noise by what a fit leaves; alike, it is left as it was.
fn settled_by(fit: &Fit, observations: &mut Observations, context: &Context) -> Judged {
    /// Relative change of the noise that is worth a change.
    const CHANGED: f64 = 0.04;
    /// Relative change at which the first search was misled.
    const MISJUDGED: f64 = 0.75;
    let before: Vec<_> = observations.scans.iter().map(|scan| scan.scatter.clone()).collect();
    settle_scatter(observations, fit, context, true);
    let pairs = || observations.scans.iter().map(|scan| &scan.scatter).zip(&before);
    let changed = pairs().any(|(scatter, before)| {
        let off = |now: f64, before: f64| (now / before - 1.0).abs() > CHANGED;
        off(scatter.share, before.share) || off(scatter.additive, before.additive)
    });
    let misled = pairs().any(|(scatter, before)| {
        !(MISJUDGED..1.0 / MISJUDGED).contains(&(scatter.share / before.share))
            || (scatter.turbulence > 0.0) != (before.turbulence > 0.0)
    });
    if !changed {
        for (scan, before) in observations.scans.iter_mut().zip(before) {
            scan.set_scatter(before);
        }
        return Judged::Alike;
    }
    if misled { Judged::Misled } else { Judged::Otherwise }
}

/// All that is known when it is told.
struct Told<'s> {
    scans: &'s [RecordedScan],
    simulator: Simulator,
    observations: Observations,
    context: Context,
    tried: Vec<Tried>,
    base: Tried,
    /// What the best leaves.
    left: Left,
    judgement: Judgement,
}

impl Told<'_> {
    fn tell(self, registration: Registration) -> Diagnosis {
        let Self { scans, simulator, observations, context, tried, base, left, judgement } = &self;
        let nuisance = as_believed(observations);
        let before = expected(observations, &Supposed::default(), &nuisance);
        let held_out = HeldOut::of(observations);
        let gap_before_held_out = held_out.before();
        let told = judgement.named.iter().map(|number| number + 1).fold(TOLD, usize::max);
        let mut ranked: Vec<Candidate> = tried
            .iter()
            .take(told)
            .enumerate()
            .map(|(number, tried)| self.candidate(number, tried))
            .collect();
        ranked.par_iter_mut().zip(tried).for_each(|(candidate, tried)| {
            candidate.gap_after_held_out = held_out.after(&tried.fit, context);
        });
        let best = &tried[0];
        let after = expected(observations, &best.fit.supposed(context), &best.fit.nuisance);
        let noise_floor = noise_floor(observations);
        let beyond = |gap: f64| gap * gap - noise_floor * noise_floor;
        let open = beyond(gap_before_held_out);
        let explained_fraction = match open > 0.0 {
            true => (1.0 - beyond(ranked[0].gap_after_held_out) / open).clamp(0.0, 1.0),
            false => 0.0,
        };
        let left_before = Left::and_its_patterns(&base.fit, observations, context);
        let residual_tests = left
            .tests
            .iter()
            .map(|test| {
                let before = left_before.tests.iter().find(|other| other.name == test.name);
                ResidualTest {
                    name: test.name,
                    z: test.z,
                    z_before: before.map(|before| before.z),
                    limit: test.limit,
                    sign_of: test.sign_of.clone().filter(|_| test.fails()),
                }
            })
            .collect();
        let named = |number: &usize| tried[*number].fit.ids();
        let (effects, alternatives) = match judgement.verdict {
            Verdict::Explained => (judgement.named.first().map(named).unwrap_or_default(), vec![]),
            Verdict::Ambiguous => (vec![], judgement.named.iter().map(named).collect()),
            Verdict::Unexplained | Verdict::None => (vec![], vec![]),
        };
        let scatter = &observations.scans[0].scatter;
        let drawn = Drawn {
            before: &before,
            after: &after,
            residual_before: &left_before.residuals,
            residual_after: &left.residuals,
        };
        let gap_before = gap(observations, &before);
        Diagnosis {
            format: 1,
            scan: scans[0].setup.name.clone(),
            scans: scans.iter().map(|scan| scan.setup.name.clone()).collect(),
            simulator: *simulator,
            reading_unit: scans[0].setup.unit.clone(),
            points: observations.len(),
            verdict: judgement.verdict,
            sentence: self.sentence(&ranked, gap_before, noise_floor, explained_fraction),
            effects,
            alternatives,
            gap_before,
            gap_before_held_out,
            noise_floor,
            explained_fraction,
            r#where: account(observations, &nuisance, &before, &after),
            next_measurement: self.next_measurement(),
            noise: Noise {
                additive: scatter.additive,
                multiplicative: scatter.share,
                source: match scatter.pairs.is_empty() {
                    true => NoiseSource::Residual,
                    false => NoiseSource::Repeats,
                },
            },
            planes: maps(observations, &registration, &drawn),
            residual_tests,
            waterfall: self.waterfall(),
            undetermined: registration
                .undetermined
                .iter()
                .map(|combination| combination.explanation.clone())
                .collect(),
            registration,
            ranked,
        }
    }

    fn next_measurement(&self) -> Option<super::NextMeasurement> {
        let [one, other, ..] = self.judgement.named[..] else { return None };
        next_measurement(
            &self.observations,
            &self.context,
            [&self.tried[one].fit, &self.tried[other].fit],
            self.simulator,
            &self.scans[0].setup.name,
        )
    }

    fn candidate(&self, number: usize, tried: &Tried) -> Candidate {
        let fit = &tried.fit;
        let mut parameters: BTreeMap<String, FittedParameter> = BTreeMap::new();
        let mut readings = Vec::new();
        for (instance, fitted) in fit.instances.iter().zip(fitted(fit)) {
            let said = instance.effect.say(&fitted, &instance.choice, &self.context);
            let id = instance.effect.id();
            parameters.extend(said.parameters.into_iter().map(|(p, v)| (format!("{id}.{p}"), v)));
            readings.push(said.sentence);
        }
        let supposed = fit.supposed(&self.context);
        let after = expected(&self.observations, &supposed, &fit.nuisance);
        Candidate {
            effects: fit.ids(),
            probability: (1.0 - ANOTHER_CAUSE) * self.judgement.probabilities[number],
            log_evidence: tried.log_evidence - self.tried[0].log_evidence,
            parameters,
            readings,
            gap_after: gap(&self.observations, &after),
            gap_after_held_out: f64::NAN,
        }
    }

    /// How far the excess chi-square falls as the effects of the best set come in, in the order of what each takes alone.
    fn waterfall(&self) -> Vec<WaterfallStep> {
        let n = self.observations.len() as f64;
        let excess = |tried: &Tried| (tried.fit.cost - n).max(0.0);
        let whole = excess(&self.base);
        if whole <= 0.0 {
            return vec![WaterfallStep { effect: None, share: 1.0 }];
        }
        let mut steps = Vec::new();
        let mut left = whole;
        let mut added: Vec<&'static str> = Vec::new();
        for id in self.tried[0].fit.ids() {
            added.push(id);
            let mut set = added.clone();
            set.sort_unstable();
            let same = |tried: &&Tried| {
                let mut ids = tried.fit.ids();
                ids.sort_unstable();
                ids == set
            };
            // (The search came by each of these sets on its way.)
            let now = self.tried.iter().find(same).map_or(left, excess).min(left);
            steps.push(WaterfallStep { effect: Some(id), share: (left - now) / whole });
            left = now;
        }
        steps.push(WaterfallStep { effect: None, share: left / whole });
        steps
    }

    fn sentence(&self, ranked: &[Candidate], before: f64, floor: f64, closed: f64) -> String {
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let names = |ids: &[&str]| match ids.split_last() {
            Some((last, [])) => (*last).to_owned(),
            Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
            None => "no effect".to_owned(),
        };
        let gap = format!("The gap of {} (noise alone: {})", percent(before), percent(floor));
        match self.judgement.verdict {
            Verdict::Explained => {
                let best = &ranked[self.judgement.named[0]];
                format!(
                    "{gap} is explained by {}, which {} {} of it beyond noise: {}.",
                    names(&best.effects),
                    if best.effects.len() == 1 { "closes" } else { "close" },
                    percent(closed),
                    best.readings.join("; ")
                )
            }
            Verdict::Ambiguous => {
                let rivals: Vec<String> =
                    self.judgement.named.iter().map(|&n| names(&self.tried[n].fit.ids())).collect();
                format!(
                    "{gap} is explained equally well by {}; these data cannot tell them apart.",
                    rivals.join(", or by ")
                )
            }
            Verdict::Unexplained => {
                let tests = self.left.tests.iter().filter(|test| test.fails());
                let failed: Vec<String> = tests
                    .map(|test| {
                        let sign = test.sign_of.as_ref().map(|sign| format!(", {sign}"));
                        let digits = if test.z < 1.0 { 1 } else { 0 };
                        format!("{}: {:.digits$} σ{}", test.name, test.z, sign.unwrap_or_default())
                    })
                    .collect();
                let why = match failed.is_empty() {
                    false => {
                        format!("what that leaves is not noise ({})", failed.join("; "))
                    }
                    true if self.judgement.too_faint => {
                        "so faint a gap is seldom made by several effects at once".to_owned()
                    }
                    true => "many sets of effects come equally near".to_owned(),
                };
                let nearest = match &ranked[0].effects[..] {
                    [] => "nothing in it comes nearer than the set-up as believed,".to_owned(),
                    [one] => format!("{one} comes nearest"),
                    several => format!("{} come nearest", names(several)),
                };
                format!("{gap} is not explained by the catalogue: {nearest} and {why}.")
            }
            Verdict::None => {
                format!("{gap} is no gap beyond noise: the believed set-up explains the scan.")
            }
        }
    }
}

/// The parameters of each effect of a fit, as its own file says them.
fn fitted(fit: &Fit) -> Vec<Vec<Fitted>> {
    let error = |index: usize| {
        fit.covariance.as_ref().map_or(f64::NAN, |covariance| covariance[(index, index)].sqrt())
    };
    fit.ranges()
        .into_iter()
        .zip(&fit.values)
        .zip(&fit.spreads)
        .map(|((range, values), spread)| {
            let mut fitted: Vec<Fitted> = values
                .iter()
                .zip(range)
                .map(|(&value, index)| Fitted { value, error: error(index) })
                .collect();
            if spread.is_finite() {
                // So many draws tell a spread to one in √2n.
                let error = spread / (2.0 * values.len() as f64).sqrt();
                fitted.push(Fitted { value: *spread, error });
            }
            fitted
        })
        .collect()
}
