//! The curvature by fewer residuals than parameters, most of which have a narrow prior: its inverse by a matrix of the size of the residuals
//! (M. A. Woodbury, *Inverting modified matrices*, Princeton, 1950).
//!
//! With the derivatives M of the residuals by the parameters of narrow priors, F by the others, and the stiffness D of the priors, M and F are seen
//! through K = 1 + M D⁻¹ Mᵀ: the others alone have the curvature Fᵀ K⁻¹ F and that of their own priors.

use nalgebra::{DMatrix, DVector};

use super::curvature::hold;
use super::{Factor, Linearisation, Parameter, inner_products};

/// Parameters of narrow priors for one residual, from which on K takes fewer operations than the curvature of all parameters.
const PARAMETERS_A_RESIDUAL: usize = 2;

/// Fewer of these are not worth it.
const MANY: usize = 64;

/// Stiffness of a narrow prior, in scales of its parameter. The digits of K that a wide prior costs are then too few to matter.
const NARROW: f64 = 1e-4;

/// Derivatives in scales of the parameters.
pub(super) struct FewReadings {
    /// Numbers of the parameters with a narrow prior, and their derivatives.
    narrow: Vec<usize>,
    by_narrow: DMatrix<f64>,
    /// The others.
    other: Vec<usize>,
    by_other: DMatrix<f64>,
    /// Curvature of the prior of each parameter.
    stiffness: Vec<f64>,
}

impl FewReadings {
    /// `None` where the curvature of all parameters takes fewer operations.
    pub fn of(parameters: &[Parameter], linear: &Linearisation) -> Option<Self> {
        let is_narrow = |j: &usize| {
            let parameter = &parameters[*j];
            parameter.range.is_none() && parameter.stiffness() >= NARROW
        };
        let (narrow, other): (Vec<usize>, Vec<usize>) = (0..parameters.len()).partition(is_narrow);
        let readings = linear.residuals.len();
        if narrow.len() < MANY.max(PARAMETERS_A_RESIDUAL * readings) {
            return None;
        }
        let by = |some: &[usize]| {
            let scaled = some.iter().flat_map(|&j| {
                linear.columns[j].iter().map(move |slope| slope * parameters[j].scale)
            });
            DMatrix::from_iterator(readings, some.len(), scaled)
        };
        let (by_narrow, by_other) = (by(&narrow), by(&other));
        let stiffness = parameters.iter().map(Parameter::stiffness).collect();
        Some(Self { narrow, by_narrow, other, by_other, stiffness })
    }

    /// With a damping in each direction, and with some of the other parameters held.
    pub fn reduced(&self, damping: f64, held: &[usize]) -> Option<Reduced<'_>> {
        let damped = |some: &[usize]| {
            DVector::from_iterator(some.len(), some.iter().map(|&j| self.stiffness[j] + damping))
        };
        let compliance = damped(&self.narrow).map(f64::recip);
        let roots = compliance.map(f64::sqrt);
        let row = |row: usize| -> Vec<f64> {
            self.by_narrow.row(row).iter().zip(&roots).map(|(slope, root)| slope * root).collect()
        };
        let rows: Vec<Vec<f64>> = (0..self.by_narrow.nrows()).map(row).collect();
        let mut seen = inner_products(&rows);
        (0..seen.nrows()).for_each(|i| seen[(i, i)] += 1.0);
        let seen = Factor::of(seen)?;
        let mut by_other = self.by_other.clone();
        let held = held.iter().filter_map(|j| self.other.iter().position(|other| other == j));
        let held: Vec<usize> = held.collect();
        held.iter().for_each(|&column| by_other.column_mut(column).fill(0.0));
        let whitened = seen.whitened(&by_other);
        let stiffness = DMatrix::from_diagonal(&damped(&self.other));
        let mut curvature = whitened.tr_mul(&whitened) + stiffness;
        hold(&mut curvature, &held);
        let curvature = Factor::of(curvature)?;
        Some(Reduced { of: self, by_other, compliance, seen, curvature })
    }
}

/// The inverse by the matrix of the residuals.
pub(super) struct Reduced<'f> {
    of: &'f FewReadings,
    /// Derivatives by the other parameters, zero for those that are held.
    by_other: DMatrix<f64>,
    /// One over the stiffness of the narrow priors.
    compliance: DVector<f64>,
    /// K.
    seen: Factor,
    /// The curvature of the other parameters, those of narrow priors fitted.
    curvature: Factor,
}

