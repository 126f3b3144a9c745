//! The noise of a plane without repeats, from what its map holds beyond the wavenumber.
//!
//! The square of an amplitude, |p|², is a product of two fields of the wavenumber k, so that far from the sources its map holds nothing
//! beyond 2k; noise is white. Differences of some order along both axes keep what is near the corner of the map's spectrum, √2 times as far out
//! as either axis reaches: at a step of 3 mm still beyond 2k at 40 kHz. No model of the field is needed.
//!
//! A difference d of order m along both axes has the variance g (4 v a² + ...) with g the square sum of its coefficients, and v = b² + r² a² the
//! noise of a reading a: additive and proportional. Both parts are those that make the squared differences most probable, by Lee and Seung's
//! multiplicative steps (Nature 401, 788, 1999), which never leave the positive numbers.
//!
//! What is tied from reading to reading is not white, and only its quick part is seen: it is underestimated.

use fieldgap_records::{OFF_LINE_MM, Plane, RecordedScan, SAME_HEIGHT_MM, plane_map};

/// Largest step of a recorded plane, in wavelengths. Sixth differences along both axes then keep less than a hundredth of the power of what reaches
/// 1.4 k, as far as arrays that are seen under 45 degrees to either side do.
const COARSEST: f64 = 0.25;

/// Points along the shorter side of a recorded plane, at least: differences of fifth order then have enough points.
const FEWEST_ALONG: usize = 20;

/// Equal largest readings from which on they are a full scale, where no noise shows: four equal ones do not happen by chance.
const AT_FULL_SCALE: usize = 4;

/// Largest order of the differences: with it a field of 40 kHz leaves less than a percent of noise at a step of 2 mm.
const ORDER: usize = 6;

/// Points along the shorter side for each order: what a difference loses at the edges stays below half of the map.
const POINTS_FOR_EACH: usize = 4;

/// Fewest differences that tell a noise.
const ENOUGH: usize = 30;

/// Steps of the search; each comes nearer by a constant share.
const STEPS: usize = 60;

/// Standard deviations from which on a difference stands out: of normal noise one in a hundred million.
const STANDING_OUT: f64 = 6.0;

/// Median of the square of a normal number.
const MEDIAN: f64 = 0.455;

/// Rounds in which those that stand out are left out. What is left shows the next.
const CLEANINGS: usize = 6;

/// If the noise by the order below is larger by this, the field itself is still in the differences.
const STILL_FIELD: f64 = 1.2;

/// The noise of a reading: the root of `additive² + (multiplicative · level)²`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneNoise {
    /// At no level, in the unit of the readings.
    pub additive: f64,
    /// Relative to the level.
    pub multiplicative: f64,
    /// Rms noise over rms reading.
    pub relative: f64,
    /// Whether the field itself may be in it: the step is too wide for its structure, and the noise is at most this.
    pub is_bound: bool,
}

