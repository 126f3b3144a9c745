//! How much the readings speak for a set of effects, whatever its parameters are.
//!
//! The logarithm of the evidence is that of the likelihood at its best less what the parameters' freedom costs. With u the size
//! of an effect in standard deviations of its own parameters, and a prior that holds every order of magnitude of u
//! for equally likely and every direction too, p parameters cost p ln u + ln(L S_p) - (p/2) ln 2π (Laplace's method; S_p the
//! surface of the unit sphere, L the span of ln u). So nothing depends on an arbitrary width of a prior, and an effect that is not
//! seen costs little to allow. Each discrete choice costs the logarithm of their number.

use std::f64::consts::{PI, TAU};

use super::effects::{Choice, Search, phase_quantisation::steps_and_zeros};
use super::fit::Fit;
use super::observations::Observations;
use super::scatter::Scatter;

/// Span of the logarithm of an effect's size, from one standard deviation to thousands.
const SPAN: f64 = 8.0;

/// Span of the logarithm of a spread of elements.
const SPREAD_SPAN: f64 = 6.0;

/// Nats that another effect costs beyond the first: sets are rarer than single effects, and there are more of them.
const ANOTHER_EFFECT: f64 = 5.0;

/// Nats by which "no effect" is likelier beforehand than one particular effect.
const NO_EFFECT: f64 = 3.0;

/// Natural logarithm of evidence times prior, less a constant of the observations.
pub(super) fn log_evidence(fit: &Fit, observations: &Observations) -> f64 {
    let mut log = -0.5 * fit.penalised;
    let (turbulence, speckle) = fit.turbulence();
    let scans = observations.scans.iter();
    log -= scans.map(|scan| scan.scatter.against_turbulence(turbulence, speckle)).sum::<f64>();
    let ranges = fit.ranges();
    for (number, instance) in fit.instances.iter().enumerate() {
        let values = &fit.values[number];
        log -= cost_of_choice(&instance.choice, observations.elements());
        let block = fit.covariance.as_ref().map(|covariance| {
            let range = ranges[number].clone();
            covariance.view((range.start, range.start), (range.len(), range.len())).into_owned()
        });
        if instance.effect.id() == "noise-floor" {
            log += observations.scans.iter().map(|scan| of_silence(&scan.scatter)).sum::<f64>();
        }
        if values.is_empty() {
            continue;
        }
        if instance.effect.search() == Search::Random {
            let spread = fit.spreads[number];
            let determinant = block
                .and_then(|block| (block / (spread * spread)).cholesky())
                .map_or(0.0, |c| c.l().diagonal().iter().map(|d| 2.0 * d.ln()).sum::<f64>());
            // ln det(1 + s² H) is what the elements' freedom costs; the spread is one number more.
            log += 0.5 * determinant - SPREAD_SPAN.ln() + 0.5 * (PI / values.len() as f64).ln();
            continue;
        }
        let parameters = instance.effect.parameters();
        let departures = nalgebra::DVector::from_iterator(
            values.len(),
            values.iter().zip(parameters).map(|(v, p)| v - p.neutral),
        );
        let size = block
            .and_then(|block| block.cholesky())
            .map_or(1.0, |cholesky| departures.dot(&cholesky.solve(&departures)).sqrt());
        log -= cost_of_freedom(values.len(), size);
    }
    match fit.instances.len() {
        0 => log + NO_EFFECT,
        _ => log - ANOTHER_EFFECT * fit.physical_effects().saturating_sub(1) as f64,
    }
}

/// What silence says of a floor, in nats: for it, or, where it could have shown one and did not, against it.
fn of_silence(scatter: &Scatter) -> f64 {
    const NOT_SEEN: f64 = 4.0;
    match scatter.floor > 0.0 || scatter.most_floor.is_infinite() {
        true => scatter.floor_evidence,
        false => -NOT_SEEN,
    }
}

/// What so many parameters cost an effect of a size in standard deviations.
pub(super) fn cost_of_freedom(parameters: usize, size: f64) -> f64 {
    let p = parameters as f64;
    let sphere = match parameters {
        1 => 2.0,
        2 => TAU,
        _ => 4.0 * PI,
    };
    (p * size.max(1.0).ln() + (SPAN * sphere).ln() - 0.5 * p * TAU.ln()).max(0.0)
}

pub(super) fn cost_of_choice(choice: &Choice, elements: usize) -> f64 {
    /// Sizes of sets, equally likely.
    const SIZES: f64 = 3.0;
    match choice {
        Choice::None => 0.0,
        Choice::Law(_) => 2f64.ln(),
        Choice::Steps(..) => (steps_and_zeros().count() as f64).ln(),
        Choice::Elements(set) => {
            let ways: f64 =
                (0..set.len()).map(|i| (elements - i) as f64 / (i + 1) as f64).product();
            (SIZES * ways).ln()
        }
    }
}
