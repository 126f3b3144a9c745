//! Upper limit on a processor: the kernel's arithmetic for pistons that face z, hand-written in vector instructions, without
//! its generality.

use fieldgap::acoustics::{InstructionSet, Precision, Vec3};

use super::reference::{Elements, piston_series};

type Run = fn(&Elements, f64, f64, &[Vec3], &mut [Vec<f64>; 2]);

/// A hand-written sum.
pub struct Ceiling {
    pub name: &'static str,
    pub set: InstructionSet,
    pub precision: Precision,
    /// Allowed error, relative to the peak.
    pub tolerance: f64,
    pub run: Run,
}

#[cfg(not(target_arch = "x86_64"))]
pub fn all() -> Vec<Ceiling> {
    Vec::new()
}

/// The sums that the processor supports.
#[cfg(target_arch = "x86_64")]
pub fn all() -> Vec<Ceiling> {
    let mut all = vec![
        Ceiling {
            name: "AVX2 f64",
            set: InstructionSet::Avx2,
            precision: Precision::Double,
            tolerance: 1e-12,
            // SAFETY: only run if the instruction set is supported.
            run: |e, k, ka, p, o| unsafe { avx2_f64::run(e, k, ka, p, o) },
        },
        Ceiling {
            name: "AVX2 f32",
            set: InstructionSet::Avx2,
            precision: Precision::Single,
            tolerance: 1e-5,
            // SAFETY: likewise.
            run: |e, k, ka, p, o| unsafe { avx2_f32::run(e, k, ka, p, o) },
        },
        Ceiling {
            name: "AVX-512 f64",
            set: InstructionSet::Avx512,
            precision: Precision::Double,
            tolerance: 1e-12,
            // SAFETY: likewise.
            run: |e, k, ka, p, o| unsafe { avx512_f64::run(e, k, ka, p, o) },
        },
        Ceiling {
            name: "AVX-512 f32",
            set: InstructionSet::Avx512,
            precision: Precision::Single,
            tolerance: 1e-5,
            // SAFETY: likewise.
            run: |e, k, ka, p, o| unsafe { avx512_f32::run(e, k, ka, p, o) },
        },
    ];
    all.retain(|ceiling| ceiling.set.is_available());
    all
}

