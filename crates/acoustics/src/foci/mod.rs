//! Several foci at once: phases that give several points pressures in given proportions.
//!
//! An array driven with the complex amplitudes q produces the pressures p = H q at some points; H has a row for each point and a
//! column for each element. For one focus there is a closed form: the phase of every element compensates its path. For several foci,
//! with every element at full amplitude, only iterative solutions are known. Three methods, in the order of their quality:
//!
//! | solver | what it does | source |
//! |---|---|---|
//! | [`Solver::Naive`] | sums the drives of the single foci, all in phase, and keeps the phases of the sum | superposition; both others start from it |
//! | [`Solver::GerchbergSaxton`] | propagates to the points, where it sets the wanted amplitudes, and back, where it sets full amplitudes; phases are kept | Gerchberg and Saxton, Optik 35, 237 (1972); for arrays of transducers Marzo and Drinkwater, PNAS 116, 84 (2019) |
//! | [`Solver::Weighted`] | the same; a point below the mean has more weight in the next round | Di Leonardo, Ianni and Ruocco, Opt. Express 15, 1913 (2007) |
//!
//! For 200 random sets of 2 to 8 foci, 100 mm above the thesis's 6 x 6 array, at least 12 mm apart, with 50 rounds
//! (`tests/several_foci.rs` makes them and checks these figures):
//!
//! | solver | uniformity, mean | worst | efficiency, mean | worst |
//! |---|---|---|---|---|
//! | naive | 0.57 | 0.18 | 0.70 | 0.56 |
//! | gerchberg-saxton | 0.65 | 0.23 | 0.80 | 0.70 |
//! | weighted | 0.97 | 0.22 | 0.77 | 0.63 |
//!
//! The worst cases are foci closer than the array's resolution, 14 mm at this height (λ z over its width): no drive makes them
//! uniform. Uniformity is 1 - (max - min)/(max + min) of the intensities divided by the wanted ones (Di Leonardo et al., eq. 8).
//! Efficiency is the sum of the intensities over its maximum for any drive of the same power, the largest eigenvalue of H H†.

mod solve;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::{Array, FieldKernel, PathLengths, Vec3};
use crate::transducer::Transducer;

/// How phases for several foci are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// The sum of the single foci's drives.
    Naive,
    /// Gerchberg and Saxton's iteration.
    GerchbergSaxton,
    /// The same with weights that make the foci uniform.
    Weighted,
}

impl Solver {
    /// Every solver.
    pub const ALL: [Self; 3] = [Self::Naive, Self::GerchbergSaxton, Self::Weighted];
}

impl std::fmt::Display for Solver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Naive => "naive",
            Self::GerchbergSaxton => "gerchberg-saxton",
            Self::Weighted => "weighted",
        })
    }
}

/// The complex pressure that each element, driven alone with unit amplitude and zero phase, produces at each point.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// A row for each point, a column for each element.
    matrix: DMatrix<Complex64>,
}

/// How well drives produce the wanted pressures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quality {
    /// 1 where all points have the wanted proportions; 0 where one has no pressure.
    pub uniformity: f64,
    /// Sum of the points' intensities over the largest possible sum, 0 to 1.
    pub efficiency: f64,
}

impl Transfer {
    /// The transfer from an array of transducers to points, metres.
    pub fn new(
        array: &Array,
        transducer: &dyn Transducer,
        wavenumber_rad_m: f64,
        points_m: &[Vec3],
    ) -> Self {
        let rest = vec![0.0; array.len()];
        let kernel =
            FieldKernel::new(array, &rest, transducer, wavenumber_rad_m, PathLengths::Observed);
        let mut matrix = DMatrix::zeros(points_m.len(), array.len());
        for element in 0..array.len() {
            let column = kernel.of_element(element).at(points_m);
            matrix.set_column(element, &DVector::from_vec(column));
        }
        Self { matrix }
    }

    /// The transfer to some of the points, by their numbers.
    pub fn to_points(&self, points: &[usize]) -> Self {
        Self { matrix: self.matrix.select_rows(points) }
    }

    /// How many points there are.
    pub fn points(&self) -> usize {
        self.matrix.nrows()
    }

    /// The complex pressure at each point for some drives.
    pub fn pressures(&self, drives: &[Complex64]) -> Vec<Complex64> {
        (&self.matrix * DVector::from_column_slice(drives)).iter().copied().collect()
    }

    /// The phase of each element, radians, for amplitudes in the proportions of `wanted` (one for each point, above zero). `rounds`
    /// limits the iterations. The phase at the first point is zero, so that solutions for neighbouring points change smoothly.
    pub fn solve(&self, solver: Solver, wanted: &[f64], rounds: usize) -> Vec<f64> {
        assert_eq!(wanted.len(), self.points(), "one amplitude for each point");
        let drives = solve::drives(&self.matrix, solver, wanted, rounds);
        let first = self.pressures(&drives).first().map_or(0.0, |pressure| pressure.arg());
        drives.into_iter().map(|drive| drive.arg() - first).collect()
    }

    /// How well drives produce amplitudes in the proportions of `wanted`.
    pub fn quality(&self, drives: &[Complex64], wanted: &[f64]) -> Quality {
        let intensities: Vec<f64> = self.pressures(drives).iter().map(|p| p.norm_sqr()).collect();
        let shares = intensities.iter().zip(wanted).map(|(have, want)| have / (want * want));
        let (least, most) = shares.fold((f64::INFINITY, 0.0f64), |(least, most), share| {
            (least.min(share), most.max(share))
        });
        let power: f64 = drives.iter().map(|drive| drive.norm_sqr()).sum();
        let gram = &self.matrix * self.matrix.adjoint();
        let largest = SymmetricEigen::new(gram).eigenvalues.max();
        Quality {
            uniformity: if most > 0.0 { 1.0 - (most - least) / (most + least) } else { 0.0 },
            efficiency: intensities.iter().sum::<f64>() / (power * largest),
        }
    }
}

#[cfg(test)]
mod tests;
