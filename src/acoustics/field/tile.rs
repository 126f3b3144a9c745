//! The sum over one tile of points.
//!
//! Points go through `W` at a time, and every source is added to them before the next ones come. Places are taken from a point
//! amid the tile, so that single precision spends its digits on the tile and not on the way to it.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::derivatives::{AT_ONCE, Slopes, variable_by_cosine};
use super::instruction_set::Vectorised;
use super::{FieldKernel, PathLengths, TILE};
use crate::acoustics::Vec3;
use crate::acoustics::lanes::Lanes;
use crate::acoustics::lobe::{Fit, Lobe};
use crate::acoustics::propagation::Air;
use crate::acoustics::real::Real;
use crate::acoustics::transducer::{OnAxis, Smooth};

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

/// A source as it stands to the middle of a tile.
#[derive(Clone, Copy)]
struct Near<T> {
    /// From the source to the tile's middle, m.
    offset: [T; 3],
    normal: [T; 3],
    /// Place of the source, m.
    centre: [T; 3],
    amplitude: T,
    /// Phase of the drive, rad.
    drive: T,
    /// Length of the path to the tile's middle, m: where path lengths are frozen, to below or above it.
    path: T,
    /// What its square as rounded lacks of the true square, m².
    lacking: T,
    /// Height of the path where it is frozen, m.
    rise: T,
    /// Phase at the tile's middle, half turns, -1 to 1.
    half_turns: T,
    lobe: usize,
    /// What the near field makes a path longer by on the axis, times its length, halved, m².
    near_field: T,
}

/// A tile's middle, and the sources as they stand to it.
pub(super) struct Surroundings<T> {
    middle_m: Vec3,
    near: Vec<Near<T>>,
}

impl<T> Default for Surroundings<T> {
    fn default() -> Self {
        Self { middle_m: Vec3::zeros(), near: Vec::new() }
    }
}

/// What is summed over a tile, point by point.
pub(super) struct Sums {
    pub real: [f64; TILE],
    pub imaginary: [f64; TILE],
    /// What the sources' parts have for a sum of squared magnitudes, and of squares, real and imaginary.
    pub power: [f64; TILE],
    pub square: [[f64; TILE]; 2],
    /// Real and imaginary parts of the derivatives.
    pub slopes: [[[f64; TILE]; 2]; AT_ONCE],
}

impl Default for Sums {
    fn default() -> Self {
        let none = [0.0; TILE];
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

    /// Places the sources about a tile of points.
    pub fn surround(
        &self,
        points_m: &[Vec3],
        Surroundings { middle_m, near }: &mut Surroundings<T>,
    ) {
        *middle_m = middle(points_m);
        let middle_m = *middle_m;
        let kernel = self.kernel;
        let amplitude = match kernel.on_axis {
            OnAxis::Exponential { amplitude, .. } | OnAxis::Absorbed { amplitude, .. } => amplitude,
            OnAxis::Spherical | OnAxis::Power { .. } => 1.0,
        };
        let lanes = |vector: Vec3| [T::of(vector.x), T::of(vector.y), T::of(vector.z)];
        near.clear();
        near.extend(kernel.sources.iter().map(|source| {
            let offset_m = middle_m - source.centre_m;
            let rise_m = match kernel.paths {
                PathLengths::Observed => offset_m.z,
                PathLengths::FrozenAt(height_m) => height_m - source.centre_m.z,
            };
            let square = offset_m.x * offset_m.x + offset_m.y * offset_m.y + rise_m * rise_m;
            let path = T::of(square.sqrt());
            let half_turns =
                (path.to_f64() * kernel.wavenumber_rad_m + source.drive_rad + source.own_rad) / PI;
            let turns = (0.5 * half_turns + f64::ROUNDER) - f64::ROUNDER;
            Near {
                offset: lanes(offset_m),
                normal: lanes(source.normal),
                centre: lanes(source.centre_m),
                amplitude: T::of(source.amplitude * amplitude),
                drive: T::of(source.drive_rad),
                path,
                lacking: T::of(square - path.to_f64() * path.to_f64()),
                rise: T::of(rise_m),
                half_turns: T::of(half_turns - 2.0 * turns),
                lobe: source.lobes,
                near_field: T::of(
                    kernel.near_field * kernel.lobes[source.lobes].radius_m.powi(2) / 8.0,
                ),
            }
        }));
    }
}

/// The middle of the box about points.
fn middle(points_m: &[Vec3]) -> Vec3 {
    // Boxes about every fourth point: one after the other, comparisons would wait for each other longer than sums do.
    let mut boxes = [[[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]]; 4];
    for four in points_m.chunks(4) {
        for ([low, high], point) in boxes.iter_mut().zip(four) {
            for axis in 0..3 {
                // As the processor's own least and greatest: what is no number is passed over.
                low[axis] = if point[axis] < low[axis] { point[axis] } else { low[axis] };
                high[axis] = if point[axis] > high[axis] { point[axis] } else { high[axis] };
            }
        }
    }
    let extremes = |axis: usize| {
        boxes.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], [low, high]| {
            [least.min(low[axis]), most.max(high[axis])]
        })
    };
    Vec3::from_fn(|axis, _| extremes(axis).iter().sum::<f64>() * 0.5)
}

