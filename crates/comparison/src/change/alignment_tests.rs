//! Alignments of fields in closed form, which no simulator of the project makes.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::tests::setup;
use super::*;
use fieldgap_records::RecordedSample;

/// A focus of 5 mm half-width beside the axis with rings of side lobes about it, and three weaker spots that fix the turn.
fn with_side_lobes([x, y]: [f64; 2]) -> f64 {
    let spot = |height: f64, at: [f64; 2]| {
        // As fast as the magnitude varies 100 mm above an array of 60 mm at 40 kHz.
        let r = 400.0 * (x - at[0]).hypot(y - at[1]);
        height * (if r < 1e-6 { 1.0 } else { (r.sin() / r).abs() })
    };
    (spot(3.0, [4e-3, -3e-3]).powi(2)
        + spot(1.1, [-14e-3, 9e-3]).powi(2)
        + spot(0.8, [11e-3, 13e-3]).powi(2)
        + spot(0.6, [-9e-3, -16e-3]).powi(2)
        + 0.01)
        .sqrt()
}

/// Where B truly lies.
#[derive(Clone, Copy)]
struct Truth {
    shift_m: [f64; 2],
    turn_rad: f64,
}

const HERE: Truth = Truth { shift_m: [0.0; 2], turn_rad: 0.0 };

/// A record of a field times a gain, on a grid of 60 mm in the coordinates of B, every place read twice.
fn record(
    field: impl Fn([f64; 2]) -> f64,
    truth: Truth,
    gain: f64,
    noise: f64,
    step_mm: f64,
    seed: u64,
) -> RecordedScan {
    let mut draws = ChaCha8Rng::seed_from_u64(seed);
    let count = (60.0 / step_mm).round() as usize + 1;
    let (sin, cos) = truth.turn_rad.sin_cos();
    let mut samples = Vec::new();
    for _ in 0..2 {
        for n in 0..count * count {
            let along = |k: usize| (step_mm * k as f64 - 30.0) * 1e-3;
            let (x, y) = (along(n % count), along(n / count));
            let at = [cos * x - sin * y + truth.shift_m[0], sin * x + cos * y + truth.shift_m[1]];
            let draw: f64 = StandardNormal.sample(&mut draws);
            let reading = (gain * field(at) + noise * draw).max(0.0);
            samples.push(RecordedSample::measured(
                0.0,
                Some(0),
                Vec3::new(x, y, 0.1),
                reading,
                None,
            ));
        }
    }
    RecordedScan { setup: setup("V", 343.0), samples }
}

#[test]
fn shifts_and_turns_are_found_within_their_errors() {
    let mut scores = Vec::new();
    for seed in 0..24 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let truth = Truth {
            shift_m: [0, 1].map(|_| random.random_range(-12e-3..12e-3)),
            turn_rad: random.random_range(-0.6..0.6),
        };
        let a = record(with_side_lobes, HERE, 1.0, 0.03, 1.5, 100 + seed);
        let b = record(with_side_lobes, truth, 0.9, 0.03, 1.5, 200 + seed);
        let found = aligned_change(&a, &b, Aligning::Pose, Scaling::Gain).expect("alike");
        let alignment = found.alignment.as_ref().expect("aligned");
        let [x, y] = [0, 1].map(|axis| {
            let of = alignment.shift_m[axis];
            (of.value - truth.shift_m[axis]) / of.standard_error
        });
        let turn = (alignment.turn_rad.value - truth.turn_rad) / alignment.turn_rad.standard_error;
        // Three numbers, each within 3.5 standard errors: one in 700 is not, by chance.
        assert!([x, y, turn].iter().all(|z| z.abs() < 3.5), "{seed}: {x} {y} {turn} {alignment:?}");
        assert!(alignment.shift_m[0].standard_error < 0.1e-3, "{alignment:?}");
        let gain = found.overall.gain;
        assert!((gain.value - 0.9).abs() < 0.01, "{gain:?}");
        assert!(alignment.gap_after_alignment < 0.2 * alignment.gap_as_read.expect("common"));
        let chi_square = found.overall.chi_square_per_point;
        assert!((0.6..1.3).contains(&chi_square), "{chi_square}");
        scores.extend([x, y, turn]);
    }
    let rms = (scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64).sqrt();
    // Of 72 numbers the rms scatters by 8 %. Errors of the interpolation are upper bounds.
    assert!((0.6..1.25).contains(&rms), "{rms}");
}

#[test]
fn a_shift_is_found_from_another_grid_and_says_what_it_removed() {
    let truth = Truth { shift_m: [7.3e-3, -5.1e-3], turn_rad: 0.0 };
    let a = record(with_side_lobes, HERE, 1.0, 0.03, 1.5, 1);
    let b = record(with_side_lobes, truth, 1.0, 0.03, 2.0, 2);
    for aligning in [Aligning::Shift, Aligning::Auto] {
        let change = aligned_change(&a, &b, aligning, Scaling::AsRead).expect("alike");
        let alignment = change.alignment.as_ref().expect("aligned");
        assert_eq!(alignment.chosen, Aligning::Shift, "{alignment:?}");
        for axis in 0..2 {
            let of = alignment.shift_m[axis];
            assert!((of.value - truth.shift_m[axis]).abs() < 3.5 * of.standard_error, "{of:?}");
        }
        assert!(alignment.gap_as_read.expect("common") > 0.5);
        assert!(alignment.gap_after_gain.expect("common") > 0.5);
        assert!(alignment.gap_after_alignment < 0.15, "{alignment:?}");
        // The peak lies where it lies in A.
        let [Some(one), Some(other)] = [&change.heights[0].a_figures, &change.heights[0].b_figures]
        else {
            panic!("both are maps")
        };
        let moved = (one.peak_position_m[0].value - other.peak_position_m[0].value).abs();
        assert!(moved < 0.4e-3, "{moved}");
        assert!(change.left_out > 0 && alignment.overlap < 1.0);
    }
}

