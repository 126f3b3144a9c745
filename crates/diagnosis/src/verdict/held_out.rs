//! Readings that are kept out of a fit to check it: a fifth, by place, by drive or by time, whichever a record has enough of.
//!
//! Neighbouring places, readings under one drive and readings one after another are alike. So whole blocks of places are kept out, several
//! wavelengths wide where the scan allows it; where the places are too few for that, whole drives; and where there are few of both, stretches
//! of time.

use std::collections::BTreeSet;

use fieldgap_acoustics::least_squares::Stopping;

use crate::fit::joint_fit::{Fit, Start, fit as fit_again};
use crate::limits::{CARRIED, HELD_OUT_BLOCK_WAVELENGTHS, HELD_OUT_BLOCKS_ACROSS};
use crate::model::effect::Context;
use crate::model::forward_model::ForwardModel;
use crate::model::observations::{Observations, ObservedScan};
use crate::result::HeldOutBy;
use crate::verdict::gap_size::{as_believed, gap};

/// One group in so many is kept out.
const ONE_IN: usize = 5;

/// Stretches of time, of which a fifth is kept out.
const STRETCHES: usize = 25;

/// The readings of a fit and those kept out of it.
pub(crate) struct HeldOut {
    pub training: Observations,
    pub kept_out: Observations,
    /// How they were chosen.
    pub by: HeldOutBy,
    /// Side of the blocks of places, m, if they were chosen so.
    pub block_m: Option<f64>,
}

impl HeldOut {
    pub fn of(observations: &Observations) -> Self {
        let block_m = block_m(observations);
        let by = |by: HeldOutBy| {
            let kept: Vec<BTreeSet<usize>> =
                observations.scans.iter().map(|scan| kept_out(scan, by, block_m)).collect();
            let is_fair = observations
                .scans
                .iter()
                .zip(&kept)
                .all(|(scan, kept)| !kept.is_empty() && 2 * kept.len() < scan.len());
            (is_fair || by == HeldOutBy::Time).then_some((by, kept))
        };
        let by_time = || by(HeldOutBy::Time).expect("the last resort");
        let (by, kept) =
            by(HeldOutBy::Place).or_else(|| by(HeldOutBy::Drive)).unwrap_or_else(by_time);
        let part =
            |out: bool| observations.part(|scan, visit| kept[scan].contains(&visit.number) == out);
        let block_m = (by == HeldOutBy::Place).then_some(block_m);
        Self { training: part(false), kept_out: part(true), by, block_m }
    }

    /// Of the believed set-up, its gain from the training points.
    pub fn before(&self) -> f64 {
        let nuisance = as_believed(&self.training);
        gap(&self.kept_out, &ForwardModel::believed().expected_readings(&self.kept_out, &nuisance))
    }

    /// Of a fit, repeated on the training points with the same spread of random departures.
    pub fn after(&self, fit: &Fit, context: &Context) -> f64 {
        let start = Start {
            instances: fit.instances.clone(),
            values: fit.values.clone(),
            spreads: fit.spreads.clone(),
            nuisance: Some(fit.nuisance.clone()),
        };
        let few = Stopping { iterations: 4, step: 1e-2, fall: 1e-6, carried: CARRIED };
        let again = fit_again(&self.training, context, start, few);
        let model = again.model(context);
        gap(&self.kept_out, &model.expected_readings(&self.kept_out, &again.nuisance))
    }
}

/// Side of the blocks of places, m: several wavelengths, or less in a narrow scan, but not below one.
fn block_m(observations: &Observations) -> f64 {
    let believed = &observations.first().believed;
    let wavelength_m = believed.medium.wavelength_m(believed.frequency_hz);
    let drives = observations.scans.iter().flat_map(|scan| &scan.drives);
    let places = drives.flat_map(|drive| &drive.visits).map(|visit| visit.at_m);
    let ends = places.fold(None, |ends, at_m| match ends {
        None => Some((at_m, at_m)),
        Some((least, most)) => Some((at_m.inf(&least), at_m.sup(&most))),
    });
    let longest_m = ends.map_or(0.0, |(least, most)| (most - least).max());
    let most_m = HELD_OUT_BLOCK_WAVELENGTHS * wavelength_m;
    (longest_m / HELD_OUT_BLOCKS_ACROSS).clamp(wavelength_m, most_m)
}

