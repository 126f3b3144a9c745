//! Start values for a pose: every plausible pose on a coarse grid.
//!
//! A field with interference fringes has as many false optima as fringes, so that a local search has to start within about a quarter of
//! a wavelength. Here the simulated field is computed once on a wide grid at each height, and some hundreds of readings are compared with
//! it at every combination of handedness, quarter turn, small turn, step, height and shift. The best correlations in each orientation
//! are then refined. All combinations are tried with a quarter of the readings, the best of them with all.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;

use super::pose::{Mirror, Pose};
use super::readings::{Drive, Readings};
use fieldgap_acoustics::{PlaneGrid, Simulation, Vec3};

/// Heights looked at: enough to tell one pose from another, few enough to stay quick.
const MAX_LEVELS: usize = 6;
/// Readings looked at, over all heights.
const READINGS: usize = 600;
/// Shifts tried: this far either way, in steps, metres. A step is less than a third of a wavelength at 40 kHz.
const SHIFT_STEPS: usize = 8;
const SHIFT_STEP_M: f64 = 2.5e-3;
const SHIFT_RANGE_M: f64 = SHIFT_STEPS as f64 * SHIFT_STEP_M;
/// Shifts along each axis.
const SHIFTS: usize = 2 * SHIFT_STEPS + 1;
/// The widest step of the grid that the field is computed on, in wavelengths.
const GRID_STEP: f64 = 0.25;
/// One reading in so many is used at first, and the best one in so many poses of each orientation is tried with all.
const FIRST_LOOK: usize = 4;
const SECOND_LOOK: usize = 8;
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

/// Shifts handed on where nothing else is searched.
const KEPT_SHIFTS: usize = 3;

/// The most promising shifts at the recorded height, in the recorded axes, the best first; the same ones each time.
pub fn shifts(readings: &Readings) -> Vec<Vec3> {
    let levels = levels(readings);
    let reach_m = levels
        .iter()
        .flat_map(|level| &level.positions_m)
        .map(|point| point.xy().norm())
        .fold(0.0, f64::max);
    let images: Vec<FieldImage> = levels
        .par_iter()
        .map(|level| FieldImage::of(level.simulation, level.z_m, reach_m + SHIFT_RANGE_M))
        .collect();
    let mut found: Vec<(f64, Vec3)> = correlations(&levels, &images, &Pose::default(), 1).collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<Vec3> = Vec::new();
    for (_, shift_m) in found {
        if kept.len() < KEPT_SHIFTS && kept.iter().all(|other| (other - shift_m).norm() >= APART_M)
        {
            kept.push(shift_m);
        }
    }
    kept
}

/// Points of the grid on which the field is computed at each height.
pub fn grid_points(readings: &Readings) -> f64 {
    let positions_m = readings.positions_m();
    let widest_m = GRID_STEP * readings.wavelength_m();
    let step_m = SHIFT_STEP_M / (SHIFT_STEP_M / widest_m).ceil();
    (2.0 * half_width_m(&positions_m, &centre(&positions_m)) / step_m).powi(2)
}

/// The mean place, at the height of the array.
fn centre(points: &[Vec3]) -> Vec3 {
    let centre = points.iter().sum::<Vec3>() / points.len().max(1) as f64;
    Vec3::new(centre.x, centre.y, 0.0)
}

/// Half the side of the square about the array's axis that every pose leaves the places in.
fn half_width_m(points: &[Vec3], centre: &Vec3) -> f64 {
    let reach_m = points.iter().map(|point| point.xy().norm()).fold(0.0, f64::max);
    reach_m * STEP_RATIOS[STEP_RATIOS.len() - 1] + 2.0 * centre.norm() + SHIFT_RANGE_M
}

