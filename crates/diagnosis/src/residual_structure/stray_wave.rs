//! Whether the residuals contain a wave from a place without an element: an object that scatters, a wall beside the field.
//!
//! A stray wave changes a reading by an amount that depends on its phase relative to the expected pressure. For each possible source this
//! phase is known. The residuals, with the phase of the expected pressure, are therefore propagated back into the room, as in acoustic
//! holography (J. D. Maynard, E. G. Williams, Y. Lee, J. Acoust. Soc. Am. 78, 1395, 1985); at the source they add in phase. The field
//! kernel computes the sums, with the readings as sources.

use fieldgap_acoustics::{
    Array, Element, FieldKernel, PathLengths, Precision, Vec3, transducer::Piston,
};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::fit::joint_fit::Fit;
use crate::fit::score_statistic::ScoreStatistics;
use crate::limits::{FARTHEST_SOURCE_M, TOUCHED_M};
use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, ObservedDrive};
use crate::model::planes::{by_height, is_flat};
use crate::residual_structure::patterns::mean_square;
use crate::residual_structure::test::Test;
use crate::statistics::median::median;
use crate::statistics::significance::{less_by_chance, z_of_sum_of_squares};

/// Steps between places within the field and beside it, across and up, m: half the resolution of a scan there.
const WITHIN_M: (f64, f64) = (4e-3, 5e-3);
const BESIDE_M: (f64, f64) = (10e-3, 15e-3);

/// Most places within the field: of a larger one the steps are wider.
const MOST_WITHIN: f64 = 60e3;

/// How far the field reaches beyond the outermost readings, m.
const MARGIN_M: f64 = 10e-3;

/// Readings of a drive from which the variance by noise is estimated at least. Of few readings a single one may be most of it.
const ENOUGH: usize = 700;

/// A reading counts as if it changed with the pressure by at most this many times the median: near zeros of the field, noise in proportion to the level
/// would make single readings count for more than all others. Set by judgement.
const LARGEST_SLOPE: f64 = 3.0;

/// The largest share of one reading in the variance by noise: with few readings above a place, one that is off is no wave. Set by judgement.
const LARGEST_SHARE: f64 = 0.05;

/// Radius of an omnidirectional face, m.
const POINT_M: f64 = 1e-5;

/// The test for the strongest stray wave in these residuals; `None` if there is no possible source. Only waves from below the readings
/// are considered.
pub(crate) fn test(scores: &ScoreStatistics<'_>, residuals: &[f64]) -> Option<Test> {
    let ScoreStatistics { observations, context, fit, .. } = scores;
    let model = fit.model(context);
    let by_pressure = scores.by_pressure();
    let power = mean_square(residuals);
    let places_m = places(observations);
    let mut sums = vec![0.0; places_m.len()];
    let (mut first, mut numbers) = (0, 0.0);
    for (drive, nuisance) in drives(observations, fit) {
        let range = first..first + drive.visits.len();
        first = range.end;
        let slopes = &by_pressure[range.clone()];
        let most = LARGEST_SLOPE * median(slopes.iter().map(|slope| slope.norm()).collect());
        let bounded = |slope: &Complex64| slope * (most / slope.norm()).min(1.0);
        let radiated: Vec<(f64, Complex64)> =
            residuals[range].iter().zip(slopes).map(|(r, slope)| (*r, bounded(slope))).collect();
        let met = met(&model, drive, nuisance, &radiated, &places_m);
        sums.iter_mut().zip(met).for_each(|(sum, met)| *sum += met / power);
        numbers += 2.0;
    }
    let (best, sum) = sums.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    let z = less_by_chance(z_of_sum_of_squares(*sum, numbers), places_m.len() as f64);
    let from_mm = places_m[best] * 1e3;
    let sign = format!(
        "from about ({:.0}, {:.0}, {:.0}) mm in the array's frame",
        from_mm.x, from_mm.y, from_mm.z
    );
    Some(Test::of_one_thing("a wave from elsewhere", z, Some(sign)))
}

fn drives<'o>(
    observations: &'o Observations,
    fit: &'o Fit,
) -> impl Iterator<Item = (&'o ObservedDrive, &'o Nuisance)> {
    let scans = observations.scans.iter().zip(fit.nuisance.iter());
    scans.flat_map(|(scan, nuisance)| scan.drives.iter().map(move |drive| (drive, nuisance)))
}

