//! Readings that stand out from those beside them: a lost packet, a click, a knock at the bench.
//!
//! A gap varies over a wavelength, so that readings nearer to each other than that have similar residuals, whatever its cause. One that differs from
//! the median of its neighbours by far more than they differ among themselves is no field (F. R. Hampel, J. Am. Stat. Assoc. 69, 383, 1974).

use std::collections::{HashMap, HashSet};

use fieldgap_acoustics::Vec3;

use crate::limits::{MOST_OUTLIERS, OUTLIER_DEVIATIONS};
use crate::model::observations::{Observations, ObservedDrive};
use crate::statistics::median::median;

/// Standard deviation of a normal distribution over its median absolute deviation.
const BY_MEDIAN: f64 = 1.4826;

/// Deviations of all residuals of a scan up to which they are noise but for a few.
const MOSTLY_NOISE: f64 = 1.3;

/// Fewest readings without neighbours that stand out together, and how far the mean rank of their levels may be from the middle, in its deviations:
/// what a gap makes of readings far apart lies where the field is loud, or where it is quiet.
const FEWEST_APART: usize = 3;
const ANY_LEVEL: f64 = 2.5;

/// Neighbours that are looked at, and those that there must be.
const MOST_NEIGHBOURS: usize = 12;
const FEWEST_NEIGHBOURS: usize = 6;

/// The readings, given their residuals in standard deviations of the noise and their expected levels, that stand out: each scan by its number, with the
/// number of the visit. None where many do: the noise is then not what it seems.
///
/// Readings too far apart to have neighbours stand out of all others of their scan, where these are noise.
pub(crate) fn outliers(
    observations: &Observations,
    residuals: &[f64],
    levels: &[f64],
) -> HashSet<(usize, usize)> {
    let mut first = 0;
    let mut found = HashSet::new();
    for (number, scan) in observations.scans.iter().enumerate() {
        let range = first..first + scan.len();
        first = range.end;
        let (residuals, levels) = (&residuals[range.clone()], &levels[range]);
        let mut neighbours = Vec::with_capacity(residuals.len());
        let mut indices = Vec::new();
        for drive in &scan.drives {
            let from = neighbours.len();
            let of_drive = &residuals[from..from + drive.visits.len()];
            neighbours.extend(neighbours_of(drive, of_drive));
            let standing_out = standing_out(of_drive, &neighbours[from..]).into_iter();
            indices.extend(standing_out.map(|index| from + index));
        }
        indices.extend(standing_out_alone(residuals, levels, &neighbours));
        let visits: Vec<usize> =
            scan.drives.iter().flat_map(|drive| &drive.visits).map(|visit| visit.number).collect();
        found.extend(indices.into_iter().map(|index| (number, visits[index])));
    }
    match found.len() as f64 > MOST_OUTLIERS * observations.len() as f64 {
        true => HashSet::new(),
        false => found,
    }
}

/// The residuals of the readings beside each reading of a drive.
fn neighbours_of(drive: &ObservedDrive, residuals: &[f64]) -> Vec<Vec<f64>> {
    let wavelength_m = drive.believed.medium.wavelength_m(drive.believed.frequency_hz);
    let near = Near::of(drive, 0.75 * wavelength_m);
    let beside = |index: usize| near.of_visit(drive, index).into_iter().map(|n| residuals[n]);
    (0..residuals.len()).map(|index| beside(index).collect()).collect()
}

