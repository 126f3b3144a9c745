//! The sum over sources at the points of one tile.
//!
//! The points of a bundle of vectors are summed together: every source is added to them before the next bundle begins. Places are
//! given relative to a point in the middle of the tile, so that single precision spends its digits on differences within the tile.

use std::cell::RefCell;
use std::f64::consts::PI;
use std::marker::PhantomData;

use num_complex::Complex64;

use super::case::Case;
use super::derivative_sums::{
    AT_ONCE, Contribution, DerivativeSums, Differentiation, by_angle_and_wavelength,
};
use super::instruction_set::Vectorised;
use super::on_axis_law::OnAxisLaw;
use super::ray::{Ray, excess, half_tangent};
use super::surroundings::{Near, ROOM, Surroundings};
use super::usual_derivatives::UsualDerivatives;
use super::{FieldKernel, PathLengths};
use crate::lobe::{Fit, Lobe};
use crate::propagation::Air;
use crate::simd::float::Float;
use crate::simd::{MAX_LANES, Registers, Simd, Vector};
use crate::transducer::Smooth;

/// A kernel with its coefficients in one precision.
pub(super) struct Prepared<'k, T> {
    kernel: &'k FieldKernel,
    /// Lobes of the sources, one for each radius.
    lobes: Vec<Lobe<T>>,
    reception: Option<Lobe<T>>,
    air: Option<Air<T>>,
    half_turns_per_m: T,
    on_axis: OnAxisLaw<T>,
    frozen: bool,
    /// What is differentiated by.
    by: Differentiation<T>,
}

impl<'k, T: Float> Prepared<'k, T> {
    pub fn new(kernel: &'k FieldKernel, by: Differentiation<T>) -> Self {
        Self {
            kernel,
            lobes: kernel.lobes.iter().map(|lobes| lobes.directivity.in_precision()).collect(),
            reception: kernel.reception.as_ref().map(Fit::in_precision),
            air: kernel.propagation.as_ref().map(Air::new),
            half_turns_per_m: T::of(kernel.wavenumber_rad_m / PI),
            on_axis: OnAxisLaw::new(kernel.on_axis),
            frozen: kernel.paths != PathLengths::Observed,
            by,
        }
    }

    #[inline(always)]
    fn smooth<C: Case>(&self) -> Smooth {
        if C::USUAL {
            Smooth::InSineSquared
        } else if C::THESIS {
            Smooth::InHalfTangent
        } else {
            self.kernel.smooth
        }
    }

    #[inline(always)]
    fn law<C: Case>(&self) -> OnAxisLaw<T> {
        match self.on_axis {
            _ if C::USUAL => OnAxisLaw::Spherical,
            OnAxisLaw::Exponential { per_m } if C::THESIS => OnAxisLaw::Exponential { per_m },
            _ if C::THESIS => unreachable!("the case is chosen by the law"),
            law => law,
        }
    }

    /// The directivity of a source and, where derivatives are summed, its slope by the lobe's variable.
    #[inline(always)]
    fn directivity<V: Vector<T>, const L: usize, C: Case>(
        &self,
        source: &Near<T>,
        variable: Simd<T, V, L>,
    ) -> [Simd<T, V, L>; 2] {
        let lobe = &self.lobes[source.lobe];
        if C::USUAL {
            [lobe.smooth_at(variable), Simd::zero()]
        } else if C::THESIS {
            lobe.smooth_with_slope(variable)
        } else if C::DERIVATIVES {
            lobe.with_slope(variable)
        } else {
            [lobe.at(variable), Simd::zero()]
        }
    }

    /// The sums with derivatives in the usual case.
    #[inline(always)]
    fn usual_derivatives<V: Vector<T>, const L: usize>(
        &self,
        near: &[Near<T>],
        step: [Simd<T, V, L>; 3],
    ) -> Bundle<T, V, L> {
        let usual = UsualDerivatives {
            lobes: &self.lobes,
            half_turns_per_m: self.half_turns_per_m,
            wavenumber_rad_m: T::of(self.kernel.wavenumber_rad_m),
        };
        let ([real, imaginary], derivatives) = usual.sum(near, step);
        Bundle { real, imaginary, derivatives, ..Bundle::zero() }
    }

