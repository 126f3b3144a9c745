//! The field kernel: the complex sum over elements of amplitude times directivity times phase, at any points.
//!
//! For element n with centre c, normal m, drive w exp(i φ) and a point x, with r = x - c, d = |r|, h = r·m and θ the
//! angle between r and m:
//!
//! p(x) = Σ w A(d, h) D(θ) exp(i (k d + φ))
//!
//! D enters as a polynomial in a variable that needs neither arc tangent nor branch ([`Smooth`]), so that there is one path
//! through the code for every transducer. Points go through eight at a time (see `lanes`), tiles of points are shared
//! out over threads, and each point's sum runs in the elements' order: the result does not depend on the number of
//! threads.

use num_complex::Complex64;
use rayon::prelude::*;

use super::lanes::{Lanes, WIDTH};
use super::propagation::{Propagation, Ray};
use super::rayleigh::across;
use super::series::Series;
use super::transducer::{OnAxis, Smooth, Transducer};
use super::{Array, Vec3};

/// Points that one task computes: small enough to share out a plane, large enough to pay for itself.
const TILE: usize = 512;

/// What the series may leave out, relative to their largest term.
const SERIES_TOLERANCE: f64 = 2e-15;

/// Where path lengths are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathLengths {
    /// At the observed point, as physics has it.
    Observed,
    /// As if every point lay at this height, metres: the thesis's simulator freezes its phases at the focus.
    FrozenAt(f64),
}

/// An array, its drive and its transducer, ready to be summed at any points.
#[derive(Debug, Clone)]
pub struct FieldKernel {
    sources: Vec<Source>,
    series: Vec<Series>,
    smooth: Smooth,
    on_axis: OnAxis,
    turns_per_m: f64,
    paths: PathLengths,
    propagation: Option<Propagation>,
    /// The receiver's sensitivity, in the cosine of the angle of arrival.
    reception: Option<Series>,
}

/// The sums over elements at one point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FieldSum {
    /// The complex field.
    pub field: Complex64,
    /// Sum of the squared magnitudes: the field's mean square if the elements had random phases.
    pub incoherent_power: f64,
}

