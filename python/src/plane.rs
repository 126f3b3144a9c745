//! Points that are the grid of a plane: the kernel sums such a plane with less work.

use fieldgap_acoustics::PlaneGrid;

use crate::argument::FARTHEST_M;

/// Most points of a plane that is summed at once: 400 bytes for each, as for the planes of `simulate`.
const MOST_POINTS: usize = 4_000_000;

/// Fewest points along each side for which the search for a structure is worth its time.
const FEWEST_ALONG: usize = 8;

/// A plane's grid, and which of the two axes of the points is x.
#[derive(Debug, PartialEq)]
pub struct GridOfPoints {
    pub grid: PlaneGrid,
    /// Whether the points run along x first (the outer axis is x), as `numpy.meshgrid` with `indexing="ij"` orders them.
    pub x_outer: bool,
}

impl GridOfPoints {
    /// The grid of points of shape (`outer`, `inner`, 3) in one row; `None` if they are not exactly on one.
    pub fn of(points_m: &[f64], outer: usize, inner: usize) -> Option<Self> {
        if outer.min(inner) < FEWEST_ALONG || outer * inner > MOST_POINTS {
            return None;
        }
        let at = |row: usize, column: usize| &points_m[3 * (row * inner + column)..][..3];
        let z_m = at(0, 0)[2];
        let x_outer = at(0, 0)[0] == at(0, 1)[0];
        let (of_outer, of_inner) = if x_outer { (0, 1) } else { (1, 0) };
        let along_outer: Vec<f64> = (0..outer).map(|row| at(row, 0)[of_outer]).collect();
        let along_inner: Vec<f64> = (0..inner).map(|column| at(0, column)[of_inner]).collect();
        let ascending = |along: &[f64]| along.windows(2).all(|pair| pair[0] < pair[1]);
        if !ascending(&along_outer) || !ascending(&along_inner) {
            return None;
        }
        let on_grid = points_m.chunks_exact(3 * inner).zip(&along_outer).all(|(row, &of_row)| {
            row.chunks_exact(3).zip(&along_inner).all(|(point, &of_column)| {
                point[of_outer] == of_row && point[of_inner] == of_column && point[2] == z_m
            })
        });
        if !on_grid {
            return None;
        }
        let (x_m, y_m) =
            if x_outer { (along_outer, along_inner) } else { (along_inner, along_outer) };
        Some(Self { grid: PlaneGrid { x_m, y_m, z_m }, x_outer })
    }

    /// Whether the plane lies within ten metres of the array.
    pub fn is_near(&self) -> bool {
        let PlaneGrid { x_m, y_m, z_m } = &self.grid;
        let ends = |along: &[f64]| [along[0], along[along.len() - 1]];
        let furthest = ends(x_m).into_iter().chain(ends(y_m)).chain([*z_m]);
        furthest.into_iter().all(|along| along.abs() < FARTHEST_M)
    }
}

/// Writes a plane's field, row by row with y outer and `columns` along x, in the order of its points.
pub fn write_plane<T: Copy>(field: &[T], columns: usize, x_outer: bool, out: &mut [T]) {
    if !x_outer {
        out.copy_from_slice(field);
        return;
    }
    for (column, out) in out.chunks_exact_mut(field.len() / columns).enumerate() {
        for (row, out) in out.iter_mut().enumerate() {
            *out = field[row * columns + column];
        }
    }
}
