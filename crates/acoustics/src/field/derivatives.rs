//! Derivatives of the field by what a diagnosis fits, in the same pass as the field.
//!
//! With p = Σ m exp(i φ), dp/dq = Σ (dm/dq + i m dφ/dq) exp(i φ): what takes time, distances, lobes, sine and cosine, is there
//! already.

use num_complex::Complex64;
use rayon::prelude::*;

use super::surroundings::Surroundings;
use super::tile::{Geometry, Prepared, SumTile, Sums};
use super::{FieldKernel, PathLengths, TILE, fit};
use crate::Vec3;
use crate::lanes::{Lanes, Vector};
use crate::lobe::{Fit, Lobe};
use crate::real::Real;
use crate::transducer::{OnAxis, Smooth, Transducer, Widened};

/// Parameters that are differentiated by at once.
pub(super) const AT_ONCE: usize = 4;

/// What is known of a lobe's derivative, relative to its largest value: it is found by differences.
const SLOPE_TOLERANCE: f64 = 1e-11;

/// What the field is differentiated by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameter {
    /// Place of all points along x, per metre. Across a lobe's corner on its axis it is taken as zero.
    X,
    /// Place of all points along y.
    Y,
    /// Place of all points along z.
    Z,
    /// Natural logarithm of the speed of sound, the drives' phases held.
    SoundSpeed,
    /// Natural logarithm of the frequency, the drives' delays held: their phases go with it.
    Frequency,
    /// The exponent n, where pressure falls as d^-n (also where n is 1).
    Spreading,
    /// Attenuation of the air, per neper a metre.
    Attenuation,
    /// Width of all lobes over theirs, their angles stretched.
    LobeWidth,
    /// Width of all lobes over theirs, their faces made smaller.
    LobeWidthByFace,
}

/// A field and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldDerivatives {
    /// The complex field.
    pub field: Complex64,
    /// Its derivatives, in the order of the parameters that were asked for; zero beyond them.
    pub by: [Complex64; AT_ONCE],
}

/// The parameters, and what the directivities do where these change them.
pub(super) struct Slopes<T> {
    parameters: [Option<Parameter>; AT_ONCE],
    /// Of each lobe: its derivative by the parameter's own effect on it.
    lobes: [Vec<Lobe<T>>; AT_ONCE],
    wavenumber_rad_m: T,
    /// Whether the lobes have a corner on their axis.
    corner_on_axis: bool,
}

/// What is mostly asked for, in this order.
const USUAL_FOUR: [Parameter; AT_ONCE] =
    [Parameter::X, Parameter::Y, Parameter::Z, Parameter::SoundSpeed];

impl FieldKernel {
    /// The field and its derivatives by up to four parameters at each point; `transducer` is the one that the kernel was made
    /// with.
    ///
    /// They agree with differences of fields to the differences' own accuracy. In air that is not still, even and clear, with a
    /// receiver that does not hear alike from everywhere, or with a near field, there is `None`.
    ///
    /// # Panics
    /// For more than four parameters.
    pub fn derivatives_at(
        &self,
        transducer: &dyn Transducer,
        parameters: &[Parameter],
        points_m: &[Vec3],
    ) -> Option<Vec<FieldDerivatives>> {
        assert!(parameters.len() <= AT_ONCE, "{AT_ONCE} parameters at once");
        if !self.is_in_plain_air() || self.near_field != 0.0 {
            return None;
        }
        let usual = self.is_usual(parameters);
        let prepared = Prepared::new(self, Slopes::<f64>::new(self, transducer, parameters));
        let mut derivatives = Vec::with_capacity(points_m.len());
        // Nearly a megabyte for a plane of 101 x 101: it is written once, not cleared before.
        let room = &mut derivatives.spare_capacity_mut()[..points_m.len()];
        room.par_chunks_mut(TILE).zip(points_m.par_chunks(TILE)).for_each_init(
            || (Sums::default(), Surroundings::default()),
            |(sums, surroundings), (out, points_m)| {
                surroundings.surround(self, points_m);
                let prepared = &prepared;
                macro_rules! run {
                    ($usual:literal) => {
                        self.instructions.run(SumTile::<f64, true, false, false, AT_ONCE, $usual> {
                            prepared,
                            surroundings,
                            sums,
                        })
                    };
                }
                if usual {
                    run!(true)
                } else {
                    run!(false)
                }
                for (point, out) in out.iter_mut().enumerate() {
                    out.write(FieldDerivatives {
                        field: sums.field(point),
                        by: sums.derivatives(point),
                    });
                }
            },
        );
        // SAFETY: every point has been written.
        unsafe { derivatives.set_len(points_m.len()) };
        Some(derivatives)
    }

