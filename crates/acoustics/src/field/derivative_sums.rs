//! The sums of the field's derivatives over sources.
//!
//! With p = Σ m exp(i φ), dp/dq = Σ (dm/dq + i m dφ/dq) exp(i φ). The expensive terms, distances, lobes, sine and cosine, are those
//! of the field itself.

use super::case::Case;
use super::phasor::Phasor;
use super::{FieldKernel, fit};
use crate::lobe::{Fit, Lobe};
use crate::simd::float::Float;
use crate::simd::{Simd, Vector};
use crate::transducer::{Smooth, Transducer, Widened};

/// Parameters that are differentiated by at once.
pub(super) const AT_ONCE: usize = 4;

/// Relative accuracy of a lobe's derivative by its width, which is computed by differences.
const SLOPE_TOLERANCE: f64 = 1e-11;

/// What the field is differentiated by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Position of all points along x, per metre. Across a lobe's corner on its axis the derivative is taken as zero.
    X,
    /// Position of all points along y, per metre.
    Y,
    /// Position of all points along z, per metre.
    Z,
    /// Natural logarithm of the speed of sound, at constant phases of the drives.
    SoundSpeed,
    /// Natural logarithm of the frequency, at constant delays of the drives: their phases change in proportion.
    Frequency,
    /// The exponent n, where pressure falls as d^-n (also where n is 1).
    Spreading,
    /// Attenuation of the air, Np/m.
    Attenuation,
    /// Relative width of all lobes, their angles stretched.
    LobeWidth,
    /// Relative width of all lobes, their faces made smaller.
    LobeWidthByFace,
}

/// The parameters that are asked for most, in this order.
pub(super) const USUAL_PARAMETERS: [Parameter; AT_ONCE] =
    [Parameter::X, Parameter::Y, Parameter::Z, Parameter::SoundSpeed];

/// The parameters of a differentiation, and the slopes of the lobes by those that change lobes.
pub(super) struct Differentiation<T> {
    parameters: [Option<Parameter>; AT_ONCE],
    /// For each parameter: the derivative of each lobe by it.
    lobes: [Vec<Lobe<T>>; AT_ONCE],
    wavenumber_rad_m: T,
    /// Whether the lobes have a corner on their axis.
    corner_on_axis: bool,
}

impl<T: Float> Differentiation<T> {
    /// By no parameters.
    pub fn none() -> Self {
        Self {
            parameters: [None; AT_ONCE],
            lobes: std::array::from_fn(|_| Vec::new()),
            wavenumber_rad_m: T::ZERO,
            corner_on_axis: false,
        }
    }

    /// By the first [`AT_ONCE`] of some parameters, for a kernel that was made with `transducer`.
    pub fn new(
        kernel: &FieldKernel,
        transducer: &dyn Transducer,
        parameters: &[Parameter],
    ) -> Self {
        let parameters = std::array::from_fn(|n| parameters.get(n).copied());
        let lobes = parameters.map(|parameter| {
            let of_face = |radius_m| match parameter? {
                Parameter::LobeWidth => Some(by_width(kernel, transducer, radius_m, false)),
                Parameter::LobeWidthByFace => Some(by_width(kernel, transducer, radius_m, true)),
                _ => None,
            };
            let fits = kernel.lobes.iter().filter_map(|lobes| of_face(lobes.radius_m));
            fits.map(|fit| fit.in_precision()).collect()
        });
        Self {
            parameters,
            lobes,
            wavenumber_rad_m: T::of(kernel.wavenumber_rad_m),
            corner_on_axis: kernel.smooth == Smooth::InHalfTangent,
        }
    }
}

