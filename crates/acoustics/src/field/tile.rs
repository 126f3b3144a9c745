//! The sum over sources at the points of one tile.
//!
//! The points of a bundle of vectors are summed together: every source is added to them before the next bundle begins. Places are
//! given relative to a point in the middle of the tile, so that single precision spends its digits on differences within the tile.

use std::f64::consts::PI;
use std::marker::PhantomData;

use num_complex::Complex64;

use super::case::Case;
use super::derivative_sums::{AT_ONCE, Contribution, DerivativeSums, Differentiation};
use super::instruction_set::Vectorised;
use super::on_axis_law::OnAxisLaw;
use super::phasor::Phasor;
use super::ray::{Direction, Path, Ray};
use super::surroundings::{Near, ROOM, Surroundings};
use super::{FieldKernel, PathLengths};
use crate::float::Float;
use crate::lobe::{Fit, Lobe};
use crate::propagation::Air;
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
        if C::USUAL { Smooth::InSineSquared } else { self.kernel.smooth }
    }

    #[inline(always)]
    fn law<C: Case>(&self) -> OnAxisLaw<T> {
        if C::USUAL { OnAxisLaw::Spherical } else { self.on_axis }
    }

    /// The path that the phase of a source is computed for.
    #[inline(always)]
    fn path<V: Vector<T>, const L: usize, C: Case>(
        &self,
        source: &Near<T>,
        step: [Simd<T, V, L>; 3],
        ray: &Ray<T, V, L>,
        cosine: Simd<T, V, L>,
    ) -> Path<T, V, L> {
        let mut path = if !C::USUAL && self.frozen {
            Path::frozen(source, step, ray)
        } else {
            Path::observed(source, step, ray)
        };
        if C::NEAR_FIELD {
            let beside_axis = cosine.square() * T::of(3.0) - T::ONE;
            path.excess = (beside_axis * source.near_field).mul_add(ray.inverse, path.excess);
        }
        if !C::PLAIN_AIR
            && let Some(air) = &self.air
        {
            let delay = air.delay(source.centre, ray.along, ray.inverse);
            path.excess = path.length.mul_add(delay, path.excess);
        }
        path
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
            lobe.smooth_with_slope(variable)
        } else if C::DERIVATIVES {
            lobe.with_slope(variable)
        } else {
            [lobe.at(variable), Simd::zero()]
        }
    }

    /// What the air lets through and how sensitive the receiver is, for a magnitude.
    #[inline(always)]
    fn received<V: Vector<T>, const L: usize, C: Case>(
        &self,
        mut magnitude: Simd<T, V, L>,
        ray: &Ray<T, V, L>,
    ) -> Simd<T, V, L> {
        if !C::PLAIN_AIR {
            if let Some(air) = &self.air {
                magnitude = magnitude * air.transmission(ray.distance);
            }
            if let Some(reception) = &self.reception {
                let cosine_of_arrival = ray.along[2] * ray.inverse;
                magnitude = magnitude * reception.at(cosine_of_arrival.at_least(T::ZERO));
            }
        }
        magnitude
    }
}

/// Vectors at a time with air and reception, which need all registers for themselves at any number of vectors.
const WITH_AIR: usize = 4;

/// Vectors at a time with four derivatives, whose sums alone take eight registers a vector.
const WITH_DERIVATIVES: usize = 2;

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
            sum_bundle::<T, V, L, C>(self.prepared, near, step).store::<C>(self.sums, first);
        }
    }
}