impl PlaneNoise {
    /// The noise of a reading of a recorded scan, from its planes with steps up to a quarter of the wavelength along both axes and 20 points or more
    /// along each. `None` if it has none.
    pub fn of_scan(scan: &RecordedScan) -> Option<Self> {
        let setup = &scan.setup;
        let wavelength_m = setup.medium.medium().wavelength_m(setup.array.frequency_hz());
        let coarsest_mm = COARSEST * wavelength_m * 1e3;
        let full_scale = full_scale(scan);
        let maps: Vec<(Vec<f64>, usize)> = scan
            .planes(SAME_HEIGHT_MM)
            .into_iter()
            .filter_map(|mut plane: Plane<'_>| {
                plane.samples.retain(|sample| sample.reading < full_scale);
                let mapped = plane_map(&plane, OFF_LINE_MM).ok()?;
                let (columns, rows) = (mapped.map.x_m().len(), mapped.map.y_m().len());
                let is_dense = mapped.step_mm.iter().all(|step_mm| *step_mm <= coarsest_mm);
                let is_large = columns.min(rows) >= FEWEST_ALONG;
                (is_dense && is_large).then(|| (mapped.map.values().to_vec(), columns))
            })
            .collect();
        let maps: Vec<(&[f64], usize)> =
            maps.iter().map(|(map, columns)| (&map[..], *columns)).collect();
        Self::of(&maps)
    }

    /// The noise of maps, each row by row with its number of columns; NaN where nothing was read. `None` if they are too small.
    pub fn of(maps: &[(&[f64], usize)]) -> Option<Self> {
        let side = maps.iter().map(|&(map, columns)| columns.min(map.len() / columns.max(1)));
        let order = (side.min()? / POINTS_FOR_EACH).min(ORDER);
        if order < 2 {
            return None;
        }
        let [noise, below] = [order, order - 1].map(|order| {
            let differences: Vec<Difference> = maps
                .iter()
                .enumerate()
                .flat_map(|(number, (map, columns))| differences(number, map, *columns, order))
                .collect();
            parts(differences, order)
        });
        let ([additive, proportional], [below_additive, below_proportional]) = (noise?, below?);
        let driven = || maps.iter().flat_map(|(map, _)| map.iter()).filter(|a| !a.is_nan());
        let power = driven().map(|a| a * a).sum::<f64>() / driven().count().max(1) as f64;
        if power <= 0.0 {
            return None;
        }
        let variance = additive + proportional * power;
        Some(Self {
            additive: additive.sqrt(),
            multiplicative: proportional.sqrt(),
            relative: (variance / power).sqrt(),
            is_bound: below_additive + below_proportional * power > STILL_FIELD.powi(2) * variance,
        })
    }
}

/// The largest reading, if several equal it; infinite otherwise.
fn full_scale(scan: &RecordedScan) -> f64 {
    let readings = || scan.samples.iter().map(|sample| sample.reading);
    let largest = readings().fold(0.0, f64::max);
    match readings().filter(|&reading| reading == largest).count() >= AT_FULL_SCALE {
        true => largest,
        false => f64::INFINITY,
    }
}

/// A difference of squares in units of its coefficients.
struct Difference {
    /// A quarter of its square: the noise times a², where a is the amplitude.
    variance: f64,
    /// Mean of a², weighted as the noise of each reading is.
    second: f64,
    /// Mean of a⁴.
    fourth: f64,
    /// Map, first row and first column of its readings.
    at: [usize; 3],
}

impl Difference {
    /// Its square over what these parts of the noise make of it.
    fn over(&self, parts: [f64; 2]) -> f64 {
        let expected = parts[0] * self.second + parts[1] * self.fourth;
        // A map of no noise at all has nothing to weigh.
        self.variance / expected.max(f64::MIN_POSITIVE.sqrt())
    }

    /// Whether it holds the reading in the middle of the one that begins there, both of this order.
    fn holds_the_middle(&self, [map, top, left]: [usize; 3], order: usize) -> bool {
        let is_near = |one: usize, other: usize| one.abs_diff(other) <= order.div_ceil(2);
        self.at[0] == map && is_near(self.at[1], top) && is_near(self.at[2], left)
    }
}

fn differences(number: usize, map: &[f64], columns: usize, order: usize) -> Vec<Difference> {
    let rows = map.len() / columns;
    let mut binomial = vec![1.0];
    for k in 0..order {
        let next = -binomial[k] * (order - k) as f64 / (k + 1) as f64;
        binomial.push(next);
    }
    let gain: f64 = binomial.iter().map(|c| c * c).sum::<f64>().powi(2);
    let mut found = Vec::new();
    for top in 0..rows.saturating_sub(order) {
        for left in 0..columns.saturating_sub(order) {
            let (mut sum, mut second, mut fourth) = (0.0, 0.0, 0.0);
            for (i, a) in binomial.iter().enumerate() {
                for (j, b) in binomial.iter().enumerate() {
                    let square = map[(top + i) * columns + left + j].powi(2);
                    let coefficient = a * b;
                    sum += coefficient * square;
                    second += coefficient * coefficient * square;
                    fourth += coefficient * coefficient * square * square;
                }
            }
            if !sum.is_nan() && second > 0.0 {
                found.push(Difference {
                    variance: sum * sum / (4.0 * gain),
                    second: second / gain,
                    fourth: fourth / gain,
                    at: [number, top, left],
                });
            }
        }
    }
    found
}