/// The back-propagated power of one drive's residuals at each place; for noise the sum of two squares of variance one.
fn met(
    model: &ForwardModel,
    drive: &ObservedDrive,
    nuisance: &Nuisance,
    radiated: &[(f64, Complex64)],
    places_m: &[Vec3],
) -> Vec<f64> {
    // Stray waves come from below the readings, but the kernel's elements radiate upwards: everything is mirrored in z.
    let on_its_head = |at_m: &Vec3| Vec3::new(at_m.x, at_m.y, -at_m.z);
    let readings_m: Vec<Vec3> =
        model.places(&drive.visits, nuisance).iter().map(on_its_head).collect();
    let radiating = readings_m.iter().zip(radiated).map(|(at_m, (residual, slope))| {
        let radiates = slope * residual;
        let (amplitude, phase_rad) = (radiates.norm(), radiates.arg());
        Element {
            centre_m: *at_m,
            radius_m: POINT_M,
            amplitude,
            phase_rad,
            ..Element::at(0.0, 0.0)
        }
    });
    let array = Array::from_elements(radiating.collect()).expect("a drive has readings");
    let wavenumber = model.wavenumber_rad_m(&drive.believed);
    let dark = vec![0.0; array.len()];
    let kernel = FieldKernel::new(&array, &dark, &Piston, wavenumber, PathLengths::Observed)
        .with_precision(Precision::Single);
    let places_m: Vec<Vec3> = places_m.iter().map(on_its_head).collect();
    let met = kernel.at(&places_m);
    // (Of many readings the variance by noise hardly changes from one to the next.)
    let one_in = (radiated.len() / ENOUGH).max(1);
    let some: Vec<(Vec3, f64)> = readings_m
        .into_iter()
        .zip(radiated)
        .step_by(one_in)
        .map(|(at_m, (_, slope))| (at_m, one_in as f64 * slope.norm_sqr()))
        .collect();
    let of_noise = |at_m: &Vec3| -> f64 {
        let below = some.iter().filter(|(reading_m, _)| reading_m.z < at_m.z);
        let (sum, largest) = below
            .map(|(reading_m, power)| power / (at_m - reading_m).norm_squared())
            .fold((0.0, 0.0), |(sum, largest), power| (sum + power, power.max(largest)));
        if largest > LARGEST_SHARE * sum { 0.0 } else { sum }
    };
    places_m
        .par_iter()
        .zip(met)
        .map(|(at_m, met)| {
            let of_noise = of_noise(at_m);
            if of_noise > 0.0 { 2.0 * met.norm_sqr() / of_noise } else { 0.0 }
        })
        .collect()
}

/// Where a wave may come from: within the field between the planes, and beside it.
fn places(observations: &Observations) -> Vec<Vec3> {
    let all = || observations.scans.iter().flat_map(|scan| &scan.drives);
    let readings_m = || all().flat_map(|drive| drive.visits.iter().map(|visit| visit.at_m));
    let (mut least, mut most) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    for at_m in readings_m() {
        (least, most) = (least.inf(&at_m), most.sup(&at_m));
    }
    let (mut heights_m, mut scattered_m) = (Vec::new(), Vec::new());
    for drive in all() {
        for plane in by_height(drive) {
            match is_flat(drive, &plane) {
                true => heights_m.push(drive.visits[plane[0]].at_m.z),
                false => scattered_m.extend(plane.iter().map(|&index| drive.visits[index].at_m)),
            }
        }
    }
    let (least, most) = (least - Vec3::repeat(MARGIN_M), most + Vec3::repeat(MARGIN_M));
    let within = |at_m: &Vec3| (0..2).all(|axis| (least[axis]..=most[axis]).contains(&at_m[axis]));
    let touched = |at_m: &Vec3| {
        heights_m.iter().any(|z_m| (z_m - at_m.z).abs() < TOUCHED_M)
            || scattered_m.iter().any(|reading_m| (reading_m - at_m).norm() < TOUCHED_M)
    };
    let (across_m, up_m) = WITHIN_M;
    let count = (most.x - least.x) * (most.y - least.y) * most.z / (across_m * across_m * up_m);
    let wider = (count / MOST_WITHIN).cbrt().max(1.0);
    let steps_m = (wider * across_m, wider * up_m);
    let inner = lattice([least.x, least.y, up_m], [most.x, most.y, most.z], steps_m)
        .into_iter()
        .filter(|at_m| !touched(at_m));
    let far = FARTHEST_SOURCE_M;
    let outer = lattice([-far, -far, 0.0], [far, far, most.z], BESIDE_M)
        .into_iter()
        .filter(|at_m| !within(at_m));
    inner.chain(outer).collect()
}