#[cfg(target_arch = "x86_64")]
macro_rules! ceiling {
    (
        $module:ident, $features:literal, $float:ident, lanes $lanes:literal, vectors $vectors:literal,
        rounder $rounder:expr, roots |$square:ident| $roots:expr,
        refined $refined:literal, sign $sign:literal,
        cosine $cosine:expr, sine $sine:expr, lobe $lobe:literal,
        $set1:ident $loadu:ident $storeu:ident $add:ident $sub:ident $mul:ident $fmadd:ident
        $fnmadd:ident $xor:ident $to_bits:ident $from_bits:ident $shift_left:ident
    ) => {
        mod $module {
            use std::arch::x86_64::*;

            use super::*;

            const POINTS: usize = $lanes * $vectors;

            #[target_feature(enable = $features)]
            pub fn run(
                elements: &Elements,
                wavenumber: f64,
                ka: f64,
                points_m: &[Vec3],
                out: &mut [Vec<f64>; 2],
            ) {
                let lobe = piston_series::<$lobe>(ka).map(|c| $set1(c as $float));
                let cosine = $cosine.map(|c| $set1(c));
                let sine = $sine.map(|c| $set1(c));
                let half = $set1(0.5);
                let rounder = $set1($rounder);
                let half_turns = $set1((wavenumber / std::f64::consts::PI) as $float);
                // Places from amid all points, and paths from those to it, as the kernel takes them.
                let low = points_m.iter().fold(points_m[0], |low, point| low.inf(point));
                let high = points_m.iter().fold(points_m[0], |high, point| high.sup(point));
                let middle = 0.5 * (low + high);
                let sources: Vec<[$float; 6]> = elements
                    .centres_m
                    .iter()
                    .zip(&elements.phases_rad)
                    .map(|(centre, phase)| {
                        let offset = middle - centre;
                        let path = offset.norm() as $float;
                        let lacking = offset.norm_squared() - f64::from(path) * f64::from(path);
                        let turns = (f64::from(path) * wavenumber + phase) / std::f64::consts::PI;
                        let offset = [offset.x as $float, offset.y as $float, offset.z as $float];
                        let [x, y, z] = offset;
                        [x, y, z, path, lacking as $float, (turns % 2.0) as $float]
                    })
                    .collect();
                for first in (0..points_m.len()).step_by(POINTS) {
                    let points_m = &points_m[first..points_m.len().min(first + POINTS)];
                    let mut place = [[0.0 as $float; POINTS]; 3];
                    for (lane, point) in points_m.iter().enumerate() {
                        for axis in 0..3 {
                            place[axis][lane] = (point[axis] - middle[axis]) as $float;
                        }
                    }
                    let mut real = [$set1(0.0); $vectors];
                    let mut imaginary = [$set1(0.0); $vectors];
                    for source in &sources {
                        let [ox, oy, oz, path, lacking, phase] = source.map(|value| $set1(value));
                        for v in 0..$vectors {
                            // SAFETY: each place holds all vectors.
                            let [sx, sy, sz] = unsafe {
                                [
                                    $loadu(place[0].as_ptr().add(v * $lanes)),
                                    $loadu(place[1].as_ptr().add(v * $lanes)),
                                    $loadu(place[2].as_ptr().add(v * $lanes)),
                                ]
                            };
                            let (x, y, z) = ($add(sx, ox), $add(sy, oy), $add(sz, oz));
                            let across_square = $fmadd(x, x, $mul(y, y));
                            let $square = $fmadd(z, z, across_square);
                            let (distance, inverse, inverse_square) = $roots;
                            let t = $mul(across_square, inverse_square);
                            let mut level = lobe[$lobe - 1];
                            for n in (0..$lobe - 1).rev() {
                                level = $fmadd(level, t, lobe[n]);
                            }
                            let mut longer = $sub(distance, path);
                            if $refined {
                                let squares = $fmadd(sz, $add(z, oz), lacking);
                                let squares = $fmadd(sy, $add(y, oy), squares);
                                let squares = $fmadd(sx, $add(x, ox), squares);
                                let both = $add(longer, $add(path, path));
                                let missing = $fnmadd(longer, both, squares);
                                longer = $fmadd($mul(missing, inverse), half, longer);
                            }
                            let turns = $fmadd(longer, half_turns, phase);
                            let rounded = $add(turns, rounder);
                            let rest = $sub(turns, $sub(rounded, rounder));
                            let sign = $from_bits($shift_left::<$sign>($to_bits(rounded)));
                            let magnitude = $xor($mul(level, inverse), sign);
                            let rest_square = $mul(rest, rest);
                            let mut cos = cosine[cosine.len() - 1];
                            let mut sin = sine[sine.len() - 1];
                            for n in (0..cosine.len() - 1).rev() {
                                cos = $fmadd(cos, rest_square, cosine[n]);
                                sin = $fmadd(sin, rest_square, sine[n]);
                            }
                            real[v] = $fmadd(magnitude, cos, real[v]);
                            imaginary[v] = $fmadd(magnitude, $mul(sin, rest), imaginary[v]);
                        }
                    }
                    for (out, sums) in out.iter_mut().zip([real, imaginary]) {
                        let mut lanes = [0.0 as $float; POINTS];
                        for v in 0..$vectors {
                            // SAFETY: there is room for all vectors.
                            unsafe { $storeu(lanes.as_mut_ptr().add(v * $lanes), sums[v]) };
                        }
                        for (out, lane) in out[first..].iter_mut().zip(lanes).take(points_m.len()) {
                            *out = f64::from(lane);
                        }
                    }
                }
            }
        }
    };
}

/// cos(πr) and sin(πr)/r in powers of r², |r| at most a half: polynomials of least largest error.
#[cfg(target_arch = "x86_64")]
const COSINE: [f64; 8] = [
    0.999_999_999_999_998_1,
    -4.934_802_200_543_686,
    4.058_712_126_333_295,
    -1.335_262_766_181_763_5,
    0.235_330_588_313_178_73,
    -0.025_806_531_975_921_562,
    0.001_927_870_052_698_133_3,
    -0.000_100_416_464_220_538_9,
];
#[cfg(target_arch = "x86_64")]
const SINE: [f64; 8] = [
    std::f64::consts::PI,
    -5.167_712_780_049_786,
    2.550_164_039_861_868,
    -0.599_264_528_825_224,
    0.082_145_878_816_310_43,
    -0.007_370_364_326_530_416,
    0.000_465_987_015_804_337_8,
    -2.113_362_735_205_297e-5,
];
#[cfg(target_arch = "x86_64")]
const COSINE_SINGLE: [f32; 5] = [0.999_999_95, -4.934_793, 4.058_410_6, -1.331_873, 0.219_682_42];
#[cfg(target_arch = "x86_64")]
const SINE_SINGLE: [f32; 5] =
    [std::f32::consts::PI, -5.167_71, 2.550_077_4, -0.598_290_4, 0.077_655_91];