/// Points at a time where there is more to a pair than the plain sum.
const NARROW: usize = 8;

/// The sums at every point of a tile, with derivatives by `N` parameters.
/// `NEAR` says whether faces have a near field, `PLAIN` that the air is still, even and clear and the receiver hears alike from
/// everywhere and, but for derivatives, that all sources look along z, `SQUARES` that powers and squares are summed too.
pub(super) struct SumTile<
    't,
    T,
    const PLAIN: bool,
    const NEAR: bool,
    const SQUARES: bool,
    const N: usize,
> {
    pub prepared: &'t Prepared<'t, T>,
    pub surroundings: &'t Surroundings<T>,
    pub points_m: &'t [Vec3],
    pub sums: &'t mut Sums,
}

impl<T: Real, const PLAIN: bool, const NEAR: bool, const SQUARES: bool, const N: usize> Vectorised
    for SumTile<'_, T, PLAIN, NEAR, SQUARES, N>
{
    #[inline(always)]
    fn run<const DOUBLE: usize, const SINGLE: usize, const FUSED: bool>(self) {
        // With air and reception beside, the registers of several bundles would not do.
        if !PLAIN {
            self.sum::<NARROW, FUSED>();
        } else if T::REFINED {
            self.sum::<SINGLE, FUSED>();
        } else {
            self.sum::<DOUBLE, FUSED>();
        }
    }
}

impl<T: Real, const PLAIN: bool, const NEAR: bool, const SQUARES: bool, const N: usize>
    SumTile<'_, T, PLAIN, NEAR, SQUARES, N>
{
    /// The sums at `W` points at a time.
    #[inline(always)]
    fn sum<const W: usize, const FUSED: bool>(self) {
        let Self { prepared, surroundings: Surroundings { middle_m, near }, points_m, sums } = self;
        for first in (0..points_m.len()).step_by(W) {
            let points_m = &points_m[first..points_m.len().min(first + W)];
            let mut step = [Lanes::<T, W, FUSED>::zero(); 3];
            for (lane, point_m) in points_m.iter().enumerate() {
                for axis in 0..3 {
                    step[axis].0[lane] = T::of(point_m[axis] - middle_m[axis]);
                }
            }
            let bundle = sum_bundle::<T, W, FUSED, PLAIN, NEAR, SQUARES, N>(prepared, near, step);
            for lane in 0..points_m.len() {
                let point = first + lane;
                sums.real[point] = bundle.real.0[lane].to_f64();
                sums.imaginary[point] = bundle.imaginary.0[lane].to_f64();
                if SQUARES {
                    sums.power[point] = bundle.power.0[lane].to_f64();
                    sums.square[0][point] = bundle.square[0].0[lane].to_f64();
                    sums.square[1][point] = bundle.square[1].0[lane].to_f64();
                }
                for (slopes, slope) in sums.slopes.iter_mut().zip(&bundle.slopes) {
                    slopes[0][point] = slope[0].0[lane].to_f64();
                    slopes[1][point] = slope[1].0[lane].to_f64();
                }
            }
        }
    }
}