    /// Whether derivatives are asked for as mostly: by places and the speed of sound, of sources that look along z, with lobes
    /// without corners that are smooth in sin² θ and pressure that falls as one over the distance, paths as they are.
    fn is_usual(&self, parameters: &[Parameter]) -> bool {
        parameters == USUAL_FOUR
            && self.is_upright()
            && self.smooth == Smooth::InSineSquared
            && self.lobes.iter().all(|lobes| lobes.directivity.is_smooth())
            && self.on_axis == OnAxis::Spherical
            && self.paths == PathLengths::Observed
    }
}

impl<T: Real> Slopes<T> {
    /// No parameters.
    pub fn none() -> Self {
        Self {
            parameters: [None; AT_ONCE],
            lobes: std::array::from_fn(|_| Vec::new()),
            wavenumber_rad_m: T::ZERO,
            corner_on_axis: false,
        }
    }

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
            fits.map(|fit| fit.written_out()).collect()
        });
        Self {
            parameters,
            lobes,
            wavenumber_rad_m: T::of(kernel.wavenumber_rad_m),
            corner_on_axis: kernel.smooth == Smooth::InHalfTangent,
        }
    }

    /// Adds what one source has to the derivatives.
    ///
    /// With the unit vector u from source to point, D' the derivative of the lobe by cos θ = u·m and L the law on the axis, the
    /// magnitude m = L D changes along an axis by m u L'/L + L D' (m - u cos θ)/d and the phase by k u: both are the way r to the point
    /// and the normal m times numbers alike for all axes.
    #[inline(always)]
    pub fn add<V: Vector<T>, const L: usize, const N: usize, const USUAL: bool>(
        &self,
        at: &Geometry<T, V, L>,
        [cosine, sine]: [Lanes<T, V, L>; 2],
        sums: &mut [[Lanes<T, V, L>; 2]; N],
    ) {
        let by_cosine = at.by_cosine * at.inverse;
        let inwards = by_cosine.mul_add(at.cosine, at.magnitude * at.fall) * at.inverse;
        let aside = if at.by_height == T::ZERO {
            by_cosine
        } else {
            at.magnitude.scale_add(at.by_height, by_cosine)
        };
        let turning = at.magnitude * self.wavenumber_rad_m * at.path_inverse;
        let phase = Phasor([cosine, sine]);
        let way = phase.grown_and_turned_back(inwards, turning);
        let level_way = if at.frozen { phase.grown(inwards) } else { way };
        let ways = Ways { phase, way, level_way, aside };
        // Written out one by one: the sums then stay in registers.
        if N == AT_ONCE {
            sums[0] = self.one::<V, L, USUAL>(0, at, &ways, sums[0]);
            sums[1] = self.one::<V, L, USUAL>(1, at, &ways, sums[1]);
            sums[2] = self.one::<V, L, USUAL>(2, at, &ways, sums[2]);
            sums[3] = self.one::<V, L, USUAL>(3, at, &ways, sums[3]);
        }
    }

    /// One derivative's sum with one source added.
    #[inline(always)]
    fn one<V: Vector<T>, const L: usize, const USUAL: bool>(
        &self,
        n: usize,
        at: &Geometry<T, V, L>,
        ways: &Ways<T, V, L>,
        sum: [Lanes<T, V, L>; 2],
    ) -> [Lanes<T, V, L>; 2] {
        let sum = Phasor(sum);
        let phase = ways.phase;
        // A match on what is only known as the sum runs joins again after it, and its sums leave their registers for that.
        let parameter = if USUAL { Some(USUAL_FOUR[n]) } else { self.parameters[n] };
        let sum = match parameter {
            None => sum,
            Some(Parameter::X) => self.along_axis(0, at, ways, ways.way, sum),
            Some(Parameter::Y) => self.along_axis(1, at, ways, ways.way, sum),
            Some(Parameter::Z) => self.along_axis(2, at, ways, ways.level_way, sum),
            Some(Parameter::SoundSpeed) => {
                let turned = at.magnitude * self.wavenumber_rad_m * at.path;
                sum.plus(phase, at.by_wavelength).minus_turned(phase, turned)
            }
            Some(Parameter::Frequency) => {
                let turned = at.path.scale_add(self.wavenumber_rad_m, splat(at.drive));
                let turned = at.magnitude * turned;
                sum.minus(phase, at.by_wavelength).plus_turned(phase, turned)
            }
            Some(Parameter::Spreading) => sum.minus(phase, at.distance.ln() * at.magnitude),
            Some(Parameter::Attenuation) => sum.minus(phase, at.distance * at.magnitude),
            Some(parameter @ (Parameter::LobeWidth | Parameter::LobeWidthByFace)) => {
                let of_angle = parameter == Parameter::LobeWidth && !self.corner_on_axis;
                let variable = if of_angle { at.cosine } else { at.variable };
                sum.plus(phase, self.lobes[n][at.lobe].at(variable) * at.level)
            }
        };
        sum.0
    }

    /// The sum of a derivative along an axis with one source added; most look along z.
    #[inline(always)]
    fn along_axis<V: Vector<T>, const L: usize>(
        &self,
        axis: usize,
        at: &Geometry<T, V, L>,
        ways: &Ways<T, V, L>,
        way: Phasor<T, V, L>,
        sum: Phasor<T, V, L>,
    ) -> Phasor<T, V, L> {
        let sum = sum.minus(way, at.along[axis]);
        if at.normal[axis] == T::ZERO {
            sum
        } else {
            sum.plus(ways.phase, ways.aside * at.normal[axis])
        }
    }
}

