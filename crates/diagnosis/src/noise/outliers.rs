//! Readings that stand out from those beside them: a lost packet, a click, a knock at the bench.
//!
//! A gap varies over a wavelength, so that readings nearer to each other than that have similar residuals, whatever its cause. One that differs from
//! the median of its neighbours by far more than they differ among themselves is no field (F. R. Hampel, J. Am. Stat. Assoc. 69, 383, 1974).

use std::collections::{HashMap, HashSet};

use fieldgap_acoustics::Vec3;

use crate::limits::{MOST_OUTLIERS, OUTLIER_DEVIATIONS};
use crate::model::observations::{Observations, ObservedDrive};

/// Standard deviation of a normal distribution over its median absolute deviation.
const BY_MEDIAN: f64 = 1.4826;

/// Neighbours that are looked at, and those that there must be.
const MOST_NEIGHBOURS: usize = 12;
const FEWEST_NEIGHBOURS: usize = 6;

/// The readings, given their residuals in standard deviations of the noise, that stand out: each scan by its number, with the number of the visit. None where many do: the
/// noise is then not what it seems.
pub(crate) fn outliers(observations: &Observations, residuals: &[f64]) -> HashSet<(usize, usize)> {
    let mut first = 0;
    let mut found = HashSet::new();
    for (number, scan) in observations.scans.iter().enumerate() {
        for drive in &scan.drives {
            let of_drive = &residuals[first..first + drive.visits.len()];
            first += drive.visits.len();
            let standing_out = standing_out(drive, of_drive).into_iter();
            found.extend(standing_out.map(|index| (number, drive.visits[index].number)));
        }
    }
    match found.len() as f64 > MOST_OUTLIERS * observations.len() as f64 {
        true => HashSet::new(),
        false => found,
    }
}

/// The numbers of the readings of one drive that stand out.
fn standing_out(drive: &ObservedDrive, residuals: &[f64]) -> Vec<usize> {
    let wavelength_m = drive.believed.medium.wavelength_m(drive.believed.frequency_hz);
    let near = Near::of(drive, 0.75 * wavelength_m);
    let beside: Vec<Option<(f64, f64)>> = (0..residuals.len())
        .map(|index| {
            let neighbours: Vec<f64> =
                near.of_visit(drive, index).into_iter().map(|n| residuals[n]).collect();
            (neighbours.len() >= FEWEST_NEIGHBOURS).then(|| {
                let middle = median(neighbours.clone());
                let apart = neighbours.iter().map(|r| (r - middle).abs()).collect();
                (residuals[index] - middle, BY_MEDIAN * median(apart))
            })
        })
        .collect();
    let all: Vec<f64> = beside.iter().flatten().map(|(off, _)| off.abs()).collect();
    if all.is_empty() {
        return Vec::new();
    }
    let usual = BY_MEDIAN * median(all);
    let stands_out = |index: &usize| {
        beside[*index].is_some_and(|(off, among_themselves)| {
            off.abs() > OUTLIER_DEVIATIONS * usual.max(among_themselves).max(1.0)
        })
    };
    (0..residuals.len()).filter(stands_out).collect()
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

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
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

    /// A gap of ten times the noise that varies over a wavelength has none; three clicks in it are found.
    #[test]
    fn clicks_stand_out_of_a_gap_and_a_gap_does_not() {
        let gap = |at_m: &Vec3| 10.0 * (740.0 * at_m.x).sin() * (500.0 * at_m.y).cos();
        let mut with_gap = residuals(gap);
        assert_eq!(outliers(&plane(), &with_gap), HashSet::new());
        for n in [100, 455, 783] {
            with_gap[n] += 60.0;
        }
        let expected: HashSet<_> = [100, 455, 783].map(|n| (0, n)).into();
        assert_eq!(outliers(&plane(), &with_gap), expected);
    }

    #[test]
    fn noise_alone_has_none_and_many_are_none() {
        let mut noise = residuals(|_| 0.0);
        assert_eq!(outliers(&plane(), &noise), HashSet::new());
        (0..900).step_by(20).for_each(|n| noise[n] += 30.0);
        assert_eq!(outliers(&plane(), &noise), HashSet::new());
    }
}
