//! Equal sources on a lattice and a grid of points whose step fits it: few different rays occur from source to point.
//!
//! Where the grid's step is q times a divisor of the lattice's step, the rays form q × q grids, each with the grid's step. The field of
//! one source is computed once for every ray. Each row of the total field is a sum of shifted rows of these, times the drives.

use num_complex::Complex64;
use rayon::prelude::*;

use super::resample::{Map, Rows, Term, WeightedSum};
use super::{FieldKernel, Source};
use crate::Vec3;

/// Positions closer than this are taken as equal, m: about a millionth of a wavelength.
const SAME_M: f64 = 1e-8;

/// Smallest step of a lattice that is looked for, m.
const FINEST_M: f64 = 1e-4;

/// Most grids of rays along each axis.
const MAX_PHASES: usize = 4;

/// Most rays for each point of the grid.
const MAX_RAYS: usize = 12;

/// The lattice along x and y of a kernel's sources.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lattice {
    axes: [AxisLattice; 2],
    /// Height of all sources, m.
    pub height_m: f64,
}

/// Positions at whole numbers of `step_m` from `first_m`; the step is infinite where there is only one position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxisLattice {
    first_m: f64,
    pub step_m: f64,
}

impl AxisLattice {
    fn of(places_m: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let first_m = places_m.clone().fold(f64::INFINITY, f64::min);
        let mut step_m = 0.0;
        for place_m in places_m {
            // Euclid's algorithm for numbers with rounding errors.
            let (mut larger, mut smaller) = (step_m, place_m - first_m);
            while smaller > SAME_M {
                let rest: f64 = larger % smaller;
                let rest = rest.min(smaller - rest).max(0.0);
                (larger, smaller) = (smaller, rest);
            }
            step_m = larger;
        }
        if step_m == 0.0 {
            return Some(Self { first_m, step_m: f64::INFINITY });
        }
        (step_m > FINEST_M).then_some(Self { first_m, step_m })
    }

    /// Steps of the lattice from its first position.
    fn number(self, place_m: f64) -> i64 {
        if self.step_m.is_finite() {
            ((place_m - self.first_m) / self.step_m).round() as i64
        } else {
            0
        }
    }
}

/// The rays' components along one axis, from a lattice to a grid.
#[derive(Debug, Clone, Copy)]
struct AxisRays {
    lattice: AxisLattice,
    rows: Rows,
    /// Grids of rays.
    phases: usize,
    /// Steps of the finest common grid in one step of the lattice.
    steps: i64,
}

impl AxisRays {
    /// The rays from a lattice to a grid; `None` if too few of them are equal.
    fn new(lattice: AxisLattice, rows: Rows) -> Option<Self> {
        if !lattice.step_m.is_finite() {
            return Some(Self { lattice, rows, phases: 1, steps: 0 });
        }
        (1..=MAX_PHASES).find_map(|phases| {
            let steps = lattice.step_m * phases as f64 / rows.step_m;
            // The deviation from a whole number accumulates over the array.
            let fits = (steps - steps.round()).abs() * rows.step_m < SAME_M;
            (fits && steps > 0.5).then(|| Self {
                lattice,
                rows,
                phases,
                steps: steps.round() as i64,
            })
        })
    }

    /// The grid of rays that a source belongs to, and its shift in it in rows.
    fn of(self, place_m: f64) -> (usize, i64) {
        let finest = -self.lattice.number(place_m) * self.steps;
        let phases = self.phases as i64;
        (finest.rem_euclid(phases) as usize, finest.div_euclid(phases))
    }

    /// Component of a ray along the axis, m.
    fn component_m(self, phase: usize, shifted: i64) -> f64 {
        self.rows.first_m - self.lattice.first_m
            + self.rows.step_m * (shifted as f64 + phase as f64 / self.phases as f64)
    }
}

impl Lattice {
    /// The lattice of sources that differ only in position and drive; `None` if there is none.
    pub fn of(sources: &[Source]) -> Option<Self> {
        let first = sources.first()?;
        let alike = |source: &Source| {
            source.normal == first.normal
                && source.lobes == first.lobes
                && (source.centre_m.z - first.centre_m.z).abs() < SAME_M
        };
        if !sources.iter().all(alike) {
            return None;
        }
        let axis = |axis: usize| AxisLattice::of(sources.iter().map(move |s| s.centre_m[axis]));
        Some(Self { axes: [axis(0)?, axis(1)?], height_m: first.centre_m.z })
    }