impl<T: Float, C: Case> Vectorised for TileSum<'_, T, C> {
    #[inline(always)]
    fn run<R: Registers, const VECTORS: usize>(self) {
        if C::USUAL {
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
    // Root and division are slow: the processor computes those of the next source while it adds this one.
    let mut next = Ray::new(first, step);
    for (n, source) in near.iter().enumerate() {
        let ray = next;
        next = Ray::new(near.get(n + 1).unwrap_or(source), step);

        let direction = Direction::new::<C>(source, &ray);
        let path = prepared.path::<V, L, C>(source, step, &ray, direction.cosine);
        let half_turns =
            path.excess.scale_add(prepared.half_turns_per_m, Simd::splat(source.half_turns));
        // The sign that cosine and sine have in common goes to the level and all that is computed from it.
        let [cosine, sine, odd] = half_turns.cos_sin_half_turns();

        let variable = direction.variable(smooth, &ray);
        let [directivity, slope] = prepared.directivity::<V, L, C>(source, variable);
        let level = law.level(ray.distance, ray.inverse, direction.height) * source.amplitude;
        let level = level.only_where_above(direction.height, T::ZERO).negated_if_odd(odd);
        let magnitude = prepared.received::<V, L, C>(directivity * level, &ray);

        let phase = Phasor([cosine, sine]);
        sum.add::<C>(magnitude, phase);
        if C::DERIVATIVES {
            let by_variable = level * slope;
            let (fall, by_height) = law.rates(ray.inverse);
            let frozen = !C::USUAL && prepared.frozen;
            let contribution = Contribution {
                ray,
                direction,
                path,
                variable,
                level,
                magnitude,
                by_variable,
                fall,
                by_height,
                phase,
                frozen,
            };
            sum.derivatives.add::<C>(&prepared.by, smooth, source, &contribution);
        }
    }
    sum
}

/// The sums at the points of `L` vectors.
struct Bundle<T, V, const L: usize> {
    field: Phasor<T, V, L>,
    power: Simd<T, V, L>,
    square: [Simd<T, V, L>; 2],
    derivatives: DerivativeSums<T, V, L>,
}

impl<T: Float, V: Vector<T>, const L: usize> Bundle<T, V, L> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = Simd::zero();
        Self {
            field: Phasor::zero(),
            power: zero,
            square: [zero; 2],
            derivatives: DerivativeSums::zero(),
        }
    }

    /// Adds a source's magnitude times the cosine and sine of its phase.
    #[inline(always)]
    fn add<C: Case>(&mut self, magnitude: Simd<T, V, L>, phase: Phasor<T, V, L>) {
        self.field = self.field.plus(phase, magnitude);
        if C::SQUARES {
            let [real, imaginary] = phase.scaled(magnitude).0;
            let [real_square, imaginary_square] = [real.square(), imaginary.square()];
            self.power = self.power + real_square + imaginary_square;
            self.square[0] = self.square[0] + real_square - imaginary_square;
            self.square[1] = (real + real).mul_add(imaginary, self.square[1]);
        }
    }

    /// Writes the sums out, from the tile's point `first` on.
    #[inline(always)]
    fn store<C: Case>(self, sums: &mut Sums, first: usize) {
        store(self.field.0, &mut sums.field, first);
        if C::SQUARES {
            store([self.power], &mut sums.power, first);
            store(self.square, &mut sums.square, first);
        }
        if C::DERIVATIVES {
            for (sum, out) in self.derivatives.0.into_iter().zip(&mut sums.derivatives) {
                store(sum.0, out, first);
            }
        }
    }
}

/// Writes vectors out in double precision, from a place on.
#[inline(always)]
fn store<T: Float, V: Vector<T>, const L: usize, const N: usize>(
    from: [Simd<T, V, L>; N],
    to: &mut [[f64; ROOM]; N],
    first: usize,
) {
    for (vectors, to) in from.into_iter().zip(to) {
        let mut numbers = [T::ZERO; MAX_LANES];
        vectors.store(&mut numbers);
        for (to, number) in to[first..].iter_mut().zip(&numbers[..Simd::<T, V, L>::COUNT]) {
            *to = number.to_f64();
        }
    }
}

/// What is summed over a tile, point by point; of pairs, the first is the real part and the second the imaginary.
pub(super) struct Sums {
    field: [[f64; ROOM]; 2],
    /// The sources' squared magnitudes.
    power: [[f64; ROOM]; 1],
    /// The squares of the sources' contributions.
    square: [[f64; ROOM]; 2],
    /// Derivatives by each parameter.
    derivatives: [[[f64; ROOM]; 2]; AT_ONCE],
}

impl Default for Sums {
    fn default() -> Self {
        let none = [0.0; ROOM];
        Self {
            field: [none; 2],
            power: [none],
            square: [none; 2],
            derivatives: [[none; 2]; AT_ONCE],
        }
    }
}

impl Sums {
    pub fn field(&self, point: usize) -> Complex64 {
        complex(&self.field, point)
    }

    pub fn power(&self, point: usize) -> f64 {
        self.power[0][point]
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
