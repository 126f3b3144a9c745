//! How much possible readings would tell about which set of effects holds.
//!
//! The quantity is the mutual information I(M; y) of the set M and the readings y of a round. It has no closed form for Gaussian
//! predictions; the bound of A. Kolchinsky and B. D. Tracey (Entropy 19, 361, 2017, equation 9) takes its place:
//! I ≤ -Σᵢ pᵢ ln Σⱼ pⱼ exp(-Dᵢⱼ), with the Kullback-Leibler divergences Dᵢⱼ of the predictions. It saturates once two sets are
//! apart, so that the next readings go to those that are not. (The criterion of G. E. P. Box and W. J. Hill, Technometrics 9, 57, 1967,
//! Σ pᵢ pⱼ Dᵢⱼ, is its beginning for small divergences.)
//!
//! Readings are chosen one after another. After each, every set's parameters are updated as if it had read what each set in turn
//! expects (one Kalman step): a rival that a refit brings near is not apart. That the noise of a reading moves the refit a little is left
//! out, which makes divergences too small by up to half a nat for each parameter. Predictions are linear in the parameters between the
//! fits of two rounds.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use fieldgap_diagnosis::Outlook;

/// Sets with their predictions for the possible readings, given the readings chosen so far.
pub(crate) struct Contest {
    sets: Vec<Live>,
    /// Divergence of set j from set i by the readings chosen so far: row i, column j, nats.
    divergence: DMatrix<f64>,
}

/// One set.
struct Live {
    probability: f64,
    /// Its own expectation.
    means: Vec<f64>,
    /// Variance of each reading about its mean, parameters known.
    noise: Vec<f64>,
    /// Variance of each reading, parameters unknown.
    variances: Vec<f64>,
    slopes: DMatrix<f64>,
    covariance: DMatrix<f64>,
    /// Its expectation where another set holds and it was fitted again to the readings chosen so far; by the number of the other.
    refitted: Vec<Vec<f64>>,
}

impl Contest {
    /// Between these sets. Probabilities from few readings are too sure of themselves: `share` of the whole is dealt out evenly.
    pub fn new(outlooks: &[Outlook], share: f64) -> Self {
        let total: f64 = outlooks.iter().map(|outlook| outlook.probability).sum();
        let n = outlooks.len();
        let sets = outlooks.iter().map(|outlook| {
            let by_covariance = &outlook.covariance * &outlook.slopes;
            let variances = outlook.variances.iter().enumerate().map(|(reading, noise)| {
                noise + outlook.slopes.column(reading).dot(&by_covariance.column(reading)).max(0.0)
            });
            Live {
                probability: (1.0 - share) * outlook.probability / total + share / n as f64,
                means: outlook.means.clone(),
                noise: outlook.variances.clone(),
                variances: variances.collect(),
                slopes: outlook.slopes.clone(),
                covariance: outlook.covariance.clone(),
                refitted: vec![outlook.means.clone(); n],
            }
        });
        Self { sets: sets.collect(), divergence: DMatrix::zeros(n, n) }
    }

    /// Information of the readings chosen so far, nats.
    pub fn information(&self) -> f64 {
        self.bound(|i, j| self.divergence[(i, j)])
    }

    /// Information that some readings would add together, nats: what a refit between them would take up is left out, so that this is too
    /// much for many of them.
    pub fn gain(&self, readings: Range<usize>) -> f64 {
        let with = |i: usize, j: usize| {
            let steps = readings.clone().map(|reading| self.step(i, j, reading));
            self.divergence[(i, j)] + steps.sum::<f64>()
        };
        self.bound(with) - self.information()
    }

    /// Entropy by which each of some readings would narrow the parameters of the most probable set, their sum, nats.
    pub fn narrowing(&self, readings: Range<usize>) -> f64 {
        let first = &self.sets[0];
        readings.map(|reading| 0.5 * (first.variances[reading] / first.noise[reading]).ln()).sum()
    }

    /// The smallest of the two divergences between two sets by the readings chosen so far, nats.
    pub fn apart(&self, i: usize, j: usize) -> f64 {
        self.divergence[(i, j)].min(self.divergence[(j, i)])
    }

    /// Chooses a reading.
    pub fn choose(&mut self, reading: usize) {
        let n = self.sets.len();
        for i in 0..n {
            for j in 0..n {
                self.divergence[(i, j)] += self.step(i, j, reading);
            }
        }
        let means: Vec<f64> = self.sets.iter().map(|set| set.means[reading]).collect();
        for set in &mut self.sets {
            set.learn(reading, &means);
        }
    }

    /// Divergence of set j from set i by one more reading (of two Gaussians: S. Kullback, *Information Theory and Statistics*, 1959).
    fn step(&self, i: usize, j: usize, reading: usize) -> f64 {
        if i == j {
            return 0.0;
        }
        let (one, other) = (&self.sets[i], &self.sets[j]);
        let ratio = one.variances[reading] / other.variances[reading];
        let apart = one.means[reading] - other.refitted[i][reading];
        0.5 * (ratio - 1.0 - ratio.ln() + apart * apart / other.variances[reading])
    }

