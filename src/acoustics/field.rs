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
}

#[derive(Debug, Clone, Copy)]
struct Source {
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
            .map(|(element, phase_rad)| {
                let series = radii_m
                    .iter()
                    .position(|&known| known == element.radius_m)
                    .unwrap_or_else(|| {
                        radii_m.push(element.radius_m);
                        radii_m.len() - 1
                    });
                Source {
                    centre_m: element.centre_m,
                    normal: element.normal,
                    amplitude: element.amplitude,
                    phase_turns: (phase_rad + element.phase_rad) / std::f64::consts::TAU,
                    series,
                }
            })
            .collect();
        let series = radii_m
            .iter()
            .map(|&radius_m| {
                Series::fit(SERIES_TOLERANCE, |variable| {
                    let theta_rad = match transducer.smooth() {
                        Smooth::InSineSquared => variable.sqrt().asin(),
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
        }
    }

    /// The complex field at each point. Behind an element's face it radiates nothing.
    pub fn at(&self, points_m: &[Vec3]) -> Vec<Complex64> {
        let mut field = vec![Complex64::ZERO; points_m.len()];
        field
            .par_chunks_mut(TILE)
            .zip(points_m.par_chunks(TILE))
            .for_each(|(field, points_m)| sum_tile(self, points_m, field));
        field
    }

    #[inline(always)]
    fn sum<const FUSED: bool>(&self, points_m: &[Vec3], field: &mut [Complex64]) {
        for (points_m, field) in points_m.chunks(WIDTH).zip(field.chunks_mut(WIDTH)) {
            let last = points_m.len() - 1;
            let axis = |axis: usize| {
                let mut lanes = Lanes::splat(0.0);
                for lane in 0..WIDTH {
                    lanes.0[lane] = points_m[lane.min(last)][axis];
                }
                lanes
            };
            let (real, imaginary) = self.sum_lanes::<FUSED>([axis(0), axis(1), axis(2)]);
            for (lane, value) in field.iter_mut().enumerate() {
                *value = Complex64::new(real.0[lane], imaginary.0[lane]);
            }
        }
    }

    #[inline(always)]
    fn sum_lanes<const FUSED: bool>(&self, [x, y, z]: [Lanes; 3]) -> (Lanes, Lanes) {
        let (mut real, mut imaginary) = (Lanes::splat(0.0), Lanes::splat(0.0));
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
            };
            let in_front = height.map(|height| if height > 0.0 { 1.0 } else { 0.0 });
            let magnitude =
                self.series[source.series].at::<FUSED>(variable).mul(on_axis).mul(in_front);

            let path = match self.paths {
                PathLengths::Observed => distance,
                PathLengths::FrozenAt(height_m) => {
                    let rise = Lanes::splat(height_m - source.centre_m.z);
                    rise.mul_add::<FUSED>(rise, across_square).sqrt()
                }
            };
            let turns = path
                .mul_add::<FUSED>(Lanes::splat(self.turns_per_m), Lanes::splat(source.phase_turns));
            let (cosine, sine) = turns.cos_sin_turns::<FUSED>();
            real = magnitude.mul_add::<FUSED>(cosine, real);
            imaginary = magnitude.mul_add::<FUSED>(sine, imaginary);
        }
        (real, imaginary)
    }
}

/// One tile, compiled once for each instruction set and chosen when the program runs.
#[multiversion::multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+fma+avx2",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn sum_tile(kernel: &FieldKernel, points_m: &[Vec3], field: &mut [Complex64]) {
    if multiversion::target::target_cfg_f!(any(target_feature = "fma", target_arch = "aarch64")) {
        kernel.sum::<true>(points_m, field);
    } else {
        kernel.sum::<false>(points_m, field);
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
