//! The field kernel: the complex sum over elements of amplitude times directivity times phase, at any points.
//!
//! For element n with centre c, normal m, drive w exp(i φ) and a point x, with r = x - c, d = |r|, h = r·m and θ the
//! angle between r and m:
//!
//! p(x) = Σ w A(d, h) D(θ) exp(i (k d + φ))
//!
//! D enters as a polynomial in a variable that needs neither arc tangent nor branch ([`Smooth`](super::transducer::Smooth)), so
//! that there is one path through the code for every transducer; a transducer that is more than one source, such as the
//! integral over a face, enters as its patches. Tiles of points are shared out over threads, and each point's sum runs in the elements'
//! order: the result does not depend on the number of threads.
//!
//! The sum itself stands in `field/tile.rs`.

mod derivatives;
mod instruction_set;
mod lattice;
mod plane;
mod resample;
mod surroundings;
mod tile;
mod transfer;

use num_complex::Complex64;
use rayon::prelude::*;

use derivatives::Slopes;
pub use derivatives::{FieldDerivatives, Parameter};
pub use instruction_set::InstructionSet;
pub use plane::{PLANE_TOLERANCE, PlaneMethod, PlaneSum};
pub use transfer::Transfer;

use super::lobe::{DOUBLE_TOLERANCE, Fit};
use super::propagation::Propagation;
use super::rayleigh::across;
use super::real::Real;
use super::transducer::{OnAxis, Smooth, Transducer};
use super::{Array, Vec3};
use surroundings::Surroundings;
use tile::{Prepared, SumTile, Sums};

/// Points that one task computes: small enough to share out a plane, large enough to pay for itself.
const TILE: usize = 512;

/// Where path lengths are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathLengths {
    /// At the observed point, as physics has it.
    Observed,
    /// As if every point lay at this height, metres: the thesis's simulator freezes its phases at the focus.
    FrozenAt(f64),
}

/// The digits that a sum is carried with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// `f32`: twice to three times as fast, within 1e-5 of the peak.
    Single,
    /// `f64`: within 1e-12 of the peak.
    Double,
}

/// An array, its drive and its transducer, ready to be summed at any points.
#[derive(Debug, Clone)]
pub struct FieldKernel {
    sources: Vec<Source>,
    elements: usize,
    lobes: Vec<Lobes>,
    smooth: Smooth,
    on_axis: OnAxis,
    wavenumber_rad_m: f64,
    paths: PathLengths,
    propagation: Option<Propagation>,
    /// The receiver's sensitivity, in the cosine of the angle of arrival.
    reception: Option<Fit>,
    /// How much of their faces' near field the elements have.
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
    /// Sum of the squares: of parts that turn at random by little, it says in which direction their sum wanders.
    pub square: Complex64,
}

/// What radiates from one place: an element, or a patch of one.
#[derive(Debug, Clone, Copy)]
struct Source {
    element: usize,
    centre_m: Vec3,
    normal: Vec3,
    amplitude: f64,
    /// What it is driven with.
    drive_rad: f64,
    /// Its own phase.
    own_rad: f64,
    lobes: usize,
}

/// What is summed: each is compiled by itself.
#[derive(Debug, Clone, Copy)]
enum Summed {
    PlainField,
    Field,
    FieldAndSquares,
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
            lobes,
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

    /// The same with another law on the axis.
    pub fn with_on_axis(self, on_axis: OnAxis) -> Self {
        Self { on_axis, ..self }
    }

    /// The same in air that bends, carries or attenuates the sound.
    pub fn through(self, propagation: Propagation) -> Self {
        let propagation = (propagation != Propagation::default()).then_some(propagation);
        Self { propagation, ..self }
    }

    /// The same field as a receiver that looks along -z reads it. `sensitivity` gives the receiver's relative sensitivity at
    /// an angle of arrival from 0 to π/2 rad; it must be smooth in the cosine of that angle.
    pub fn with_receiver_directivity(self, sensitivity: impl Fn(f64) -> f64) -> Self {
        let reception = Fit::new(&[], |cosine| sensitivity(cosine.acos()));
        Self { reception: Some(reception), ..self }
    }

    /// The same with a share of what a vibrating face's field departs from its far field by: 1 for a piston, 0 for none.
    ///
    /// Of the Rayleigh integral over a face of radius a, the next term in a/d: paths are longer by a² (3 cos² θ - 1) / 8d. It
    /// leaves an error of the order of (ka sin θ)² of itself.
    pub fn with_near_field(self, near_field: f64) -> Self {
        Self { near_field, ..self }
    }

