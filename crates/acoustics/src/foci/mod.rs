//! Several foci at once: the phases that give each of some points its share of the pressure.
//!
//! An array driven with the complex amplitudes q gives the points the pressures p = H q, where H has a row for each point and a
//! column for each element. One focus has a closed form: every element's phase takes back that of its own path. For
//! several only iterations are known, since each element has but one phase to serve them all, and full drive is wanted
//! of every element. Three ways, in the order of their quality:
//!
//! | solver | what it does | source |
//! |---|---|---|
//! | [`Solver::Naive`] | adds up the drives of the single foci, all in phase, and keeps the phases of the sum | superposition; the start of both others |
//! | [`Solver::GerchbergSaxton`] | goes to the points and back, keeping their phases and the wanted amplitudes there, the elements' phases and full drive here | Gerchberg and Saxton, Optik 35, 237 (1972); for arrays of transducers Marzo and Drinkwater, PNAS 116, 84 (2019) |
//! | [`Solver::Weighted`] | the same, and what a point lacks against the others raises its weight for the next round | Di Leonardo, Ianni and Ruocco, Opt. Express 15, 1913 (2007) |
//!
//! Over 200 draws of 2 to 8 foci, 100 mm above the thesis's 6 x 6 array, at least 12 mm apart, 50 rounds each
//! (`tests/several_foci.rs` draws them and holds these figures):
//!
//! | solver | uniformity, mean | worst | efficiency, mean | worst |
//! |---|---|---|---|---|
//! | naive | 0.57 | 0.18 | 0.70 | 0.56 |
//! | gerchberg-saxton | 0.65 | 0.23 | 0.80 | 0.70 |
//! | weighted | 0.97 | 0.22 | 0.77 | 0.63 |
//!
//! The worst are foci nearer to each other than the array resolves, 14 mm at this height (λ z over its width): no drive serves
//! them evenly. Uniformity is 1 - (max - min)/(max + min) of the intensities over the wanted ones (Di Leonardo et al., eq. 8); efficiency
//! the sum of the intensities over the largest that any drive of the same power could give, the largest eigenvalue of H H†.

mod solve;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::{Array, FieldKernel, PathLengths, Vec3};
use crate::transducer::Transducer;

/// How the phases for several foci are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// The sum of the single foci's drives.
    Naive,
    /// Gerchberg and Saxton's iteration.
    GerchbergSaxton,
    /// The same with weights that even the foci out.
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

/// What each element, driven alone with unit amplitude and no phase, gives each point.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// A row for each point, a column for each element.
    matrix: DMatrix<Complex64>,
}

/// How well some drives serve the points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quality {
    /// 1 where all points have what was wanted of them, relative to each other; 0 where one has nothing.
    pub uniformity: f64,
    /// Sum of the points' intensities over the largest that is possible, 0 to 1.
    pub efficiency: f64,
}

impl Transfer {
    /// The transfer from an array of some transducers to points, metres.
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

    /// The complex pressure that some drives give each point.
    pub fn pressures(&self, drives: &[Complex64]) -> Vec<Complex64> {
        (&self.matrix * DVector::from_column_slice(drives)).iter().copied().collect()
    }

    /// The phase of each element, radians, for points that want amplitudes in the proportion of `wanted` (one for each
    /// point, above zero). `rounds` bounds the iterations. The first point's phase is zero, so that solutions for
    /// neighbouring places follow each other smoothly.
    pub fn solve(&self, solver: Solver, wanted: &[f64], rounds: usize) -> Vec<f64> {
        assert_eq!(wanted.len(), self.points(), "one amplitude for each point");
        let drives = solve::drives(&self.matrix, solver, wanted, rounds);
        let first = self.pressures(&drives).first().map_or(0.0, |pressure| pressure.arg());
        drives.into_iter().map(|drive| drive.arg() - first).collect()
    }

    /// How well some drives serve points that want amplitudes in the proportion of `wanted`.
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
