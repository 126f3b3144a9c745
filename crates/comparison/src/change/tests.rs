//! Records of a field in closed form, which no simulator of the project makes.

use std::path::Path;

use proptest::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, ScanSetup};

pub(super) fn setup(unit: &str, speed_m_s: f64) -> ScanSetup {
    let text = format!(
        "format = 1\nname = \"plane\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"{unit}\"\n\
         [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
         [medium]\nspeed_of_sound_m_s = {speed_m_s:?}\n[simulator]\nmodel = \"piston\"\n\
         [[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 100.0\n"
    );
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("a set-up")
}

/// A focal spot of 8 mm with its first side lobe, in volts.
fn field(at_m: Vec3) -> f64 {
    let r = at_m.x.hypot(at_m.y) / 8e-3;
    3.0 * (-r * r).exp() + 0.3 * (2.0 * r).cos().abs()
}

/// A record of the field times a gain on a grid, each place measured twice with noise.
fn record(origin_mm: f64, step_mm: f64, gain: f64, noise: f64, seed: u64) -> RecordedScan {
    let mut draws = ChaCha8Rng::seed_from_u64(seed);
    let count = (30.0 / step_mm).round() as usize;
    let mut samples = Vec::new();
    for _ in 0..2 {
        for n in 0..count * count {
            let along = |k: usize| (origin_mm - 15.0 + step_mm * k as f64) * 1e-3;
            let at_m = Vec3::new(along(n % count), along(n / count), 0.1);
            let draw: f64 = StandardNormal.sample(&mut draws);
            let reading = (gain * field(at_m) + noise * draw).max(0.0);
            samples.push(RecordedSample::measured(0.0, Some(0), at_m, reading, None));
        }
    }
    RecordedScan { setup: setup("V", 343.0), samples }
}

#[test]
fn a_gain_is_found_with_its_error_and_noise_is_noise() {
    let (noise, gain) = (0.02, 1.1);
    let a = record(0.0, 1.5, 1.0, noise, 1);
    let b = record(0.0, 1.5, gain, noise, 2);
    let read = change(&a, &b, Scaling::AsRead).expect("comparable");
    assert!((read.overall.gap - 0.1).abs() < 0.003, "{}", read.overall.gap);
    assert!(read.overall.chi_square_per_point > 5.0);
    let found = read.overall.gain;
    assert!((found.value - gain).abs() < 4.0 * found.standard_error, "{found:?}");
    assert!(found.standard_error < 2e-3, "{found:?}");
    let scaled = change(&a, &b, Scaling::Gain).expect("comparable");
    // 400 places: the mean of their squares scatters by √(2/400) = 0.07, the estimated noise by as much.
    let chi = scaled.overall.chi_square_per_point;
    assert!((chi - 1.0).abs() < 0.35, "{chi}");
    assert!(scaled.overall.beyond_three < 0.015 && scaled.left_out == 0);
    let [Some(one), Some(other)] = [&scaled.heights[0].a_figures, &scaled.heights[0].b_figures]
    else {
        panic!("both are maps")
    };
    assert!((other.peak.value / one.peak.value - gain).abs() < 0.03);
}

#[test]
fn on_a_coarse_grid_without_repeats_the_difference_shows_the_noise() {
    // A step of 3 mm across a focus of 8 mm: the field's own third differences are a hundred times those of the noise.
    let noise = 0.01;
    let once = |gain: f64, seed: u64| {
        let mut record = record(0.0, 3.0, gain, noise, seed);
        record.samples.truncate(100);
        record
    };
    let (a, b) = (once(1.0, 11), once(1.2, 12));
    let change = change(&a, &b, Scaling::Gain).expect("comparable");
    let chi = change.overall.chi_square_per_point;
    assert!((0.5..2.0).contains(&chi), "{chi}");
    for noise_found in [&change.noise_a, &change.noise_b] {
        let at = noise_found.at(0.5);
        assert!((0.5 * noise..2.0 * noise).contains(&at), "{noise_found:?}");
    }
    // A place that really changed is far beyond it.
    let mut changed = b.clone();
    changed.samples[44].reading += 0.2;
    let change = super::change(&a, &changed, Scaling::Gain).expect("comparable");
    let largest = change.heights[0].places.iter().map(|place| place.in_standard_errors().abs());
    assert!(largest.fold(0.0, f64::max) > 4.0);
}