    /// The same carried with other digits.
    pub fn in_precision(self, precision: Precision) -> Self {
        Self { precision, ..self }
    }

    /// The same by the instructions of a set, which the processor must have: for tests and benches.
    pub fn by(self, instructions: InstructionSet) -> Self {
        assert!(instructions.is_there(), "the processor has no {instructions:?}");
        Self { instructions, ..self }
    }

    /// The field of one element alone.
    pub fn of_element(&self, element: usize) -> Self {
        self.of_elements(&[element])
    }

    /// The field of some elements alone, each named once.
    pub fn of_elements(&self, elements: &[usize]) -> Self {
        let of_them = self.sources.iter().filter(|source| elements.contains(&source.element));
        Self { sources: of_them.copied().collect(), elements: elements.len(), ..self.clone() }
    }

    /// The complex field at each point. Behind an element's face it radiates nothing.
    pub fn at(&self, points_m: &[Vec3]) -> Vec<Complex64> {
        // An upright array in still, clear air and an even receiver are what nearly every sum is over: it is compiled without
        // the rest.
        let plain = self.is_upright() && self.is_in_plain_air();
        let what = if plain { Summed::PlainField } else { Summed::Field };
        let mut fields = vec![Complex64::ZERO; points_m.len()];
        self.sum(what, points_m, &mut fields, &|sums, lane| sums.field(lane));
        fields
    }

    /// The field at each point, and the sums of its parts' squares.
    ///
    /// Each element is one part, also where its face is summed patch by patch.
    pub fn sums_at(&self, points_m: &[Vec3]) -> Vec<FieldSum> {
        if self.sources.len() > self.elements {
            return self.sums_of_whole_elements(points_m);
        }
        let mut sums_at = vec![FieldSum::default(); points_m.len()];
        self.sum(Summed::FieldAndSquares, points_m, &mut sums_at, &|sums, lane| FieldSum {
            field: sums.field(lane),
            incoherent_power: sums.power[lane],
            square: Complex64::new(sums.square[0][lane], sums.square[1][lane]),
        });
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

    /// Whether all sources look along z.
    fn is_upright(&self) -> bool {
        self.sources.iter().all(|source| source.normal == Vec3::z())
    }

    /// Whether the air is still, even and clear, and the receiver hears alike from everywhere.
    fn is_in_plain_air(&self) -> bool {
        self.propagation.is_none() && self.reception.is_none()
    }

    fn sum<O: Send>(
        &self,
        what: Summed,
        points_m: &[Vec3],
        out: &mut [O],
        take: &(impl Fn(&Sums, usize) -> O + Sync),
    ) {
        match self.precision {
            Precision::Single => self.sum_in::<f32, O>(what, points_m, out, take),
            Precision::Double => self.sum_in::<f64, O>(what, points_m, out, take),
        }
    }

    fn sum_in<T: Real, O: Send>(
        &self,
        what: Summed,
        points_m: &[Vec3],
        out: &mut [O],
        take: &(impl Fn(&Sums, usize) -> O + Sync),
    ) {
        let prepared = Prepared::new(self, Slopes::<T>::none());
        out.par_chunks_mut(TILE).zip(points_m.par_chunks(TILE)).for_each_init(
            || (Sums::default(), Surroundings::default()),
            |(sums, surroundings), (out, points_m)| {
                surroundings.surround(self, points_m);
                let prepared = &prepared;
                let instructions = self.instructions;
                macro_rules! run {
                    ($plain:literal, $near:literal, $squares:literal) => {
                        instructions.run(SumTile::<T, $plain, $near, $squares, 0, false> {
                            prepared,
                            surroundings,
                            sums,
                        })
                    };
                }
                match (what, self.near_field != 0.0) {
                    (Summed::PlainField, false) => run!(true, false, false),
                    (Summed::PlainField, true) => run!(true, true, false),
                    (Summed::Field, _) => run!(false, true, false),
                    (Summed::FieldAndSquares, _) => run!(false, true, true),
                }
                for (lane, out) in out.iter_mut().enumerate() {
                    *out = take(sums, lane);
                }
            },
        );
    }
}

/// A function of the angle from an element's axis, known to `tolerance` of its largest value, in the variable in which it is
/// smooth but for the transducer's corners.
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