    /// The lattice along x and y.
    pub fn axes(&self) -> [AxisLattice; 2] {
        self.axes
    }

    /// A source of the lattice, undriven, at its origin.
    fn model(&self, kernel: &FieldKernel) -> FieldKernel {
        let source = Source {
            element: 0,
            centre_m: Vec3::new(0.0, 0.0, self.height_m),
            amplitude: 1.0,
            drive_rad: 0.0,
            own_rad: 0.0,
            ..kernel.sources[0]
        };
        FieldKernel { sources: vec![source], elements: 1, ..kernel.clone() }
    }

    /// The field of a kernel's sources on a grid at height `z_m`; `None` if too few rays are equal.
    pub fn field(&self, kernel: &FieldKernel, [columns, rows]: [Rows; 2], z_m: f64) -> Option<Map> {
        let rays = [AxisRays::new(self.axes[0], columns)?, AxisRays::new(self.axes[1], rows)?];
        let sources: Vec<_> = kernel
            .sources
            .iter()
            .map(|source| {
                let place = [0, 1].map(|axis| rays[axis].of(source.centre_m[axis]));
                let weight =
                    Complex64::from_polar(source.amplitude, source.drive_rad + source.own_rad);
                (place, weight)
            })
            .collect();
        let least = |axis: usize| sources.iter().map(|(place, _)| place[axis].1).min();
        let most = |axis: usize| sources.iter().map(|(place, _)| place[axis].1).max();
        let [least_x, least_y] = [least(0)?, least(1)?];
        let wide = columns.count + (most(0)? - least_x) as usize;
        let high = rows.count + (most(1)? - least_y) as usize;
        if wide * high * rays[0].phases * rays[1].phases > MAX_RAYS * columns.count * rows.count {
            return None;
        }

        let model = self.model(kernel);
        let mut grids: Vec<Option<Map>> = vec![None; rays[0].phases * rays[1].phases];
        let grid_of = |place: &[(usize, i64); 2]| place[1].0 * rays[0].phases + place[0].0;
        for (place, _) in &sources {
            grids[grid_of(place)].get_or_insert_with(|| {
                let points_m: Vec<Vec3> = (0..high)
                    .flat_map(|y| (0..wide).map(move |x| (x, y)))
                    .map(|(x, y)| {
                        let x_m = rays[0].component_m(place[0].0, x as i64 + least_x);
                        let y_m = rays[1].component_m(place[1].0, y as i64 + least_y);
                        Vec3::new(x_m, y_m, z_m)
                    })
                    .collect();
                Map::of(&model.at(&points_m), wide)
            });
        }

        let mut out = Map::zero(rows.count, columns.count);
        out.rows_mut().enumerate().for_each(|(row, (real, imaginary))| {
            let mut part = [vec![0.0; columns.count], vec![0.0; columns.count]];
            for (number, grid) in grids.iter().enumerate() {
                let Some(grid) = grid else { continue };
                let of_it = sources.iter().filter(|(place, _)| grid_of(place) == number);
                let terms: Vec<Term> = of_it
                    .map(|(place, weight)| {
                        let [x, y] = [place[0].1 - least_x, place[1].1 - least_y];
                        let start = (row + y as usize) * wide + x as usize;
                        Term { start, weight: [weight.re, weight.im] }
                    })
                    .collect();
                let [re, im] = &mut part;
                kernel.instructions.run(WeightedSum::<true> {
                    map: grid,
                    terms: &terms,
                    real: re,
                    imaginary: im,
                });
                add(real, re);
                add(imaginary, im);
            }
        });
        Some(out)
    }
}

fn add(sum: &mut [f64], part: &[f64]) {
    for (sum, part) in sum.iter_mut().zip(part) {
        *sum += part;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_of_positions_with_rounding_errors_is_found() {
        let lattice = |places: &[f64]| AxisLattice::of(places.iter().copied());
        let step = |places: &[f64]| lattice(places).map(|lattice| lattice.step_m);
        let thirds: Vec<f64> = (0..30).map(|n| 10.5e-3 * (f64::from(n) - 14.5)).collect();
        assert!((step(&thirds).expect("a lattice") - 10.5e-3).abs() < 1e-12);
        assert!((step(&[0.0, 6e-3, 9e-3]).expect("a lattice") - 3e-3).abs() < 1e-9);
        assert_eq!(step(&[2e-3, 2e-3]), Some(f64::INFINITY));
        assert_eq!(step(&[0.0, 1e-3, 2.71828e-3, 3.14159e-3]), None);
    }
}