#[derive(Debug, Clone, Copy)]
struct Source {
    element: usize,
    centre_m: Vec3,
    normal: Vec3,
    amplitude: f64,
    phase_turns: f64,
    series: usize,
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
        let mut radii_m: Vec<f64> = Vec::new();
        let sources = array
            .elements()
            .iter()
            .zip(phases_rad)
            .enumerate()
            .flat_map(|(number, (element, phase_rad))| {
                let series = radii_m
                    .iter()
                    .position(|&known| known == element.radius_m)
                    .unwrap_or_else(|| {
                        radii_m.push(element.radius_m);
                        radii_m.len() - 1
                    });
                let (first, second) = across(element.normal);
                let patches = transducer.patches(element.radius_m, wavenumber_rad_m);
                patches.into_iter().map(move |patch| Source {
                    element: number,
                    centre_m: element.centre_m
                        + element.radius_m * (patch.u * first + patch.v * second),
                    normal: element.normal,
                    amplitude: element.amplitude * patch.weight,
                    phase_turns: (phase_rad + element.phase_rad) / std::f64::consts::TAU,
                    series,
                })
            })
            .collect();
        let series = radii_m
            .iter()
            .map(|&radius_m| {
                Series::fit(SERIES_TOLERANCE, |variable| {
                    let theta_rad = match transducer.smooth() {
                        Smooth::InSineSquared => variable.sqrt().asin(),
                        Smooth::InCosine => variable.acos(),
                        Smooth::InHalfTangent => 2.0 * variable.atan(),
                    };
                    transducer.directivity(theta_rad, radius_m, wavenumber_rad_m)
                })
            })
            .collect();
        Self {
            sources,
            series,
            smooth: transducer.smooth(),
            on_axis: transducer.on_axis(),
            turns_per_m: wavenumber_rad_m / std::f64::consts::TAU,
            paths,
            propagation: None,
            reception: None,
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

    /// The same heard by a receiver that looks along -z and whose sensitivity depends on the angle of arrival, 0 to pi/2
    /// rad, as `sensitivity` says; it must be smooth in that angle's cosine.
    pub fn heard_with(self, sensitivity: impl Fn(f64) -> f64) -> Self {
        let reception = Series::fit(SERIES_TOLERANCE, |cosine| sensitivity(cosine.acos()));
        Self { reception: Some(reception), ..self }
    }

    /// The field of one element alone.
    pub fn of_element(&self, element: usize) -> Self {
        self.of_elements(&[element])
    }

    /// The field of some elements alone.
    pub fn of_elements(&self, elements: &[usize]) -> Self {
        let of_them = self.sources.iter().filter(|source| elements.contains(&source.element));
        Self { sources: of_them.copied().collect(), ..self.clone() }
    }

    /// The complex field at each point. Behind an element's face it radiates nothing.
    pub fn at(&self, points_m: &[Vec3]) -> Vec<Complex64> {
        // Still, clear air and an even receiver are what nearly every sum is over: it is compiled without the rest.
        let plain = self.propagation.is_none() && self.reception.is_none();
        self.tiles(plain, points_m).into_iter().map(|sum| sum.field).collect()
    }

    /// The field and the incoherent power at each point.
    pub fn sums_at(&self, points_m: &[Vec3]) -> Vec<FieldSum> {
        self.tiles(false, points_m)
    }

    fn tiles(&self, plain: bool, points_m: &[Vec3]) -> Vec<FieldSum> {
        let mut sums = vec![FieldSum::default(); points_m.len()];
        sums.par_chunks_mut(TILE)
            .zip(points_m.par_chunks(TILE))
            .for_each(|(sums, points_m)| sum_tile(self, plain, points_m, sums));
        sums
    }

    #[inline(always)]
    fn sum<const FUSED: bool, const PLAIN: bool>(&self, points_m: &[Vec3], sums: &mut [FieldSum]) {
        for (points_m, sums) in points_m.chunks(WIDTH).zip(sums.chunks_mut(WIDTH)) {
            let last = points_m.len() - 1;
            let axis = |axis: usize| {
                let mut lanes = Lanes::splat(0.0);
                for lane in 0..WIDTH {
                    lanes.0[lane] = points_m[lane.min(last)][axis];
                }
                lanes
            };
            let [real, imaginary, power] =
                self.sum_lanes::<FUSED, PLAIN>([axis(0), axis(1), axis(2)]);
            for (lane, sum) in sums.iter_mut().enumerate() {
                sum.field = Complex64::new(real.0[lane], imaginary.0[lane]);
                sum.incoherent_power = power.0[lane];
            }
        }
    }

    #[inline(always)]
    fn sum_lanes<const FUSED: bool, const PLAIN: bool>(&self, [x, y, z]: [Lanes; 3]) -> [Lanes; 3] {
        let [mut real, mut imaginary, mut power] = [Lanes::splat(0.0); 3];
        for source in &self.sources {
            let [cx, cy, cz] = [0, 1, 2].map(|axis| Lanes::splat(source.centre_m[axis]));
            let [mx, my, mz] = [0, 1, 2].map(|axis| Lanes::splat(source.normal[axis]));
            let (rx, ry, rz) = (x.sub(cx), y.sub(cy), z.sub(cz));
            let across_square = rx.mul_add::<FUSED>(rx, ry.mul(ry));
            let distance = rz.mul_add::<FUSED>(rz, across_square).sqrt();
            let inverse = Lanes::splat(1.0).div(distance);
            let height = rx.mul_add::<FUSED>(mx, ry.mul_add::<FUSED>(my, rz.mul(mz)));
            let variable = match self.smooth {
                Smooth::InSineSquared => {
                    let cosine = height.mul(inverse);
                    Lanes::splat(1.0).sub(cosine.mul(cosine))
                }
                Smooth::InCosine => height.mul(inverse),
                Smooth::InHalfTangent => {
                    // ρ from its own components: d² - h² would lose half the digits near the axis.
                    let off_axis = |r: Lanes, m: Lanes| r.sub(height.mul(m));
                    let (ox, oy, oz) = (off_axis(rx, mx), off_axis(ry, my), off_axis(rz, mz));
                    ox.mul_add::<FUSED>(ox, oy.mul_add::<FUSED>(oy, oz.mul(oz)))
                        .sqrt()
                        .div(distance.add(height))
                        .map(|t| if t < 1.0 { t } else { 1.0 })
                }
            };

            let on_axis = match self.on_axis {
                OnAxis::Spherical => inverse.mul(Lanes::splat(source.amplitude)),
                OnAxis::Exponential { amplitude, decay_per_m } => height
                    .mul(Lanes::splat(-decay_per_m))
                    .exp::<FUSED>()
                    .mul(Lanes::splat(source.amplitude * amplitude)),
                OnAxis::Absorbed { amplitude, attenuation_np_m } => distance
                    .mul(Lanes::splat(-attenuation_np_m))
                    .exp::<FUSED>()
                    .mul(inverse)
                    .mul(Lanes::splat(source.amplitude * amplitude)),
                OnAxis::Power { exponent } => distance
                    .ln::<FUSED>()
                    .mul(Lanes::splat(-exponent))
                    .exp::<FUSED>()
                    .mul(Lanes::splat(source.amplitude)),
            };
            let in_front = height.map(|height| if height > 0.0 { 1.0 } else { 0.0 });
            let mut magnitude =
                self.series[source.series].at::<FUSED>(variable).mul(on_axis).mul(in_front);

            let path = match self.paths {
                PathLengths::Observed => distance,
                PathLengths::FrozenAt(height_m) => {
                    let rise = Lanes::splat(height_m - source.centre_m.z);
                    rise.mul_add::<FUSED>(rise, across_square).sqrt()
                }
            };
            let mut path = path;
            if let Some(propagation) = self.propagation.as_ref().filter(|_| !PLAIN) {
                let ray = Ray { from_m: [cx, cy, cz], along_m: [rx, ry, rz], inverse };
                path = path.mul(propagation.slowness::<FUSED>(&ray));
                magnitude = magnitude.mul(propagation.transmission::<FUSED>(distance));
            }
            if let Some(reception) = self.reception.as_ref().filter(|_| !PLAIN) {
                let cosine = rz.mul(inverse).map(|cosine| if cosine > 0.0 { cosine } else { 0.0 });
                magnitude = magnitude.mul(reception.at::<FUSED>(cosine));
            }
            let turns = path
                .mul_add::<FUSED>(Lanes::splat(self.turns_per_m), Lanes::splat(source.phase_turns));
            let (cosine, sine) = turns.cos_sin_turns::<FUSED>();
            real = magnitude.mul_add::<FUSED>(cosine, real);
            imaginary = magnitude.mul_add::<FUSED>(sine, imaginary);
            if !PLAIN {
                power = magnitude.mul_add::<FUSED>(magnitude, power);
            }
        }
        [real, imaginary, power]
    }
}

/// One tile, compiled once for each instruction set and chosen when the program runs.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma+avx2",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn sum_tile(kernel: &FieldKernel, plain: bool, points_m: &[Vec3], sums: &mut [FieldSum]) {
    let fused =
        multiversion::target::target_cfg_f!(any(target_feature = "fma", target_arch = "aarch64"));
    match (fused, plain) {
        (true, true) => kernel.sum::<true, true>(points_m, sums),
        (true, false) => kernel.sum::<true, false>(points_m, sums),
        (false, true) => kernel.sum::<false, true>(points_m, sums),
        (false, false) => kernel.sum::<false, false>(points_m, sums),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::acoustics::Element;
    use crate::acoustics::transducer::{MurataFit, Piston};

    /// The defining sum, element by element, with the library's functions and no series.
    fn plain_sum(
        array: &Array,
        phases_rad: &[f64],
        transducer: &dyn Transducer,
        k: f64,
        paths: PathLengths,
        x: Vec3,
    ) -> Complex64 {
        array
            .elements()
            .iter()
            .zip(phases_rad)
            .map(|(e, phase)| {
                let r = x - e.centre_m;
                let (d, h) = (r.norm(), r.dot(&e.normal));
                if h <= 0.0 {
                    return Complex64::ZERO;
                }
                let theta = r.cross(&e.normal).norm().atan2(h);
                let on_axis = match transducer.on_axis() {
                    OnAxis::Spherical => 1.0 / d,
                    OnAxis::Exponential { amplitude, decay_per_m } => {
                        amplitude * (-decay_per_m * h).exp()
                    }
                    OnAxis::Power { exponent } => d.powf(-exponent),
                    OnAxis::Absorbed { amplitude, attenuation_np_m } => {
                        amplitude * (-attenuation_np_m * d).exp() / d
                    }
                };
                let path = match paths {
                    PathLengths::Observed => d,
                    PathLengths::FrozenAt(z) => Vec3::new(r.x, r.y, z - e.centre_m.z).norm(),
                };
                let magnitude =
                    e.amplitude * on_axis * transducer.directivity(theta, e.radius_m, k);
                Complex64::from_polar(1.0, k * path + phase + e.phase_rad) * magnitude
            })
            .sum()
    }

    fn unit_vector() -> impl Strategy<Value = Vec3> {
        (-0.5..0.5f64, -0.5..0.5f64).prop_map(|(x, y)| Vec3::new(x, y, 1.0).normalize())
    }

    fn element() -> impl Strategy<Value = Element> {
        (
            (-0.08..0.08f64, -0.08..0.08f64, -0.01..0.01f64),
            unit_vector(),
            prop_oneof![Just(4.5e-3), Just(8.0e-3)],
            0.0..1.5f64,
            -4.0..4.0f64,
        )
            .prop_map(|((x, y, z), normal, radius_m, amplitude, phase_rad)| Element {
                centre_m: Vec3::new(x, y, z),
                normal,
                radius_m,
                amplitude,
                phase_rad,
            })
    }

    proptest! {
        #[test]
        fn the_kernel_meets_the_plain_sum_to_twelve_digits_of_the_peak(
            elements in prop::collection::vec((element(), -7.0..7.0f64), 1..20),
            points in prop::collection::vec((-0.1..0.1f64, -0.1..0.1f64, -0.02..0.3f64), 1..30),
            wavenumber in 400.0..1200.0f64,
            frozen in prop::option::of(0.05..0.2f64),
            murata: bool,
        ) {
            let (elements, phases): (Vec<Element>, Vec<f64>) = elements.into_iter().unzip();
            let array = Array::from_elements(elements).expect("not empty");
            let points: Vec<Vec3> = points.into_iter().map(|(x, y, z)| Vec3::new(x, y, z)).collect();
            let paths = frozen.map_or(PathLengths::Observed, PathLengths::FrozenAt);
            let transducer: &dyn Transducer = if murata { &MurataFit::CENTIMETRES } else { &Piston };
            let kernel = FieldKernel::new(&array, &phases, transducer, wavenumber, paths);
            let peak = array.elements().iter().map(|e| e.amplitude).sum::<f64>()
                * if murata { 1.0 } else { 10.0 };
            for (ours, x) in kernel.at(&points).into_iter().zip(&points) {
                let nearest = array.elements().iter().map(|e| (x - e.centre_m).norm()).fold(1.0, f64::min);
                prop_assume!(nearest > 1e-3);
                let plain = plain_sum(&array, &phases, transducer, wavenumber, paths, *x);
                let scale = peak.max(peak * 0.1 / nearest) + 1e-3;
                prop_assert!((ours - plain).norm() < 1e-12 * scale, "{} {} at {}", ours, plain, x);
            }
        }

        #[test]
        fn air_and_receiver_act_on_every_path_of_the_plain_sum(
            points in prop::collection::vec((-0.05..0.05f64, -0.05..0.05f64, 0.05..0.25f64), 1..20),
            mach in (-0.03..0.03f64, -0.03..0.03f64), gradient in -0.3..0.3f64,
            attenuation_np_m in 0.0..2.0f64, exponent in 0.4..1.6f64, wavenumber in 600.0..900.0f64,
        ) {
            let array = Array::square(3, 3, 10.5e-3).expect("not empty");
            let propagation = Propagation {
                mach: Vec3::new(mach.0, mach.1, 0.0),
                gradient_per_m: Vec3::new(gradient, 0.0, -gradient),
                attenuation_np_m,
            };
            let hears = |angle_rad: f64| (-0.8 * angle_rad * angle_rad).exp();
            let kernel =
                FieldKernel::new(&array, &[0.0; 9], &Piston, wavenumber, PathLengths::Observed)
                    .with_on_axis(OnAxis::Power { exponent })
                    .through(propagation)
                    .heard_with(hears);
            let points: Vec<Vec3> = points.into_iter().map(|(x, y, z)| Vec3::new(x, y, z)).collect();
            for (sum, x) in kernel.sums_at(&points).into_iter().zip(&points) {
                let (mut field, mut power) = (Complex64::ZERO, 0.0);
                for element in array.elements() {
                    let r = x - element.centre_m;
                    let d = r.norm();
                    let theta = (r.z / d).acos();
                    let magnitude = d.powf(-exponent)
                        * Piston.directivity(theta, element.radius_m, wavenumber)
                        * (-attenuation_np_m * d).exp()
                        * hears(theta);
                    // The mean of slowness along the way, by its middle: the next term is of the order of (g d)^4.
                    let middle = 1.0 + propagation.gradient_per_m.dot(&(element.centre_m + 0.5 * r));
                    let change = propagation.gradient_per_m.dot(&r) / middle;
                    let slowness = (1.0 + change * change / 12.0)
                        / (middle * (1.0 + propagation.mach.dot(&r) / d));
                    field += Complex64::from_polar(magnitude, wavenumber * d * slowness);
                    power += magnitude * magnitude;
                }
                let scale = power.sqrt() * 3.0;
                prop_assert!((sum.field - field).norm() < 1e-11 * scale, "{} {field}", sum.field);
                prop_assert!((sum.incoherent_power - power).abs() < 1e-11 * power);
            }
        }

        #[test]
        fn neither_order_nor_company_changes_a_point(count in 1usize..2000) {
            let array = Array::square(3, 3, 10.5e-3).expect("not empty");
            let kernel = FieldKernel::new(&array, &[0.0; 9], &Piston, 732.7, PathLengths::Observed);
            let points: Vec<Vec3> = (0..count).map(|i| Vec3::new(i as f64 * 1e-5, 1e-3, 0.1)).collect();
            let last = *points.last().expect("at least one");
            prop_assert_eq!(*kernel.at(&points).last().expect("at least one"), kernel.at(&[last])[0]);
        }
    }

    #[test]
    fn one_piston_on_its_axis_is_a_spherical_wave() {
        let array = Array::linear(1, 10.5e-3).expect("not empty");
        let kernel = FieldKernel::new(&array, &[0.0], &Piston, 732.7, PathLengths::Observed);
        let p = kernel.at(&[Vec3::new(0.0, 0.0, 0.25)])[0];
        assert!((p - Complex64::from_polar(4.0, 732.7 * 0.25)).norm() < 1e-12);
    }
}