#[cfg(target_arch = "x86_64")]
ceiling!(
    avx512_f64, "avx512f,avx512dq,avx512vl,avx2,fma", f64, lanes 8, vectors 4,
    rounder 6_755_399_441_055_744.0,
    roots |square| {
        let guess = _mm512_rsqrt14_pd(square);
        let left = _mm512_fnmadd_pd(_mm512_mul_pd(square, guess), guess, _mm512_set1_pd(1.0));
        let series = _mm512_fmadd_pd(left, _mm512_set1_pd(0.3125), _mm512_set1_pd(0.375));
        let series = _mm512_fmadd_pd(left, series, _mm512_set1_pd(0.5));
        let inverse = _mm512_fmadd_pd(_mm512_mul_pd(guess, left), series, guess);
        (_mm512_mul_pd(square, inverse), inverse, _mm512_mul_pd(inverse, inverse))
    },
    refined false, sign 63,
    cosine COSINE, sine SINE, lobe 12,
    _mm512_set1_pd _mm512_loadu_pd _mm512_storeu_pd _mm512_add_pd _mm512_sub_pd _mm512_mul_pd
    _mm512_fmadd_pd _mm512_fnmadd_pd _mm512_xor_pd _mm512_castpd_si512 _mm512_castsi512_pd _mm512_slli_epi64
);

#[cfg(target_arch = "x86_64")]
ceiling!(
    avx512_f32, "avx512f,avx512dq,avx512vl,avx2,fma", f32, lanes 16, vectors 4,
    rounder 12_582_912.0,
    roots |square| {
        let guess = _mm512_rsqrt14_ps(square);
        let left = _mm512_fnmadd_ps(_mm512_mul_ps(square, guess), guess, _mm512_set1_ps(1.0));
        let inverse = _mm512_fmadd_ps(_mm512_mul_ps(guess, left), _mm512_set1_ps(0.5), guess);
        (_mm512_mul_ps(square, inverse), inverse, _mm512_mul_ps(inverse, inverse))
    },
    refined true, sign 31,
    cosine COSINE_SINGLE, sine SINE_SINGLE, lobe 7,
    _mm512_set1_ps _mm512_loadu_ps _mm512_storeu_ps _mm512_add_ps _mm512_sub_ps _mm512_mul_ps
    _mm512_fmadd_ps _mm512_fnmadd_ps _mm512_xor_ps _mm512_castps_si512 _mm512_castsi512_ps _mm512_slli_epi32
);

#[cfg(target_arch = "x86_64")]
ceiling!(
    avx2_f64, "avx2,fma", f64, lanes 4, vectors 3,
    rounder 6_755_399_441_055_744.0,
    roots |square| {
        let distance = _mm256_sqrt_pd(square);
        let inverse_square = _mm256_div_pd(_mm256_set1_pd(1.0), square);
        (distance, _mm256_mul_pd(distance, inverse_square), inverse_square)
    },
    refined false, sign 63,
    cosine COSINE, sine SINE, lobe 12,
    _mm256_set1_pd _mm256_loadu_pd _mm256_storeu_pd _mm256_add_pd _mm256_sub_pd _mm256_mul_pd
    _mm256_fmadd_pd _mm256_fnmadd_pd _mm256_xor_pd _mm256_castpd_si256 _mm256_castsi256_pd _mm256_slli_epi64
);

#[cfg(target_arch = "x86_64")]
ceiling!(
    avx2_f32, "avx2,fma", f32, lanes 8, vectors 3,
    rounder 12_582_912.0,
    roots |square| {
        let distance = _mm256_sqrt_ps(square);
        let inverse_square = _mm256_div_ps(_mm256_set1_ps(1.0), square);
        (distance, _mm256_mul_ps(distance, inverse_square), inverse_square)
    },
    refined true, sign 31,
    cosine COSINE_SINGLE, sine SINE_SINGLE, lobe 7,
    _mm256_set1_ps _mm256_loadu_ps _mm256_storeu_ps _mm256_add_ps _mm256_sub_ps _mm256_mul_ps
    _mm256_fmadd_ps _mm256_fnmadd_ps _mm256_xor_ps _mm256_castps_si256 _mm256_castsi256_ps _mm256_slli_epi32
);