/// What derivatives by several parameters share.
struct Ways<T, V, const L: usize> {
    /// exp(i φ)
    phase: Phasor<T, V, L>,
    /// Change along the way back to the source, over its length; and where the phase does not change with height.
    way: Phasor<T, V, L>,
    level_way: Phasor<T, V, L>,
    /// Change of the magnitude along the normal.
    aside: Lanes<T, V, L>,
}

/// Real and imaginary parts.
#[derive(Clone, Copy)]
struct Phasor<T, V, const L: usize>([Lanes<T, V, L>; 2]);

impl<T: Real, V: Vector<T>, const L: usize> Phasor<T, V, L> {
    /// Times a real factor.
    #[inline(always)]
    fn grown(self, factor: Lanes<T, V, L>) -> Self {
        Self([self.0[0] * factor, self.0[1] * factor])
    }

    /// Times `grown - i turned`.
    #[inline(always)]
    fn grown_and_turned_back(self, grown: Lanes<T, V, L>, turned: Lanes<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([
            turned.mul_add(imaginary, grown * real),
            turned.mul_sub_from(real, grown * imaginary),
        ])
    }

    /// Plus another times a real factor.
    #[inline(always)]
    fn plus(self, other: Self, factor: Lanes<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([other.0[0].mul_add(factor, real), other.0[1].mul_add(factor, imaginary)])
    }

    /// Plus another a quarter turn on, times a real factor.
    #[inline(always)]
    fn plus_turned(self, other: Self, factor: Lanes<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([other.0[1].mul_sub_from(factor, real), other.0[0].mul_add(factor, imaginary)])
    }

    /// Less another a quarter turn on, times a real factor.
    #[inline(always)]
    fn minus_turned(self, other: Self, factor: Lanes<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([other.0[1].mul_add(factor, real), other.0[0].mul_sub_from(factor, imaginary)])
    }

    /// Less another times a real factor.
    #[inline(always)]
    fn minus(self, other: Self, factor: Lanes<T, V, L>) -> Self {
        let [real, imaginary] = self.0;
        Self([other.0[0].mul_sub_from(factor, real), other.0[1].mul_sub_from(factor, imaginary)])
    }
}

#[inline(always)]
fn splat<T: Real, V: Vector<T>, const L: usize>(value: T) -> Lanes<T, V, L> {
    Lanes::splat(value)
}

