//! How widely each group of numbers is spread, found from the numbers themselves, and whether the readings ask for the group at all.
//!
//! The width of a normal prior that makes the readings most probable obeys w² = Σ x² / γ, where γ is the count of numbers of the group that
//! the readings determine (MacKay, Neural Computation 4, 415, 1992). Weights have the prior of Student's distribution instead, so that a
//! dead or reversed element widens nothing: it is a normal prior whose precision is scaled element by element.

use nalgebra::DMatrix;

use super::dense::covariance;
use super::parameters::{Group, Layout, Shared};

/// Degrees of freedom of Student's distribution: a reversed element, ten widths off, then costs 13 in place of 50.
const STUDENT: f64 = 4.0;

/// Largest change of a width in one step: the search stays near the parameters that it was found with.
const LARGEST_STEP: f64 = 2.0;

/// Widths that are nothing: far below what a reading shows.
const LEAST: f64 = 0.01;

/// The width of a group.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
    /// The group.
    pub group: Group,
    /// Standard deviation beforehand, in the unit of the group.
    pub width: f64,
    /// How many of its numbers the readings determine.
    pub determined: f64,
}

/// Widths of the groups.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Group by group.
    pub widths: Vec<Width>,
}

/// Mean and precision of each parameter beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The means.
    pub mean: Vec<f64>,
    /// One over the variances.
    pub precision: Vec<f64>,
}

impl Prior {
    /// Squared departures from the means in units of the widths.
    pub fn cost(&self, x: &[f64]) -> f64 {
        let terms = x.iter().zip(&self.mean).zip(&self.precision);
        terms.map(|((x, mean), precision)| (x - mean).powi(2) * precision).sum()
    }
}

impl Spread {
    /// Where the search begins.
    pub fn first(groups: &[Group]) -> Self {
        let width = |&group: &Group| Width { group, width: group.first_width(), determined: 0.0 };
        Self { widths: groups.iter().map(width).collect() }
    }

    /// The width of a group, zero if it is not fitted.
    pub fn of(&self, group: Group) -> f64 {
        self.widths.iter().find(|w| w.group == group).map_or(0.0, |w| w.width)
    }

    /// How much narrower than the widths the prior of each weight is: Student's distribution about one.
    fn scales(&self, layout: &Layout, x: &[f64]) -> Vec<f64> {
        let [gain, phase] = [Group::Gain, Group::Phase].map(|group| self.of(group));
        let scale = |weight: &num_complex::Complex64| {
            let off = ((weight.re - 1.0) / gain).powi(2) + (weight.im / phase).powi(2);
            (STUDENT + 2.0) / (STUDENT + off)
        };
        layout.weights(x).iter().map(scale).collect()
    }

    /// The prior about parameters that are near `x`; the shared ones are about `start`.
    pub fn prior(&self, layout: &Layout, x: &[f64], start: &[f64]) -> Prior {
        let n = layout.elements;
        let scales = self.scales(layout, x);
        let (mut mean, mut precision) = (vec![0.0; n], Vec::with_capacity(layout.len()));
        mean.fill(1.0);
        for &group in &layout.groups {
            let narrow = self.of(group).powi(-2);
            let is_weight = matches!(group, Group::Gain | Group::Phase);
            for _ in 0..group.size() {
                precision
                    .extend((0..n).map(|k| if is_weight { scales[k] * narrow } else { narrow }));
            }
        }
        mean.resize(layout.shared_at(), 0.0);
        for which in Shared::ALL {
            mean.push(start[layout.shared(which)]);
            let width = match which {
                Shared::Travel(_) if !layout.has_travel => 1e-9,
                _ => which.width(),
            };
            precision.push(width.powi(-2));
        }
        Prior { mean, precision }
    }

    /// The widths that parameters with some variances ask for. Returns the largest relative change.
    pub fn follow(&mut self, layout: &Layout, x: &[f64], variances: &[f64], prior: &Prior) -> f64 {
        let mut largest = 0.0f64;
        for found in &mut self.widths {
            let Some(at) = layout.at(found.group) else { continue };
            let all = at..at + found.group.size() * layout.elements;
            let gamma: f64 = all.clone().map(|k| 1.0 - variances[k] * prior.precision[k]).sum();
            let squares: f64 =
                all.map(|k| (x[k] - prior.mean[k]).powi(2) * prior.precision[k]).sum();
            // Squares in units of the present width.
            let ratio = (squares / gamma.max(1e-6)).sqrt().clamp(1.0 / LARGEST_STEP, LARGEST_STEP);
            let next = (found.width * ratio).max(LEAST * found.group.first_width());
            largest = largest.max((next / found.width - 1.0).abs());
            (found.width, found.determined) = (next, gamma);
        }
        largest
    }

    /// The logarithm of how much more probable the readings are with a group than without it: the density of its numbers at none of them,
    /// beforehand over afterwards (Dickey, Ann. Math. Stat. 42, 204, 1971).
    pub fn evidence(
        &self,
        layout: &Layout,
        x: &[f64],
        inverse_factor: &DMatrix<f64>,
        prior: &Prior,
        group: Group,
    ) -> f64 {
        let Some(at) = layout.at(group) else { return 0.0 };
        let all: Vec<usize> = (at..at + group.size() * layout.elements).collect();
        let Some(cholesky) = covariance(inverse_factor, &all).cholesky() else { return 0.0 };
        let off =
            nalgebra::DVector::from_iterator(all.len(), all.iter().map(|&k| x[k] - prior.mean[k]));
        let log_afterwards: f64 = cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        let log_before: f64 = all.iter().map(|&k| -0.5 * prior.precision[k].ln()).sum();
        0.5 * off.dot(&cholesky.solve(&off)) + log_afterwards - log_before
    }
}
