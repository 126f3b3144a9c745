//! The noise of two records whose own readings do not tell it.
//!
//! Without repeats, the noise of a record is judged by what a model leaves. Where the model of A is poor, that is mostly field. In the difference of two
//! records the field cancels, and its fine structure along rows is the noise of both.
//!
//! Repeats tell a noise only as well as their number allows: thirty tell its variance to 26 %. The pairs are many more. Where a set of effects leaves
//! noise alone of them, they tell it better.

use crate::fit::joint_fit::Fit;
use crate::limits::{LEAST_ADDITIVE_NOISE, NOISE_CHANGED};
use crate::model::effect::Context;
use crate::model::observations::{Observations, ObservedScan};
use crate::noise::judge::roughness;
use crate::residual_structure::ResidualStructure;
use crate::residual_structure::test::Test;
use crate::statistics::reading_pairs::{Compression, Level};
use crate::statistics::scatter::Scatter;

/// The most noise that a record has, by the difference of two.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MostNoise {
    share: f64,
    additive: f64,
}

impl MostNoise {
    /// Of A and of B, whose readings are pairs; the readings of A times `gain` are of B's size. `None` where rows have too few readings.
    pub fn of_difference(a: &Observations, b: &Observations, gain: f64) -> Option<[Self; 2]> {
        let expected = |reading: &f64| Level {
            reading: gain * reading,
            by_turbulence: [0.0; 2],
            by_jitter: [0.0; 2],
            compression: Compression::NONE,
        };
        let [of_a, of_b] = [a, b].map(|observations| &observations.scans[0]);
        let levels: Vec<Vec<Level>> =
            of_a.drives.iter().map(|drive| drive.readings.iter().map(expected).collect()).collect();
        let (share, additive) = roughness(of_b, &levels, false)?;
        // Half of the variance is that of each.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let of = |size: f64| Self { share: share * half, additive: additive * half / size };
        Some([of(gain), of(1.0)])
    }

    /// Holds the scatter of a record below this, unless its repeats tell it. The additive part is held where no dark readings tell it.
    pub fn hold(self, scan: &mut ObservedScan) {
        if scan.scatter.is_told_by_repeats() {
            return;
        }
        let largest = scan.drives.iter().flat_map(|d| &d.readings).fold(0.0f64, |a, r| a.max(*r));
        let additive = match scan.dark.is_empty() {
            true => self.additive.max(LEAST_ADDITIVE_NOISE * largest),
            false => f64::INFINITY,
        };
        let share = scan.scatter.share.min(self.share);
        let additive = scan.scatter.additive.min(additive);
        scan.set_scatter(Scatter { share, additive, ..scan.scatter.clone() });
    }
}

/// Factor by which the noise of both records is larger than was judged, by what the best set leaves of their pairs; `None` where that is not noise alone, or is no
/// more than was judged. What no effect needs is no alarm however small the noise, and is not looked at.
///
/// The variance of the noise has a scaled inverse χ² distribution with as many degrees of freedom as there are repeats; the pairs add theirs
/// (A. Gelman et al., Bayesian Data Analysis, 3rd ed., 2013, section 2.6).
pub(crate) fn noise_left(
    best: &Fit,
    observations: &Observations,
    records: [&Observations; 2],
    context: &Context,
) -> Option<f64> {
    if best.instances.is_empty() {
        return None;
    }
    let repeats: usize = records.iter().map(|of| of.scans[0].scatter.pairs.len()).sum();
    let known = repeats as f64;
    let variance = (best.cost + known) / (observations.len() as f64 + known);
    let factor = variance.sqrt();
    let is_noise = || {
        let structure = ResidualStructure::of(best, observations, context);
        !structure.tests.iter().any(Test::fails)
    };
    (factor > 1.0 + NOISE_CHANGED && is_noise()).then_some(factor)
}
