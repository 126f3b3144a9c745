//! The field on a regular grid of a plane, by the fastest method.
//!
//! Two properties save work, alone or together. If the sources are on a lattice that fits the grid, rays from source to point repeat
//! (`lattice`). And a field at some distance from its sources has no structure finer than about half a wavelength: waves with a
//! wavenumber K above k along the plane are evanescent, exp(-z √(K² - k²)). A fine grid is then interpolated from a coarse one
//! (`resample`).

use num_complex::Complex64;

use super::lattice::Lattice;
use super::resample::{Map, Rows, TAPS, coarsest_step_m, resampled};
use super::{FieldKernel, PathLengths};
use crate::transducer::Smooth;
use crate::{PlaneGrid, Vec3};

/// Largest error of a plane's field, relative to the sum of the elements' magnitudes there.
pub const PLANE_TOLERANCE: f64 = 1e-9;

/// Decay from which evanescent waves are left out, Np: a tenth of the tolerance.
const EVANESCENT: f64 = 23.0;

/// Largest number of points of a coarse grid that still saves time, relative to the fine grid.
const WORTHWHILE: f64 = 0.6;

/// Irregularity of a grid's steps that is taken as rounding, m.
const REGULAR_M: f64 = 1e-10;

/// How a plane was summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaneMethod {
    /// Point by point.
    Direct,
    /// With repeated rays; exact.
    Repeating,
    /// Point by point on a coarse grid, then interpolated.
    Coarse,
    /// With repeated rays on a coarse grid, then interpolated.
    CoarseRepeating,
}

/// A field on a plane's grid.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneSum {
    /// The complex field, row by row in the order of [`PlaneGrid::points`].
    pub field: Vec<Complex64>,
    /// How it was summed.
    pub method: PlaneMethod,
}

impl FieldKernel {
    /// The complex field at every point of a plane's grid, within [`PLANE_TOLERANCE`], by the fastest method.
    pub fn on_plane(&self, grid: &PlaneGrid) -> PlaneSum {
        self.by_structure(grid).unwrap_or_else(|| PlaneSum {
            field: self.at(&grid.points()),
            method: PlaneMethod::Direct,
        })
    }

    fn by_structure(&self, grid: &PlaneGrid) -> Option<PlaneSum> {
        if !self.is_in_plain_air() || self.near_field != 0.0 || self.paths != PathLengths::Observed
        {
            return None;
        }
        let axes = [regular(&grid.x_m)?, regular(&grid.y_m)?];
        let lattice = Lattice::of(&self.sources);
        let coarse = self.coarse(grid.z_m, axes, lattice.as_ref());
        let Some(coarse) = coarse else {
            let map = lattice?.field(self, axes, grid.z_m)?;
            return Some(PlaneSum { field: map.joined(), method: PlaneMethod::Repeating });
        };
        let repeating = lattice.and_then(|lattice| lattice.field(self, coarse, grid.z_m));
        let method =
            if repeating.is_some() { PlaneMethod::CoarseRepeating } else { PlaneMethod::Coarse };
        let map = repeating.unwrap_or_else(|| self.on_rows(coarse, grid.z_m));
        // Along x first, where rows are still few.
        let [columns, rows] = coarse;
        let wide = resampled(self.instructions, &map.transposed(), columns, &grid.x_m);
        let map = resampled(self.instructions, &wide.transposed(), rows, &grid.y_m);
        Some(PlaneSum { field: map.joined(), method })
    }

    /// A coarser grid that extends beyond the fine one as far as the interpolation needs; `None` if none saves time.
    fn coarse(&self, z_m: f64, axes: [Rows; 2], lattice: Option<&Lattice>) -> Option<[Rows; 2]> {
        // A corner on the axis of a lobe has arbitrarily fine structure.
        if self.smooth == Smooth::InHalfTangent {
            return None;
        }
        let nearest_m =
            self.sources.iter().map(|s| z_m - s.centre_m.z).fold(f64::INFINITY, f64::min);
        if nearest_m <= 0.0 || self.sources.iter().any(|source| source.normal != Vec3::z()) {
            return None;
        }
        let band_rad_m = self.wavenumber_rad_m.hypot(EVANESCENT / nearest_m);
        let most_m = coarsest_step_m(band_rad_m);
        let coarser = |axis: usize| {
            let fine = axes[axis];
            let of_lattice = lattice.map(|lattice| lattice.axes()[axis].step_m);
            let step_m = match of_lattice.filter(|step_m| step_m.is_finite()) {
                Some(of_lattice) => of_lattice / (of_lattice / most_m).ceil(),
                None => most_m,
            };
            let beyond_m = step_m * (TAPS / 2) as f64;
            let last_m = fine.at(fine.count - 1);
            let count = ((last_m - fine.first_m + 2.0 * beyond_m) / step_m).ceil() as usize + 2;
            Rows { first_m: fine.first_m - beyond_m, step_m, count }
        };
        let coarse = [coarser(0), coarser(1)];
        let points = |rows: [Rows; 2]| rows[0].count as f64 * rows[1].count as f64;
        (points(coarse) < WORTHWHILE * points(axes)).then_some(coarse)
    }

