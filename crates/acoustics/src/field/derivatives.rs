//! The field and its derivatives, in one pass.

use std::mem::MaybeUninit;

use num_complex::Complex64;

use super::case::{AnyDerivatives, ThesisDerivatives, UsualDerivatives};
use super::derivative_sums::{AT_ONCE, Differentiation, Parameter, USUAL_PARAMETERS};
use super::tile::Sums;
use super::{FieldKernel, InstructionSet, PathLengths};
use crate::transducer::{OnAxis, Transducer};
use crate::{Array, Vec3};

/// A field kernel together with the transducer that it was made with: derivatives by the width of the lobes need both.
///
/// It has no propagation, receiver directivity or near field, by which nothing is differentiated.
#[derive(Clone)]
pub struct DifferentiableKernel<'t> {
    kernel: FieldKernel,
    transducer: &'t dyn Transducer,
}

/// A field and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldDerivatives {
    /// The complex field.
    pub field: Complex64,
    /// Its derivatives, in the order of the parameters that were asked for; zero beyond them.
    pub by: [Complex64; AT_ONCE],
}

impl<'t> DifferentiableKernel<'t> {
    /// Prepares an array as [`FieldKernel::new`] does.
    pub fn new(
        array: &Array,
        phases_rad: &[f64],
        transducer: &'t dyn Transducer,
        wavenumber_rad_m: f64,
        paths: PathLengths,
    ) -> Self {
        let kernel = FieldKernel::new(array, phases_rad, transducer, wavenumber_rad_m, paths);
        Self { kernel, transducer }
    }

    /// The same kernel with another decay of the pressure on the axis.
    pub fn with_on_axis(self, on_axis: OnAxis) -> Self {
        Self { kernel: self.kernel.with_on_axis(on_axis), ..self }
    }

    /// The same kernel with the instructions of a set, which the processor must have: for tests and benchmarks.
    pub fn with_instructions(self, instructions: InstructionSet) -> Self {
        Self { kernel: self.kernel.with_instructions(instructions), ..self }
    }

    /// The kernel of the field alone.
    pub fn kernel(&self) -> &FieldKernel {
        &self.kernel
    }

    /// The field and its derivatives by up to four parameters at each point, in double precision.
    ///
    /// # Panics
    /// For more than four parameters.
    pub fn derivatives_at(
        &self,
        parameters: &[Parameter],
        points_m: &[Vec3],
    ) -> Vec<FieldDerivatives> {
        assert!(parameters.len() <= AT_ONCE, "{AT_ONCE} parameters at once");
        let by = Differentiation::<f64>::new(&self.kernel, self.transducer, parameters);
        let mut derivatives = Vec::with_capacity(points_m.len());
        // Nearly a megabyte for a plane of 101 x 101: it is written once, and not cleared before.
        let out = &mut derivatives.spare_capacity_mut()[..points_m.len()];
        let write = |out: &mut MaybeUninit<FieldDerivatives>, sums: &Sums, point| {
            out.write(FieldDerivatives { field: sums.field(point), by: sums.derivatives(point) });
        };
        let usual = parameters == USUAL_PARAMETERS;
        if usual && self.kernel.is_usual() {
            self.kernel.sum_tiles::<f64, UsualDerivatives, _>(by, points_m, out, &write);
        } else if usual && self.kernel.is_thesis() {
            self.kernel.sum_tiles::<f64, ThesisDerivatives, _>(by, points_m, out, &write);
        } else {
            self.kernel.sum_tiles::<f64, AnyDerivatives, _>(by, points_m, out, &write);
        }
        // SAFETY: the sum writes every point.
        unsafe { derivatives.set_len(points_m.len()) };
        derivatives
    }
}

#[cfg(test)]
mod tests;
