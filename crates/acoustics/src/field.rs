//! The field kernel: the complex sum over elements of amplitude times directivity times phase, at any points.
//!
//! For element n with centre c, normal m, drive w exp(i φ) and a point x, with r = x - c, d = |r|, h = r·m and θ the
//! angle between r and m:
//!
//! p(x) = Σ w A(d, h) D(θ) exp(i (k d + φ))
//!
//! D enters as a polynomial in a variable that needs neither arc tangent nor branch ([`Smooth`](super::transducer::Smooth)), so
//! that every transducer takes the same path through the code. A transducer that is more than one source, such as the integral
//! over a face, enters as its patches. Tiles of points are distributed over threads, and each point's sum runs in the order of the
//! elements: the result does not depend on the number of threads.
//!
//! | file | what it holds |
//! |---|---|
//! | `surroundings` | a tile's points and sources, relative to the tile's middle |
//! | `tile`, `case` | the sum over sources, compiled for each case |
//! | `ray`, `on_axis_law` | distance, excess path and level of one source |
//! | `derivatives`, `derivative_sums`, `phasor` | derivatives, in the same pass as the field |
//! | `usual_derivatives` | the same for the usual kernel and parameters, with the fewest operations |
//! | `plane`, `lattice`, `resample` | a plane with less work, from repeated rays or a coarse grid |
//! | `shifted_rows` | sums of shifted rows of a map, several rows at a time |
//! | `transfer` | the matrix from drives to fields |
//! | `instruction_set` | which vector instructions the processor has |

mod case;
mod derivative_sums;
mod derivatives;
mod instruction_set;
mod lattice;
mod on_axis_law;
mod phasor;
mod plane;
mod ray;
mod resample;
mod shifted_rows;
mod surroundings;
mod tile;
mod transfer;
mod usual_derivatives;

use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;

use case::{AnyField, AnyFieldAndSquares, Case, PlainField, PlainNearField, UsualField};
use derivative_sums::Differentiation;
pub use derivative_sums::Parameter;
pub use derivatives::{DifferentiableKernel, FieldDerivatives};
pub use instruction_set::InstructionSet;
pub use plane::{PLANE_TOLERANCE, PlaneMethod, PlaneSum};
pub use transfer::Transfer;

use super::lobe::{DOUBLE_TOLERANCE, Fit};
use super::propagation::Propagation;
use super::rayleigh::across;
use super::simd::float::Float;
use super::transducer::{OnAxis, Smooth, Transducer};
use super::{Array, Vec3};
use surroundings::Surroundings;
use tile::{Prepared, Sums, TileSum};

/// Points that one task computes: small enough to distribute a plane, large enough to outweigh the cost of a task.
const TILE: usize = 512;

/// Where path lengths are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathLengths {
    /// At the observed point, as physics has it.
    Observed,
    /// As if every point lay at this height, metres: the thesis's simulator freezes its phases at the focus.
    FrozenAt(f64),
}

/// The floating-point precision of a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// `f32`: two to three times as fast; the error is below 1e-5 of the peak.
    Single,
    /// `f64`: the error is below 1e-12 of the peak.
    Double,
}

/// An array, its drive and its transducer, ready to be summed at any points.
#[derive(Debug, Clone)]
pub struct FieldKernel {
    sources: Vec<Source>,
    elements: usize,
    lobes: Arc<[Lobes]>,
    smooth: Smooth,
    on_axis: OnAxis,
    wavenumber_rad_m: f64,
    paths: PathLengths,
    propagation: Option<Propagation>,
    /// The receiver's sensitivity as a function of the cosine of the angle of arrival.
    reception: Option<Fit>,
    /// Share of the near field of a vibrating face, 0 to 1.
    near_field: f64,
    precision: Precision,
    instructions: InstructionSet,
}

/// The sums over elements at one point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FieldSum {
    /// The complex field.
    pub field: Complex64,
    /// Sum of the squared magnitudes: the field's mean square if the elements had random phases.
    pub incoherent_power: f64,
    /// Sum of the squares of the contributions: the direction in which the field scatters if their phases vary a little at random.
    pub square: Complex64,
}

