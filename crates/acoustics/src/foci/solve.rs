//! The iterations of the solvers.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::Solver;

/// Weights change by no more than this factor in one round, so that a point in a null does not get all the weight.
const MAX_CHANGE: f64 = 2.0;

/// Drives of unit amplitude that a solver finds.
pub(super) fn drives(
    transfer: &DMatrix<Complex64>,
    solver: Solver,
    wanted: &[f64],
    rounds: usize,
) -> Vec<Complex64> {
    let back = transfer.adjoint();
    let wanted = DVector::from_column_slice(wanted);
    // The sum of the single foci's drives: exact for one focus, the start of the iterations for several.
    let mut drives = phases_of(&back * wanted.map(Complex64::from));
    let rounds = if wanted.len() == 1 || solver == Solver::Naive { 0 } else { rounds };
    let mut weights = DVector::from_element(wanted.len(), 1.0);
    for _ in 0..rounds {
        let pressures = transfer * &drives;
        if solver == Solver::Weighted {
            let shares = pressures.zip_map(&wanted, |pressure, wanted| pressure.norm() / wanted);
            let mean = shares.mean();
            weights.zip_apply(&shares, |weight, share| {
                *weight *= (mean / share).clamp(1.0 / MAX_CHANGE, MAX_CHANGE);
            });
            weights /= weights.mean();
        }
        let asked = pressures
            .zip_map(&wanted, |pressure, wanted| unit(pressure) * wanted)
            .zip_map(&weights, |pressure, weight| pressure * weight);
        drives = phases_of(&back * asked);
    }
    drives.iter().copied().collect()
}

fn phases_of(drives: DVector<Complex64>) -> DVector<Complex64> {
    drives.map(unit)
}

fn unit(value: Complex64) -> Complex64 {
    Complex64::from_polar(1.0, value.arg())
}