/// Numbers of the readings of a scan that are kept out.
fn kept_out(scan: &ObservedScan, by: HeldOutBy, block_m: f64) -> BTreeSet<usize> {
    let visits = || scan.drives.iter().flat_map(|drive| &drive.visits);
    match by {
        HeldOutBy::Place => visits()
            .filter(|visit| {
                let block = visit.at_m.map(|m| (m / block_m).floor() as i64);
                // In every direction one block in five, and no two of them beside each other.
                (block.x + 2 * block.y + 3 * block.z).rem_euclid(ONE_IN as i64) == 0
            })
            .map(|visit| visit.number)
            .collect(),
        HeldOutBy::Drive => {
            let drives = scan.drives.iter().skip(ONE_IN - 1).step_by(ONE_IN);
            drives.flat_map(|drive| &drive.visits).map(|visit| visit.number).collect()
        }
        HeldOutBy::Time => {
            let mut numbers: Vec<usize> = visits().map(|visit| visit.number).collect();
            numbers.sort_unstable();
            let stretch = numbers.len().div_ceil(STRETCHES).max(1);
            let stretches = numbers.chunks(stretch).skip(ONE_IN - 1).step_by(ONE_IN);
            stretches.flatten().copied().collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::{Excitation, Vec3};

    use super::*;
    use crate::effects::testing::Bench;

    /// A plane of that side, a point every two millimetres.
    fn plane(side_mm: u32) -> Observations {
        let along = || (0..=side_mm / 2).map(|n| 2e-3 * f64::from(n) - 5e-4 * f64::from(side_mm));
        let places = along().flat_map(|y| along().map(move |x| Vec3::new(x, y, 0.1)));
        Bench::new().observations(&[(Excitation::Uniform, places.collect())])
    }

    #[test]
    fn blocks_are_four_wavelengths_wide_and_narrower_in_a_narrow_scan_but_not_below_one() {
        let wavelength_m = 343.0 / 40e3;
        for (side_mm, wanted_m) in [(200, 4.0 * wavelength_m), (70, 14e-3), (20, wavelength_m)] {
            let held_out = HeldOut::of(&plane(side_mm));
            assert_eq!(held_out.by, HeldOutBy::Place);
            let block_m = held_out.block_m.expect("by place");
            assert!((block_m - wanted_m).abs() < 1e-9, "{side_mm}: {block_m}");
        }
    }

    /// From a point in the middle of a block that is kept out, no point that is fitted is nearer than the block's edge.
    #[test]
    fn a_fifth_is_kept_out_and_its_blocks_are_whole() {
        let HeldOut { training, kept_out, block_m, .. } = HeldOut::of(&plane(200));
        let share = kept_out.len() as f64 / (training.len() + kept_out.len()) as f64;
        assert!((share - 0.2).abs() < 0.06, "{share}");
        let block_m = block_m.expect("by place");
        let at_m = |of: &Observations| -> Vec<Vec3> {
            of.first().visits.iter().map(|visit| visit.at_m).collect()
        };
        let fitted_m = at_m(&training);
        let within = |m: f64| (m / block_m).rem_euclid(1.0) - 0.5;
        let middles = at_m(&kept_out)
            .into_iter()
            .filter(|at_m| within(at_m.x).abs().max(within(at_m.y).abs()) < 0.05);
        let nearest_m = middles.map(|middle_m| {
            fitted_m.iter().map(|m| (m - middle_m).norm()).fold(f64::INFINITY, f64::min)
        });
        let nearest_m: Vec<f64> = nearest_m.collect();
        assert!(!nearest_m.is_empty() && nearest_m.iter().all(|m| *m > 0.45 * block_m));
    }
}
