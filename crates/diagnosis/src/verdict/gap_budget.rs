//! Where the gap lies: the squared gap beyond noise shared out over heights, regions and kinds.

use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

use crate::model::forward_model::ForwardModel;
use crate::model::nuisance::Nuisance;
use crate::model::observations::{Observations, ObservedDrive};
use crate::model::planes::{by_height, step_m};
use crate::result::{KindShares, PlaneShare, Region, RegionShare, Where};

/// Step of the difference quotient of the believed field, m.
const DIFFERENCE_M: f64 = 1e-6;

/// One height of one drive.
struct Part<'o> {
    scan: usize,
    drive: &'o ObservedDrive,
    /// Readings of this height: their indices in the drive.
    own: Vec<usize>,
    /// Where the drive begins among all readings.
    first: usize,
}

/// Divides the gap, given the readings expected of the believed set-up and of the best fit.
pub(crate) fn gap_budget(
    observations: &Observations,
    nuisance: &[Nuisance],
    before: &[f64],
    after: &[f64],
) -> Where {
    let parts = parts(observations);
    let noise = |part: &Part<'_>, i: usize| {
        observations.scans[part.scan].noise_variance(part.drive.readings[i])
    };
    let squares = |part: &Part<'_>, expected: &[f64], of: &[usize]| -> f64 {
        of.iter().map(|&i| (part.drive.readings[i] - expected[part.first + i]).powi(2)).sum()
    };
    let beyond = |part: &Part<'_>, of: &[usize]| -> f64 {
        squares(part, before, of) - of.iter().map(|&i| noise(part, i)).sum::<f64>()
    };
    let shares = |amounts: Vec<f64>| -> Vec<f64> {
        let positive: Vec<f64> = amounts.into_iter().map(|amount| amount.max(0.0)).collect();
        let sum: f64 = positive.iter().sum();
        let even = 1.0 / positive.len().max(1) as f64;
        positive.iter().map(|amount| if sum > 0.0 { amount / sum } else { even }).collect()
    };
    let of_planes = shares(parts.iter().map(|part| beyond(part, &part.own)).collect());
    let planes = parts
        .iter()
        .zip(of_planes)
        .map(|(part, share)| {
            let power: f64 = part.own.iter().map(|&i| part.drive.readings[i].powi(2)).sum();
            let height_m: f64 = part.own.iter().map(|&i| part.drive.visits[i].at_m.z).sum();
            let z_mm = 1e3 * height_m / part.own.len() as f64;
            PlaneShare {
                scan: part.scan,
                focus: part.drive.focus,
                z_mm: (z_mm * 1e3).round() / 1e3,
                share,
                gap: (squares(part, before, &part.own) / power).sqrt(),
                gap_after: (squares(part, after, &part.own) / power).sqrt(),
                noise: (part.own.iter().map(|&i| noise(part, i)).sum::<f64>() / power).sqrt(),
            }
        })
        .collect();
    let all = [Region::MainLobe, Region::SideLobes, Region::Outside];
    let mut amounts = [0.0; 3];
    for part in &parts {
        let regions = regions(part, before);
        for (region, amount) in all.iter().zip(&mut amounts) {
            let of: Vec<usize> =
                part.own.iter().copied().filter(|index| regions[index] == *region).collect();
            *amount += beyond(part, &of);
        }
    }
    let of_regions = shares(amounts.to_vec());
    let regions = all.into_iter().zip(of_regions);
    let regions = regions.map(|(region, share)| RegionShare { region, share }).collect();
    Where { planes, regions, kinds: kinds(observations, &parts, nuisance, before) }
}

fn parts(observations: &Observations) -> Vec<Part<'_>> {
    let mut parts = Vec::new();
    let mut first = 0;
    for (scan, observed) in observations.scans.iter().enumerate() {
        for drive in &observed.drives {
            parts.extend(by_height(drive).into_iter().map(|own| Part { scan, drive, own, first }));
            first += drive.readings.len();
        }
    }
    parts
}