    /// What the air lets through and how sensitive the receiver is, for a magnitude.
    #[inline(always)]
    fn received<V: Vector<T>, const L: usize, C: Case>(
        &self,
        mut magnitude: Simd<T, V, L>,
        z: Simd<T, V, L>,
        distance: Simd<T, V, L>,
        inverse: Simd<T, V, L>,
    ) -> Simd<T, V, L> {
        if !C::PLAIN_AIR {
            if let Some(air) = &self.air {
                magnitude = magnitude * air.transmission(distance);
            }
            if let Some(reception) = &self.reception {
                magnitude = magnitude * reception.at((z * inverse).at_least(T::ZERO));
            }
        }
        magnitude
    }
}

/// Vectors at a time with air and reception, which need all registers for themselves at any number of vectors.
const WITH_AIR: usize = 4;

/// Vectors at a time with four derivatives: of each, sums alone take ten registers. With 32 registers, the kernel of the usual case
/// works on two sources at once in place of two vectors.
const WITH_DERIVATIVES: usize = 2;
const WITH_TWO_SOURCES: usize = 1;

/// The sums of one case at every point of a tile.
pub(super) struct TileSum<'t, T, C> {
    prepared: &'t Prepared<'t, T>,
    surroundings: &'t Surroundings<T>,
    sums: &'t mut Sums,
    case: PhantomData<C>,
}

impl<'t, T: Float, C: Case> TileSum<'t, T, C> {
    pub fn new(
        prepared: &'t Prepared<'t, T>,
        surroundings: &'t Surroundings<T>,
        sums: &'t mut Sums,
    ) -> Self {
        Self { prepared, surroundings, sums, case: PhantomData }
    }

    /// The sums, `L` vectors of points at a time.
    #[inline(always)]
    fn sum<V: Vector<T>, const L: usize>(self) {
        const { assert!(Simd::<T, V, L>::COUNT <= MAX_LANES) };
        let Surroundings { points, steps: [x, y, z], near } = self.surroundings;
        for first in (0..*points).step_by(Simd::<T, V, L>::COUNT) {
            let step = [Simd::load(&x[first..]), Simd::load(&y[first..]), Simd::load(&z[first..])];
            let bundle = if C::USUAL && C::DERIVATIVES {
                self.prepared.usual_derivatives(near, step)
            } else {
                sum_bundle::<T, V, L, C>(self.prepared, near, step)
            };
            bundle.store::<C>(self.sums, first);
        }
    }
}

impl<T: Float, C: Case> Vectorised for TileSum<'_, T, C> {
    #[inline(always)]
    fn run<R: Registers, const VECTORS: usize>(self) {
        if C::USUAL && C::DERIVATIVES {
            if <T::In<R>>::MANY_REGISTERS {
                self.sum::<T::In<R>, WITH_TWO_SOURCES>();
            } else {
                self.sum::<T::In<R>, WITH_DERIVATIVES>();
            }
        } else if C::THESIS {
            self.sum::<T::In<R>, WITH_DERIVATIVES>();
        } else if C::PLAIN_AIR {
            self.sum::<T::In<R>, VECTORS>();
        } else {
            self.sum::<T::In<R>, WITH_AIR>();
        }
    }
}

