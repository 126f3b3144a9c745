//! A field map on a regular or irregular grid of columns and rows.

/// Magnitudes over the columns `x` and rows `y` of a plane; NaN where nothing was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneMap {
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    values: Vec<f64>,
}

/// Why numbers are not a map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "a map needs ascending positions and one value for each: {columns} columns and {rows} rows do not fit {values} values"
)]
pub struct MapShapeError {
    columns: usize,
    rows: usize,
    values: usize,
}

impl PlaneMap {
    /// Takes column and row positions, metres, both ascending, and the values row by row (y outer, x inner).
    ///
    /// # Errors
    /// [`MapShapeError`] if there is no column or row, if positions do not ascend, or if the counts do not fit.
    pub fn new(x_m: Vec<f64>, y_m: Vec<f64>, values: Vec<f64>) -> Result<Self, MapShapeError> {
        let rising = |along: &[f64]| !along.is_empty() && along.windows(2).all(|w| w[0] < w[1]);
        if rising(&x_m) && rising(&y_m) && values.len() == x_m.len() * y_m.len() {
            Ok(Self { x_m, y_m, values })
        } else {
            Err(MapShapeError { columns: x_m.len(), rows: y_m.len(), values: values.len() })
        }
    }

    /// Column positions, metres, ascending.
    pub fn x_m(&self) -> &[f64] {
        &self.x_m
    }

    /// Row positions, metres, ascending.
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

    /// Column, row and size of the largest value; of several equal ones the first, column by column, as in the thesis's listing.
    /// `None` if nothing was measured.
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
