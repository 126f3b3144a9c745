//! The stated errors of gap and correlation against the scatter of the same scan, made again and again with new noise.

use std::path::Path;

use fieldgap_acoustics::{PlaneGrid, Simulator, Vec3};
use fieldgap_archive::RecordFigures;
use fieldgap_comparison::{Registering, compare};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_text::Uncertain;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// How often the scan is made: the scatter is then known to 1/√(2·300), 4 %.
const SCANS: u64 = 300;

/// Standard deviations from the mean that hold 95 % of a normal distribution.
const COVERS_95: f64 = 1.96;

const SETUP: &str = "format = 1\nname = \"repeated\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
    [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 4\nrows = 4\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
    [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n[[focus]]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 80.0\n";

/// A scan of two planes: readings that differ from the simulation by a pattern of relative size `misfit`, with noise of a constant part
/// (relative to the largest reading) and a proportional one. A corner is measured forty times, and the silence as often, from which the
/// comparison estimates the noise.
fn scan(misfit: f64, additive: f64, proportional: f64, draws: &mut ChaCha8Rng) -> RecordedScan {
    let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), SETUP)).expect("good");
    let mut points = PlaneGrid::square(16e-3, 4e-3, 0.06).points();
    points.extend(PlaneGrid::square(16e-3, 4e-3, 0.1).points());
    points.extend(vec![Vec3::new(0.0, 0.0, 0.06); 40]);
    let simulated = setup.simulation(Simulator::Piston, 0).expect("a focus").magnitudes(&points);
    let largest = simulated.iter().copied().fold(0.0, f64::max);
    let mut noise = || -> f64 { StandardNormal.sample(draws) };
    let mut samples = Vec::new();
    for (at, magnitude) in points.iter().zip(simulated) {
        // A slow pattern, with as much above the simulation as below.
        let pattern = misfit * (at.x * 150.0).sin() * (1.0 + 10.0 * (at.z - 0.08));
        let level = 5.0 * magnitude * (1.0 + pattern) / largest;
        let reading = level * (1.0 + proportional * noise()) + 5.0 * additive * noise();
        samples.push(RecordedSample::measured(0.0, Some(0), *at, reading.max(0.0), None));
    }
    for _ in 0..40 {
        // A detector of magnitude sees two quadratures of noise.
        let silent = (5.0 * additive) * noise().hypot(noise());
        samples.push(RecordedSample::measured(0.0, None, points[0], silent, None));
    }
    RecordedScan { setup, samples }
}

fn repeated(misfit: f64, additive: f64, proportional: f64) -> Vec<RecordFigures> {
    let one = |seed| {
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        let scan = scan(misfit, additive, proportional, &mut draws);
        let comparison =
            compare(&scan, Simulator::Piston, Registering::GainAndShift).expect("comparable");
        RecordFigures::of(&scan, &comparison, None, None)
    };
    (0..SCANS).into_par_iter().map(one).collect()
}

/// Stated over empirical standard deviation, and the share of scans whose 95 % interval holds the mean.
fn stated_against_seen(figures: &[Uncertain]) -> (f64, f64) {
    let count = figures.len() as f64;
    let mean = figures.iter().map(|figure| figure.value).sum::<f64>() / count;
    let variance = figures.iter().map(|figure| (figure.value - mean).powi(2)).sum::<f64>() / count;
    let stated = figures.iter().map(|figure| figure.standard_error.powi(2)).sum::<f64>() / count;
    let holds =
        |figure: &&Uncertain| (figure.value - mean).abs() <= COVERS_95 * figure.standard_error;
    ((stated / variance).sqrt(), figures.iter().filter(holds).count() as f64 / count)
}

/// Stated errors are within 20 % of the scatter: 4 % of it are from the number of scans, and the noise itself is estimated from
/// forty readings, which tell it to 11 %.
fn check(case: &str, figures: &[Uncertain]) {
    let (ratio, coverage) = stated_against_seen(figures);
    println!("{case}: stated/seen {ratio:.3}, 95 % interval holds the mean in {coverage:.3}");
    assert!((0.8..1.25).contains(&ratio), "{case}: stated over seen {ratio}");
    assert!((0.88..=0.99).contains(&coverage), "{case}: coverage {coverage}");
}

fn check_all(case: &str, scans: &[RecordFigures]) {
    let of = |read: &dyn Fn(&RecordFigures) -> Uncertain| -> Vec<Uncertain> {
        scans.iter().map(read).collect()
    };
    check(&format!("{case}, gap"), &of(&|f| f.gap));
    check(&format!("{case}, correlation"), &of(&|f| f.correlation));
    for height in 0..2 {
        check(&format!("{case}, gap at {height}"), &of(&|f| f.heights[height].gap));
        check(&format!("{case}, correlation at {height}"), &of(&|f| f.heights[height].correlation));
    }
}

#[test]
fn a_gap_far_above_the_noise() {
    check_all("misfit", &repeated(0.2, 0.004, 0.02));
}

#[test]
fn a_gap_as_large_as_the_noise() {
    check_all("both", &repeated(0.03, 0.01, 0.02));
}

/// The rule of small errors alone would state √2 times the scatter here.
#[test]
fn a_gap_of_noise_alone_is_the_noise_floor() {
    let scans = repeated(0.0, 0.01, 0.02);
    check_all("noise", &scans);
    let mean = |of: &dyn Fn(&RecordFigures) -> f64| {
        (scans.iter().map(|f| of(f).powi(2)).sum::<f64>() / scans.len() as f64).sqrt()
    };
    let (gap, floor) = (mean(&|f| f.gap.value), mean(&|f| f.noise_floor));
    assert!((gap / floor - 1.0).abs() < 0.05, "gap {gap}, noise floor {floor}");
}

/// E gap² = gap² without noise + noise floor².
#[test]
fn the_bias_of_the_gap_is_the_noise_floor() {
    let mean = |scans: &[RecordFigures], of: &dyn Fn(&RecordFigures) -> f64| {
        scans.iter().map(|f| of(f).powi(2)).sum::<f64>() / scans.len() as f64
    };
    let exact = mean(&repeated(0.03, 0.0, 0.0)[..1], &|f| f.gap.value);
    let noisy = repeated(0.03, 0.01, 0.02);
    let expected = exact + mean(&noisy, &|f| f.noise_floor);
    let seen = mean(&noisy, &|f| f.gap.value);
    assert!((seen / expected - 1.0).abs() < 0.06, "seen {seen}, expected {expected}");
}
