//! The sizes of what the simulation misses, by the evidence: the logarithm of the probability of the readings, their means integrated out.
//!
//! -½ yᵀ K⁻¹ y - ½ ln det K, about the linearisation, with a wide normal prior of each logarithm (C. E. Rasmussen and C. K. I. Williams,
//! *Gaussian Processes for Machine Learning*, eq. 2.30). It is maximised by steps along each logarithm in turn, which halve where none helps.

use fieldgap_acoustics::least_squares::Factor;
use nalgebra::{DMatrix, DVector};

use crate::prior::Sizes;

/// Readings on which sizes are sought: of more, three sizes hardly become more certain.
const MOST_READINGS: usize = 320;

/// Usual sizes, and the standard deviation of their logarithms: errors of elements of a percent, a diffuse field of 0.2 % of the largest
/// reading, each within a factor of five; the noise as the diagnosis found it, within 15 %. Set by judgement.
const USUAL_ELEMENTS: f64 = 0.01;
const USUAL_DIFFUSE: f64 = 2e-3;
const WITHIN: [f64; 3] = [1.6, 1.6, 0.15];

/// First and last step of the logarithms.
const FIRST_STEP: f64 = 0.8;
const LAST_STEP: f64 = 0.12;

/// The parts of the covariance of readings.
pub(crate) struct Parts {
    /// Derivatives by the parameters in standard deviations; a column for each reading.
    pub by_parameters: DMatrix<f64>,
    /// Derivatives by the errors of elements.
    pub by_elements: DMatrix<f64>,
    /// Covariance by a diffuse field of mean square one.
    pub by_diffuse: DMatrix<f64>,
    /// Variance of the noise of each.
    pub noise: Vec<f64>,
    /// What each departs from the expected.
    pub departures: DVector<f64>,
}

impl Parts {
    /// The covariance of the readings.
    pub fn covariance(&self, sizes: Sizes) -> DMatrix<f64> {
        let mut covariance = self.by_parameters.tr_mul(&self.by_parameters);
        covariance += self.by_elements.tr_mul(&self.by_elements) * sizes.elements.powi(2);
        covariance += &self.by_diffuse * sizes.diffuse.powi(2);
        for (n, noise) in self.noise.iter().enumerate() {
            covariance[(n, n)] += noise * sizes.noise.powi(2);
        }
        covariance
    }

    /// About as many of them as sizes are sought on, spread evenly.
    fn thinned(&self) -> Self {
        let step = self.noise.len().div_ceil(MOST_READINGS).max(1);
        let kept: Vec<usize> = (0..self.noise.len()).step_by(step).collect();
        Self {
            by_parameters: self.by_parameters.select_columns(&kept),
            by_elements: self.by_elements.select_columns(&kept),
            by_diffuse: self.by_diffuse.select_columns(&kept).select_rows(&kept),
            noise: kept.iter().map(|&n| self.noise[n]).collect(),
            departures: self.departures.select_rows(&kept),
        }
    }
}

/// The sizes with the greatest evidence, from a start. `largest` is the largest reading.
pub(crate) fn best_sizes(parts: &Parts, start: Sizes, largest: f64) -> Sizes {
    let some = parts.thinned();
    let by_parameters = some.by_parameters.tr_mul(&some.by_parameters);
    let by_elements = some.by_elements.tr_mul(&some.by_elements);
    let usual = [USUAL_ELEMENTS, USUAL_DIFFUSE * largest, 1.0].map(f64::ln);
    let evidence = |logs: [f64; 3]| -> f64 {
        let [elements, diffuse, noise] = logs.map(|log| (2.0 * log).exp());
        let mut covariance = &by_parameters + &by_elements * elements + &some.by_diffuse * diffuse;
        for (n, variance) in some.noise.iter().enumerate() {
            covariance[(n, n)] += noise * variance;
        }
        let Some(factor) = Factor::of(covariance) else { return f64::NEG_INFINITY };
        let misfit = some.departures.dot(&factor.solve(&some.departures));
        let unusual = (0..3).map(|n| ((logs[n] - usual[n]) / WITHIN[n]).powi(2)).sum::<f64>();
        -0.5 * (misfit + factor.log_determinant() + unusual)
    };
    let start = [start.elements, start.diffuse, start.noise].map(f64::ln);
    let [elements, diffuse, noise] =
        climb(start, [FIRST_STEP, FIRST_STEP, 0.2 * FIRST_STEP], evidence).map(f64::exp);
    Sizes { elements, diffuse, noise }
}

/// The maximum of a function by steps along each coordinate, which grow where they help and halve where none does.
pub(crate) fn climb<const N: usize>(
    start: [f64; N],
    first: [f64; N],
    height: impl Fn([f64; N]) -> f64,
) -> [f64; N] {
    let (mut at, mut steps) = (start, first);
    let mut best = height(at);
    while steps.iter().zip(&first).any(|(step, first)| step.abs() > first * LAST_STEP / FIRST_STEP)
    {
        for n in 0..N {
            let mut moved = false;
            for sign in [1.0, -1.0] {
                let mut beside = at;
                beside[n] += sign * steps[n];
                let there = height(beside);
                if there > best {
                    (at, best, moved) = (beside, there, true);
                    steps[n] *= sign;
                    break;
                }
            }
            if !moved {
                steps[n] *= 0.5;
            }
        }
    }
    at
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn the_sizes_that_made_the_readings_are_found() {
        let (readings, elements) = (300, 40);
        let mut draws = ChaCha8Rng::seed_from_u64(2);
        let mut normal = || -> f64 { StandardNormal.sample(&mut draws) };
        let by_elements = DMatrix::from_fn(elements, readings, |_, _| normal() / 6.0);
        let weights = DVector::from_fn(elements, |_, _| 0.05 * normal());
        let noise: f64 = 0.01;
        let departures = by_elements.tr_mul(&weights)
            + DVector::from_fn(readings, |_, _| noise * normal() + 0.02 * normal());
        let parts = Parts {
            by_parameters: DMatrix::zeros(1, readings),
            by_elements,
            // A diffuse field that no two readings share.
            by_diffuse: DMatrix::identity(readings, readings),
            noise: vec![noise * noise; readings],
            departures,
        };
        let start = Sizes { elements: 0.01, diffuse: 0.002, noise: 1.0 };
        let found = best_sizes(&parts, start, 1.0);
        assert!((0.035..0.07).contains(&found.elements), "{found:?}");
        assert!((0.016..0.024).contains(&found.diffuse), "{found:?}");
    }

    #[test]
    fn a_climb_ends_at_the_top() {
        let top =
            climb([0.0, 0.0], [0.8, 0.8], |[x, y]| -(x - 1.3).powi(2) - 2.0 * (y + 0.7).powi(2));
        assert!((top[0] - 1.3).abs() < 0.15 && (top[1] + 0.7).abs() < 0.15, "{top:?}");
    }
}
