//! The sum over one tile of points.
//!
//! Points go through some vectors at a time, and every source is added to them before the next ones come. Places are taken from a
//! point amid the tile, so that single precision spends its digits on the tile and not on the way to it.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::derivatives::{AT_ONCE, Slopes, by_angle_and_wavelength};
use super::instruction_set::Vectorised;
use super::surroundings::{Near, ROOM, Surroundings};
use super::{FieldKernel, PathLengths};
use crate::lanes::{Lanes, MOST_LANES, Registers, Vector};
use crate::lobe::{Fit, Lobe};
use crate::propagation::Air;
use crate::real::Real;
use crate::transducer::{OnAxis, Smooth};

/// A kernel written out in one precision.
pub(super) struct Prepared<'k, T> {
    kernel: &'k FieldKernel,
    /// Lobes of the elements, one for each radius.
    lobes: Vec<Lobe<T>>,
    reception: Option<Lobe<T>>,
    air: Option<Air<T>>,
    half_turns_per_m: T,
    on_axis: Law<T>,
    frozen: bool,
    slopes: Slopes<T>,
}

/// [`OnAxis`] in one precision, without its amplitude.
#[derive(Clone, Copy)]
enum Law<T> {
    Spherical,
    Exponential { per_m: T },
    Power { exponent: T },
    Absorbed { np_m: T },
}

/// What is summed over a tile, point by point.
pub(super) struct Sums {
    pub real: [f64; ROOM],
    pub imaginary: [f64; ROOM],
    /// What the sources' parts have for a sum of squared magnitudes, and of squares, real and imaginary.
    pub power: [f64; ROOM],
    pub square: [[f64; ROOM]; 2],
    /// Real and imaginary parts of the derivatives.
    pub slopes: [[[f64; ROOM]; 2]; AT_ONCE],
}

impl Default for Sums {
    fn default() -> Self {
        let none = [0.0; ROOM];
        Self {
            real: none,
            imaginary: none,
            power: none,
            square: [none; 2],
            slopes: [[none; 2]; AT_ONCE],
        }
    }
}

impl Sums {
    pub fn field(&self, point: usize) -> Complex64 {
        Complex64::new(self.real[point], self.imaginary[point])
    }
}

impl<'k, T: Real> Prepared<'k, T> {
    pub fn new(kernel: &'k FieldKernel, slopes: Slopes<T>) -> Self {
        Self {
            kernel,
            lobes: kernel.lobes.iter().map(|lobes| lobes.directivity.written_out()).collect(),
            reception: kernel.reception.as_ref().map(Fit::written_out),
            air: kernel.propagation.as_ref().map(Air::new),
            half_turns_per_m: T::of(kernel.wavenumber_rad_m / PI),
            on_axis: match kernel.on_axis {
                OnAxis::Spherical => Law::Spherical,
                OnAxis::Exponential { decay_per_m, .. } => {
                    Law::Exponential { per_m: T::of(-decay_per_m) }
                }
                OnAxis::Power { exponent } => Law::Power { exponent: T::of(-exponent) },
                OnAxis::Absorbed { attenuation_np_m, .. } => {
                    Law::Absorbed { np_m: T::of(-attenuation_np_m) }
                }
            },
            frozen: kernel.paths != PathLengths::Observed,
            slopes,
        }
    }
}

/// Vectors at a time with air and reception beside, which leave no registers to any number of them.
const BESIDE_AIR: usize = 4;

/// Vectors at a time with four derivatives, whose sums alone take eight registers a vector.
const WITH_SLOPES: usize = 2;

/// The sums at every point of a tile, with derivatives by `N` parameters.
/// `NEAR` says whether faces have a near field, `PLAIN` that the air is still, even and clear and the receiver hears alike from
/// everywhere and, but for derivatives, that all sources look along z, `SQUARES` that powers and squares are summed too, `USUAL`
/// that all is as [`FieldKernel::is_usual`] says, so that nothing of it is looked up source by source.
pub(super) struct SumTile<
    't,
    T,
    const PLAIN: bool,
    const NEAR: bool,
    const SQUARES: bool,
    const N: usize,
    const USUAL: bool,
> {
    pub prepared: &'t Prepared<'t, T>,
    pub surroundings: &'t Surroundings<T>,
    pub sums: &'t mut Sums,
}