/// What radiates from one place: an element, or a patch of one.
#[derive(Debug, Clone, Copy)]
struct Source {
    element: usize,
    centre_m: Vec3,
    normal: Vec3,
    amplitude: f64,
    /// Phase of its drive.
    drive_rad: f64,
    /// Phase of its own, which the drive does not know.
    own_rad: f64,
    lobes: usize,
}

/// The directivity of all elements with one radius, and its radius and wavenumber.
#[derive(Debug, Clone)]
struct Lobes {
    radius_m: f64,
    directivity: Fit,
}

impl FieldKernel {
    /// Prepares `array`, each element driven with its phase of `phases_rad` (as many as elements), at a wavenumber.
    pub fn new(
        array: &Array,
        phases_rad: &[f64],
        transducer: &dyn Transducer,
        wavenumber_rad_m: f64,
        paths: PathLengths,
    ) -> Self {
        assert_eq!(array.len(), phases_rad.len(), "one phase for each element");
        let mut lobes: Vec<Lobes> = Vec::new();
        let mut patches = Vec::new();
        let mut sources = Vec::with_capacity(array.len());
        for (number, (element, &drive_rad)) in array.elements().iter().zip(phases_rad).enumerate() {
            let radius_m = element.radius_m;
            let known = lobes.iter().position(|lobes| lobes.radius_m == radius_m);
            let kind = known.unwrap_or_else(|| {
                let smooth = transducer.smooth();
                let directivity = fit(DOUBLE_TOLERANCE, transducer, smooth, |theta_rad| {
                    transducer.directivity(theta_rad, radius_m, wavenumber_rad_m)
                });
                lobes.push(Lobes { radius_m, directivity });
                patches.push(transducer.patches(radius_m, wavenumber_rad_m));
                lobes.len() - 1
            });
            let (first, second) = across(element.normal);
            sources.extend(patches[kind].iter().map(|patch| Source {
                element: number,
                centre_m: element.centre_m + radius_m * (patch.u * first + patch.v * second),
                normal: element.normal,
                amplitude: element.amplitude * patch.weight,
                drive_rad,
                own_rad: element.phase_rad,
                lobes: kind,
            }));
        }
        Self {
            sources,
            elements: array.len(),
            lobes: lobes.into(),
            smooth: transducer.smooth(),
            on_axis: transducer.on_axis(),
            wavenumber_rad_m,
            paths,
            propagation: None,
            reception: None,
            near_field: 0.0,
            precision: Precision::Double,
            instructions: InstructionSet::best(),
        }
    }

    /// The same kernel with another decay of the pressure on the axis.
    pub fn with_on_axis(self, on_axis: OnAxis) -> Self {
        Self { on_axis, ..self }
    }

    /// The same kernel in air with wind, a gradient of the speed of sound, or attenuation.
    pub fn with_propagation(self, propagation: Propagation) -> Self {
        let propagation = (propagation != Propagation::default()).then_some(propagation);
        Self { propagation, ..self }
    }

    /// The same field as a receiver that looks along -z reads it. `sensitivity` gives the receiver's relative sensitivity at
    /// an angle of arrival from 0 to π/2 rad; it must be smooth in the cosine of that angle.
    pub fn with_receiver_directivity(self, sensitivity: impl Fn(f64) -> f64) -> Self {
        let reception = Fit::new(&[], |cosine| sensitivity(cosine.acos()));
        Self { reception: Some(reception), ..self }
    }

    /// The same kernel with a share, 0 to 1, of a vibrating face's departure from its far field; 1 for a piston.
    ///
    /// This is the next term in a/d of the Rayleigh integral over a face of radius a: an excess path of a² (3 cos² θ - 1) / 8d.
    /// Its relative error is of the order of (ka sin θ)².
    pub fn with_near_field(self, near_field: f64) -> Self {
        Self { near_field, ..self }
    }

