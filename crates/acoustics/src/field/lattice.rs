//! Equal sources on a lattice and a grid of points whose step fits it: few different rays occur from source to point.
//!
//! Where the grid's step is q times a divisor of the lattice's step, the rays form q × q grids, each with the grid's step. The field of
//! one source is computed once for every ray. Each row of the total field is a sum of shifted rows of these, times the drives.

use std::collections::BTreeMap;

use num_complex::Complex64;
use rayon::prelude::*;

use super::resample::{Map, Rows};
use super::shifted_rows::{Row, Shifted, ShiftedSum, TOGETHER};
use super::{FieldKernel, InstructionSet, Source};
use crate::Vec3;

/// Positions closer than this are taken as equal, m: about a millionth of a wavelength.
const SAME_M: f64 = 1e-8;

/// Smallest step of a lattice that is looked for, m.
const FINEST_M: f64 = 1e-4;

/// Most grids of rays along each axis.
const MAX_PHASES: usize = 4;

/// Most rays for each point of the grid.
const MAX_RAYS: usize = 12;

/// Rows of rays whose field is computed at once.
const AT_ONCE: usize = 8;

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
                let mut map = Map::zero(high, wide);
                // Some rows at a time: places and field of all would be more memory than the map, and clearing it takes long.
                map.parts_mut(AT_ONCE * wide).enumerate().for_each(|(part, (real, imaginary))| {
                    let point_m = |n: usize| {
                        let (x, y) = ((n % wide) as i64, (part * AT_ONCE + n / wide) as i64);
                        let x_m = rays[0].component_m(place[0].0, x + least_x);
                        let y_m = rays[1].component_m(place[1].0, y + least_y);
                        Vec3::new(x_m, y_m, z_m)
                    };
                    let points_m: Vec<Vec3> = (0..real.len()).map(point_m).collect();
                    for (n, value) in model.at(&points_m).into_iter().enumerate() {
                        (real[n], imaginary[n]) = (value.re, value.im);
                    }
                });
                map
            });
        }

        let shifts: Vec<_> = grids
            .iter()
            .enumerate()
            .filter_map(|(number, grid)| {
                let of_it = sources.iter().filter(|(place, _)| grid_of(place) == number);
                let shift = |&(place, weight): &([(usize, i64); 2], Complex64)| Shift {
                    columns: (place[0].1 - least_x) as usize,
                    rows: (place[1].1 - least_y) as usize,
                    weight: [weight.re, weight.im],
                };
                Some((grid.as_ref()?, of_it.map(shift).collect::<Vec<_>>()))
            })
            .collect();
        let mut out = Map::zero(rows.count, columns.count);
        sum_shifted(kernel.instructions, &shifts, wide, rays[1].steps as usize, &mut out);
        Some(out)
    }
}

/// Where the rays of a source begin in a grid of rays, and the source's drive.
struct Shift {
    columns: usize,
    rows: usize,
    weight: [f64; 2],
}

/// Adds the shifted rows of grids, `wide` columns each, to the rows of `out`. Shifts differ by multiples of `step` rows.
fn sum_shifted(
    instructions: InstructionSet,
    grids: &[(&Map, Vec<Shift>)],
    wide: usize,
    step: usize,
    out: &mut Map,
) {
    let together: Vec<_> = grids
        .iter()
        .map(|(_, of)| {
            let terms = terms::<TOGETHER>(of, wide, step);
            // On a lattice with gaps, most weights would be zero. One row at a time takes half as long again for each weight.
            (2 * terms.len() <= 3 * of.len()).then_some(terms)
        })
        .collect();
    let alone: Vec<_> = grids.iter().map(|(_, of)| terms::<1>(of, wide, step)).collect();
    let class = |row: usize| row.checked_rem(step).unwrap_or(row);
    let mut rows: Vec<(usize, Row)> =
        out.rows_mut().enumerate().map(|(row, (re, im))| (row, [re, im])).collect();
    rows.sort_by_key(|(row, _)| (class(*row), *row));
    let alike = rows.chunk_by_mut(|(one, _), (other, _)| class(*one) == class(*other));
    let groups: Vec<_> = alike.flat_map(|rows| rows.chunks_mut(TOGETHER)).collect();
    groups.into_par_iter().for_each(|group| {
        let from = group[0].0 * wide;
        for (n, (map, _)) in grids.iter().enumerate() {
            let four = <&mut [_; TOGETHER]>::try_from(&mut *group);
            if let (Some(terms), Ok([(_, a), (_, b), (_, c), (_, d)])) = (&together[n], four) {
                let rows = [a, b, c, d].map(|[re, im]| [&mut **re, &mut **im]);
                instructions.run(ShiftedSum { map, terms, from, rows });
                continue;
            }
            for (row, [re, im]) in group.iter_mut() {
                let (from, rows) = (*row * wide, [[&mut **re, &mut **im]]);
                instructions.run(ShiftedSum { map, terms: &alone[n], from, rows });
            }
        }
    });
}

/// The pieces of a grid that `K` rows, each `step` below the one before, consist of.
fn terms<const K: usize>(shifts: &[Shift], wide: usize, step: usize) -> Vec<Shifted<K>> {
    let mut terms = BTreeMap::<usize, [[f64; 2]; K]>::new();
    for shift in shifts {
        for k in 0..K {
            let start = (shift.rows + k * step) * wide + shift.columns;
            let [re, im] = &mut terms.entry(start).or_insert([[0.0; 2]; K])[k];
            *re += shift.weight[0];
            *im += shift.weight[1];
        }
    }
    terms.into_iter().map(|(start, weights)| Shifted { start, weights }).collect()
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
