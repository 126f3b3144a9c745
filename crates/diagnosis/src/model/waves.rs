//! The waves of an array's elements, for drives that follow one another at the same places.
//!
//! A calibration reads hundreds of drives at one place or a few. Drives of one geometry differ in the phases of the elements alone, so that the matrix
//! from drives to fields is computed once for places that are asked for again and again.

use std::cell::RefCell;

use fieldgap_acoustics::{FieldKernel, Transfer, Vec3};
use num_complex::Complex64;

/// Times that places are asked for before their matrix is computed, which takes as long as about two fields.
const TIMES: usize = 4;

/// Lists of places that are remembered: those of the readings, their images in a plane, and the centre of an object.
const LISTS: usize = 3;

/// Pairs of element and place in a matrix at most, so that one fits the cache of a processor's core: 1 MB.
const MOST_PAIRS: usize = 1 << 16;

/// The waves of elements that are driven with some phases.
pub(crate) struct Waves {
    /// Of this drive.
    kernel: FieldKernel,
    phases_rad: Vec<f64>,
    asked: RefCell<Vec<Asked>>,
}

/// Places that were asked for.
struct Asked {
    points_m: Vec<Vec3>,
    times: usize,
    transfer: Option<Transfer>,
}

impl Waves {
    /// Of a kernel that is driven with these phases, rad.
    pub fn of(kernel: FieldKernel, phases_rad: Vec<f64>) -> Self {
        Self { kernel, phases_rad, asked: RefCell::default() }
    }

    /// The kernel of this drive.
    pub fn kernel(&self) -> &FieldKernel {
        &self.kernel
    }

    /// The phases of this drive, rad.
    pub fn phases_rad(&self) -> &[f64] {
        &self.phases_rad
    }

    /// The same geometry with another drive.
    pub fn driven(self, phases_rad: Vec<f64>) -> Self {
        Self { kernel: self.kernel.driven(&phases_rad), phases_rad, ..self }
    }

    /// The same drive with the elements elsewhere, as [`FieldKernel::moved`].
    pub fn moved(&self, place: impl Fn(&Vec3) -> Vec3, axis: impl Fn(&Vec3) -> Vec3) -> Self {
        Self::of(self.kernel.moved(place, axis), self.phases_rad.clone())
    }

    /// The field at each point.
    pub fn at(&self, points_m: &[Vec3]) -> Vec<Complex64> {
        self.by_matrix(points_m, |transfer| transfer.driven(&self.phases_rad))
            .unwrap_or_else(|| self.kernel.at(points_m))
    }

    /// What each element adds to the field at each point, element by element.
    pub fn contributions_at(&self, points_m: &[Vec3]) -> Vec<Vec<Complex64>> {
        self.by_matrix(points_m, |transfer| transfer.contributions(&self.phases_rad))
            .unwrap_or_else(|| self.kernel.contributions_at(points_m))
    }

    /// What their matrix gives at places that were asked for often enough; `None` of others.
    fn by_matrix<O>(&self, points_m: &[Vec3], of: impl FnOnce(&Transfer) -> O) -> Option<O> {
        if points_m.len() * self.phases_rad.len() > MOST_PAIRS {
            return None;
        }
        let mut asked = self.asked.borrow_mut();
        let Some(known) = asked.iter_mut().find(|asked| asked.points_m == points_m) else {
            asked.truncate(LISTS - 1);
            asked.insert(0, Asked { points_m: points_m.to_vec(), times: 1, transfer: None });
            return None;
        };
        known.times += 1;
        if known.times < TIMES {
            return None;
        }
        let transfer = known.transfer.get_or_insert_with(|| self.kernel.transfer_at(points_m));
        Some(of(transfer))
    }
}

#[cfg(test)]
mod tests {
    use fieldgap_acoustics::transducer::Piston;
    use fieldgap_acoustics::{Array, PathLengths};

    use super::*;

    #[test]
    fn drives_at_the_same_places_have_the_fields_of_their_own_kernels() {
        let array = Array::hexagonal(2, 10.5e-3);
        let places = |z_m: f64| vec![Vec3::new(3e-3, -2e-3, z_m), Vec3::new(0.0, 0.01, z_m)];
        let phases = |drive: usize| -> Vec<f64> {
            (0..array.len()).map(|n| 0.7 * drive as f64 * n as f64).collect()
        };
        let kernel = |drive: usize| {
            FieldKernel::new(&array, &phases(drive), &Piston, 732.7, PathLengths::Observed)
        };
        let mut waves = Waves::of(kernel(0), phases(0));
        for drive in 0..3 * TIMES {
            waves = waves.driven(phases(drive));
            for points_m in [places(0.1), places(0.12)] {
                let direct = kernel(drive).at(&points_m);
                for (ours, direct) in waves.at(&points_m).into_iter().zip(&direct) {
                    assert!((ours - direct).norm() < 1e-11, "{drive}: {ours} {direct}");
                }
                let parts = waves.contributions_at(&points_m);
                for (point, direct) in direct.iter().enumerate() {
                    let sum: Complex64 = parts.iter().map(|part| part[point]).sum();
                    assert!((sum - direct).norm() < 1e-11, "{drive}: {sum} {direct}");
                }
            }
        }
        let asked = waves.asked.borrow();
        assert!(asked.len() == 2 && asked.iter().all(|asked| asked.transfer.is_some()));
    }

    /// The places of a moving receiver differ from drive to drive.
    #[test]
    fn places_that_are_asked_for_once_are_forgotten() {
        let array = Array::hexagonal(1, 10.5e-3);
        let phases = vec![0.0; array.len()];
        let kernel = FieldKernel::new(&array, &phases, &Piston, 732.7, PathLengths::Observed);
        let waves = Waves::of(kernel, phases);
        for n in 0..20 {
            waves.at(&[Vec3::new(0.0, 0.0, 0.1 + 1e-3 * f64::from(n))]);
        }
        assert_eq!(waves.asked.borrow().len(), LISTS);
    }
}