    fn bound(&self, divergence: impl Fn(usize, usize) -> f64) -> f64 {
        let n = self.sets.len();
        let of_set = |i: usize| {
            let alike: f64 =
                (0..n).map(|j| self.sets[j].probability * (-divergence(i, j)).exp()).sum();
            -self.sets[i].probability * alike.ln()
        };
        (0..n).map(of_set).sum()
    }
}

impl Live {
    /// One Kalman step: the variances after a reading, and the means if another set holds.
    fn learn(&mut self, reading: usize, means: &[f64]) {
        let slopes: DVector<f64> = self.slopes.column(reading).into_owned();
        let variance = self.variances[reading];
        let by_slopes = &self.covariance * &slopes;
        let shared = self.slopes.tr_mul(&by_slopes);
        for (refitted, mean) in self.refitted.iter_mut().zip(means) {
            let surprise = (mean - refitted[reading]) / variance;
            for (expected, shared) in refitted.iter_mut().zip(shared.iter()) {
                *expected += shared * surprise;
            }
        }
        for ((of_reading, shared), noise) in
            self.variances.iter_mut().zip(shared.iter()).zip(&self.noise)
        {
            *of_reading = (*of_reading - shared * shared / variance).max(*noise);
        }
        self.covariance -= &by_slopes * by_slopes.transpose() / variance;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings at x = 0, 1, 2, 3 of a set with the given parameters' slopes and covariance.
    fn set(probability: f64, means: [f64; 4], slopes: &[[f64; 4]], variance: f64) -> Outlook {
        Outlook {
            effects: Vec::new(),
            probability,
            means: means.to_vec(),
            variances: vec![1.0; 4],
            slopes: DMatrix::from_fn(slopes.len(), 4, |p, r| slopes[p][r]),
            covariance: DMatrix::identity(slopes.len(), slopes.len()) * variance,
        }
    }

    #[test]
    fn known_sets_are_apart_by_half_the_square_of_what_separates_them() {
        let sets = [set(0.5, [0.0; 4], &[], 1.0), set(0.5, [0.0, 1.0, 2.0, 3.0], &[], 1.0)];
        let mut contest = Contest::new(&sets, 0.0);
        contest.choose(3);
        contest.choose(2);
        assert!((contest.apart(0, 1) - (9.0 + 4.0) / 2.0).abs() < 1e-12);
        // Two sets that are apart are worth the entropy of the two, ln 2, and no more.
        let more = (0..40).map(|_| contest.choose(3)).count();
        assert!(more == 40 && (contest.information() - 2.0f64.ln()).abs() < 1e-9);
        assert!(contest.gain(3..4) < 1e-9);
    }

    #[test]
    fn what_a_refit_takes_up_does_not_count() {
        // A line through the origin of unknown slope, and a parabola: only its bend is left after the line is fitted.
        let line = set(0.5, [0.0; 4], &[[0.0, 1.0, 2.0, 3.0]], 1e6);
        let parabola = set(0.5, [0.0, 1.0, 4.0, 9.0], &[], 1.0);
        let mut contest = Contest::new(&[line, parabola], 0.0);
        (0..4).for_each(|reading| contest.choose(reading));
        // Least squares: slope Σx·x²/Σx² = 36/14; residuals x² - 36/14 x; their squares sum to 98 - 36²/14.
        let left = 98.0 - 36.0 * 36.0 / 14.0;
        let of_variances = {
            // The determinant of the line's predictive covariance is 1 + 1e6 Σx².
            let determinant = 1.0 + 1e6 * 14.0f64;
            // Trace of its inverse: four, less one for the parameter.
            0.5 * (3.0 + 1.0 / determinant - 4.0 + determinant.ln())
        };
        let exact = 0.5 * left + of_variances;
        let computed = contest.divergence[(1, 0)];
        // The noise in the refit is left out: half a nat for the one parameter, less what is known of it.
        assert!((0.0..0.75).contains(&(exact - computed)), "{computed} {exact}");
        assert!(computed > 0.5 * left);
    }

    #[test]
    fn a_reading_where_the_sets_differ_is_worth_more() {
        let sets = [
            set(0.6, [0.0; 4], &[[1.0; 4]], 0.1),
            set(0.4, [0.0, 0.1, 0.5, 2.0], &[[1.0; 4]], 0.1),
        ];
        let contest = Contest::new(&sets, 0.0);
        let gains: Vec<f64> = (0..4).map(|reading| contest.gain(reading..reading + 1)).collect();
        assert!(gains.windows(2).all(|pair| pair[0] < pair[1]), "{gains:?}");
        assert!(gains[3] < 2.0f64.ln());
    }

    #[test]
    fn probabilities_that_are_too_sure_are_shared_out() {
        let sets = [set(1.0, [0.0; 4], &[], 1.0), set(0.0, [3.0; 4], &[], 1.0)];
        assert_eq!(Contest::new(&sets, 0.0).gain(0..1), 0.0);
        assert!(Contest::new(&sets, 0.2).gain(0..1) > 0.1);
    }
}
