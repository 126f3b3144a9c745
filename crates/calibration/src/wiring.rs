//! Which channels were exchanged.
//!
//! A channel that drives another element's place cannot be explained by one weight at several places: its phase would have to differ
//! from place to place. Pairs of such channels are tried exchanged. The weight itself need not look odd: a mean over places can come out
//! ordinary. What an exchange would explain is predicted from the derivatives, with all other weights following: they have adapted to
//! the wrong wiring, and with them as they are exchanges hide one another. Exchanges are fitted in the order of this prediction, and the
//! first that explains the readings better by far is kept.

use nalgebra::{DVector, Matrix2, Matrix4, Vector2, Vector4};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::limits::{MOST_SUSPECTS, ORDINARY_GAIN, ORDINARY_PHASE_RAD, SWAP_FALL};
use crate::model::Model;
use crate::readings::median;
use crate::retrieval::{Retrieval, retrieve_roughly};
use fieldgap_acoustics::least_squares::{Linearisation, dot};

/// Exchanges that are fitted before none is thought to be there, times the elements: a hundred for 36 elements. Of a hundred drawn arrays
/// of 36 with one exchange, a dead and a reversed channel, the hardest needed 57.
const TRIED_BY_ELEMENTS: usize = 3600;

/// The fewest such fits of a large array, where each takes long.
const FEWEST_TRIED: usize = 10;

/// The model with the channels that were exchanged, and its weights. `found` are those of the model with its present wiring.
pub fn with_exchanges<'a>(mut model: Model<'a>, mut found: Retrieval) -> (Model<'a>, Retrieval) {
    let tried = (TRIED_BY_ELEMENTS / model.channels()).max(FEWEST_TRIED);
    for _ in 0..MOST_SUSPECTS / 2 {
        let hopeful = candidates(&model, &found).into_iter().take(tried);
        // Prediction is far from exact while other exchanges are not found.
        let hopeful: Vec<Candidate> = hopeful.take_while(|c| c.fall > SWAP_FALL).collect();
        let better = hopeful.into_par_iter().find_map_first(|candidate| {
            let Candidate { pair: [a, b], weights: end, .. } = candidate;
            let mut wiring = model.wiring().to_vec();
            wiring.swap(a, b);
            let mut weights = found.weights.clone();
            [weights.weights[a], weights.weights[b]] = end;
            let exchanged = model.clone().wired(wiring);
            let again = retrieve_roughly(&exchanged, &weights);
            let limit = SWAP_FALL * again.chi_square.max(1.0);
            (found.cost - again.cost > limit).then_some((exchanged, again))
        });
        let Some((exchanged, again)) = better else { break };
        (model, found) = (exchanged, again);
    }
    (model, found)
}

/// An exchange of two channels.
struct Candidate {
    /// Predicted fall of the cost.
    fall: f64,
    pair: [usize; 2],
    /// Predicted weights with their channels exchanged.
    weights: [Complex64; 2],
}

/// Exchanges of two channels that ask for other weights at other places, the best first.
fn candidates(model: &Model<'_>, found: &Retrieval) -> Vec<Candidate> {
    let Some(covariance) = &found.covariance else { return Vec::new() };
    let parameters: Vec<f64> =
        model.parameters(&found.weights).iter().map(|parameter| parameter.start).collect();
    let linear = model.linearise(&parameters);
    // In units of the readings' own noise: exchanges that were not found yet raise the misfit of sound channels too, and must not hide one
    // another. Both channels of a pair have about the same share in what its exchange explains.
    let misfits = misfits(model, &linear);
    let mut suspects: Vec<usize> =
        (0..misfits.len()).filter(|&n| misfits[n] > SWAP_FALL / 2.0).collect();
    suspects.sort_by(|&a, &b| misfits[b].total_cmp(&misfits[a]));
    suspects.truncate(MOST_SUSPECTS);
    if suspects.len() < 2 {
        return Vec::new();
    }

    let weights = &found.weights.weights;
    let gain = median(weights.iter().map(|w| w.norm()).collect());
    let sum: Complex64 = weights.iter().filter(|w| w.norm() > 0.0).map(|w| w / w.norm()).sum();
    let ordinary = sum / sum.norm().max(f64::MIN_POSITIVE) * gain;
    let inverse = covariance / found.chi_square.max(1.0);
    let crossed = |channel: usize, beside: usize| {
        let parts = model.parts(&found.weights, channel, model.wiring()[beside]);
        let products = |column: &[f64]| {
            DVector::from_iterator(
                linear.columns.len(),
                linear.columns.iter().map(|known| dot(known, column)),
            )
        };
        let shadow = [products(&parts[0]), products(&parts[1])];
        let slope = [dot(&parts[0], &linear.residuals), dot(&parts[1], &linear.residuals)];
        Crossed { followed: [&inverse * &shadow[0], &inverse * &shadow[1]], shadow, parts, slope }
    };
    let ordered: Vec<[usize; 2]> = suspects
        .iter()
        .flat_map(|&a| suspects.iter().filter(move |&&b| b != a).map(move |&b| [a, b]))
        .collect();
    let crossings: Vec<Crossed> = ordered.par_iter().map(|&[a, b]| crossed(a, b)).collect();
    let of = |a: usize, b: usize| {
        let index = ordered.iter().position(|pair| *pair == [a, b]);
        &crossings[index.expect("both are suspects")]
    };
    let mut candidates: Vec<Candidate> = suspects
        .iter()
        .enumerate()
        .flat_map(|(k, &a)| suspects[..k].iter().map(move |&b| [a, b]))
        .map(|pair| predicted(pair, [of(pair[0], pair[1]), of(pair[1], pair[0])], ordinary))
        .collect();
    candidates.sort_by(|a, b| b.fall.total_cmp(&a.fall));
    candidates
}