/// The most promising poses, the best first; the same ones each time.
pub fn candidates(readings: &Readings) -> Vec<Candidate> {
    let levels = levels(readings);
    let points: Vec<Vec3> = levels.iter().flat_map(|level| level.positions_m.clone()).collect();
    if points.is_empty() {
        return Vec::new();
    }
    let centre = centre(&points);
    let half_width_m = half_width_m(&points, &centre);

    let images: Vec<Vec<FieldImage>> = HEIGHTS_M
        .par_iter()
        .map(|height_m| {
            let image = |level: &Level| {
                FieldImage::of(level.simulation, level.z_m + height_m, half_width_m)
            };
            levels.iter().map(image).collect()
        })
        .collect();
    let look = |task: &Task, one_in: usize| {
        let mut pose = oriented(task.orientation, task.turn_deg.to_radians(), task.step_ratio);
        pose.shift_m = task.pivot - pose.to_array(&task.pivot);
        pose.shift_m.z = HEIGHTS_M[task.height];
        let (correlation, shift) = best_shift(&levels, &images[task.height], &pose, one_in);
        pose.shift_m += shift;
        Candidate { pose, correlation, orientation: task.orientation }
    };
    let mut found: Vec<Candidate> = Vec::new();
    for orientation in 0..ORIENTATIONS {
        let tasks = tasks(orientation, &centre);
        let mut first: Vec<(f64, Task)> =
            tasks.into_par_iter().map(|task| (look(&task, FIRST_LOOK).correlation, task)).collect();
        first.sort_by(|a, b| b.0.total_cmp(&a.0));
        first.truncate(first.len().div_ceil(SECOND_LOOK));
        found.par_extend(first.par_iter().map(|(_, task)| look(task, 1)));
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

/// A pose but for its shift.
#[derive(Debug, Clone, Copy)]
struct Task {
    orientation: usize,
    turn_deg: f64,
    step_ratio: f64,
    /// Number of the height.
    height: usize,
    /// The point of the scan that turn and step leave in place.
    pivot: Vec3,
}

/// All that is tried in one orientation; the scan's origin stays in place, or its centre where that is elsewhere.
fn tasks(orientation: usize, centre: &Vec3) -> Vec<Task> {
    let mut pivots = vec![Vec3::zeros()];
    if centre.norm() > APART_M {
        pivots.push(*centre);
    }
    let mut tasks = Vec::new();
    for height in 0..HEIGHTS_M.len() {
        for turn_deg in TURNS_DEG {
            for step_ratio in STEP_RATIOS {
                let task = |&pivot| Task { orientation, turn_deg, step_ratio, height, pivot };
                tasks.extend(pivots.iter().map(task));
            }
        }
    }
    tasks
}

/// Symmetries of a square.
const ORIENTATIONS: usize = 8;

/// One of the eight symmetries of a square, and a small turn.
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

/// The shift at which one reading in so many correlates best with the images, and the correlation.
fn best_shift(
    levels: &[Level<'_>],
    images: &[FieldImage],
    pose: &Pose,
    one_in: usize,
) -> (f64, Vec3) {
    let lowest = (f64::NEG_INFINITY, Vec3::zeros());
    correlations(levels, images, pose, one_in)
        .fold(lowest, |best, other| if other.0 > best.0 { other } else { best })
}

/// The correlation of one reading in so many with the images, for every shift, row by row.
fn correlations(
    levels: &[Level<'_>],
    images: &[FieldImage],
    pose: &Pose,
    one_in: usize,
) -> impl Iterator<Item = (f64, Vec3)> {
    let mut sums = Sums::default();
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for (level, image) in levels.iter().zip(images) {
        for (scan_m, &reading) in level.positions_m.iter().zip(&level.readings).step_by(one_in) {
            count += 1.0;
            sum += reading;
            squares += reading * reading;
            sums.add(image, &pose.to_array(scan_m), reading);
        }
    }
    let spread = squares - sum * sum / count;
    (0..SHIFTS * SHIFTS).map(move |n| {
        let (row, column) = (n / SHIFTS, n % SHIFTS);
        let (s, ss, sr) =
            (sums.simulated[row][column], sums.squares[row][column], sums.both[row][column]);
        let scale = ((ss - s * s / count) * spread).sqrt();
        let correlation = if scale > 0.0 { (sr - s * sum / count) / scale } else { -1.0 };
        let shift_m = |step: usize| step as f64 * SHIFT_STEP_M - SHIFT_RANGE_M;
        (correlation, Vec3::new(shift_m(column), shift_m(row), 0.0))
    })
}

/// What is summed for every shift, by row and column.
#[derive(Default)]
struct Sums {
    simulated: [[f64; SHIFTS]; SHIFTS],
    squares: [[f64; SHIFTS]; SHIFTS],
    /// Simulated times read.
    both: [[f64; SHIFTS]; SHIFTS],
}

impl Sums {
    /// Adds one reading at all shifts of a place.
    fn add(&mut self, image: &FieldImage, at_m: &Vec3, reading: f64) {
        let Some(corners) = image.corners(at_m) else { return };
        for row in 0..SHIFTS {
            let [a, b, c, d] = corners.map(|corner| corner.row(row, image.stride));
            let [wa, wb, wc, wd] = corners.map(|corner| corner.weight);
            let (simulated, squares, both) =
                (&mut self.simulated[row], &mut self.squares[row], &mut self.both[row]);
            for column in 0..SHIFTS {
                let value = wa * a[column] + wb * b[column] + wc * c[column] + wd * d[column];
                simulated[column] += value;
                squares[column] += value * value;
                both[column] += value * reading;
            }
        }
    }
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
            let here = readings.with_drives(vec![drive.only(indices)]).thinned(wanted);
            let positions_m = here.positions_m();
            let z_m = positions_m.iter().map(|p| p.z).sum::<f64>() / positions_m.len() as f64;
            Level { simulation: &drive.simulation, z_m, positions_m, readings: here.values() }
        })
        .collect()
}

/// The simulated magnitudes on a square about the array's axis, read between its points at every shift of a place.
///
/// A step of the shift is a whole number of the grid's steps, so that a place stands alike between points at every shift. The
/// points are kept in parts, those that are a shift apart side by side.
struct FieldImage {
    half_width_m: f64,
    per_m: f64,
    columns: usize,
    /// Steps of the grid in a step of the shift.
    per_shift: usize,
    /// Points of one part in a row.
    stride: usize,
    /// By the remainders of row and column.
    parts: Vec<Vec<f64>>,
}

/// One of the four points about a place at the first shift.
#[derive(Clone, Copy)]
struct Corner<'i> {
    part: &'i [f64],
    weight: f64,
}

impl<'i> Corner<'i> {
    /// Its values at all shifts of a row.
    fn row(self, row: usize, stride: usize) -> &'i [f64; SHIFTS] {
        self.part[row * stride..].first_chunk().expect("the place stands within the image")
    }
}

