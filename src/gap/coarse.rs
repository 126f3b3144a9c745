//! Where to start: every plausible pose tried on a coarse grid.
//!
//! A field of interference fringes has as many false optima as fringes, so a search that walks downhill has to start
//! within a quarter of a wavelength or so. Here the simulated field is computed once on a wide grid about
//! each height, and some hundreds of readings are laid on it at every combination of handedness, quarter turn, small turn,
//! step, height and shift; what correlates best in each orientation is handed on to be refined.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;

use super::pose::{Mirror, Pose};
use super::readings::{Drive, Readings};
use crate::acoustics::{PlaneGrid, Simulation, Vec3};

/// Heights looked at: enough to tell one pose from another, few enough to stay quick.
const MAX_LEVELS: usize = 6;
/// Readings looked at, over all heights.
const READINGS: usize = 600;
/// Shifts tried: this far either way, in steps, metres. A step is less than a third of a wavelength at 40 kHz.
const SHIFT_RANGE_M: f64 = 21e-3;
const SHIFT_STEP_M: f64 = 2.5e-3;
/// Steps of the grid that the field is computed on, in wavelengths.
const GRID_STEP: f64 = 0.25;
const TURNS_DEG: [f64; 5] = [-6.0, -3.0, 0.0, 3.0, 6.0];
const STEP_RATIOS: [f64; 5] = [0.9, 0.95, 1.0, 1.05, 1.1];
const HEIGHTS_M: [f64; 5] = [-16e-3, -8e-3, 0.0, 8e-3, 16e-3];
/// Candidates handed on for each orientation, and how far apart they stand at least, metres.
const KEPT: usize = 2;
const APART_M: f64 = 5e-3;

/// A pose worth refining.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The pose.
    pub pose: Pose,
    /// Pearson's correlation of the readings looked at.
    pub correlation: f64,
    /// Which handedness and quarter turn it was found in, 0 to 7.
    pub orientation: usize,
}

/// The most promising poses, the best first; the same ones each time.
pub fn candidates(readings: &Readings) -> Vec<Candidate> {
    let levels = levels(readings);
    let points: Vec<Vec3> = levels.iter().flat_map(|level| level.positions_m.clone()).collect();
    if points.is_empty() {
        return Vec::new();
    }
    let centre = points.iter().sum::<Vec3>() / points.len() as f64;
    let centre = Vec3::new(centre.x, centre.y, 0.0);
    let reach_m = points.iter().map(|point| point.xy().norm()).fold(0.0, f64::max);
    let half_width_m =
        reach_m * STEP_RATIOS[STEP_RATIOS.len() - 1] + 2.0 * centre.norm() + SHIFT_RANGE_M;

    let mut found: Vec<Candidate> = Vec::new();
    for height_m in HEIGHTS_M {
        let images: Vec<FieldImage> = levels
            .par_iter()
            .map(|level| FieldImage::of(level.simulation, level.z_m + height_m, half_width_m))
            .collect();
        let tasks: Vec<(usize, f64, f64, Vec3)> = tasks(&centre);
        found.par_extend(tasks.into_par_iter().map(
            |(orientation, turn_deg, step_ratio, pivot)| {
                let mut pose = oriented(orientation, turn_deg.to_radians(), step_ratio);
                pose.shift_m = pivot - pose.to_array(&pivot);
                pose.shift_m.z = height_m;
                let (correlation, shift) = best_shift(&levels, &images, &pose);
                pose.shift_m += shift;
                Candidate { pose, correlation, orientation }
            },
        ));
    }
    found.sort_by(|a, b| b.correlation.total_cmp(&a.correlation));
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in found {
        let stands_at = |pose: &Pose| pose.to_array(&centre).xy();
        let mut alike = kept.iter().filter(|other| other.orientation == candidate.orientation);
        let near = |other: &Candidate| {
            (stands_at(&other.pose) - stands_at(&candidate.pose)).norm() < APART_M
        };
        if alike.clone().count() < KEPT && !alike.any(near) {
            kept.push(candidate);
        }
    }
    kept
}

/// Orientation, small turn, step ratio and the point of the scan that all three leave in place: the scan's origin, and
/// its centre where that is elsewhere.
fn tasks(centre: &Vec3) -> Vec<(usize, f64, f64, Vec3)> {
    let mut pivots = vec![Vec3::zeros()];
    if centre.norm() > APART_M {
        pivots.push(*centre);
    }
    let mut tasks = Vec::new();
    for orientation in 0..8 {
        for turn_deg in TURNS_DEG {
            for step_ratio in STEP_RATIOS {
                tasks
                    .extend(pivots.iter().map(|pivot| (orientation, turn_deg, step_ratio, *pivot)));
            }
        }
    }
    tasks
}

/// One of the eight ways to lay a square on itself, and a small turn more.
fn oriented(orientation: usize, turn_rad: f64, step_ratio: f64) -> Pose {
    let (mirror, quarter) = match orientation {
        0 => (Mirror::None, 0.0),
        1 => (Mirror::None, 1.0),
        2 => (Mirror::None, 2.0),
        3 => (Mirror::None, -1.0),
        4 => (Mirror::X, 0.0),
        5 => (Mirror::Y, 0.0),
        6 => (Mirror::X, 1.0),
        _ => (Mirror::Y, 1.0),
    };
    Pose { mirror, turn_rad: quarter * FRAC_PI_2 + turn_rad, step_ratio, shift_m: Vec3::zeros() }
}