#[test]
fn another_grid_is_interpolated_with_its_error() {
    let a = record(0.0, 1.5, 1.0, 0.01, 3);
    let b = record(0.7, 1.2, 1.0, 0.01, 4);
    let change = change(&a, &b, Scaling::AsRead).expect("comparable");
    let height = &change.heights[0];
    assert!(height.figures.interpolated > 300 && change.left_out > 0, "{:?}", height.figures);
    assert_eq!(change.left_out + height.figures.points, 400);
    assert!(height.interpolation_error.is_some_and(|error| error > 0.005));
    // The stated error is an upper bound, as noise is in it.
    assert!((0.2..1.2).contains(&height.figures.chi_square_per_point), "{:?}", height.figures);
    // A change larger than that error shows.
    let moved = record(2.7, 1.2, 1.0, 0.01, 5);
    let shifted = RecordedScan {
        samples: moved
            .samples
            .iter()
            .map(|sample| RecordedSample {
                position_mm: sample.position_mm - Vec3::new(2.0, 0.0, 0.0),
                ..*sample
            })
            .collect(),
        ..moved
    };
    let change = super::change(&a, &shifted, Scaling::AsRead).expect("comparable");
    assert!(change.overall.chi_square_per_point > 5.0, "{:?}", change.overall);
}

#[test]
fn a_change_of_the_air_is_predicted_by_the_set_ups() {
    // Readings that follow the simulator: what is tested is the bookkeeping of the prediction, not the field.
    let of = |speed_m_s: f64| {
        let setup = setup("V", speed_m_s);
        let places = record(0.0, 1.5, 1.0, 0.0, 0).samples;
        let simulation = setup.simulation(setup.simulator, 0).expect("focus 0");
        let samples = places.iter().map(|sample| {
            let p = simulation.magnitudes(&[sample.position_m()])[0];
            RecordedSample { reading: 7.0 * p, ..*sample }
        });
        RecordedScan { samples: samples.collect(), setup }
    };
    let (cold, warm) = (of(338.0), of(349.0));
    let change = change(&cold, &warm, Scaling::AsRead).expect("comparable");
    assert!(
        change.explained_by_set_up.is_some_and(|share| share > 0.999),
        "{:?}",
        change.explained_by_set_up
    );
    assert_eq!(change.conditions.len(), 1);
    assert_eq!(
        (change.conditions[0].what, change.conditions[0].b.as_str()),
        ("speed of sound", "349.00 m/s")
    );
    let same = super::change(&cold, &cold, Scaling::AsRead).expect("comparable");
    assert_eq!((same.explained_by_set_up, same.conditions), (None, vec![]));
}

#[test]
fn records_without_common_places_or_units_are_refused_in_words() {
    let a = record(0.0, 1.5, 1.0, 0.01, 1);
    let far = record(500.0, 1.5, 1.0, 0.01, 1);
    let refused = change(&a, &far, Scaling::AsRead).expect_err("far away").to_string();
    assert!(
        refused.contains("0 places in common") && refused.contains("x 485.0 to 513.5 mm"),
        "{refused}"
    );
    let counts = RecordedScan { setup: setup("count", 343.0), ..record(0.0, 1.5, 1000.0, 10.0, 1) };
    let refused = change(&a, &counts, Scaling::AsRead).expect_err("another unit").to_string();
    assert!(refused.contains("`--register gain`"), "{refused}");
    assert!(change(&a, &counts, Scaling::Gain).is_ok());
    let nothing = RecordedScan { samples: Vec::new(), ..a.clone() };
    let refused = change(&a, &nothing, Scaling::AsRead).expect_err("nothing").to_string();
    assert!(refused.contains("no reading with the array driven"), "{refused}");
    let mut silent = a.clone();
    silent.samples.iter_mut().for_each(|sample| sample.reading = 0.0);
    assert_eq!(
        change(&a, &silent, Scaling::AsRead).expect_err("silent"),
        NoChange::AllZero("plane".to_owned())
    );
}

#[test]
fn the_text_says_what_changed() {
    let change =
        change(&record(0.0, 1.5, 1.0, 0.02, 1), &record(0.0, 1.5, 1.1, 0.02, 2), Scaling::AsRead)
            .expect("comparable");
    insta::assert_snapshot!(change.to_text());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    #[test]
    fn a_record_is_the_same_as_itself_whatever_its_gain(gain in 0.01..1000.0f64, step in 1.0..4.0f64, seed in 0..100u64) {
        let one = record(0.0, step, gain, 0.02 * gain, seed);
        let same = change(&one, &one, Scaling::AsRead).expect("comparable");
        prop_assert_eq!((same.overall.gap, same.overall.chi_square_per_point, same.left_out), (0.0, 0.0, 0));
        prop_assert!((same.overall.gain.value - 1.0).abs() < 1e-12);
    }
}