/// The sum over all sources at points that lie `step` from the tile's middle.
#[inline(always)]
fn sum_bundle<T: Float, V: Vector<T>, const L: usize, C: Case>(
    prepared: &Prepared<T>,
    near: &[Near<T>],
    step: [Simd<T, V, L>; 3],
) -> Bundle<T, V, L> {
    let mut sum = Bundle::zero();
    let Some(first) = near.first() else { return sum };
    let (smooth, law) = (prepared.smooth::<C>(), prepared.law::<C>());
    let frozen = !C::USUAL && !C::THESIS && prepared.frozen;
    let z_axis = [T::ZERO, T::ZERO, T::ONE];
    // Where roots are slow, the processor computes those of the next source while it adds this one.
    let mut next = Ray::new(first, step);
    for (n, source) in near.iter().enumerate() {
        if !V::SLOW_ROOTS {
            next = Ray::new(source, step);
        }
        let Ray { along, across_square, distance, inverse, inverse_square } = next;
        if V::SLOW_ROOTS {
            next = Ray::new(near.get(n + 1).unwrap_or(source), step);
        }
        let normal = if C::UPRIGHT { z_axis } else { source.normal };
        let upright = C::UPRIGHT || (C::PLAIN_AIR && normal == z_axis);
        let height = if upright { along[2] } else { Simd::dot_add(along, normal, Simd::zero()) };
        let cosine_of_angle = height * inverse;

        let (path, path_inverse, mut excess_path) = if frozen {
            let square = across_square + source.rise * source.rise;
            let [path, inverse, _] = square.root_and_reciprocals();
            let [sx, sy, _] = Simd::moved(along, source.offset);
            (path, inverse, excess(source, step, path, inverse, [sx, sy, Simd::zero()]))
        } else {
            let sum_of_ends = Simd::moved(along, source.offset);
            (distance, inverse, excess(source, step, distance, inverse, sum_of_ends))
        };
        if C::NEAR_FIELD {
            let beside_axis = cosine_of_angle.square() * T::of(3.0) - T::ONE;
            excess_path = (beside_axis * source.near_field).mul_add(inverse, excess_path);
        }
        if !C::PLAIN_AIR
            && let Some(air) = &prepared.air
        {
            excess_path = path.mul_add(air.delay(source.centre, along, inverse), excess_path);
        }
        let half_turns =
            excess_path.scale_add(prepared.half_turns_per_m, Simd::splat(source.half_turns));
        // The sign that cosine and sine have in common goes to the level and all that is computed from it.
        let [cosine, sine, odd] = half_turns.cos_sin_half_turns();

        let variable = match smooth {
            Smooth::InCosine => cosine_of_angle,
            Smooth::InSineSquared if upright => across_square * inverse_square,
            Smooth::InSineSquared => {
                cosine_of_angle.mul_sub_from(cosine_of_angle, Simd::splat(T::ONE))
            }
            Smooth::InHalfTangent => half_tangent(along, normal, distance, height),
        };
        let [directivity, slope] = prepared.directivity::<V, L, C>(source, variable);
        let level = law.level(distance, inverse, height) * source.amplitude;
        let level = level.only_where_above(height, T::ZERO).negated_if_odd(odd);
        let magnitude =
            prepared.received::<V, L, C>(directivity * level, along[2], distance, inverse);
        sum.add::<C>(magnitude, [cosine, sine]);
        if C::DERIVATIVES {
            let (fall, by_height) = law.rates(inverse);
            let [by_cosine, by_wavelength] =
                by_angle_and_wavelength(smooth, level * slope, variable, cosine_of_angle);
            let contribution = Contribution {
                along,
                normal,
                distance,
                inverse,
                cosine: cosine_of_angle,
                variable,
                level,
                magnitude,
                by_wavelength,
                by_cosine,
                fall,
                by_height,
                path,
                path_inverse,
                drive: source.drive,
                lobe: source.lobe,
                frozen,
            };
            prepared.by.add::<V, L, C>(&contribution, [cosine, sine], &mut sum.derivatives);
        }
    }
    sum
}

/// The sums at the points of `L` vectors.
struct Bundle<T, V, const L: usize> {
    real: Simd<T, V, L>,
    imaginary: Simd<T, V, L>,
    power: Simd<T, V, L>,
    square: [Simd<T, V, L>; 2],
    derivatives: DerivativeSums<T, V, L>,
}