impl<
    T: Real,
    const PLAIN: bool,
    const NEAR: bool,
    const SQUARES: bool,
    const N: usize,
    const USUAL: bool,
> Vectorised for SumTile<'_, T, PLAIN, NEAR, SQUARES, N, USUAL>
{
    #[inline(always)]
    fn run<R: Registers, const VECTORS: usize>(self) {
        if USUAL {
            self.sum::<T::In<R>, WITH_SLOPES>();
        } else if PLAIN {
            self.sum::<T::In<R>, VECTORS>();
        } else {
            self.sum::<T::In<R>, BESIDE_AIR>();
        }
    }
}

impl<
    T: Real,
    const PLAIN: bool,
    const NEAR: bool,
    const SQUARES: bool,
    const N: usize,
    const USUAL: bool,
> SumTile<'_, T, PLAIN, NEAR, SQUARES, N, USUAL>
{
    /// The sums, `L` vectors of points at a time.
    #[inline(always)]
    fn sum<V: Vector<T>, const L: usize>(self) {
        const { assert!(Lanes::<T, V, L>::COUNT <= MOST_LANES) };
        let Self { prepared, surroundings: Surroundings { points, steps, near }, sums } = self;
        for first in (0..*points).step_by(Lanes::<T, V, L>::COUNT) {
            let [x, y, z] = steps;
            let step =
                [Lanes::load(&x[first..]), Lanes::load(&y[first..]), Lanes::load(&z[first..])];
            let bundle =
                sum_bundle::<T, V, L, PLAIN, NEAR, SQUARES, N, USUAL>(prepared, near, step);
            put(bundle.real, &mut sums.real[first..]);
            put(bundle.imaginary, &mut sums.imaginary[first..]);
            if SQUARES {
                put(bundle.power, &mut sums.power[first..]);
                put(bundle.square[0], &mut sums.square[0][first..]);
                put(bundle.square[1], &mut sums.square[1][first..]);
            }
            for (slopes, slope) in sums.slopes.iter_mut().zip(&bundle.slopes) {
                put(slope[0], &mut slopes[0][first..]);
                put(slope[1], &mut slopes[1][first..]);
            }
        }
    }
}

/// Writes lanes out.
#[inline(always)]
fn put<T: Real, V: Vector<T>, const L: usize>(lanes: Lanes<T, V, L>, to: &mut [f64]) {
    let mut numbers = [T::ZERO; MOST_LANES];
    lanes.store(&mut numbers);
    for (to, number) in to.iter_mut().zip(&numbers[..Lanes::<T, V, L>::COUNT]) {
        *to = number.to_f64();
    }
}

/// The sums at the points of `L` vectors.
struct Bundle<T, V, const L: usize, const N: usize> {
    real: Lanes<T, V, L>,
    imaginary: Lanes<T, V, L>,
    power: Lanes<T, V, L>,
    square: [Lanes<T, V, L>; 2],
    slopes: [[Lanes<T, V, L>; 2]; N],
}

/// One source and the points of `L` vectors, as far as derivatives need them.
pub(super) struct Geometry<T, V, const L: usize> {
    pub along: [Lanes<T, V, L>; 3],
    pub normal: [T; 3],
    pub distance: Lanes<T, V, L>,
    pub inverse: Lanes<T, V, L>,
    pub cosine: Lanes<T, V, L>,
    pub variable: Lanes<T, V, L>,
    /// Law on the axis and amplitude, without the lobe.
    pub level: Lanes<T, V, L>,
    pub magnitude: Lanes<T, V, L>,
    /// Derivative of the magnitude by the logarithm of the wavelength.
    pub by_wavelength: Lanes<T, V, L>,
    /// Derivative of the magnitude by the cosine of the angle.
    pub by_cosine: Lanes<T, V, L>,
    /// Relative fall of the level by distance, and its relative change by height.
    pub fall: Lanes<T, V, L>,
    pub by_height: T,
    pub path: Lanes<T, V, L>,
    pub path_inverse: Lanes<T, V, L>,
    pub drive: T,
    pub lobe: usize,
    /// Whether the path's length does not depend on the point's height.
    pub frozen: bool,
}