/// The derivatives of a magnitude by the cosine of the angle and by the logarithm of the wavelength, from that by the lobe's
/// variable.
#[inline(always)]
pub(super) fn by_angle_and_wavelength<T: Real, V: Vector<T>, const L: usize>(
    smooth: Smooth,
    steep: Lanes<T, V, L>,
    variable: Lanes<T, V, L>,
    cosine: Lanes<T, V, L>,
) -> [Lanes<T, V, L>; 2] {
    match smooth {
        Smooth::InCosine => [steep, Lanes::zero()],
        Smooth::InSineSquared => {
            // v = 1 - cos² θ; and D(ka sin θ) changes by k as by sin θ: twice v D'(v), by the wavelength the other way.
            let twice = steep * T::of(-2.0);
            [twice * cosine, twice * variable]
        }
        Smooth::InHalfTangent => {
            // t = tan(θ/2), cos θ = (1 - t²)/(1 + t²): dt/dcos = -(1 + t²)²/(4 t), without bound on the axis.
            let one_and_square = variable.square() + T::ONE;
            let by_cosine =
                one_and_square.square() * T::of(-0.25) / variable.at_least(T::of(1e-30));
            [steep * by_cosine.only_where_above(variable, T::of(1e-9)), Lanes::zero()]
        }
    }
}

/// Change of the directivity of a face by the ratio to which it is widened.
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

/// The derivative at zero by seven points; its error goes with the sixth power of their distance.
fn slope_at_zero(function: impl Fn(f64) -> f64) -> f64 {
    const STEP: f64 = 0.01;
    let difference = |n: f64| function(n * STEP) - function(-n * STEP);
    (45.0 * difference(1.0) - 9.0 * difference(2.0) + difference(3.0)) / (60.0 * STEP)
}