/// The sums at `W` points.
struct Bundle<T, const W: usize, const FUSED: bool, const N: usize> {
    real: Lanes<T, W, FUSED>,
    imaginary: Lanes<T, W, FUSED>,
    power: Lanes<T, W, FUSED>,
    square: [Lanes<T, W, FUSED>; 2],
    slopes: [[Lanes<T, W, FUSED>; 2]; N],
}

/// One source and `W` points, as far as derivatives need them.
pub(super) struct Geometry<T, const W: usize, const F: bool> {
    pub along: [Lanes<T, W, F>; 3],
    pub normal: [T; 3],
    pub distance: Lanes<T, W, F>,
    pub inverse: Lanes<T, W, F>,
    pub cosine: Lanes<T, W, F>,
    pub variable: Lanes<T, W, F>,
    /// Law on the axis and amplitude, without the lobe.
    pub level: Lanes<T, W, F>,
    pub directivity: Lanes<T, W, F>,
    pub magnitude: Lanes<T, W, F>,
    /// Derivative of the lobe by the logarithm of the wavenumber.
    pub by_wavenumber: Lanes<T, W, F>,
    /// Derivative of the lobe by the cosine of the angle.
    pub slope: Lanes<T, W, F>,
    /// Relative change of the level by distance, and by height.
    pub by_distance: Lanes<T, W, F>,
    pub by_height: T,
    pub path: Lanes<T, W, F>,
    pub path_inverse: Lanes<T, W, F>,
    pub drive: T,
    pub lobe: usize,
    /// Whether the path's length does not depend on the point's height.
    pub frozen: bool,
}

impl<T: Real> Law<T> {
    /// The relative changes by distance and by height.
    #[inline(always)]
    fn rates<const W: usize, const F: bool>(self, inverse: Lanes<T, W, F>) -> (Lanes<T, W, F>, T) {
        match self {
            Self::Spherical => (Lanes::zero() - inverse, T::ZERO),
            Self::Exponential { per_m } => (Lanes::zero(), per_m),
            Self::Power { exponent } => (inverse * exponent, T::ZERO),
            Self::Absorbed { np_m } => (Lanes::splat(np_m) - inverse, T::ZERO),
        }
    }
}

/// The sum over all sources at points that lie `step` from the tile's middle.
#[inline(always)]
fn sum_bundle<
    T: Real,
    const W: usize,
    const FUSED: bool,
    const PLAIN: bool,
    const NEAR: bool,
    const SQUARES: bool,
    const N: usize,