impl FieldImage {
    fn of(simulation: &Simulation, z_m: f64, half_width_m: f64) -> Self {
        let widest_m = GRID_STEP * simulation.medium.wavelength_m(simulation.frequency_hz);
        let per_shift = (SHIFT_STEP_M / widest_m).ceil() as usize;
        let step_m = SHIFT_STEP_M / per_shift as f64;
        let grid = PlaneGrid::square(half_width_m + step_m, step_m, z_m);
        let (columns, magnitudes) = (grid.x_m.len(), simulation.magnitudes(&grid.points()));
        let stride = columns.div_ceil(per_shift);
        let mut parts = vec![vec![0.0; stride * stride]; per_shift * per_shift];
        for (n, magnitude) in magnitudes.into_iter().enumerate() {
            let (row, column) = (n / columns, n % columns);
            let part = &mut parts[row % per_shift * per_shift + column % per_shift];
            part[row / per_shift * stride + column / per_shift] = magnitude;
        }
        Self { half_width_m: -grid.x_m[0], per_m: 1.0 / step_m, columns, per_shift, stride, parts }
    }

    /// The four points about a place at the first shift, with their weights; `None` if some shift leaves the image.
    fn corners(&self, at_m: &Vec3) -> Option<[Corner<'_>; 4]> {
        let from_corner = |m: f64| (m - SHIFT_RANGE_M + self.half_width_m) * self.per_m;
        let (x, y) = (from_corner(at_m.x), from_corner(at_m.y));
        let last = (self.columns - 1 - 2 * SHIFT_STEPS * self.per_shift) as f64;
        if !(x >= 0.0 && y >= 0.0 && x < last && y < last) {
            return None;
        }
        let (column, row) = (x as usize, y as usize);
        let (right, up) = (x - column as f64, y - row as f64);
        let corner = |row: usize, column: usize, weight: f64| {
            let part = &self.parts[row % self.per_shift * self.per_shift + column % self.per_shift];
            let from = row / self.per_shift * self.stride + column / self.per_shift;
            Corner { part: &part[from..], weight }
        };
        Some([
            corner(row, column, (1.0 - up) * (1.0 - right)),
            corner(row, column + 1, (1.0 - up) * right),
            corner(row + 1, column, up * (1.0 - right)),
            corner(row + 1, column + 1, up * right),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fieldgap_acoustics::{Array, Excitation, Medium, Simulator};

    /// Between points 1.25 mm apart a focus of this width bends by less than a fiftieth of its peak. On its flanks a shift too far or
    /// rows for columns would be off by a tenth and more.
    #[test]
    fn an_image_is_read_between_its_points_at_every_shift() {
        let simulation = Simulation {
            simulator: Simulator::Piston,
            array: Array::square(6, 6, 10.5e-3).expect("a layout"),
            excitation: Excitation::Focus(Vec3::new(0.0, 0.0, 0.1)),
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
        };
        let image = FieldImage::of(&simulation, 0.1, 40e-3);
        let at_m = Vec3::new(7.3e-3, -4.9e-3, 0.1);
        let mut sums = Sums::default();
        sums.add(&image, &at_m, 2.0);
        let peak = simulation.magnitudes(&[Vec3::new(0.0, 0.0, 0.1)])[0];
        for (row, column) in [(10, 5), (10, 7), (12, 5), (8, 3), (0, 0), (3, 11), (16, 16)] {
            let shift_m = |step: usize| step as f64 * SHIFT_STEP_M - SHIFT_RANGE_M;
            let there_m = at_m + Vec3::new(shift_m(column), shift_m(row), 0.0);
            let expected = simulation.magnitudes(&[there_m])[0];
            let ours = sums.simulated[row][column];
            assert!((ours - expected).abs() < 0.02 * peak, "{row} {column}: {ours} {expected}");
            assert_eq!(sums.both[row][column], 2.0 * ours);
        }
        assert!(image.corners(&Vec3::new(0.0, 30e-3, 0.1)).is_none());
    }
}