/// The region of each reading of a plane, by the believed field: what is above half its peak and connected to
/// it, what else is above a tenth, and the rest.
fn regions(part: &Part<'_>, believed: &[f64]) -> HashMap<usize, Region> {
    let level = |i: usize| believed[part.first + i];
    let peak = part.own.iter().copied().max_by(|&a, &b| level(a).total_cmp(&level(b)));
    let Some(peak) = peak else { return HashMap::new() };
    let step_m = step_m(part.drive).unwrap_or(f64::INFINITY);
    let cell = |i: usize| {
        let at_m = part.drive.visits[i].at_m;
        ((at_m.x / step_m).round() as i64, (at_m.y / step_m).round() as i64)
    };
    let mut loud: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
    for &i in part.own.iter().filter(|&&i| level(i) >= 0.5 * level(peak)) {
        loud.entry(cell(i)).or_default().push(i);
    }
    let mut main_lobe: Vec<usize> = Vec::new();
    let mut reached = vec![cell(peak)];
    while let Some((x, y)) = reached.pop() {
        let Some(here) = loud.remove(&(x, y)) else { continue };
        main_lobe.extend(here);
        reached.extend((-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (x + dx, y + dy))));
    }
    let main_lobe: std::collections::HashSet<usize> = main_lobe.into_iter().collect();
    let region = |i: usize| match i {
        i if main_lobe.contains(&i) => Region::MainLobe,
        i if level(i) >= 0.1 * level(peak) => Region::SideLobes,
        _ => Region::Outside,
    };
    part.own.iter().map(|&i| (i, region(i))).collect()
}

/// What a separate gain, and then a separate shift, for each height would remove to first order; the noise; the rest.
fn kinds(
    observations: &Observations,
    parts: &[Part<'_>],
    nuisance: &[Nuisance],
    before: &[f64],
) -> KindShares {
    let (mut whole, mut with_gain, mut with_shift, mut noise) = (0.0, 0.0, 0.0, 0.0);
    for part in parts {
        let scan = &observations.scans[part.scan];
        let visits: Vec<_> = part.own.iter().map(|&i| part.drive.visits[i]).collect();
        let residual = DVector::from_iterator(
            visits.len(),
            part.own.iter().map(|&i| part.drive.readings[i] - before[part.first + i]),
        );
        let level = |i: usize| before[part.first + part.own[i]];
        let gain = nuisance[part.scan].log_gain.exp();
        let beside = [0, 1, 2].map(|axis| {
            let shift_m = fieldgap_acoustics::Vec3::ith(axis, DIFFERENCE_M);
            let shifted = Nuisance { shift_m, ..nuisance[part.scan] };
            let pressures =
                ForwardModel::believed().pressures_at(&part.drive.believed, &visits, &shifted);
            pressures.iter().map(|p| gain * p.coherent.norm()).collect::<Vec<f64>>()
        });
        let columns = DMatrix::from_fn(visits.len(), 4, |i, j| match j {
            0 => level(i),
            _ => (beside[j - 1][i] - level(i)) / DIFFERENCE_M,
        });
        let left = |count: usize| -> f64 {
            let design = columns.columns(0, count).into_owned();
            let normal = design.transpose() * &design;
            let solution = normal.cholesky().map(|c| c.solve(&(design.transpose() * &residual)));
            solution.map_or(residual.norm_squared(), |s| (&residual - design * s).norm_squared())
        };
        whole += residual.norm_squared();
        with_gain += left(1);
        with_shift += left(4);
        noise += part.own.iter().map(|&i| scan.noise_variance(part.drive.readings[i])).sum::<f64>();
    }
    if whole <= 0.0 {
        return KindShares { gain: 0.0, registration: 0.0, shape: 0.0, noise: 1.0 };
    }
    let noise = noise.min(with_shift);
    KindShares {
        gain: (whole - with_gain) / whole,
        registration: (with_gain - with_shift) / whole,
        shape: (with_shift - noise) / whole,
        noise: noise / whole,
    }
}
