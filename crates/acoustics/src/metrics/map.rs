//! A field map on a regular or irregular grid of columns and rows.

/// Magnitudes over the columns `x` and rows `y` of a plane; not-a-number where nothing was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneMap {
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    values: Vec<f64>,
}

/// Why numbers do not make a map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "a map of {columns} rising columns and {rows} rising rows needs that many values, not {values}"
)]
pub struct MapShapeError {
    columns: usize,
    rows: usize,
    values: usize,
}

impl PlaneMap {
    /// Takes column and row positions, metres, both rising, and the values row by row (y outer, x inner).
    ///
    /// # Errors
    /// [`MapShapeError`] if there is no column or row, if positions do not rise, or if the counts do not fit.
    pub fn new(x_m: Vec<f64>, y_m: Vec<f64>, values: Vec<f64>) -> Result<Self, MapShapeError> {
        let rising = |along: &[f64]| !along.is_empty() && along.windows(2).all(|w| w[0] < w[1]);
        if rising(&x_m) && rising(&y_m) && values.len() == x_m.len() * y_m.len() {
            Ok(Self { x_m, y_m, values })
        } else {
            Err(MapShapeError { columns: x_m.len(), rows: y_m.len(), values: values.len() })
        }
    }

    /// Column positions, metres, rising.
    pub fn x_m(&self) -> &[f64] {
        &self.x_m
    }

    /// Row positions, metres, rising.
    pub fn y_m(&self) -> &[f64] {
        &self.y_m
    }

    /// The values, row by row.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value in a column and row; `None` outside the map and where nothing was measured.
    pub fn at(&self, column: usize, row: usize) -> Option<f64> {
        if column >= self.x_m.len() || row >= self.y_m.len() {
            return None;
        }
        Some(self.values[row * self.x_m.len() + column]).filter(|value| !value.is_nan())
    }

    /// Column and row of the largest value, the first in the order of columns where several are equal (as the
    /// thesis's listing finds it); `None` if nothing was measured.
    pub(super) fn largest(&self) -> Option<(usize, usize, f64)> {
        let mut largest: Option<(usize, usize, f64)> = None;
        for column in 0..self.x_m.len() {
            for row in 0..self.y_m.len() {
                if let Some(value) = self.at(column, row)
                    && largest.is_none_or(|(_, _, so_far)| value > so_far)
                {
                    largest = Some((column, row, value));
                }
            }
        }
        largest
    }
}
