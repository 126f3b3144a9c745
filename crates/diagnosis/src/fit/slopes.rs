//! Derivatives of readings that several fits begin with, with what is computed from them once.

use fieldgap_acoustics::least_squares::inner_products;
use nalgebra::DMatrix;

/// Derivatives of the residuals by the first of the parameters, one column each.
pub(crate) struct Slopes {
    columns: Vec<Vec<f64>>,
    products: DMatrix<f64>,
}

impl Slopes {
    /// With their products, which several threads compute: where these were computed only when asked for, behind a lock, a thread that waits for the others
    /// may be given a task that waits for this lock.
    pub fn of(columns: Vec<Vec<f64>>) -> Self {
        Self { products: inner_products(&columns), columns }
    }

    pub fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    /// The products of the columns with one another.
    pub fn products(&self) -> &DMatrix<f64> {
        &self.products
    }
}