impl Sums {
    fn derivatives(&self, point: usize) -> [Complex64; AT_ONCE] {
        std::array::from_fn(|n| {
            let [real, imaginary] = &self.slopes[n];
            Complex64::new(real[point], imaginary[point])
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::PathLengths;
    use super::super::tests::transducers;
    use super::*;
    use crate::transducer::{MurataFit, OnAxis, Piston};
    use crate::{Array, InstructionSet, Propagation};

    const EVERY: [Parameter; 9] = [
        Parameter::X,
        Parameter::Y,
        Parameter::Z,
        Parameter::SoundSpeed,
        Parameter::Frequency,
        Parameter::Spreading,
        Parameter::Attenuation,
        Parameter::LobeWidth,
        Parameter::LobeWidthByFace,
    ];

    /// The field with one parameter changed, by making the whole set-up anew.
    fn changed(
        array: &Array,
        phases_rad: &[f64],
        transducer: &dyn Transducer,
        paths: PathLengths,
        (parameter, change): (Parameter, f64),
        at_m: Vec3,
    ) -> Complex64 {
        let mut k = 732.7;
        let mut at_m = at_m;
        let mut phases_rad = phases_rad.to_vec();
        let mut widened = Widened { transducer, ratio: 1.0, by_face: false };
        let mut attenuation_np_m = 0.0;
        let mut on_axis = transducer.on_axis();
        match parameter {
            Parameter::X => at_m.x += change,
            Parameter::Y => at_m.y += change,
            Parameter::Z => at_m.z += change,
            Parameter::SoundSpeed => k *= (-change).exp(),
            Parameter::Frequency => {
                k *= change.exp();
                phases_rad.iter_mut().for_each(|phase| *phase *= change.exp());
            }
            Parameter::Spreading => {
                let exponent = match on_axis {
                    OnAxis::Power { exponent } => exponent,
                    _ => 1.0,
                };
                on_axis = OnAxis::Power { exponent: exponent + change };
            }
            Parameter::Attenuation => attenuation_np_m = change,
            Parameter::LobeWidth => widened.ratio += change,
            Parameter::LobeWidthByFace => {
                widened.ratio += change;
                widened.by_face = true;
            }
        }
        FieldKernel::new(array, &phases_rad, &widened, k, paths)
            .with_on_axis(on_axis)
            .through(Propagation { attenuation_np_m, ..Propagation::default() })
            .at(&[at_m])[0]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn every_derivative_is_the_limit_of_differences(
            at in (-0.04..0.04f64, -0.04..0.04f64, 0.05..0.2f64), model in 0usize..7,
            frozen in prop::option::of(0.05..0.2f64),
        ) {
            let array = Array::hexagonal(1, 10.5e-3);
            let phases: Vec<f64> = (0..array.len()).map(|n| 0.9 * n as f64).collect();
            let transducer = &*transducers()[model];
            let paths = frozen.map_or(PathLengths::Observed, PathLengths::FrozenAt);
            let at_m = Vec3::new(at.0, at.1, at.2);
            let kernel = FieldKernel::new(&array, &phases, transducer, 732.7, paths);
            // Patches of a face do not widen as a whole: that is for the kernel that is made anew.
            let patches = transducer.patches(4.5e-3, 732.7).len() > 1;
            let tabled = !transducer.corners_rad().is_empty();
            for chosen in EVERY.chunks(4) {
                let found = kernel.derivatives_at(transducer, chosen, &[at_m]).expect("plain")[0];
                prop_assert!((found.field - kernel.at(&[at_m])[0]).norm() < 1e-11 * found.field.norm().max(1.0));
                for (&parameter, &ours) in chosen.iter().zip(&found.by) {
                    let of_lobe = matches!(parameter, Parameter::LobeWidth | Parameter::LobeWidthByFace);
                    let of_spreading = parameter == Parameter::Spreading
                        && !matches!(transducer.on_axis(), OnAxis::Power { .. } | OnAxis::Spherical);
                    if of_spreading || (patches && parameter != Parameter::X) || (tabled && of_lobe) {
                        continue;
                    }
                    let step = if matches!(parameter, Parameter::X | Parameter::Y | Parameter::Z) { 1e-6 } else { 1e-5 };
                    let moved = |by: f64| changed(&array, &phases, transducer, paths, (parameter, by * step), at_m);
                    let difference = (8.0 * (moved(1.0) - moved(-1.0)) - (moved(2.0) - moved(-2.0))) / (12.0 * step);
                    let scale = difference.norm().max(array.len() as f64 / at_m.z);
                    prop_assert!(
                        (ours - difference).norm() < 2e-5 * scale,
                        "{:?} of model {}: {} {}", parameter, model, ours, difference
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_compiled_for_the_usual_agrees_with_what_is_compiled_for_all() {
        let array = Array::hexagonal(2, 10.5e-3);
        let phases: Vec<f64> = (0..array.len()).map(|n| 0.9 * n as f64).collect();
        let points_m: Vec<Vec3> =
            (0..37).map(|n| Vec3::new(2e-3 * f64::from(n) - 0.03, 0.01, 0.08)).collect();
        let mut turned_round = USUAL_FOUR;
        turned_round.reverse();
        for set in InstructionSet::ALL.iter().copied().filter(|set| set.is_there()) {
            let kernel =
                FieldKernel::new(&array, &phases, &Piston, 732.7, PathLengths::Observed).by(set);
            assert!(kernel.is_usual(&USUAL_FOUR) && !kernel.is_usual(&turned_round));
            let by = |four: &[Parameter]| kernel.derivatives_at(&Piston, four, &points_m);
            let usual = by(&USUAL_FOUR).expect("plain");
            let any = by(&turned_round).expect("plain");
            for (usual, any) in usual.iter().zip(&any) {
                for (n, ours) in usual.by.iter().enumerate() {
                    let apart = (ours - any.by[AT_ONCE - 1 - n]).norm();
                    assert!(apart < 1e-12 * ours.norm().max(1e4), "{set:?}, {n}: {apart:e}");
                }
            }
        }
    }

    #[test]
    fn a_lobe_with_a_corner_has_a_derivative_on_its_axis_too() {
        let array = Array::linear(1, 10.5e-3).expect("not empty");
        let murata = MurataFit::CENTIMETRES;
        let kernel = FieldKernel::new(&array, &[0.0], &murata, 732.7, PathLengths::Observed);
        let found = kernel
            .derivatives_at(&murata, &[Parameter::X, Parameter::Z], &[Vec3::new(0.0, 0.0, 0.1)])
            .expect("plain")[0];
        assert!(found.by[0].norm() < 1e-9 && found.by[1].norm() > 100.0, "{found:?}");
    }

    #[test]
    fn where_the_air_bends_the_way_there_are_none() {
        let array = Array::linear(1, 10.5e-3).expect("not empty");
        let kernel = FieldKernel::new(&array, &[0.0], &Piston, 732.7, PathLengths::Observed)
            .through(Propagation { attenuation_np_m: 0.1, ..Propagation::default() });
        assert!(kernel.derivatives_at(&Piston, &[Parameter::X], &[Vec3::z()]).is_none());
    }
}
