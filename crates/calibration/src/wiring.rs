//! Which channels were exchanged.
//!
//! A channel that drives another element's place cannot be explained by one weight at several places: its phase would have to differ
//! from place to place. Pairs of channels with odd weights are tried exchanged, each with ordinary weights, and the exchange that
//! explains the readings best is kept if it does so by far.

use nalgebra::{SMatrix, SVector};
use num_complex::Complex64;

use crate::limits::{
    MOST_SUSPECTS, ORDINARY_GAIN, ORDINARY_PHASE_RAD, SUSPECT_SPREADS, SWAP_FALL,
};
use crate::model::Model;
use crate::readings::median;
use crate::retrieval::Retrieval;

/// Steps of Newton's method for a pair: it starts within the ordinary spread of its end.
const STEPS: usize = 6;

/// Weights of the best exchanges, and the wiring with them; `None` if no exchange explains the readings better.
pub fn exchanged(model: &Model<'_>, found: &Retrieval) -> Option<(Vec<usize>, Vec<Complex64>)> {
    let weights = &found.weights.weights;
    let gain = median(weights.iter().map(|w| w.norm()).collect());
    let sum: Complex64 = weights.iter().filter(|w| w.norm() > 0.0).map(|w| w / w.norm()).sum();
    let ordinary = sum / sum.norm().max(f64::MIN_POSITIVE) * gain;
    let oddness = |w: &Complex64| {
        let relative = w / ordinary;
        let by_gain = (relative.norm() - 1.0).abs() / ORDINARY_GAIN;
        let by_phase = relative.arg().abs() / ORDINARY_PHASE_RAD;
        by_gain.max(by_phase)
    };
    let mut suspects: Vec<usize> =
        (0..weights.len()).filter(|&n| oddness(&weights[n]) > SUSPECT_SPREADS).collect();
    suspects.sort_by(|&a, &b| oddness(&weights[b]).total_cmp(&oddness(&weights[a])));
    suspects.truncate(MOST_SUSPECTS);

    let fields = model.fields_of(&found.weights);
    let wiring = model.wiring();
    let limit = SWAP_FALL * found.chi_square.max(1.0);
    let mut falls: Vec<(f64, [usize; 2], [Complex64; 2])> = Vec::new();
    for (k, &a) in suspects.iter().enumerate() {
        for &b in &suspects[..k] {
            let pair = [a, b];
            let straight = model.contributions(&found.weights, &pair, &[wiring[a], wiring[b]]);
            let crossed = model.contributions(&found.weights, &pair, &[wiring[b], wiring[a]]);
            let rest: Vec<Complex64> = (0..fields.len())
                .map(|row| fields[row] - straight[0][row] * weights[a] - straight[1][row] * weights[b])
                .collect();
            let before = cost(model, &fields);
            let (end, after) = pair_fit(model, &rest, &crossed, ordinary);
            if before - after > limit {
                falls.push((before - after, pair, end));
            }
        }
    }
    falls.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut wired = wiring.to_vec();
    let mut changed = weights.clone();
    let mut taken = vec![false; weights.len()];
    let mut any = false;
    for (_, [a, b], end) in falls {
        if !taken[a] && !taken[b] {
            (taken[a], taken[b], any) = (true, true, true);
            wired.swap(a, b);
            [changed[a], changed[b]] = end;
        }
    }
    any.then_some((wired, changed))
}

fn cost(model: &Model<'_>, fields: &[Complex64]) -> f64 {
    let floor = model.floor();
    let rows = model.rows().iter().zip(fields);
    rows.map(|(row, field)| ((field.norm().hypot(floor) - row.value) / model.sd(row)).powi(2)).sum()
}

/// The weights of two channels, all else fixed, about ordinary ones; and the cost, departures from these included.
fn pair_fit(
    model: &Model<'_>,
    rest: &[Complex64],
    parts: &[Vec<Complex64>],
    ordinary: Complex64,
) -> ([Complex64; 2], f64) {
    // Gain and phase spread as parts of a weight.
    let sd = ORDINARY_GAIN.hypot(ORDINARY_PHASE_RAD) * ordinary.norm();
    let floor = model.floor();
    let mut weights = [ordinary; 2];
    let at = |weights: &[Complex64; 2], row: usize| {
        rest[row] + parts[0][row] * weights[0] + parts[1][row] * weights[1]
    };
    for _ in 0..STEPS {
        let mut curvature = SMatrix::<f64, 4, 4>::identity() / (sd * sd);
        let mut downhill = SVector::<f64, 4>::zeros();
        for (k, weight) in weights.iter().enumerate() {
            let off = weight - ordinary;
            downhill[2 * k] -= off.re / (sd * sd);
            downhill[2 * k + 1] -= off.im / (sd * sd);
        }
        for (index, row) in model.rows().iter().enumerate() {
            let field = at(&weights, index);
            let level = field.norm().hypot(floor);
            let along = field.conj() / (level.max(f64::MIN_POSITIVE) * model.sd(row));
            let slopes = [along * parts[0][index], along * parts[1][index]];
            let slope = SVector::from([slopes[0].re, -slopes[0].im, slopes[1].re, -slopes[1].im]);
            curvature += slope * slope.transpose();
            downhill -= slope * ((level - row.value) / model.sd(row));
        }
        let Some(inverse) = curvature.try_inverse() else { break };
        let step = inverse * downhill;
        weights[0] += Complex64::new(step[0], step[1]);
        weights[1] += Complex64::new(step[2], step[3]);
    }
    let fields: Vec<Complex64> = (0..rest.len()).map(|row| at(&weights, row)).collect();
    let off: f64 = weights.iter().map(|w| (w - ordinary).norm_sqr() / (sd * sd)).sum();
    (weights, cost(model, &fields) + off)
}
