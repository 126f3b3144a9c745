//! Many drives of one geometry at the same points: the matrix from drives to fields, computed once.

use num_complex::Complex64;
use rayon::prelude::*;

use super::FieldKernel;
use super::resample::{Map, Term, WeightedSum};
use crate::Vec3;

/// Points that are summed together.
const BLOCK: usize = 4096;

/// The contribution of each element to the field at some points, for any drive.
#[derive(Debug, Clone)]
pub struct Transfer {
    kernel: FieldKernel,
    /// A row for each element, a column for each point.
    map: Map,
    points: usize,
}

impl FieldKernel {
    /// The matrix from drives to the field at some points. It does not depend on the drive that the kernel was made with.
    pub fn transfer_at(&self, points_m: &[Vec3]) -> Transfer {
        let mut undriven = self.clone();
        for source in &mut undriven.sources {
            source.drive_rad = 0.0;
        }
        let columns = undriven.contributions_at(points_m).concat();
        Transfer {
            map: Map::of(&columns, points_m.len()),
            kernel: undriven,
            points: points_m.len(),
        }
    }
}

impl Transfer {
    /// The complex field at each point, with every element driven with its phase of `phases_rad`.
    pub fn driven(&self, phases_rad: &[f64]) -> Vec<Complex64> {
        assert_eq!(self.kernel.elements, phases_rad.len(), "one phase for each element");
        let mut field = Map::zero(1, self.points);
        field.parts_mut(BLOCK).enumerate().for_each(|(block, (real, imaginary))| {
            let terms: Vec<Term> = phases_rad
                .iter()
                .enumerate()
                .map(|(element, phase_rad)| {
                    let (sine, cosine) = phase_rad.sin_cos();
                    let start = element * self.points + block * BLOCK;
                    Term { start, weight: [cosine, sine] }
                })
                .collect();
            self.kernel.instructions.run(WeightedSum::<true> {
                map: &self.map,
                terms: &terms,
                real,
                imaginary,
            });
        });
        field.joined()
    }

    /// What each element adds to the field at each point, element by element, with every element driven with its phase of `phases_rad`.
    pub fn contributions(&self, phases_rad: &[f64]) -> Vec<Vec<Complex64>> {
        assert_eq!(self.kernel.elements, phases_rad.len(), "one phase for each element");
        let of_element = |(element, phase_rad): (usize, &f64)| {
            let drive = Complex64::cis(*phase_rad);
            let first = element * self.points;
            (first..first + self.points).map(|number| drive * self.map.at(number)).collect()
        };
        phases_rad.iter().enumerate().map(of_element).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transducer::Piston;
    use crate::{Array, PathLengths, PlaneGrid};

    #[test]
    fn the_matrix_gives_the_field_of_every_drive() {
        let array = Array::hexagonal(2, 10.5e-3);
        let points = PlaneGrid::square(35e-3, 1e-3, 0.07).points();
        let kernel = |phases: &[f64]| {
            FieldKernel::new(&array, phases, &Piston, 732.7, PathLengths::Observed)
        };
        let transfer = kernel(&[2.0; 19]).transfer_at(&points);
        for drive in [0.0, 0.4, -1.7] {
            let phases: Vec<f64> = (0..array.len()).map(|n| drive * n as f64).collect();
            let direct = kernel(&phases).at(&points);
            for (ours, direct) in transfer.driven(&phases).into_iter().zip(direct) {
                assert!((ours - direct).norm() < 1e-11, "{ours} {direct}");
            }
            let parts = kernel(&phases).contributions_at(&points);
            let ours = transfer.contributions(&phases);
            for (ours, direct) in ours.iter().flatten().zip(parts.iter().flatten()) {
                assert!((ours - direct).norm() < 1e-12, "{ours} {direct}");
            }
        }
    }
}