/// The squares of both parts of the noise. A reading that stands out is left out, with all differences that hold it: a click is no noise.
///
/// A click is largest in the difference about it. Few of them make the noise seem so large that none stands out; the median of all differences
/// tells by how much.
fn parts(mut differences: Vec<Difference>, order: usize) -> Option<[f64; 2]> {
    let mut found = likeliest(&differences)?;
    for _ in 0..CLEANINGS {
        let mut ratios: Vec<f64> = differences.iter().map(|d| d.over(found)).collect();
        let middle = ratios.len() / 2;
        let usual = *ratios.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN;
        let limit = STANDING_OUT * STANDING_OUT * usual.min(1.0);
        let mut clicks = 0;
        loop {
            let largest = differences.iter().max_by(|a, b| a.over(found).total_cmp(&b.over(found)));
            let Some(about) = largest.filter(|d| d.over(found) > limit).map(|d| d.at) else {
                break;
            };
            differences.retain(|d| !d.holds_the_middle(about, order));
            clicks += 1;
        }
        if clicks == 0 {
            break;
        }
        found = likeliest(&differences)?;
    }
    Some(found)
}

fn likeliest(differences: &[Difference]) -> Option<[f64; 2]> {
    if differences.len() < ENOUGH {
        return None;
    }
    let mean = |of: fn(&Difference) -> f64| differences.iter().map(of).sum::<f64>();
    let variance = mean(|d| d.variance);
    let mut parts = [0.5 * variance / mean(|d| d.second), 0.5 * variance / mean(|d| d.fourth)];
    for _ in 0..STEPS {
        let mut above = [0.0; 2];
        let mut below = [0.0; 2];
        for d in differences {
            let terms = [d.second, d.fourth];
            // A map of no noise at all has nothing to weigh.
            let expected =
                (parts[0] * terms[0] + parts[1] * terms[1]).max(f64::MIN_POSITIVE.sqrt());
            for part in 0..2 {
                above[part] += terms[part] * d.variance / (expected * expected);
                below[part] += terms[part] / expected;
            }
        }
        for part in 0..2 {
            parts[part] *= above[part] / below[part].max(f64::MIN_POSITIVE);
        }
    }
    Some(parts)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use num_complex::Complex64;
    use std::f64::consts::TAU;

    /// Amplitudes over 8 x 8 sources with lobes exp(-3 sin² θ), driven alike or focused, summed one by one.
    fn field(side: usize, step_m: f64, focus_m: Option<[f64; 3]>) -> Vec<f64> {
        let k = TAU * 40e3 / 343.0;
        let centre = |n: usize, of: usize, step: f64| (n as f64 - 0.5 * (of as f64 - 1.0)) * step;
        let distance = |a: [f64; 3], b: [f64; 3]| {
            ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
        };
        (0..side * side)
            .map(|n| {
                let at = [centre(n % side, side, step_m), centre(n / side, side, step_m), 0.1];
                let terms = (0..64).map(|e| {
                    let source = [centre(e % 8, 8, 10.5e-3), centre(e / 8, 8, 10.5e-3), 0.0];
                    let r = distance(at, source);
                    let delay = focus_m.map_or(0.0, |focus| distance(focus, source));
                    let level = (-3.0 * (1.0 - (at[2] / r).powi(2))).exp() / r;
                    Complex64::from_polar(level, k * (r - delay))
                });
                terms.sum::<Complex64>().norm()
            })
            .collect()
    }

    /// The field with both noises, the additive one relative to the rms; and the rms of noise over rms reading.
    fn noisy(field: &[f64], additive: f64, multiplicative: f64, seed: u64) -> (Vec<f64>, f64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let power = field.iter().map(|a| a * a).sum::<f64>() / field.len() as f64;
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let read = |a: &f64| {
            (a * (1.0 + multiplicative * draw()) + additive * power.sqrt() * draw()).abs()
        };
        (field.iter().map(read).collect(), additive.hypot(multiplicative))
    }

    #[test]
    fn the_noise_of_planes_of_all_sizes_and_steps_is_found_to_within_thirty_percent() {
        let mut off = Vec::new();
        for (side, step_m) in
            [(20, 1e-3), (20, 2e-3), (20, 3e-3), (45, 1e-3), (45, 2e-3), (45, 3e-3), (124, 1.4e-3)]
        {
            for focus in [None, Some([0.0, 0.0, 0.08])] {
                let field = field(side, step_m, focus);
                for (seed, (additive, multiplicative)) in
                    [(0.03, 0.0), (0.01, 0.02), (0.04, 0.03)].into_iter().enumerate()
                {
                    let (read, truth) = noisy(&field, additive, multiplicative, seed as u64);
                    let found = PlaneNoise::of(&[(&read, side)]).expect("large enough");
                    off.push((
                        found.relative / truth,
                        side,
                        step_m,
                        focus,
                        additive,
                        found.is_bound,
                    ));
                }
            }
        }
        let wrong: Vec<_> = off.iter().filter(|o| (o.0 - 1.0).abs() > 0.3).collect();
        assert!(wrong.is_empty(), "{} of {}: {wrong:#?}", wrong.len(), off.len());
    }

    #[test]
    fn both_parts_are_told_apart_on_a_large_plane() {
        let field = field(124, 1.4e-3, None);
        let rms = (field.iter().map(|a| a * a).sum::<f64>() / field.len() as f64).sqrt();
        let (read, _) = noisy(&field, 0.02, 0.03, 9);
        let found = PlaneNoise::of(&[(&read, 124)]).expect("large enough");
        assert!((found.additive / rms / 0.02 - 1.0).abs() < 0.2, "{found:?}");
        assert!((found.multiplicative / 0.03 - 1.0).abs() < 0.2, "{found:?}");
        assert!(!found.is_bound);
    }

    #[test]
    fn a_field_that_is_too_fine_for_its_step_gives_a_bound() {
        let field = field(40, 3.6e-3, Some([0.02, 0.015, 0.06]));
        let (read, truth) = noisy(&field, 1e-3, 0.0, 2);
        let found = PlaneNoise::of(&[(&read, 40)]).expect("large enough");
        assert!(found.is_bound && found.relative > truth, "{found:?}");
    }

    #[test]
    fn too_small_maps_gaps_and_silence_give_none() {
        let field = field(20, 2e-3, None);
        assert_eq!(PlaneNoise::of(&[]), None);
        assert_eq!(PlaneNoise::of(&[(&field[..7 * 20], 20)]), None);
        assert_eq!(PlaneNoise::of(&[(&[0.0; 400], 20)]), None);
        assert_eq!(PlaneNoise::of(&[(&[f64::NAN; 400], 20)]), None);
        let (mut read, truth) = noisy(&field, 0.03, 0.0, 4);
        read[30] = f64::NAN;
        let found = PlaneNoise::of(&[(&read, 20)]).expect("most of it is there");
        assert!((found.relative / truth - 1.0).abs() < 0.4, "{found:?}");
    }

    #[test]
    fn clicks_are_no_noise() {
        let (mut read, truth) = noisy(&field(45, 1.4e-3, None), 0.02, 0.0, 3);
        let rms = (read.iter().map(|a| a * a).sum::<f64>() / read.len() as f64).sqrt();
        for n in [300, 1012, 1500, 1777] {
            read[n] += 2.0 * rms;
        }
        let found = PlaneNoise::of(&[(&read, 45)]).expect("large enough");
        assert!((found.relative / truth - 1.0).abs() < 0.15, "{found:?}");
    }

    proptest! {
        /// The unit of the readings changes nothing but the additive part's.
        #[test]
        fn the_unit_does_not_matter(unit in 1e-6..1e6f64) {
            let (read, _) = noisy(&field(16, 2e-3, None), 0.03, 0.01, 1);
            let scaled: Vec<f64> = read.iter().map(|a| a * unit).collect();
            let (one, other) = (
                PlaneNoise::of(&[(&read, 16)]).expect("enough"),
                PlaneNoise::of(&[(&scaled, 16)]).expect("enough"),
            );
            prop_assert!((one.relative / other.relative - 1.0).abs() < 1e-6);
            prop_assert!((one.multiplicative - other.multiplicative).abs() < 1e-6);
        }
    }
}