/// One source's contribution to the field at the points of `L` vectors.
///
/// It is flat on purpose: with structures inside, its vectors are kept in memory and not in registers.
pub(super) struct Contribution<T, V, const L: usize> {
    /// From source to point, m.
    pub along: [Simd<T, V, L>; 3],
    /// Axis of the source.
    pub normal: [T; 3],
    /// Distance, and one over it.
    pub distance: Simd<T, V, L>,
    pub inverse: Simd<T, V, L>,
    /// Cosine of the angle to the axis.
    pub cosine: Simd<T, V, L>,
    /// The lobe's variable.
    pub variable: Simd<T, V, L>,
    /// Law on the axis and amplitude, without the lobe.
    pub level: Simd<T, V, L>,
    pub magnitude: Simd<T, V, L>,
    /// Derivative of the magnitude by the logarithm of the wavelength.
    pub by_wavelength: Simd<T, V, L>,
    /// Derivative of the magnitude by the cosine of the angle.
    pub by_cosine: Simd<T, V, L>,
    /// Relative fall of the level by distance, and its relative change by height.
    pub fall: Simd<T, V, L>,
    pub by_height: T,
    /// Length of the path, and one over it.
    pub path: Simd<T, V, L>,
    pub path_inverse: Simd<T, V, L>,
    /// Phase of the drive, rad.
    pub drive: T,
    pub lobe: usize,
    /// Whether the path's length does not depend on the point's height.
    pub frozen: bool,
}

/// What the derivatives of one source's contribution share.
struct Shared<T, V, const L: usize> {
    /// exp(i φ)
    phase: Phasor<T, V, L>,
    /// Change of the contribution along the ray, over the ray's length; and the same where the phase does not change with height.
    along_ray: Phasor<T, V, L>,
    along_ray_at_height: Phasor<T, V, L>,
    /// Change of the magnitude along the normal.
    along_normal: Simd<T, V, L>,
}

/// Real and imaginary parts of the derivatives' sums.
pub(super) type DerivativeSums<T, V, const L: usize> = [[Simd<T, V, L>; 2]; AT_ONCE];

impl<T: Float> Differentiation<T> {
    /// Adds one source to the sums.
    ///
    /// With the unit vector u from source to point, D' the derivative of the lobe by cos θ = u·m and L the law on the axis, the
    /// magnitude m = L D changes along an axis by m u L'/L + L D' (m - u cos θ)/d and the phase by k u. Both are the ray r and the
    /// normal m times factors that are the same for all axes.
    #[inline(always)]
    pub fn add<V: Vector<T>, const L: usize, C: Case>(
        &self,
        of: &Contribution<T, V, L>,
        [cosine, sine]: [Simd<T, V, L>; 2],
        sums: &mut DerivativeSums<T, V, L>,
    ) {
        let by_cosine = of.by_cosine * of.inverse;
        let inwards = by_cosine.mul_add(of.cosine, of.magnitude * of.fall) * of.inverse;
        let along_normal = if of.by_height == T::ZERO {
            by_cosine
        } else {
            of.magnitude.scale_add(of.by_height, by_cosine)
        };
        let turning = of.magnitude * self.wavenumber_rad_m * of.path_inverse;
        let phase = Phasor([cosine, sine]);
        let along_ray = phase.scaled_and_turned_back(inwards, turning);
        let along_ray_at_height = if of.frozen { phase.scaled(inwards) } else { along_ray };
        let shared = Shared { phase, along_ray, along_ray_at_height, along_normal };
        // Written out one by one: the sums then stay in registers.
        sums[0] = self.one::<V, L, C>(0, of, &shared, sums[0]);
        sums[1] = self.one::<V, L, C>(1, of, &shared, sums[1]);
        sums[2] = self.one::<V, L, C>(2, of, &shared, sums[2]);
        sums[3] = self.one::<V, L, C>(3, of, &shared, sums[3]);
    }

