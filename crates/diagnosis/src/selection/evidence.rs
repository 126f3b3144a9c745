//! The evidence for a set of effects: its likelihood integrated over its parameters.
//!
//! The logarithm of the evidence is that of the largest likelihood less a penalty for the parameters. Let u be the size of an effect in
//! standard deviations of its parameters. The prior gives every order of magnitude of u, and every direction, the same probability.
//! Then p parameters cost p ln u + ln(L S_p) - (p/2) ln 2π (Laplace's method; S_p is the surface of the unit sphere, L the span of
//! ln u). The result does not depend on an arbitrary width of a prior. A discrete choice costs the logarithm of the number of choices.
//!
//! Each size is in units of the effect's own standard deviations, all else fitted anew. Where two effects are alike for these readings, these
//! deviations are wide, and the readings still determine what the two make together: the volume of the whole covariance is smaller than the
//! product of the effects' own by the determinant of their correlations, whose root is a further penalty.

use std::f64::consts::{LN_2, PI, TAU};
use std::ops::Range;

use nalgebra::DMatrix;

use crate::effects::phase_quantisation::{FIRST_DIGITS, digits, steps_in_a_period};
use crate::fit::joint_fit::Fit;
use crate::fit::left::{Left, Likelihood};
use crate::limits::{ANOTHER_EFFECT, EFFECT_SIZE_SPAN, NO_EFFECT, SPREAD_SPAN, most_in_a_set};
use crate::model::effect::{Choice, Effect, Search};
use crate::model::observations::{Observations, ObservedScan};

/// Natural logarithm of evidence times prior, less a constant of the observations.
pub(crate) fn log_evidence(fit: &Fit, observations: &Observations) -> f64 {
    let (mut log, deviation_ratio) = match &fit.left {
        None => (-0.5 * fit.penalised, 1.0),
        Some(left) => {
            let Likelihood { log, variance_ratio } = left.likelihood(observations);
            (log - 0.5 * (fit.penalised - fit.cost), variance_ratio.sqrt())
        }
    };
    let (fluctuation, cause) = fit.fluctuation();
    let scans = observations.scans.iter();
    log -= scans.map(|scan| scan.scatter.against(fluctuation, cause)).sum::<f64>();
    let ranges = fit.ranges();
    for (number, instance) in fit.instances.iter().enumerate() {
        let values = &fit.values[number];
        log -= match instance.choice {
            Choice::Law(_) => (instance.effect.choices().len() as f64).ln(),
            _ => cost_of_choice(&instance.choice, observations.elements()),
        };
        let of_scan =
            |scan: &ObservedScan| instance.effect.evidence_of_dark_readings(&scan.scatter);
        log += observations.scans.iter().map(of_scan).sum::<f64>();
        if values.is_empty() {
            continue;
        }
        log -= instance.effect.against_size(values);
        if instance.effect.search() == Search::Random {
            // The departures have their cost together with those of the set-up; the spread is one more parameter.
            log += -SPREAD_SPAN.get().ln() + 0.5 * (PI / values.len() as f64).ln();
            continue;
        }
        let block = fit.covariance.as_ref().map(|covariance| {
            let range = ranges[number].clone();
            covariance.view((range.start, range.start), (range.len(), range.len())).into_owned()
        });
        let parameters = instance.effect.parameters_of(&instance.choice);
        let departures = nalgebra::DVector::from_iterator(
            values.len(),
            values.iter().zip(parameters).map(|(v, p)| v - p.neutral),
        );
        let size = block
            .and_then(|block| block.cholesky())
            .map_or(1.0, |cholesky| departures.dot(&cholesky.solve(&departures)).sqrt());
        log -= cost_of_freedom(values.len(), size / deviation_ratio);
    }
    log -= cost_of_likeness_of(fit) + fit.cost_of_departures + fit.cost_of_elements;
    log + log_prior(fit.instances.len(), fit.physical_effects())
}