/// The numbers of the readings of one drive that stand out of those beside them.
fn standing_out(residuals: &[f64], neighbours: &[Vec<f64>]) -> Vec<usize> {
    let beside: Vec<Option<(f64, f64)>> = neighbours
        .iter()
        .zip(residuals)
        .map(|(neighbours, residual)| {
            (neighbours.len() >= FEWEST_NEIGHBOURS).then(|| {
                let middle = median(neighbours.clone());
                let apart = neighbours.iter().map(|r| (r - middle).abs()).collect();
                (residual - middle, BY_MEDIAN * median(apart))
            })
        })
        .collect();
    let all: Vec<f64> = beside.iter().flatten().map(|(off, _)| off.abs()).collect();
    let usual = if all.is_empty() { f64::INFINITY } else { BY_MEDIAN * median(all) };
    let stands_out = |index: &usize| {
        beside[*index].is_some_and(|(off, among_themselves)| {
            off.abs() > OUTLIER_DEVIATIONS * usual.max(among_themselves).max(1.0)
        })
    };
    (0..residuals.len()).filter(stands_out).collect()
}

/// The numbers of the readings with few neighbours that stand out of all readings of their scan.
fn standing_out_alone(
    residuals: &[f64],
    levels: &[f64],
    neighbours: &[Vec<f64>],
) -> impl Iterator<Item = usize> {
    let usual = match residuals.is_empty() {
        true => f64::INFINITY,
        false => BY_MEDIAN * median(residuals.iter().map(|r| r.abs()).collect()),
    };
    let stands_out = |index: &usize| {
        let few = neighbours[*index].len() < FEWEST_NEIGHBOURS;
        let shared = neighbours[*index].iter().any(|r| 2.0 * r / residuals[*index] > 1.0);
        few && !shared && residuals[*index].abs() > OUTLIER_DEVIATIONS * usual.max(1.0)
    };
    let found: Vec<usize> = (0..residuals.len()).filter(stands_out).collect();
    let rank = |index: &usize| {
        let quieter = levels.iter().filter(|level| **level < levels[*index]).count();
        quieter as f64 / levels.len() as f64 - 0.5
    };
    let count = found.len() as f64;
    // The mean of ranks is of variance one in twelve of their number.
    let by_level = found.iter().map(rank).sum::<f64>() / (count / 12.0).sqrt();
    let accepted =
        usual < MOSTLY_NOISE && found.len() >= FEWEST_APART && by_level.abs() < ANY_LEVEL;
    found.into_iter().filter(move |_| accepted)
}

/// The readings of a drive by where they were taken.
struct Near {
    cells: HashMap<[i64; 3], Vec<usize>>,
    reach_m: f64,
}

impl Near {
    fn of(drive: &ObservedDrive, reach_m: f64) -> Self {
        let mut cells = HashMap::<_, Vec<usize>>::new();
        for (index, visit) in drive.visits.iter().enumerate() {
            cells.entry(cell(&visit.at_m, reach_m)).or_default().push(index);
        }
        Self { cells, reach_m }
    }

    /// The nearest other readings within reach.
    fn of_visit(&self, drive: &ObservedDrive, index: usize) -> Vec<usize> {
        let at_m = drive.visits[index].at_m;
        let [x, y, z] = cell(&at_m, self.reach_m);
        let mut near: Vec<(f64, usize)> = Vec::new();
        for cell in (-1..=1)
            .flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [x + i, y + j, z + k])))
        {
            let others = self.cells.get(&cell).into_iter().flatten().filter(|&&n| n != index);
            let apart = others.map(|&n| ((drive.visits[n].at_m - at_m).norm(), n));
            near.extend(apart.filter(|(apart_m, _)| *apart_m <= self.reach_m));
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter().take(MOST_NEIGHBOURS).map(|(_, n)| n).collect()
    }
}

