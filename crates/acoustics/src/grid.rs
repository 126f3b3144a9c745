//! Regular grids of points on a plane.

use super::Vec3;

/// A grid of points on a plane of constant height: every combination of its columns and rows.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneGrid {
    /// Column positions, metres, in ascending order.
    pub x_m: Vec<f64>,
    /// Row positions, metres, in ascending order.
    pub y_m: Vec<f64>,
    /// Height, metres.
    pub z_m: f64,
}

impl PlaneGrid {
    /// A square grid about the axis, from `-half_width_m` to `half_width_m`.
    pub fn square(half_width_m: f64, step_m: f64, z_m: f64) -> Self {
        let steps = (half_width_m / step_m).round() as i64;
        let along: Vec<f64> = (-steps..=steps).map(|index| index as f64 * step_m).collect();
        Self { x_m: along.clone(), y_m: along, z_m }
    }

    /// The points, row by row: y outer, x inner.
    pub fn points(&self) -> Vec<Vec3> {
        self.y_m
            .iter()
            .flat_map(|&y| self.x_m.iter().map(move |&x| Vec3::new(x, y, self.z_m)))
            .collect()
    }
}