impl<T: Float, V: Vector<T>, const L: usize> Bundle<T, V, L> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = Simd::zero();
        Self {
            real: zero,
            imaginary: zero,
            power: zero,
            square: [zero; 2],
            derivatives: [[zero; 2]; AT_ONCE],
        }
    }

    /// Adds a source's magnitude times the cosine and sine of its phase.
    #[inline(always)]
    fn add<C: Case>(&mut self, magnitude: Simd<T, V, L>, [cosine, sine]: [Simd<T, V, L>; 2]) {
        self.real = magnitude.mul_add(cosine, self.real);
        self.imaginary = magnitude.mul_add(sine, self.imaginary);
        if C::SQUARES {
            let [real, imaginary] = [magnitude * cosine, magnitude * sine];
            let [real_square, imaginary_square] = [real.square(), imaginary.square()];
            self.power = self.power + real_square + imaginary_square;
            self.square[0] = self.square[0] + real_square - imaginary_square;
            self.square[1] = (real + real).mul_add(imaginary, self.square[1]);
        }
    }

    /// Writes the sums out, from the tile's point `first` on.
    #[inline(always)]
    fn store<C: Case>(self, sums: &mut Sums, first: usize) {
        store_pair([self.real, self.imaginary], &mut sums.field, first);
        if C::SQUARES {
            store(self.power, &mut sums.power, first);
            store_pair(self.square, &mut sums.square, first);
        }
        if C::DERIVATIVES {
            store_pair(self.derivatives[0], &mut sums.derivatives[0], first);
            store_pair(self.derivatives[1], &mut sums.derivatives[1], first);
            store_pair(self.derivatives[2], &mut sums.derivatives[2], first);
            store_pair(self.derivatives[3], &mut sums.derivatives[3], first);
        }
    }
}

#[inline(always)]
fn store_pair<T: Float, V: Vector<T>, const L: usize>(
    [real, imaginary]: [Simd<T, V, L>; 2],
    to: &mut [[f64; ROOM]; 2],
    first: usize,
) {
    store(real, &mut to[0], first);
    store(imaginary, &mut to[1], first);
}

/// Writes vectors out in double precision, from a place on.
#[inline(always)]
fn store<T: Float, V: Vector<T>, const L: usize>(
    vectors: Simd<T, V, L>,
    to: &mut [f64; ROOM],
    first: usize,
) {
    vectors.store_doubles(&mut to[first..]);
}

/// What is summed over a tile, point by point; of pairs, the first is the real part and the second the imaginary.
pub(super) struct Sums {
    field: [[f64; ROOM]; 2],
    /// The sources' squared magnitudes.
    power: [f64; ROOM],
    /// The squares of the sources' contributions.
    square: [[f64; ROOM]; 2],
    /// Derivatives by each parameter.
    derivatives: [[[f64; ROOM]; 2]; AT_ONCE],
}

thread_local! {
    /// To clear tens of kilobytes for each sum would take longer than to sum at a few points.
    static OWN: RefCell<Sums> = const { RefCell::new(Sums::ZERO) };
}

impl Sums {
    const ZERO: Self = {
        let none = [0.0; ROOM];
        Self { field: [none; 2], power: none, square: [none; 2], derivatives: [[none; 2]; AT_ONCE] }
    };

    /// With the thread's own, which hold what was summed before.
    pub fn with_own(work: impl FnOnce(&mut Self)) {
        OWN.with_borrow_mut(work);
    }

    pub fn field(&self, point: usize) -> Complex64 {
        complex(&self.field, point)
    }

    pub fn power(&self, point: usize) -> f64 {
        self.power[point]
    }

    pub fn square(&self, point: usize) -> Complex64 {
        complex(&self.square, point)
    }

    pub fn derivatives(&self, point: usize) -> [Complex64; AT_ONCE] {
        std::array::from_fn(|n| complex(&self.derivatives[n], point))
    }
}

fn complex([real, imaginary]: &[[f64; ROOM]; 2], point: usize) -> Complex64 {
    Complex64::new(real[point], imaginary[point])
}