/// For each channel, the fall of the cost if its weight could differ from place to place, beside all others as they are, less that if
/// it were one for all places: Cochran's test of homogeneity, chi-square with 2 (places - 1) degrees of freedom where there is noise alone.
fn misfits(model: &Model<'_>, linear: &Linearisation) -> Vec<f64> {
    let rows = model.rows();
    let places = rows.iter().map(|row| row.place + 1).max().unwrap_or(0);
    let fall = |(slope, curvature): &(Vector2<f64>, Matrix2<f64>)| {
        curvature.try_inverse().map_or(0.0, |inverse| slope.dot(&(inverse * slope)))
    };
    (0..model.channels())
        .into_par_iter()
        .map(|channel| {
            let parts = [channel, model.channels() + channel].map(|part| &linear.columns[part]);
            let mut at = vec![(Vector2::zeros(), Matrix2::zeros()); places];
            for (index, row) in rows.iter().enumerate() {
                let change = Vector2::from_fn(|part, _| parts[part][index]);
                let (slope, curvature) = &mut at[row.place];
                *slope += change * linear.residuals[index];
                *curvature += change * change.transpose();
            }
            let of_all = at.iter().fold((Vector2::zeros(), Matrix2::zeros()), |sum, place| {
                (sum.0 + place.0, sum.1 + place.1)
            });
            at.iter().map(fall).sum::<f64>() - fall(&of_all)
        })
        .collect()
}

/// What a channel would do at another element's place: two columns of derivatives, for both parts of its weight.
struct Crossed {
    parts: [Vec<f64>; 2],
    /// Products with the columns of the fit, and how its parameters would follow.
    shadow: [DVector<f64>; 2],
    followed: [DVector<f64>; 2],
    /// Products with the residuals.
    slope: [f64; 2],
}

/// The fall of the cost with crossed weights that are about ordinary, while all other parameters follow.
fn predicted(pair: [usize; 2], crossed: [&Crossed; 2], ordinary: Complex64) -> Candidate {
    let column = |k: usize| (crossed[k / 2], k % 2);
    let curvature = Matrix4::from_fn(|i, j| {
        let ((a, i), (b, j)) = (column(i), column(j));
        dot(&a.parts[i], &b.parts[j]) - a.shadow[i].dot(&b.followed[j])
    });
    let downhill = Vector4::from_fn(|i, _| {
        let (a, i) = column(i);
        -a.slope[i]
    });
    let sd = ORDINARY_GAIN.hypot(ORDINARY_PHASE_RAD) * ordinary.norm();
    let about = Vector4::new(ordinary.re, ordinary.im, ordinary.re, ordinary.im);
    let prior = Matrix4::identity() / (sd * sd);
    let weights = (curvature + prior)
        .try_inverse()
        .map_or(about, |inverse| inverse * (downhill + about / (sd * sd)));
    let off = (weights - about).norm_squared() / (sd * sd);
    let fall = 2.0 * downhill.dot(&weights) - (weights.transpose() * curvature * weights)[0] - off;
    let weights = [Complex64::new(weights[0], weights[1]), Complex64::new(weights[2], weights[3])];
    Candidate { fall, pair, weights }
}