/// By how much the evidence for a set is higher than if the noise were known exactly. It grows with what the set leaves, less than in proportion.
pub(crate) fn nats_of_unknown_noise(fit: &Fit, observations: &Observations) -> f64 {
    let of_likelihood = |left: &Left| left.likelihood(observations).log + 0.5 * fit.cost;
    fit.left.as_ref().map_or(0.0, of_likelihood)
}

/// Natural logarithm of the prior of a set of so many effects, of which so many are not defects of the simulator, less a constant.
fn log_prior(effects: usize, physical: usize) -> f64 {
    match effects {
        0 => NO_EFFECT.get(),
        _ => -ANOTHER_EFFECT.get() * physical.saturating_sub(1) as f64,
    }
}

/// By how much the prior of a set with one more effect is lower, nats.
pub(crate) fn cost_of_one_more(fit: &Fit, effect: &dyn Effect) -> f64 {
    let [effects, physical] = [fit.instances.len(), fit.physical_effects()];
    let with_it = physical + usize::from(!effect.is_defect());
    log_prior(effects, physical) - log_prior(effects + 1, with_it)
}

/// That of a fit; departures of single elements are left out.
fn cost_of_likeness_of(fit: &Fit) -> f64 {
    let Some(covariance) = &fit.covariance else { return 0.0 };
    let smooth = fit.instances.iter().zip(fit.ranges());
    let smooth = smooth.filter(|(instance, _)| instance.effect.search() != Search::Random);
    let ranges: Vec<Range<usize>> = smooth.map(|(_, range)| range).collect();
    cost_of_likeness(covariance, &ranges)
}

/// The penalty, nats, for effects that the readings tell apart only in part: half the logarithm of the product of the determinants of their
/// covariances over the determinant of their common covariance. Their numbers are in these ranges.
pub(crate) fn cost_of_likeness(covariance: &DMatrix<f64>, ranges: &[Range<usize>]) -> f64 {
    let log_determinant = |of: Vec<usize>| {
        let deviation = |n: usize| covariance[(of[n], of[n])].sqrt();
        let correlations = DMatrix::from_fn(of.len(), of.len(), |i, j| {
            covariance[(of[i], of[j])] / (deviation(i) * deviation(j))
        });
        let cholesky = correlations.cholesky()?;
        Some(cholesky.l().diagonal().iter().map(|d| 2.0 * d.ln()).sum::<f64>())
    };
    let each: Option<f64> =
        ranges.iter().map(|range| log_determinant(range.clone().collect())).sum();
    let together = log_determinant(ranges.iter().flat_map(Clone::clone).collect());
    each.zip(together).map_or(0.0, |(each, together)| 0.5 * (each - together).max(0.0))
}

/// The penalty, nats, for this many parameters of an effect of this size in standard deviations.
pub(crate) fn cost_of_freedom(parameters: usize, size: f64) -> f64 {
    let p = parameters as f64;
    let sphere = match parameters {
        1 => 2.0,
        2 => TAU,
        _ => 4.0 * PI,
    };
    (p * size.max(1.0).ln() + (EFFECT_SIZE_SPAN.get() * sphere).ln() - 0.5 * p * TAU.ln()).max(0.0)
}

/// The penalty, nats, for a choice among elements or steps. Of a zero that all drives share, each binary digit is one more choice of two.
pub(crate) fn cost_of_choice(choice: &Choice, elements: usize) -> f64 {
    match choice {
        Choice::None | Choice::Law(_) => 0.0,
        Choice::Steps(_, zeros) => {
            let zeros = match zeros.len() {
                0 | 1 => {
                    let digits = zeros.first().map_or(FIRST_DIGITS, |&zero| digits(zero));
                    f64::from(digits) * LN_2
                }
                drives => drives as f64 * (elements as f64).ln(),
            };
            (steps_in_a_period().count() as f64).ln() + zeros
        }
        Choice::Elements(set) => {
            let ways: f64 =
                (0..set.len()).map(|i| (elements - i) as f64 / (i + 1) as f64).product();
            (most_in_a_set(elements) as f64 * ways).ln()
        }
    }
}
