//! Fits of hundreds of numbers against plain linear algebra in the same run: `cargo bench --bench least_squares`.
//!
//! The numbers are those of two departures of each of 256 elements, with priors. Each figure is the best of several runs, reference and library in turn,
//! on all threads.

use std::hint::black_box;
use std::time::Instant;

use fieldgap::acoustics::least_squares::{
    Factor, Linearisation, Parameter, Stopping, dot, inner_products, minimise,
};
use nalgebra::DMatrix;

const RUNS: usize = 10;

/// Numbers of a fit.
const NUMBERS: usize = 512;

fn main() {
    println!("{NUMBERS} numbers          plain   library   times as fast");
    let columns = columns(1500);
    compare("products, 1500 rows", || plain_products(&columns), || inner_products(&columns));
    let curvature = inner_products(&columns) + DMatrix::identity(NUMBERS, NUMBERS);
    let inverse = |curvature: DMatrix<f64>| curvature.cholesky().expect("positive").inverse();
    compare(
        "inverse",
        || inverse(curvature.clone()),
        || Factor::of(curvature.clone()).expect("positive").inverse(),
    );
    for rows in [100, 400] {
        let linear = Linearisation { residuals: vec![1.0; rows], columns: self::columns(rows) };
        let parameter = Parameter { start: 0.0, scale: 1.0, prior: Some((0.0, 1.0)), range: None };
        let parameters = [parameter; NUMBERS];
        let one_step = Stopping { iterations: 1, ..Stopping::default() };
        let fitted = || {
            let residuals = |_: &[f64]| linear.residuals.clone();
            minimise(&parameters, one_step, residuals, |_| linear.clone()).covariance
        };
        let plain =
            || Some(inverse(plain_products(&linear.columns) + DMatrix::identity(NUMBERS, NUMBERS)));
        let apart = (fitted().expect("priors") - plain().expect("priors")).amax();
        assert!(apart < 1e-9, "{apart}");
        compare(&format!("covariance, {rows} rows"), plain, fitted);
    }
}

/// Prints how long each takes.
fn compare<T>(name: &str, plain: impl Fn() -> T, library: impl Fn() -> T) {
    let [mut plain_s, mut library_s] = [f64::INFINITY; 2];
    for _ in 0..RUNS {
        plain_s = plain_s.min(seconds(&plain));
        library_s = library_s.min(seconds(&library));
    }
    let ratio = plain_s / library_s;
    println!("{name:20} {:7.1} ms {:6.1} ms {ratio:10.1}", 1e3 * plain_s, 1e3 * library_s);
}

fn seconds<T>(work: impl Fn() -> T) -> f64 {
    let start = Instant::now();
    black_box(work());
    start.elapsed().as_secs_f64()
}

/// Each product by itself.
fn plain_products(columns: &[Vec<f64>]) -> DMatrix<f64> {
    let mut products = DMatrix::zeros(columns.len(), columns.len());
    for (j, column) in columns.iter().enumerate() {
        for (i, other) in columns[..=j].iter().enumerate() {
            products[(i, j)] = dot(other, column);
        }
    }
    products.fill_lower_triangle_with_upper_triangle();
    products
}

/// Derivatives of no meaning.
fn columns(rows: usize) -> Vec<Vec<f64>> {
    let slope = |i: usize, j: usize| (0.37 * (i * i + 7 * j * j + i * j) as f64).sin();
    (0..NUMBERS).map(|j| (0..rows).map(|i| slope(i, j)).collect()).collect()
}