fn cell(at_m: &Vec3, reach_m: f64) -> [i64; 3] {
    at_m.map(|m| (m / reach_m).floor() as i64).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;
    use fieldgap_acoustics::Excitation;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    /// A plane of points 2 mm apart.
    fn plane() -> Observations {
        let at = |n: i32| 2e-3 * f64::from(n) - 0.03;
        let places = (0..900).map(|n| Vec3::new(at(n % 30), at(n / 30), 0.1)).collect();
        Bench::new().observations(&[(Excitation::Uniform, places)])
    }

    fn residuals(gap: impl Fn(&Vec3) -> f64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let visits = plane().scans[0].drives[0].visits.clone();
        let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
        visits.iter().map(|visit| gap(&visit.at_m) + noise()).collect()
    }

    fn found(observations: &Observations, residuals: &[f64]) -> HashSet<(usize, usize)> {
        let levels: Vec<f64> = (0..residuals.len()).map(|n| ((n * 7919) % 900) as f64).collect();
        outliers(observations, residuals, &levels)
    }

    /// A gap of ten times the noise that varies over a wavelength has none; three clicks in it are found.
    #[test]
    fn clicks_stand_out_of_a_gap_and_a_gap_does_not() {
        let gap = |at_m: &Vec3| 10.0 * (740.0 * at_m.x).sin() * (500.0 * at_m.y).cos();
        let mut with_gap = residuals(gap);
        assert_eq!(found(&plane(), &with_gap), HashSet::new());
        for n in [100, 455, 783] {
            with_gap[n] += 60.0;
        }
        let expected: HashSet<_> = [100, 455, 783].map(|n| (0, n)).into();
        assert_eq!(found(&plane(), &with_gap), expected);
    }

    #[test]
    fn noise_alone_has_none_and_many_are_none() {
        let mut noise = residuals(|_| 0.0);
        assert_eq!(found(&plane(), &noise), HashSet::new());
        (0..900).step_by(20).for_each(|n| noise[n] += 30.0);
        assert_eq!(found(&plane(), &noise), HashSet::new());
    }
    /// Of readings a wavelength apart, those that stand out at any level are wrong; those where the field is loudest are a gap.
    #[test]
    fn readings_far_apart_stand_out_of_all_others_but_where_the_field_is_loudest() {
        let at = |n: i32| 9e-3 * f64::from(n) - 0.13;
        let places = (0..900).map(|n| Vec3::new(at(n % 30), at(n / 30), 0.1)).collect();
        let sparse = Bench::new().observations(&[(Excitation::Uniform, places)]);
        let noise = residuals(|_| 0.0);
        assert_eq!(found(&sparse, &noise), HashSet::new());
        let mut with_clicks = noise.clone();
        for n in [100, 455, 458, 783] {
            with_clicks[n] -= 12.0;
        }
        let expected: HashSet<_> = [100, 455, 458, 783].map(|n| (0, n)).into();
        assert_eq!(found(&sparse, &with_clicks), expected);
        let loudest: Vec<f64> = with_clicks.iter().map(|r| r.abs()).collect();
        assert_eq!(outliers(&sparse, &with_clicks, &loudest), HashSet::new());
        // Two may be anything.
        let mut two = noise.clone();
        [100, 455].into_iter().for_each(|n| two[n] -= 12.0);
        assert_eq!(found(&sparse, &two), HashSet::new());
        // A gap everywhere is none either.
        let gap: Vec<f64> = with_clicks.iter().map(|r| 2.0 * r).collect();
        assert_eq!(found(&sparse, &gap), HashSet::new());
    }

    /// Points in pairs, 1 mm apart, and pairs far from each other: what both have of a pair is no click.
    #[test]
    fn what_a_reading_shares_with_the_one_beside_it_is_no_click() {
        let at = |n: i32| 2e-2 * f64::from(n / 2) + 1e-3 * f64::from(n % 2) - 0.15;
        let places =
            (0..900).map(|n| Vec3::new(at(n % 30), 2e-2 * f64::from(n / 30), 0.1)).collect();
        let pairs = Bench::new().observations(&[(Excitation::Uniform, places)]);
        let mut shared = residuals(|_| 0.0);
        for n in [100, 101, 454, 455, 782, 783] {
            shared[n] += 15.0;
        }
        assert_eq!(found(&pairs, &shared), HashSet::new());
        let mut alone = residuals(|_| 0.0);
        [100, 455, 783].into_iter().for_each(|n| alone[n] += 15.0);
        assert_eq!(found(&pairs, &alone).len(), 3);
    }
}