impl<T: Real> Law<T> {
    /// The relative fall by distance and the relative change by height.
    #[inline(always)]
    fn rates<V: Vector<T>, const L: usize>(self, inverse: Lanes<T, V, L>) -> (Lanes<T, V, L>, T) {
        match self {
            Self::Spherical => (inverse, T::ZERO),
            Self::Exponential { per_m } => (Lanes::zero(), per_m),
            Self::Power { exponent } => (inverse * (T::ZERO - exponent), T::ZERO),
            Self::Absorbed { np_m } => (inverse - np_m, T::ZERO),
        }
    }
}

/// The way from a source to points.
#[derive(Clone, Copy)]
struct Way<T, V, const L: usize> {
    along: [Lanes<T, V, L>; 3],
    /// Its square but for the part along z.
    across_square: Lanes<T, V, L>,
    distance: Lanes<T, V, L>,
    /// One over the distance, and over its square.
    inverse: Lanes<T, V, L>,
    inverse_square: Lanes<T, V, L>,
}

impl<T: Real, V: Vector<T>, const L: usize> Way<T, V, L> {
    #[inline(always)]
    fn new(source: &Near<T>, step: [Lanes<T, V, L>; 3]) -> Self {
        let along = Lanes::moved(step, source.offset);
        let [x, y, z] = along;
        let across_square = x.mul_add(x, y.mul_add(y, Lanes::splat(T::TINY)));
        let [distance, inverse, inverse_square] =
            z.mul_add(z, across_square).root_and_reciprocals();
        Self { along, across_square, distance, inverse, inverse_square }
    }
}

/// The sum over all sources at points that lie `step` from the tile's middle.
#[inline(always)]
fn sum_bundle<
    T: Real,
    V: Vector<T>,
    const L: usize,
    const PLAIN: bool,
    const NEAR: bool,
    const SQUARES: bool,
    const N: usize,
    const USUAL: bool,