    fn on_rows(&self, [columns, rows]: [Rows; 2], z_m: f64) -> Map {
        let points_m: Vec<Vec3> = (0..rows.count)
            .flat_map(|row| (0..columns.count).map(move |column| (column, row)))
            .map(|(column, row)| Vec3::new(columns.at(column), rows.at(row), z_m))
            .collect();
        Map::of(&self.at(&points_m), columns.count)
    }
}

/// Positions at equal steps; `None` if the steps differ.
fn regular(places_m: &[f64]) -> Option<Rows> {
    let [first_m, .., last_m] = *places_m else { return None };
    let rows = Rows {
        first_m,
        step_m: (last_m - first_m) / (places_m.len() - 1) as f64,
        count: places_m.len(),
    };
    let on_step = |(row, &place_m): (usize, &f64)| (rows.at(row) - place_m).abs() < REGULAR_M;
    (rows.step_m > 0.0 && places_m.iter().enumerate().all(on_step)).then_some(rows)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::tests::transducers;
    use super::*;
    use crate::transducer::{MurataFit, Piston};
    use crate::{Array, Excitation, Medium};

    fn compared(kernel: &FieldKernel, grid: &PlaneGrid, strength: f64) -> (PlaneMethod, f64) {
        let sum = kernel.on_plane(grid);
        let direct = kernel.at(&grid.points());
        let apart = sum.field.iter().zip(&direct).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        (sum.method, apart / strength)
    }

    fn grid(half_x_mm: f64, half_y_mm: f64, step_mm: f64, z_mm: f64) -> PlaneGrid {
        let along = |half_mm: f64, shift_mm: f64| {
            let count = (2.0 * half_mm / step_mm) as i32;
            (0..=count).map(|n| 1e-3 * (shift_mm - half_mm + step_mm * f64::from(n))).collect()
        };
        PlaneGrid { x_m: along(half_x_mm, 1.3), y_m: along(half_y_mm, -0.4), z_m: z_mm * 1e-3 }
    }

    #[test]
    fn each_method_is_chosen_where_it_applies_and_agrees_with_the_direct_sum() {
        let medium = Medium { speed_of_sound_m_s: 343.0 };
        let k = medium.wavenumber_rad_m(40e3);
        let square = Array::square(8, 8, 10.5e-3).expect("not empty");
        let scattered = Array::random(30, 10.5e-3, 5).expect("room");
        let (fine, odd) = (grid(40.0, 30.0, 0.5, 80.0), grid(40.0, 30.0, 3.3, 80.0));
        let corner: &dyn crate::transducer::Transducer = &MurataFit::CENTIMETRES;
        let cases = [
            (&square, corner, &fine, PlaneMethod::Repeating),
            (&square, corner, &odd, PlaneMethod::Direct),
            (&square, &Piston, &fine, PlaneMethod::CoarseRepeating),
            (&square, &Piston, &odd, PlaneMethod::Direct),
            (&scattered, &Piston, &fine, PlaneMethod::Coarse),
            (&scattered, corner, &fine, PlaneMethod::Direct),
        ];
        for (array, transducer, grid, expected) in cases {
            let focus = Excitation::Focus(Vec3::new(17.5e-3, -22.5e-3, 0.1));
            let phases = focus.phases_rad(array, &medium, 40e3);
            let kernel = FieldKernel::new(array, &phases, transducer, k, PathLengths::Observed);
            let strength = array.len() as f64 / grid.z_m;
            let (method, error) = compared(&kernel, grid, strength);
            assert_eq!(method, expected);
            assert!(error < PLANE_TOLERANCE, "{method:?}: {error:e}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn no_grid_has_an_error_above_the_tolerance(
            rows in 1usize..6, pitch_mm in 6.0..14.0f64, hexagonal: bool, model in 0usize..7,
            step_mm in 0.3..2.5f64, divides: bool, z_mm in 15.0..200.0f64, phases in prop::collection::vec(-4.0..4.0f64, 100),
        ) {
            let array = if hexagonal {
                Array::hexagonal(rows % 4, pitch_mm * 1e-3)
            } else {
                Array::square(rows, rows + 1, pitch_mm * 1e-3).expect("not empty")
            };
            let step_mm = if divides { pitch_mm / (pitch_mm / step_mm).round() } else { step_mm };
            let transducer = &*transducers()[model];
            let phases = &phases[..array.len()];
            let kernel = FieldKernel::new(&array, phases, transducer, 732.7, PathLengths::Observed);
            let grid = grid(30.0, 20.0, step_mm, z_mm);
            let strength = array.len() as f64 / grid.z_m.min(1.0);
            let (method, error) = compared(&kernel, &grid, strength);
            prop_assert!(error < PLANE_TOLERANCE, "{:?}: {:e}", method, error);
        }
    }
}
