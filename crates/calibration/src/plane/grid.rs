//! Where the readings of a plane lie on its grid: rows, neighbours, blocks, and the way of travel.

use std::collections::{BTreeMap, HashMap};

use crate::readings::CodedReadings;

/// Blocks of which every fifth is held out.
const EVERY: usize = 5;

/// Lags, in steps of the grid, within which residuals are held against one another.
const LAGS: i64 = 4;

/// The grid of the readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Column, row, layer and drive of each reading.
    cells: Vec<[i64; 4]>,
    /// Median step along x and y, m.
    pub step_m: f64,
    /// Half a step of travel: +1/2 or -1/2 along x or y, 0 where it is not known.
    pub travel: Vec<[f64; 2]>,
}

impl Grid {
    /// The grid of readings.
    pub fn of(readings: &CodedReadings) -> Self {
        let along = |axis: usize| -> (Vec<i64>, f64) {
            let mut levels: Vec<f64> =
                readings.readings.iter().map(|row| readings.places_m[row.place][axis]).collect();
            let of_reading = levels.clone();
            levels.sort_by(f64::total_cmp);
            // A robot that reports where it is strays by far less than a step.
            levels.dedup_by(|a, b| *a - *b < 0.1e-3);
            let steps: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let cell = |m: &f64| levels.partition_point(|level| *level < m + 0.05e-3) as i64;
            (of_reading.iter().map(cell).collect(), crate::readings::median(steps))
        };
        let (columns, dx) = along(0);
        let (rows, dy) = along(1);
        let (layers, _) = along(2);
        let count = columns.len();
        let cells: Vec<[i64; 4]> = (0..count)
            .map(|n| [columns[n], rows[n], layers[n], readings.readings[n].drive as i64])
            .collect();
        // The way of travel is that of the row: from the reading before, or at the beginning of a row to the next.
        let way = |a: usize, b: usize| {
            let by = [cells[b][0] - cells[a][0], cells[b][1] - cells[a][1]];
            let is_beside = by[0].abs() + by[1].abs() == 1 && cells[a][2] == cells[b][2];
            is_beside.then(|| by.map(|cells| 0.5 * cells as f64))
        };
        let steps: Vec<Option<[f64; 2]>> = (1..count).map(|n| way(n - 1, n)).collect();
        let moves = |axis: usize| steps.iter().flatten().filter(|way| way[axis] != 0.0).count();
        let along = usize::from(moves(1) > moves(0));
        let of = |n: usize| {
            let before = n.checked_sub(1).and_then(|n| steps[n]);
            let after = steps.get(n).copied().flatten();
            let is_along = |way: &[f64; 2]| way[along] != 0.0;
            before.filter(is_along).or(after.filter(is_along)).unwrap_or([0.0; 2])
        };
        let travel = (0..count).map(of).collect();
        Self { cells, step_m: 0.5 * (dx + dy), travel }
    }

    /// The readings in every fifth block of `points` by `points` places.
    pub fn held_out(&self, points: usize) -> Vec<bool> {
        let points = points as i64;
        let least = |axis: usize| self.cells.iter().map(|cell| cell[axis]).min().unwrap_or(0);
        let most = |axis: usize| self.cells.iter().map(|cell| cell[axis]).max().unwrap_or(0);
        let (left, top) = (least(0), least(1));
        let across = (most(0) - left) / points + 1;
        let block =
            |cell: &[i64; 4]| ((cell[1] - top) / points) * across + (cell[0] - left) / points;
        self.cells.iter().map(|cell| block(cell) as usize % EVERY == EVERY - 1).collect()
    }

    /// Each plane of each drive row by row, with its number of columns; NaN where nothing was read.
    pub fn maps(&self, values: &[f64]) -> Vec<(Vec<f64>, usize)> {
        let ends = |axis: usize| {
            let all = || self.cells.iter().map(move |cell| cell[axis]);
            (all().min().unwrap_or(0), all().max().unwrap_or(0))
        };
        let ((left, right), (top, bottom)) = (ends(0), ends(1));
        let columns = (right - left + 1) as usize;
        let mut maps: BTreeMap<[i64; 2], Vec<f64>> = BTreeMap::new();
        for ([x, y, layer, drive], value) in self.cells.iter().zip(values) {
            let empty = || vec![f64::NAN; columns * (bottom - top + 1) as usize];
            let map = maps.entry([*layer, *drive]).or_insert_with(empty);
            map[(y - top) as usize * columns + (x - left) as usize] = *value;
        }
        maps.into_values().map(|map| (map, columns)).collect()
    }