#[test]
fn auto_leaves_records_where_they_are_if_nothing_moved() {
    let a = record(with_side_lobes, HERE, 1.0, 0.03, 1.5, 3);
    let b = record(with_side_lobes, HERE, 0.95, 0.03, 1.5, 4);
    let change = aligned_change(&a, &b, Aligning::Auto, Scaling::AsRead).expect("alike");
    let alignment = change.alignment.expect("tried");
    assert_eq!(alignment.chosen, Aligning::None, "{alignment:?}");
    assert_eq!(change.overall.interpolated, 0);
    let turned = record(with_side_lobes, Truth { turn_rad: 0.03, ..HERE }, 1.0, 0.03, 1.5, 5);
    let change = aligned_change(&a, &turned, Aligning::Auto, Scaling::AsRead).expect("alike");
    assert_eq!(change.alignment.expect("tried").chosen, Aligning::Pose);
}

#[test]
fn what_the_field_does_not_show_is_not_stated() {
    // A ridge along y: nothing changes with a shift along it.
    let ridge = |[x, _]: [f64; 2]| 0.2 + 2.0 * (-(x / 6e-3).powi(2)).exp();
    let truth = Truth { shift_m: [3e-3, 2e-3], turn_rad: 0.0 };
    let a = record(ridge, HERE, 1.0, 0.03, 2.0, 6);
    let b = record(ridge, truth, 1.0, 0.03, 2.0, 7);
    let change = aligned_change(&a, &b, Aligning::Shift, Scaling::AsRead).expect("alike");
    let alignment = change.alignment.expect("aligned");
    let [x, y] = alignment.shift_m;
    assert!((x.value - 3e-3).abs() < 3.5 * x.standard_error, "{alignment:?}");
    assert!(y.standard_error.is_infinite(), "{alignment:?}");
    assert!(alignment.undetermined.iter().any(|words| words.contains("along y")), "{alignment:?}");
    for seed in 0..5 {
        let flat = |noise_seed: u64| record(|_| 1.0, HERE, 1.0, 0.03, 2.0, noise_seed);
        let (a, b) = (flat(20 + seed), flat(40 + seed));
        let change = aligned_change(&a, &b, Aligning::Shift, Scaling::AsRead).expect("flat");
        let alignment = change.alignment.expect("tried");
        assert_eq!(alignment.chosen, Aligning::None, "{alignment:?}");
        assert_eq!(alignment.undetermined.len(), 2, "{alignment:?}");
    }
}

#[test]
fn maps_that_hardly_overlap_or_are_unlike_are_refused() {
    let a = record(with_side_lobes, HERE, 1.0, 0.03, 2.0, 8);
    let far = Truth { shift_m: [52e-3, 0.0], turn_rad: 0.0 };
    let b = record(with_side_lobes, far, 1.0, 0.03, 2.0, 9);
    let refused = aligned_change(&a, &b, Aligning::Shift, Scaling::AsRead).expect_err("too far");
    assert!(refused.to_string().contains("cannot be aligned"), "{refused}");
    let other = |[x, y]: [f64; 2]| 1.0 + 0.5 * (900.0 * x).sin() * (400.0 * y + 0.3).cos();
    let b = record(other, HERE, 1.0, 0.03, 2.0, 10);
    let refused = aligned_change(&a, &b, Aligning::Pose, Scaling::AsRead).expect_err("unlike");
    assert!(matches!(refused, NoChange::Unlike { .. }), "{refused}");
    let line = RecordedScan {
        samples: a.samples.iter().filter(|sample| sample.position_mm.y == 0.0).copied().collect(),
        ..a.clone()
    };
    let refused = aligned_change(&line, &a, Aligning::Shift, Scaling::AsRead).expect_err("a line");
    assert!(matches!(refused, NoChange::NoMap { .. }), "{refused}");
}

#[test]
fn a_field_that_repeats_itself_has_rivals() {
    let stripes = |[x, y]: [f64; 2]| 1.0 + 0.8 * (700.0 * x).cos() * (700.0 * y).cos();
    let a = record(stripes, HERE, 1.0, 0.03, 1.5, 11);
    let b = record(stripes, Truth { shift_m: [1e-3, 0.5e-3], turn_rad: 0.0 }, 1.0, 0.03, 1.5, 12);
    let change = aligned_change(&a, &b, Aligning::Shift, Scaling::AsRead).expect("alike");
    let alignment = change.alignment.expect("aligned");
    assert!(alignment.undetermined.iter().any(|words| words.contains("repeats")), "{alignment:?}");
}
