//! Derivatives of readings that several fits begin with, with what is computed from them once.

use std::sync::OnceLock;

use fieldgap_acoustics::least_squares::inner_products;
use nalgebra::DMatrix;

/// Derivatives of the residuals by the first of the parameters, one column each.
#[derive(Default)]
pub(crate) struct Slopes {
    columns: Vec<Vec<f64>>,
    products: OnceLock<DMatrix<f64>>,
}

impl Slopes {
    pub fn of(columns: Vec<Vec<f64>>) -> Self {
        Self { columns, products: OnceLock::new() }
    }

    pub fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    /// The products of the columns with one another.
    pub fn products(&self) -> &DMatrix<f64> {
        self.products.get_or_init(|| inner_products(&self.columns))
    }
}