>(
    prepared: &Prepared<T>,
    near: &[Near<T>],
    step: [Lanes<T, W, FUSED>; 3],
) -> Bundle<T, W, FUSED, N> {
    let zero = Lanes::zero();
    let mut sum = Bundle {
        real: zero,
        imaginary: zero,
        power: zero,
        square: [zero; 2],
        slopes: [[zero; 2]; N],
    };
    for source in near {
        let along = Lanes::moved(step, source.offset);
        let [x, y, z] = along;
        let across_square = x.mul_add(x, y.mul_add(y, Lanes::splat(T::TINY)));
        let (distance, inverse) = z.mul_add(z, across_square).root_and_reciprocal();
        let height = if PLAIN && N == 0 { z } else { Lanes::dot_add(along, source.normal, zero) };
        let cosine_of_angle = height * inverse;

        let variable = match prepared.kernel.smooth {
            Smooth::InCosine => cosine_of_angle,
            Smooth::InSineSquared => {
                cosine_of_angle.mul_sub_from(cosine_of_angle, Lanes::splat(T::ONE))
            }
            Smooth::InHalfTangent => half_tangent(along, source.normal, distance, height),
        };
        let lobe = &prepared.lobes[source.lobe];
        let [directivity, slope] =
            if N == 0 { [lobe.at(variable), zero] } else { lobe.with_slope(variable) };
        let on_axis = match prepared.on_axis {
            Law::Spherical => inverse,
            Law::Exponential { per_m } => (height * per_m).exp(),
            Law::Power { exponent } => (distance.ln() * exponent).exp(),
            Law::Absorbed { np_m } => (distance * np_m).exp() * inverse,
        };
        let level = (on_axis * source.amplitude).only_where(height, |height| height > T::ZERO);
        let mut magnitude = directivity * level;

        let (path, path_inverse, mut longer) = if prepared.frozen {
            let square = across_square + source.rise * source.rise;
            let (path, inverse) = square.root_and_reciprocal();
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
        if !PLAIN {
            if let Some(air) = &prepared.air {
                longer = path.mul_add(air.delay(source.centre, along, inverse), longer);
                magnitude = magnitude * air.transmission(distance);
            }
            if let Some(reception) = &prepared.reception {
                let arrival =
                    (z * inverse).map(|cosine| if cosine > T::ZERO { cosine } else { T::ZERO });
                magnitude = magnitude * reception.at(arrival);
            }
        }
        let half_turns =
            longer.scale_add(prepared.half_turns_per_m, Lanes::splat(source.half_turns));
        let (cosine, sine) = half_turns.cos_sin_half_turns();
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
            let (by_distance, by_height) = prepared.on_axis.rates(inverse);
            let geometry = Geometry {
                along,
                normal: source.normal,
                distance,
                inverse,
                cosine: cosine_of_angle,
                variable,
                level,
                directivity,
                magnitude,
                by_wavenumber: match prepared.kernel.smooth {
                    // D(ka sin θ) changes by k as by sin θ: twice v D'(v) for v = sin² θ.
                    Smooth::InSineSquared => (variable + variable) * slope,
                    Smooth::InCosine | Smooth::InHalfTangent => zero,
                },
                slope: slope
                    * variable_by_cosine(prepared.kernel.smooth, variable, cosine_of_angle),
                by_distance,
                by_height,
                path,
                path_inverse,
                drive: source.drive,
                lobe: source.lobe,
                frozen: prepared.frozen,
            };
            prepared.slopes.add(&geometry, [cosine, sine], &mut sum.slopes);
        }
    }
    sum
}

/// tan(θ/2) = ρ/(d + h), with ρ from its own components: d² - h² would lose half the digits near the axis.
#[inline(always)]
fn half_tangent<T: Real, const W: usize, const FUSED: bool>(
    along: [Lanes<T, W, FUSED>; 3],
    normal: [T; 3],
    distance: Lanes<T, W, FUSED>,
    height: Lanes<T, W, FUSED>,
) -> Lanes<T, W, FUSED> {
    let [x, y, z] = along;
    let [x, y, z] = [x - height * normal[0], y - height * normal[1], z - height * normal[2]];
    let off_axis = x.mul_add(x, y.mul_add(y, z.square())).root();
    (off_axis / (distance + height)).map(|t| if t < T::ONE { t } else { T::ONE })
}

/// How much longer a path is than the one to the tile's middle.
///
/// In single precision the difference of two lengths has lost the digits that both have in common; one step of Newton's
/// method for the difference brings them back: with the difference of the squares, s·(r + r₀) for a step s from r₀ to r, the
/// excess e solves e (e + 2 d₀) = s·(r + r₀).
#[inline(always)]
fn excess<T: Real, const W: usize, const FUSED: bool>(
    source: &Near<T>,
    step: [Lanes<T, W, FUSED>; 3],
    path: Lanes<T, W, FUSED>,
    inverse: Lanes<T, W, FUSED>,
    sum_of_ends: [Lanes<T, W, FUSED>; 3],
) -> Lanes<T, W, FUSED> {
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
    let limit = half * source.path;
    rough + (missing * inverse * half).only_where(rough, |rough| rough.abs() < limit)
}