fn lattice(from_m: [f64; 3], to_m: [f64; 3], (across_m, up_m): (f64, f64)) -> Vec<Vec3> {
    let steps = |axis: usize, step_m: f64| {
        let count = ((to_m[axis] - from_m[axis]) / step_m).floor().max(0.0) as usize;
        (0..=count).map(move |n| from_m[axis] + step_m * n as f64)
    };
    let mut places = Vec::new();
    for z in steps(2, up_m) {
        for y in steps(1, across_m) {
            places.extend(steps(0, across_m).map(|x| Vec3::new(x, y, z)));
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::Excitation;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::effects::testing::{Bench, nuisance};
    use crate::limits::SINGLE_CAUSE_LIMIT;

    /// A cube around the focus, the places of its readings, and residuals of noise.
    fn volume(
        readings: usize,
        half_m: f64,
        check: impl FnOnce(&ScoreStatistics<'_>, &[Vec3], Vec<f64>),
    ) {
        let middle_m = Vec3::z() * 2.0 * half_m;
        let focus = Excitation::Focus(middle_m);
        let bench = Bench::of(Array::square(8, 8, 10e-3).expect("not empty"), focus.clone());
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let mut place = || middle_m + Vec3::from_fn(|_, _| random.random_range(-half_m..half_m));
        let places_m: Vec<Vec3> = (0..readings).map(|_| place()).collect();
        let noise = StandardNormal.sample_iter(&mut random).take(readings).collect();
        let observations = bench.observations(&[(focus, places_m.clone())]);
        let fit = Fit::of_nothing(vec![nuisance()]);
        check(&ScoreStatistics::of(&observations, &bench.context, &fit), &places_m, noise);
    }

    /// One of these readings after the other is off by more than noise is.
    fn one_is_off(scores: &ScoreStatistics<'_>, noise: &[f64], some: &[usize]) {
        for off in some {
            let mut residuals = noise.to_vec();
            residuals[*off] = 4.5;
            let found = test(scores, &residuals).expect("possible sources");
            assert!(found.z < SINGLE_CAUSE_LIMIT.get(), "{}", found.in_words());
        }
    }

    /// There it would count for more than all others.
    #[test]
    fn a_reading_near_a_zero_of_the_field_that_is_off_is_no_wave() {
        volume(1500, 0.03, |scores, _, noise| {
            let readings = &scores.observations.scans[0].drives[0].readings;
            let mut weakest: Vec<usize> = (0..noise.len()).collect();
            weakest.sort_by(|a, b| readings[*a].total_cmp(&readings[*b]));
            one_is_off(scores, &noise, &weakest[..5]);
        });
    }

    /// Above places near the top there are few. (Every second of so many readings stands for all in the variance: these are the others.)
    #[test]
    fn a_reading_at_the_top_of_a_volume_that_is_off_is_no_wave() {
        volume(1500, 0.1, |scores, places_m, noise| {
            let mut highest: Vec<usize> = (1..noise.len()).step_by(2).collect();
            highest.sort_by(|a, b| places_m[*b].z.total_cmp(&places_m[*a].z));
            one_is_off(scores, &noise, &highest[..8]);
        });
    }

    /// A point beside the array, by its closed form. Its wave changes half of the readings by less than 0.4 of their noise.
    #[test]
    fn a_source_beside_a_volume_is_found_where_it_is() {
        const SOURCE_M: Vec3 = Vec3::new(-0.1, 0.04, 0.03);
        volume(1500, 0.03, |scores, places_m, noise| {
            let drive = &scores.observations.scans[0].drives[0];
            let wavenumber = scores.fit.model(scores.context).wavenumber_rad_m(&drive.believed);
            let wave = places_m.iter().zip(scores.by_pressure()).map(|(at_m, slope)| {
                let path_m = (at_m - SOURCE_M).norm();
                (slope * Complex64::from_polar(1.0 / path_m, wavenumber * path_m)).re
            });
            let wave: Vec<f64> = wave.collect();
            let strength = 0.4 / median(wave.iter().map(|wave| wave.abs()).collect());
            let residuals: Vec<f64> =
                noise.iter().zip(&wave).map(|(noise, wave)| noise + strength * wave).collect();
            let found = test(scores, &residuals).expect("possible sources");
            assert!(found.z > 2.0 * SINGLE_CAUSE_LIMIT.get(), "{}", found.in_words());
            assert!(found.in_words().contains("(-100, 40, 30) mm"), "{}", found.in_words());
        });
    }
}
