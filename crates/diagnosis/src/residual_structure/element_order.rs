//! Whether departures fitted as random from element to element have a spatial order, and so a common cause.
//!
//! A bowed array gives phases that grow with the squared radius, a sagging supply amplitudes graded along the rows,
//! crosstalk differs between edge and middle. Random ones do neither.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::fit::joint_fit::Fit;
use crate::limits::FEWEST_ELEMENTS;
use crate::model::effect::{PerElement, Search};
use crate::model::observations::Observations;

/// Departures drawn of each fit.
const DRAWS: u64 = 8;

/// The largest z-score of order among the departures of a fit; `None` if it has none, or too few elements.
///
/// What few readings tell of the departures is smooth across the array, however the elements are: the fitted ones are drawn towards zero where the
/// readings do not tell them. With what is not known of them drawn at random beside them, they are as random as the elements.
pub(crate) fn order_of_elements(observations: &Observations, fit: &Fit) -> Option<f64> {
    let elements = observations.first().believed.array.elements();
    let effects = fit.instances.iter().zip(&fit.values).zip(fit.ranges());
    let random = effects.filter(|((instance, _), _)| instance.effect.search() == Search::Random);
    // Of each kind of departure the elements in turn.
    let kinds = random.flat_map(|((instance, values), range)| {
        let starts = range.step_by(elements.len());
        values
            .chunks(elements.len())
            .zip(starts)
            .map(move |(values, start)| (instance, values, start))
    });
    kinds
        .filter(|(_, values, _)| values.len() >= FEWEST_ELEMENTS)
        .map(|(instance, values, start)| {
            let places: Vec<(f64, f64)> =
                elements.iter().map(|element| (element.centre_m.x, element.centre_m.y)).collect();
            // Phases that grow along x or y steer the beam, which a shift of the scan absorbs.
            let with_slopes = instance.effect.facts().per_element != PerElement::Phase;
            let size = (values.len(), values.len());
            let unknown = fit.covariance.as_ref().and_then(|covariance| {
                let block = covariance.view((start, start), size).into_owned();
                Some(block.cholesky()?.l())
            });
            let Some(unknown) = unknown else { return 0.0 };
            let of_draw = |seed: u64| {
                let lots = StandardNormal.sample_iter(ChaCha8Rng::seed_from_u64(seed));
                let lots = DVector::from_iterator(values.len(), lots.take(values.len()));
                let drawn: Vec<f64> =
                    values.iter().zip(&(&unknown * lots)).map(|(v, lot)| v + lot).collect();
                order(&places, &drawn, with_slopes).max(likeness(&places, &drawn))
            };
            (0..DRAWS).map(of_draw).sum::<f64>() / DRAWS as f64
        })
        .max_by(f64::total_cmp)
}

/// How much of the values' variance smooth functions of the place explain, as a z-score of the F-test.
fn order(places: &[(f64, f64)], values: &[f64], with_slopes: bool) -> f64 {
    let n = values.len();
    let size = places.iter().map(|(x, y)| x.hypot(*y)).fold(f64::MIN_POSITIVE, f64::max);
    let terms: [fn(f64, f64) -> f64; 4] = [|_, _| 1.0, |x, _| x, |_, y| y, |x, y| x * x + y * y];
    let fixed = if with_slopes { 1 } else { 3 };
    let design = |count: usize| {
        DMatrix::from_fn(n, count, |i, j| terms[j](places[i].0 / size, places[i].1 / size))
    };
    let values = DVector::from_column_slice(values);
    let left = |count: usize| -> Option<f64> {
        let design = design(count);
        let solution = design.clone().svd(true, true).solve(&values, 1e-9).ok()?;
        Some((&values - design * solution).norm_squared())
    };
    let (Some(plain), Some(ordered)) = (left(fixed), left(terms.len())) else { return 0.0 };
    let (extra, rest) = ((terms.len() - fixed) as f64, (n - terms.len()) as f64);
    let f = (plain - ordered) / extra / (ordered / rest).max(f64::MIN_POSITIVE);
    // Paulson's approximation (Ann. Math. Stat. 13, 233, 1942) of F by a normal number.
    let (a, b) = (2.0 / (9.0 * extra), 2.0 / (9.0 * rest));
    let root = f.max(0.0).cbrt();
    ((1.0 - b) * root - (1.0 - a)) / (b * root * root + a).sqrt()
}

/// Moran's I over nearest neighbours.
fn likeness(places: &[(f64, f64)], values: &[f64]) -> f64 {
    let n = values.len();
    let distance =
        |i: usize, j: usize| (places[i].0 - places[j].0).hypot(places[i].1 - places[j].1);
    let nearest = (0..n)
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .map(|(i, j)| distance(i, j))
        .fold(f64::INFINITY, f64::min);
    let mean = values.iter().sum::<f64>() / n as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
    let (mut products, mut count) = (0.0, 0.0);
    for i in 0..n {
        for j in 0..i {
            if distance(i, j) < 1.2 * nearest {
                products += (values[i] - mean) * (values[j] - mean) / variance;
                count += 1.0;
            }
        }
    }
    if count > 0.0 { (products + count / (n - 1) as f64) / f64::sqrt(count) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Vec<(f64, f64)> {
        (0..36).map(|i| (f64::from(i % 6) - 2.5, f64::from(i / 6) - 2.5)).collect()
    }

    fn random(seed: u64) -> Vec<f64> {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        let mut draws = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..36).map(|_| StandardNormal.sample(&mut draws)).collect()
    }

    #[test]
    fn random_departures_have_no_order_and_a_bowl_and_a_slope_have() {
        let mut loud = 0;
        for seed in 0..400 {
            let values = random(seed);
            let z = order(&grid(), &values, true).max(likeness(&grid(), &values));
            loud += usize::from(z > 3.0);
        }
        assert!(loud <= 4, "{loud} of 400 beyond three deviations");
        let bowl: Vec<f64> = grid()
            .iter()
            .zip(random(1))
            .map(|((x, y), noise)| 0.3 * (x * x + y * y) + 0.3 * noise)
            .collect();
        assert!(order(&grid(), &bowl, false) > 4.0);
        let slope: Vec<f64> =
            grid().iter().zip(random(2)).map(|((x, _), noise)| x + 0.3 * noise).collect();
        assert!(order(&grid(), &slope, true) > 4.0);
        assert!(order(&grid(), &slope, false) < 3.0);
        assert!(likeness(&grid(), &slope) > 4.0);
    }
}
