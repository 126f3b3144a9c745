//! The noise of two records whose own readings do not tell it.
//!
//! Without repeats, the noise of a record is judged by what a model leaves. Where the model of A is poor, that is mostly field. In the difference of two
//! records the field cancels, and its fine structure along rows is the noise of both.

use crate::limits::LEAST_ADDITIVE_NOISE;
use crate::model::observations::{Observations, ObservedScan};
use crate::noise::judge::roughness;
use crate::statistics::reading_pairs::Level;
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
        };
        let [of_a, of_b] = [a, b].map(|observations| &observations.scans[0]);
        let levels: Vec<Vec<Level>> =
            of_a.drives.iter().map(|drive| drive.readings.iter().map(expected).collect()).collect();
        let (share, additive) = roughness(of_b, &levels)?;
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