    /// The same kernel in another precision.
    pub fn with_precision(self, precision: Precision) -> Self {
        Self { precision, ..self }
    }

    /// The same kernel with the instructions of a set, which the processor must have: for tests and benchmarks.
    pub fn with_instructions(self, instructions: InstructionSet) -> Self {
        assert!(instructions.is_available(), "the processor has no {instructions:?}");
        Self { instructions, ..self }
    }

    /// The same with other phases of the drive, rad, one for each element.
    #[must_use]
    pub fn driven(mut self, phases_rad: &[f64]) -> Self {
        self.sources.iter_mut().for_each(|source| source.drive_rad = phases_rad[source.element]);
        self
    }

    /// The same sources elsewhere, each at the image of its place, and facing along the image of its axis.
    pub fn moved(&self, place: impl Fn(&Vec3) -> Vec3, axis: impl Fn(&Vec3) -> Vec3) -> Self {
        let mut moved = self.clone();
        for source in &mut moved.sources {
            source.centre_m = place(&source.centre_m);
            source.normal = axis(&source.normal);
        }
        moved
    }

    /// The field of one element alone.
    pub fn of_element(&self, element: usize) -> Self {
        self.of_elements(&[element])
    }

    /// The field of some elements alone, each named once.
    pub fn of_elements(&self, elements: &[usize]) -> Self {
        let of_them = self.sources.iter().filter(|source| elements.contains(&source.element));
        Self {
            sources: of_them.copied().collect(),
            elements: elements.len(),
            lobes: Arc::clone(&self.lobes),
            reception: self.reception.clone(),
            ..*self
        }
    }

    /// The complex field at each point. Behind an element's face it radiates nothing.
    pub fn at(&self, points_m: &[Vec3]) -> Vec<Complex64> {
        let mut fields = vec![Complex64::ZERO; points_m.len()];
        let write = |field: &mut Complex64, sums: &Sums, point| *field = sums.field(point);
        // Nearly every sum is over upright sources in plain air: it is compiled without the rest.
        if !self.is_upright() || !self.is_in_plain_air() {
            self.sum::<AnyField, _>(points_m, &mut fields, &write);
        } else if self.near_field != 0.0 {
            self.sum::<PlainNearField, _>(points_m, &mut fields, &write);
        } else if self.is_usual() && self.instructions != InstructionSet::Baseline {
            // Of arrays in place of vectors, the compiler makes slower code for this case.
            self.sum::<UsualField, _>(points_m, &mut fields, &write);
        } else {
            self.sum::<PlainField, _>(points_m, &mut fields, &write);
        }
        fields
    }

    /// The field at each point, and the sums of the squares of the elements' contributions.
    ///
    /// Each element is one part, also where its face is summed patch by patch.
    pub fn sums_at(&self, points_m: &[Vec3]) -> Vec<FieldSum> {
        if self.sources.len() > self.elements {
            return self.sums_of_whole_elements(points_m);
        }
        let mut sums_at = vec![FieldSum::default(); points_m.len()];
        let write = |sum: &mut FieldSum, sums: &Sums, point| {
            *sum = FieldSum {
                field: sums.field(point),
                incoherent_power: sums.power(point),
                square: sums.square(point),
            };
        };
        self.sum::<AnyFieldAndSquares, _>(points_m, &mut sums_at, &write);
        sums_at
    }

    fn sums_of_whole_elements(&self, points_m: &[Vec3]) -> Vec<FieldSum> {
        let mut sums = vec![FieldSum::default(); points_m.len()];
        for part in self.contributions_at(points_m) {
            for (sum, pressure) in sums.iter_mut().zip(part) {
                sum.field += pressure;
                sum.incoherent_power += pressure.norm_sqr();
                sum.square += pressure * pressure;
            }
        }
        sums
    }