    /// One derivative's sum with one source added.
    #[inline(always)]
    fn one<V: Vector<T>, const L: usize, C: Case>(
        &self,
        n: usize,
        of: &Contribution<T, V, L>,
        shared: &Shared<T, V, L>,
        sum: [Simd<T, V, L>; 2],
    ) -> [Simd<T, V, L>; 2] {
        let sum = Phasor(sum);
        let phase = shared.phase;
        // A parameter that is known only while the sum runs costs a branch, for which the sums leave their registers.
        let parameter = if C::THESIS { Some(USUAL_PARAMETERS[n]) } else { self.parameters[n] };
        let sum = match parameter {
            None => sum,
            Some(Parameter::X) => along_axis(0, of, shared, shared.along_ray, sum),
            Some(Parameter::Y) => along_axis(1, of, shared, shared.along_ray, sum),
            Some(Parameter::Z) => along_axis(2, of, shared, shared.along_ray_at_height, sum),
            Some(Parameter::SoundSpeed) => {
                let turned = of.magnitude * self.wavenumber_rad_m * of.path;
                sum.plus(phase, of.by_wavelength).minus_turned(phase, turned)
            }
            Some(Parameter::Frequency) => {
                let turned = of.path.scale_add(self.wavenumber_rad_m, Simd::splat(of.drive));
                let turned = of.magnitude * turned;
                sum.minus(phase, of.by_wavelength).plus_turned(phase, turned)
            }
            Some(Parameter::Spreading) => sum.minus(phase, of.distance.ln() * of.magnitude),
            Some(Parameter::Attenuation) => sum.minus(phase, of.distance * of.magnitude),
            Some(parameter @ (Parameter::LobeWidth | Parameter::LobeWidthByFace)) => {
                let of_angle = parameter == Parameter::LobeWidth && !self.corner_on_axis;
                let variable = if of_angle { of.cosine } else { of.variable };
                sum.plus(phase, self.lobes[n][of.lobe].at(variable) * of.level)
            }
        };
        sum.0
    }
}

/// The sum of a derivative along an axis with one source added; most sources face along z.
#[inline(always)]
fn along_axis<T: Float, V: Vector<T>, const L: usize>(
    axis: usize,
    of: &Contribution<T, V, L>,
    shared: &Shared<T, V, L>,
    along_ray: Phasor<T, V, L>,
    sum: Phasor<T, V, L>,
) -> Phasor<T, V, L> {
    let sum = sum.minus(along_ray, of.along[axis]);
    if of.normal[axis] == T::ZERO {
        sum
    } else {
        sum.plus(shared.phase, shared.along_normal * of.normal[axis])
    }
}

/// The derivatives of a magnitude by the cosine of the angle and by the logarithm of the wavelength, from that by the lobe's
/// variable.
#[inline(always)]
pub(super) fn by_angle_and_wavelength<T: Float, V: Vector<T>, const L: usize>(
    smooth: Smooth,
    by_variable: Simd<T, V, L>,
    variable: Simd<T, V, L>,
    cosine: Simd<T, V, L>,
) -> [Simd<T, V, L>; 2] {
    match smooth {
        Smooth::InCosine => [by_variable, Simd::zero()],
        Smooth::InSineSquared => {
            // v = 1 - cos² θ. A lobe D(ka sin θ) changes with k as with sin θ: by 2 v D'(v), and by the opposite with the wavelength.
            let twice = by_variable * T::of(-2.0);
            [twice * cosine, twice * variable]
        }
        Smooth::InHalfTangent => {
            // t = tan(θ/2), cos θ = (1 - t²)/(1 + t²): dt/dcos = -(1 + t²)²/(4 t), unbounded on the axis.
            let one_and_square = variable.square() + T::ONE;
            let by_cosine =
                one_and_square.square() * T::of(-0.25) / variable.at_least(T::of(1e-30));
            [by_variable * by_cosine.only_where_above(variable, T::of(1e-9)), Simd::zero()]
        }
    }
}

/// Derivative of the directivity of a face by the ratio to which the lobe is widened.
fn by_width(
    kernel: &FieldKernel,
    transducer: &dyn Transducer,
    radius_m: f64,
    by_face: bool,
) -> Fit {
    let smooth = Widened { transducer, ratio: 1.0, by_face }.smooth();
    fit(SLOPE_TOLERANCE, transducer, smooth, |theta_rad| {
        slope_at_zero(|change: f64| {
            Widened { transducer, ratio: 1.0 + change, by_face }.directivity(
                theta_rad,
                radius_m,
                kernel.wavenumber_rad_m,
            )
        })
    })
}

/// The derivative at zero from seven points. Its error falls with the sixth power of their spacing.
fn slope_at_zero(function: impl Fn(f64) -> f64) -> f64 {
    const STEP: f64 = 0.01;
    let difference = |n: f64| function(n * STEP) - function(-n * STEP);
    (45.0 * difference(1.0) - 9.0 * difference(2.0) + difference(3.0)) / (60.0 * STEP)
}