    /// Points along the shorter side.
    pub fn side(&self) -> usize {
        let extent = |axis: usize| {
            let all = || self.cells.iter().map(|cell| cell[axis]);
            all().max().unwrap_or(0) - all().min().unwrap_or(0) + 1
        };
        extent(0).min(extent(1)) as usize
    }

    /// How many neighbouring residuals tell no more than one: the sum of their correlations over all lags up to four steps, at least one.
    /// An error of the model that reaches over some steps, or noise that lasts from reading to reading, is not told anew by each.
    pub fn readings_of_one(&self, keep: &[usize], residuals: &[f64]) -> f64 {
        let at: HashMap<[i64; 4], f64> =
            keep.iter().zip(residuals).map(|(&n, r)| (self.cells[n], *r)).collect();
        let power: f64 = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64;
        let mut sum = 0.0;
        for dx in -LAGS..=LAGS {
            for dy in -LAGS..=LAGS {
                let (mut product, mut pairs) = (0.0, 0);
                for (&n, r) in keep.iter().zip(residuals) {
                    let [x, y, z, drive] = self.cells[n];
                    if let Some(other) = at.get(&[x + dx, y + dy, z, drive]) {
                        product += r * other;
                        pairs += 1;
                    }
                }
                let correlation = product / (pairs.max(1) as f64 * power.max(f64::MIN_POSITIVE));
                // A lag with few pairs, or a correlation within its error, adds noise only.
                if correlation > 2.0 / f64::from(pairs.max(1)).sqrt() {
                    sum += correlation;
                }
            }
        }
        sum.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readings::Reading;
    use fieldgap_acoustics::Vec3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn serpentine(columns: usize, rows: usize) -> CodedReadings {
        let places = (0..rows).flat_map(|y| {
            (0..columns).map(move |n| {
                let x = if y.is_multiple_of(2) { n } else { columns - 1 - n };
                Vec3::new(x as f64 * 2e-3, y as f64 * 2e-3, 0.1)
            })
        });
        let places_m: Vec<Vec3> = places.collect();
        let readings = (0..places_m.len())
            .map(|place| Reading { place, drive: 0, time_s: place as f64, value: 1.0 })
            .collect();
        CodedReadings { places_m, drives: vec![vec![]], readings, silent: None }
    }

    #[test]
    fn rows_of_a_serpentine_run_to_and_fro() {
        let grid = Grid::of(&serpentine(10, 4));
        assert!((grid.step_m - 2e-3).abs() < 1e-12);
        assert_eq!(grid.side(), 4);
        for (n, way) in grid.travel.iter().enumerate() {
            assert_eq!(*way, [if (n / 10).is_multiple_of(2) { 0.5 } else { -0.5 }, 0.0], "{n}");
        }
    }

    #[test]
    fn every_fifth_block_is_held_out_whole() {
        let grid = Grid::of(&serpentine(20, 20));
        let held = grid.held_out(5);
        // Sixteen blocks, of which numbers 4, 9 and 14.
        assert_eq!(held.iter().filter(|&&held| held).count(), 75);
    }

    #[test]
    fn white_residuals_stand_for_themselves_and_means_of_three_for_fewer() {
        let readings = serpentine(60, 60);
        let grid = Grid::of(&readings);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let white: Vec<f64> = (0..3602).map(|_| random.random::<f64>() - 0.5).collect();
        let keep: Vec<usize> = (0..3600).collect();
        let one = grid.readings_of_one(&keep, &white[..3600]);
        assert!(one < 1.4, "{one}");
        // Along a row the mean of three has correlations 1, 2/3, 1/3: their sum is 3.
        let smooth: Vec<f64> = white.windows(3).map(|w| w.iter().sum::<f64>() / 3.0).collect();
        let three = grid.readings_of_one(&keep, &smooth);
        assert!((2.4..3.8).contains(&three), "{three}");
    }
}
