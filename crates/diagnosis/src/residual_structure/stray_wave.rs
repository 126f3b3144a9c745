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

/// Readings that make the variance by noise, as a number of equal ones, from which on the sum of their residuals is normal. Set by judgement.
const FEWEST_HEARD: f64 = 20.0;

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
        let radiated = residuals[range.clone()].iter().zip(&by_pressure[range]);
        let radiated: Vec<(f64, Complex64)> = radiated.map(|(r, slope)| (*r, *slope)).collect();
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
    // (Of many readings of planes the variance by noise hardly changes from one to the next. Beside a place in a volume there may be one alone.)
    let of_planes = by_height(drive).iter().all(|plane| is_flat(drive, plane));
    let one_in = if of_planes { (radiated.len() / ENOUGH).max(1) } else { 1 };
    let some: Vec<(Vec3, f64)> = readings_m
        .into_iter()
        .zip(radiated)
        .step_by(one_in)
        .map(|(at_m, (_, slope))| (at_m, one_in as f64 * slope.norm_sqr()))
        .collect();
    // A few readings that make most of it say nothing of a wave.
    let of_noise = |at_m: &Vec3| -> f64 {
        let below = some.iter().filter(|(reading_m, _)| reading_m.z < at_m.z);
        let (sum, squares) = below
            .map(|(reading_m, power)| power / (at_m - reading_m).norm_squared())
            .fold((0.0, 0.0), |(sum, squares), power| (sum + power, squares + power * power));
        if sum * sum < FEWEST_HEARD * squares { 0.0 } else { sum }
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
