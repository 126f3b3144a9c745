//! Departures of the set-up within its stated uncertainty: how much the readings narrow them, which is the cost of their freedom in the evidence, and how large
//! those of single elements are.
//!
//! The spread of elements is stated by a datasheet or from a few that were measured, so that it is itself known to some ten percent only. Its logarithm is normal
//! about the stated one; the readings move it (D. J. C. MacKay, Neural Computation 4, 415, 1992).

use nalgebra::DMatrix;

use fieldgap_acoustics::least_squares::{Factor, Parameter as Unknown};

use crate::limits::SPREAD_KNOWN_WITHIN;

/// Newton steps towards the likeliest spread.
const STEPS: usize = 12;

/// Nats by which a spread is less likely than the stated one before any reading.
pub(crate) fn cost_of_spread(spread: f64, stated: f64) -> f64 {
    0.5 * ((spread / stated).ln() / SPREAD_KNOWN_WITHIN).powi(2)
}

/// The likeliest spread of departures with this sum of mean squares, each the square of what was found and its variance.
pub(crate) fn likeliest_spread(squares: f64, count: usize, stated: f64) -> f64 {
    let n = count as f64;
    let tightness = SPREAD_KNOWN_WITHIN.powi(-2);
    let within = squares / (stated * stated);
    // Uphill in u, the logarithm over the stated one: -n u - ½ within e^(-2u) - ½ tightness u².
    let mut u = 0.0f64;
    for _ in 0..STEPS {
        let left = within * (-2.0 * u).exp();
        u += ((left - n - tightness * u) / (2.0 * left + tightness)).clamp(-0.5, 0.5);
    }
    stated * u.exp()
}

/// By Laplace's method, nats: the logarithm of the volume of their priors over that of what the readings leave of it beside the effects, whose own
/// numbers have costs of their own. `departures` and `effects` are numbers of the unknowns; zero where the covariance is not known.
pub(crate) fn cost_of_departures(
    covariance: Option<&DMatrix<f64>>,
    unknowns: &[Unknown],
    departures: &[usize],
    effects: &[usize],
) -> f64 {
    let Some(covariance) = covariance else { return 0.0 };
    let unit = |n: usize| unknowns[n].prior.map_or(unknowns[n].scale, |(_, sd)| sd);
    let log_volume = |of: &[usize]| {
        let block = DMatrix::from_fn(of.len(), of.len(), |i, j| {
            covariance[(of[i], of[j])] / (unit(of[i]) * unit(of[j]))
        });
        Some(0.5 * Factor::of(block)?.log_determinant())
    };
    let all: Vec<usize> = departures.iter().chain(effects).copied().collect();
    log_volume(effects).zip(log_volume(&all)).map_or(0.0, |(effects, all)| effects - all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The maximum by trying.
    #[test]
    fn the_likeliest_spread_is_between_the_stated_one_and_that_of_the_departures() {
        for (squares, count) in [(0.9, 36), (0.1, 36), (0.02, 4), (40.0, 100)] {
            let log = |spread: f64| {
                let n = count as f64;
                -n * spread.ln() - 0.5 * squares / (spread * spread) - cost_of_spread(spread, 0.1)
            };
            let spread = likeliest_spread(squares, count, 0.1);
            assert!(log(spread) > log(1.01 * spread) && log(spread) > log(spread / 1.01));
            let of_departures = (squares / count as f64).sqrt();
            let between = of_departures.min(0.1)..=of_departures.max(0.1);
            assert!(between.contains(&spread), "{squares} {count}: {spread}");
        }
    }

    /// Of readings y = a d + b e + noise with d normal, and e nearly free: the evidence in closed form, for several sizes of both slopes.
    #[test]
    fn the_cost_is_that_of_the_integral_over_the_departure() {
        for (slope, sd) in [(3.0f64, 0.7f64), (0.2, 2.0), (40.0, 0.1)] {
            let unknown =
                |sd| Unknown { start: 0.0, scale: 0.1, prior: Some((0.0, sd)), range: None };
            let unknowns = [unknown(sd), unknown(50.0)];
            // Four readings, of which the effect is seen in the last two.
            let columns = [[slope, slope, slope, slope], [0.0, 0.0, 1.0, 2.0]];
            let curvature = DMatrix::from_fn(2, 2, |i, j| {
                let shared: f64 = columns[i].iter().zip(columns[j]).map(|(a, b)| a * b).sum();
                let width: f64 = unknowns[i].prior.expect("it has one").1;
                shared + if i == j { width.powi(-2) } else { 0.0 }
            });
            let covariance = curvature.clone().try_inverse().expect("determined");
            let cost = cost_of_departures(Some(&covariance), &unknowns, &[0], &[1]);
            // The departure integrated out with the effect held: its precision over that of its prior.
            let expected = 0.5 * (curvature[(0, 0)] * sd * sd).ln();
            assert!((cost - expected).abs() < 1e-9, "{slope} {sd}: {cost} {expected}");
        }
    }
}