>(
    prepared: &Prepared<T>,
    near: &[Near<T>],
    step: [Lanes<T, V, L>; 3],
) -> Bundle<T, V, L, N> {
    let zero = Lanes::zero();
    let mut sum = Bundle {
        real: zero,
        imaginary: zero,
        power: zero,
        square: [zero; 2],
        slopes: [[zero; 2]; N],
    };
    let Some(first) = near.first() else { return sum };
    let upwards = [T::ZERO, T::ZERO, T::ONE];
    let smooth = if USUAL { Smooth::InSineSquared } else { prepared.kernel.smooth };
    let law = if USUAL { Law::Spherical } else { prepared.on_axis };
    let frozen = !USUAL && prepared.frozen;
    // Root and division are slow: the processor does those of the next source while it sums this one.
    let mut ahead = Way::new(first, step);
    for (n, source) in near.iter().enumerate() {
        let Way { along, across_square, distance, inverse, inverse_square } = ahead;
        ahead = Way::new(near.get(n + 1).unwrap_or(source), step);
        let z = along[2];
        let normal = if USUAL { upwards } else { source.normal };
        let upright = PLAIN && (N == 0 || normal == upwards);
        let height = if upright { z } else { Lanes::dot_add(along, normal, zero) };
        let cosine_of_angle = height * inverse;

        let (path, path_inverse, mut longer) = if frozen {
            let square = across_square + source.rise * source.rise;
            let [path, inverse, _] = square.root_and_reciprocals();
            let [sx, sy, _] = Lanes::moved(along, source.offset);
            (path, inverse, excess(source, step, path, inverse, [sx, sy, zero]))
        } else {
            let sum_of_ends = Lanes::moved(along, source.offset);
            (distance, inverse, excess(source, step, distance, inverse, sum_of_ends))
        };
        if NEAR {
            let beside_axis = cosine_of_angle.square() * T::of(3.0) - T::ONE;
            longer = (beside_axis * source.near_field).mul_add(inverse, longer);
        }
        if !PLAIN && let Some(air) = &prepared.air {
            longer = path.mul_add(air.delay(source.centre, along, inverse), longer);
        }
        let half_turns =
            longer.scale_add(prepared.half_turns_per_m, Lanes::splat(source.half_turns));
        // The sign goes to the magnitude and all that comes of it.
        let [cosine, sine, odd] = half_turns.cos_sin_half_turns();

        let variable = match smooth {
            Smooth::InCosine => cosine_of_angle,
            Smooth::InSineSquared if upright => across_square * inverse_square,
            Smooth::InSineSquared => {
                cosine_of_angle.mul_sub_from(cosine_of_angle, Lanes::splat(T::ONE))
            }
            Smooth::InHalfTangent => half_tangent(along, normal, distance, height),
        };
        let lobe = &prepared.lobes[source.lobe];
        let [directivity, slope] = if USUAL {
            lobe.smooth_with_slope(variable)
        } else if N > 0 {
            lobe.with_slope(variable)
        } else {
            [lobe.at(variable), zero]
        };
        let on_axis = match law {
            Law::Spherical => inverse,
            Law::Exponential { per_m } => (height * per_m).exp(),
            Law::Power { exponent } => (distance.ln() * exponent).exp(),
            Law::Absorbed { np_m } => (distance * np_m).exp() * inverse,
        };
        let level = (on_axis * source.amplitude).only_where_above(height, T::ZERO);
        let level = level.negated_if_odd(odd);
        let mut magnitude = directivity * level;

        if !PLAIN {
            if let Some(air) = &prepared.air {
                magnitude = magnitude * air.transmission(distance);
            }
            if let Some(reception) = &prepared.reception {
                magnitude = magnitude * reception.at((z * inverse).at_least(T::ZERO));
            }
        }
        sum.real = magnitude.mul_add(cosine, sum.real);
        sum.imaginary = magnitude.mul_add(sine, sum.imaginary);
        if SQUARES {
            let [real, imaginary] = [magnitude * cosine, magnitude * sine];
            let [real_square, imaginary_square] = [real.square(), imaginary.square()];
            sum.power = sum.power + real_square + imaginary_square;
            sum.square[0] = sum.square[0] + real_square - imaginary_square;
            sum.square[1] = (real + real).mul_add(imaginary, sum.square[1]);
        }
        if N > 0 {
            let (fall, by_height) = law.rates(inverse);
            let [by_cosine, by_wavelength] =
                by_angle_and_wavelength(smooth, level * slope, variable, cosine_of_angle);
            let geometry = Geometry {
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
            prepared.slopes.add::<V, L, N, USUAL>(&geometry, [cosine, sine], &mut sum.slopes);
        }
    }
    sum
}

/// tan(θ/2) = ρ/(d + h), with ρ from its own components: d² - h² would lose half the digits near the axis.
#[inline(always)]
fn half_tangent<T: Real, V: Vector<T>, const L: usize>(
    along: [Lanes<T, V, L>; 3],
    normal: [T; 3],
    distance: Lanes<T, V, L>,
    height: Lanes<T, V, L>,
) -> Lanes<T, V, L> {
    let [x, y, z] = along;
    let [x, y, z] = [x - height * normal[0], y - height * normal[1], z - height * normal[2]];
    let off_axis = x.mul_add(x, y.mul_add(y, z.square())).root();
    (off_axis / (distance + height)).at_most(T::ONE)
}

/// How much longer a path is than the one to the tile's middle.
///
/// In single precision the difference of two lengths has lost the digits that both have in common; one step of Newton's
/// method for the difference brings them back: with the difference of the squares, s·(r + r₀) for a step s from r₀ to r, the
/// excess e solves e (e + 2 d₀) = s·(r + r₀).
#[inline(always)]
fn excess<T: Real, V: Vector<T>, const L: usize>(
    source: &Near<T>,
    step: [Lanes<T, V, L>; 3],
    path: Lanes<T, V, L>,
    inverse: Lanes<T, V, L>,
    sum_of_ends: [Lanes<T, V, L>; 3],
) -> Lanes<T, V, L> {
    let rough = path - source.path;
    if !T::REFINED {
        return rough;
    }
    let [x, y, z] = step;
    let [sx, sy, sz] = sum_of_ends;
    let squares = x.mul_add(sx, y.mul_add(sy, z.mul_add(sz, Lanes::splat(source.lacking))));
    let missing = rough.mul_sub_from(rough + (source.path + source.path), squares);
    let half = T::of(0.5);
    // Where the path is much shorter than that to the middle, the difference has all the digits it needs.
    let below = Lanes::splat(half * source.path) - rough.abs();
    rough + (missing * inverse * half).only_where_above(below, T::ZERO)
}