/// The shift at which the readings correlate best with the images, and the correlation.
fn best_shift(levels: &[Level<'_>], images: &[FieldImage], pose: &Pose) -> (f64, Vec3) {
    let steps = (SHIFT_RANGE_M / SHIFT_STEP_M) as i32;
    let placed: Vec<Vec<(f64, f64, f64)>> = levels
        .iter()
        .map(|level| {
            let at = level.positions_m.iter().map(|scan_m| pose.to_array(scan_m));
            at.zip(&level.readings).map(|(p, reading)| (p.x, p.y, *reading)).collect()
        })
        .collect();
    let count = placed.iter().map(Vec::len).sum::<usize>() as f64;
    let sum: f64 = placed.iter().flatten().map(|(_, _, reading)| reading).sum();
    let squares: f64 = placed.iter().flatten().map(|(_, _, reading)| reading * reading).sum();
    let spread = squares - sum * sum / count;
    let mut best = (f64::NEG_INFINITY, Vec3::zeros());
    for row in -steps..=steps {
        for column in -steps..=steps {
            let (dx, dy) = (f64::from(column) * SHIFT_STEP_M, f64::from(row) * SHIFT_STEP_M);
            let (mut s, mut ss, mut sr) = (0.0, 0.0, 0.0);
            for (points, image) in placed.iter().zip(images) {
                for (x, y, reading) in points {
                    let simulated = image.at(x + dx, y + dy);
                    s += simulated;
                    ss += simulated * simulated;
                    sr += simulated * reading;
                }
            }
            let scale = ((ss - s * s / count) * spread).sqrt();
            let correlation = if scale > 0.0 { (sr - s * sum / count) / scale } else { -1.0 };
            if correlation > best.0 {
                best = (correlation, Vec3::new(dx, dy, 0.0));
            }
        }
    }
    best
}

/// Some readings of one drive at one height.
struct Level<'r> {
    simulation: &'r Simulation,
    z_m: f64,
    positions_m: Vec<Vec3>,
    readings: Vec<f64>,
}

/// Some heights, evenly among all, and some readings of each.
fn levels(readings: &Readings) -> Vec<Level<'_>> {
    let thickness_m = GRID_STEP * readings.wavelength_m();
    let mut all: BTreeMap<(usize, i64), Vec<usize>> = BTreeMap::new();
    for (number, drive) in readings.drives().iter().enumerate() {
        for (index, position_m) in drive.positions_m.iter().enumerate() {
            let layer = (position_m.z / thickness_m).round() as i64;
            all.entry((number, layer)).or_default().push(index);
        }
    }
    let count = all.len().min(MAX_LEVELS);
    let wanted = READINGS.div_ceil(count.max(1));
    (0..count)
        .filter_map(|n| all.iter().nth(n * all.len() / count))
        .map(|((number, _), indices)| {
            let drive: &Drive = &readings.drives()[*number];
            let here = Readings::from_drives(vec![Drive {
                positions_m: indices.iter().map(|&i| drive.positions_m[i]).collect(),
                readings: indices.iter().map(|&i| drive.readings[i]).collect(),
                ..drive.clone()
            }])
            .thinned(wanted);
            let positions_m = here.positions_m();
            let z_m = positions_m.iter().map(|p| p.z).sum::<f64>() / positions_m.len() as f64;
            Level { simulation: &drive.simulation, z_m, positions_m, readings: here.values() }
        })
        .collect()
}

/// The simulated magnitudes on a square about the array's axis, read between its points.
struct FieldImage {
    half_width_m: f64,
    per_m: f64,
    columns: usize,
    magnitudes: Vec<f64>,
}

impl FieldImage {
    fn of(simulation: &Simulation, z_m: f64, half_width_m: f64) -> Self {
        let step_m = GRID_STEP * simulation.medium.wavelength_m(simulation.frequency_hz);
        let grid = PlaneGrid::square(half_width_m, step_m, z_m);
        Self {
            half_width_m: -grid.x_m[0],
            per_m: 1.0 / step_m,
            columns: grid.x_m.len(),
            magnitudes: simulation.magnitudes(&grid.points()),
        }
    }

    /// Bilinear between four points; zero outside.
    fn at(&self, x_m: f64, y_m: f64) -> f64 {
        let (x, y) =
            ((x_m + self.half_width_m) * self.per_m, (y_m + self.half_width_m) * self.per_m);
        let last = (self.columns - 1) as f64;
        if !(x >= 0.0 && y >= 0.0 && x < last && y < last) {
            return 0.0;
        }
        let (column, row) = (x as usize, y as usize);
        let (right, up) = (x - column as f64, y - row as f64);
        let corner = row * self.columns + column;
        let below = &self.magnitudes[corner..corner + 2];
        let above = &self.magnitudes[corner + self.columns..corner + self.columns + 2];
        let low = below[0] + right * (below[1] - below[0]);
        let high = above[0] + right * (above[1] - above[0]);
        low + up * (high - low)
    }
}