    /// What each element adds to the field at each point, element by element.
    pub fn contributions_at(&self, points_m: &[Vec3]) -> Vec<Vec<Complex64>> {
        (0..self.elements).into_par_iter().map(|n| self.of_element(n).at(points_m)).collect()
    }

    /// Whether all sources face along z.
    fn is_upright(&self) -> bool {
        self.sources.iter().all(|source| source.normal == Vec3::z())
    }

    /// Whether it has the usual properties: sources that face along z, lobes without corners that are smooth in sin² θ, pressure that
    /// falls as one over the distance, path lengths at the observed point.
    fn is_usual(&self) -> bool {
        self.is_regular()
            && self.smooth == Smooth::InSineSquared
            && self.on_axis == OnAxis::Spherical
    }

    /// Whether it has these properties but for lobes that are smooth in tan(θ/2) and pressure that falls exponentially with height,
    /// as the thesis's transducer has them.
    fn is_thesis(&self) -> bool {
        self.is_regular()
            && self.smooth == Smooth::InHalfTangent
            && matches!(self.on_axis, OnAxis::Exponential { .. })
    }

    /// Whether sources face along z, lobes have no corners, and path lengths are those at the observed point.
    fn is_regular(&self) -> bool {
        self.is_upright()
            && self.lobes.iter().all(|lobes| lobes.directivity.is_smooth())
            && self.paths == PathLengths::Observed
    }

    /// Whether the air is still, uniform and clear, and the receiver is equally sensitive in all directions.
    fn is_in_plain_air(&self) -> bool {
        self.propagation.is_none() && self.reception.is_none()
    }

    /// Sums a case without derivatives in the kernel's precision, and writes what it gives at each point.
    fn sum<C: Case, O: Send>(
        &self,
        points_m: &[Vec3],
        out: &mut [O],
        write: &(impl Fn(&mut O, &Sums, usize) + Sync),
    ) {
        match self.precision {
            Precision::Single => {
                self.sum_tiles::<f32, C, O>(Differentiation::none(), points_m, out, write);
            }
            Precision::Double => {
                self.sum_tiles::<f64, C, O>(Differentiation::none(), points_m, out, write);
            }
        }
    }

    fn sum_tiles<T: Float, C: Case, O: Send>(
        &self,
        by: Differentiation<T>,
        points_m: &[Vec3],
        out: &mut [O],
        write: &(impl Fn(&mut O, &Sums, usize) + Sync),
    ) {
        let prepared = Prepared::new(self, by);
        out.par_chunks_mut(TILE).zip(points_m.par_chunks(TILE)).for_each(|(out, points_m)| {
            let surroundings = Surroundings::of(self, points_m);
            Sums::with_own(|sums| {
                self.instructions.run(TileSum::<T, C>::new(&prepared, &surroundings, sums));
                for (point, out) in out.iter_mut().enumerate() {
                    write(out, sums, point);
                }
            });
        });
    }
}

/// A function of the angle from an element's axis, as a polynomial in the transducer's variable, in which it is smooth except at
/// the transducer's corners. `tolerance` is relative to its largest value.
fn fit(
    tolerance: f64,
    transducer: &dyn Transducer,
    smooth: Smooth,
    of_angle: impl Fn(f64) -> f64,
) -> Fit {
    let variable = |theta_rad: f64| match smooth {
        Smooth::InSineSquared => theta_rad.sin().powi(2),
        Smooth::InCosine => theta_rad.cos(),
        Smooth::InHalfTangent => (0.5 * theta_rad).tan(),
    };
    let angle_rad = |variable: f64| match smooth {
        Smooth::InSineSquared => variable.sqrt().asin(),
        Smooth::InCosine => variable.acos(),
        Smooth::InHalfTangent => 2.0 * variable.atan(),
    };
    let mut corners: Vec<f64> = transducer.corners_rad().into_iter().map(variable).collect();
    corners.sort_by(f64::total_cmp);
    Fit::within(tolerance, &corners, |variable| of_angle(angle_rad(variable)))
}

#[cfg(test)]
mod tests;