impl Reduced<'_> {
    pub fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let FewReadings { narrow, by_narrow, other, .. } = self.of;
        let of =
            |some: &[usize]| DVector::from_iterator(some.len(), some.iter().map(|&j| right[j]));
        let soft = of(narrow).component_mul(&self.compliance);
        let pushed = by_narrow * &soft;
        let pull = of(other) - self.by_other.tr_mul(&self.seen.solve(&pushed));
        let found = self.curvature.solve(&pull);
        let back = by_narrow.tr_mul(&self.seen.solve(&(pushed + &self.by_other * &found)));
        let beside = soft - back.component_mul(&self.compliance);
        let mut solved = DVector::zeros(right.len());
        narrow.iter().zip(&beside).for_each(|(&j, x)| solved[j] = *x);
        other.iter().zip(&found).for_each(|(&j, x)| solved[j] = *x);
        solved
    }

    pub fn inverse(&self) -> DMatrix<f64> {
        let FewReadings { narrow, by_narrow, other, .. } = self.of;
        let mut soft = self.seen.whitened(by_narrow);
        for (mut column, compliance) in soft.column_iter_mut().zip(&self.compliance) {
            column *= *compliance;
        }
        let soft_transposed = soft.transpose();
        let of_other = self.curvature.inverse();
        let followed = &soft_transposed * self.seen.whitened(&self.by_other);
        let across = -&followed * &of_other;
        let of_narrow = DMatrix::from_diagonal(&self.compliance)
            - soft_transposed * soft
            - &across * followed.transpose();
        let n = narrow.len() + other.len();
        let mut inverse = DMatrix::zeros(n, n);
        for (column, &j) in narrow.iter().enumerate() {
            for (row, &i) in narrow.iter().enumerate() {
                inverse[(i, j)] = of_narrow[(row, column)];
            }
        }
        for (column, &j) in other.iter().enumerate() {
            for (row, &i) in other.iter().enumerate() {
                inverse[(i, j)] = of_other[(row, column)];
            }
            for (row, &i) in narrow.iter().enumerate() {
                inverse[(i, j)] = across[(row, column)];
                inverse[(j, i)] = across[(row, column)];
            }
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Against the curvature of all parameters, with and without damping, and with a parameter at its limit.
    #[test]
    fn the_inverse_is_that_of_the_curvature_of_all_parameters() {
        let (readings, count) = (31, 90);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let parameters: Vec<Parameter> = (0..count)
            .map(|j| Parameter {
                start: 0.0,
                scale: 0.01 + 0.02 * (j % 3) as f64,
                prior: (j % 40 != 7).then_some((0.1, if j % 10 == 1 { 300.0 } else { 0.2 })),
                range: (j % 10 == 1).then_some((-1.0, 1.0)),
            })
            .collect();
        let mut column = || (0..readings).map(|_| random.random_range(-20.0..20.0)).collect();
        let columns: Vec<Vec<f64>> = (0..count).map(|_| column()).collect();
        let linear = Linearisation { residuals: vec![1.0; readings], columns };
        let few = FewReadings::of(&parameters, &linear).expect("more parameters than readings");
        assert_eq!(few.other.len(), 12);
        let right = |j: usize| if j == 21 { 0.0 } else { random.random_range(-1.0..1.0) };
        let right = DVector::from_iterator(count, (0..count).map(right));
        for (damping, held) in [(0.0, vec![]), (0.3, vec![]), (0.3, vec![21])] {
            let mut curvature = DMatrix::from_fn(count, count, |i, j| {
                let products = linear.columns[i].iter().zip(&linear.columns[j]);
                let product: f64 = products.map(|(a, b)| a * b).sum();
                product * parameters[i].scale * parameters[j].scale
            });
            for (j, parameter) in parameters.iter().enumerate() {
                curvature[(j, j)] += parameter.stiffness() + damping;
            }
            hold(&mut curvature, &held);
            let plain = curvature.cholesky().expect("positive definite");
            let reduced = few.reduced(damping, &held).expect("positive definite");
            let solved = plain.solve(&right);
            let apart = (reduced.solve(&right) - &solved).norm() / solved.norm();
            assert!(apart < 1e-9, "{damping} {held:?}: {apart}");
            let whole = plain.inverse();
            let apart = (reduced.inverse() - &whole).norm() / whole.norm();
            assert!(apart < 1e-9, "{damping} {held:?}: {apart}");
        }
    }
}
