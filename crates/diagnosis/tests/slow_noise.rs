//! Receivers whose level wanders slowly. The noise has a spectrum of 1/f as a sum of sines, and shares nothing with the diagnosis.

use std::f64::consts::TAU;

use fieldgap_acoustics::Element;
use fieldgap_diagnosis::{Diagnosis, EffectId, Verdict, diagnose};
use fieldgap_records::RecordedScan;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use piston::piston;
use square_array::{Scan, named_alone, real};

mod piston;
mod square_array;

/// Standard deviation of the level where it wanders.
const WANDERS: f64 = 0.012;

/// The scan of an array with this pitch over the believed one.
fn read(seed: u64, pitch: f64) -> RecordedScan {
    let scan = Scan::new(6, &[[5.0, 0.0, 100.0]], 30, &[80.0, 100.0, 120.0]);
    scan.read_waves(seed, |element, phase_rad, at| {
        let element = Element { centre_m: pitch * element.centre_m, ..*element };
        piston(&element, at) * Complex64::cis(phase_rad)
    })
}

/// Each reading of a driven array times a factor, given its number and how many there are.
fn times(record: &mut RecordedScan, factor: impl Fn(usize, usize) -> f64) {
    let driven = record.samples.iter_mut().filter(|sample| sample.focus.is_some());
    let driven: Vec<_> = driven.collect();
    let count = driven.len();
    for (number, sample) in driven.into_iter().enumerate() {
        sample.reading *= factor(number, count);
    }
}

/// Sines of one to a thousand periods in a scan, each with the power of 1/f.
fn wander(record: &mut RecordedScan, seed: u64) {
    const MOST: u32 = 1000;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let waves: Vec<[f64; 3]> = (1..=MOST)
        .map(f64::from)
        .map(|periods| [periods, periods.sqrt().recip(), random.random_range(0.0..TAU)])
        .collect();
    let power: f64 = waves.iter().map(|[_, amplitude, _]| 0.5 * amplitude * amplitude).sum();
    times(record, |number, count| {
        let turn = TAU * number as f64 / count as f64;
        let sum: f64 =
            waves.iter().map(|[n, amplitude, at]| amplitude * (n * turn + at).sin()).sum();
        1.0 + WANDERS * sum / power.sqrt()
    });
}

fn diagnosed(record: RecordedScan) -> Diagnosis {
    diagnose(&[record], None).expect("comparable")
}

#[test]
fn a_level_that_wanders_slowly_is_noise_and_no_cause() {
    for seed in 1..=4 {
        let mut record = read(seed, 1.0);
        wander(&mut record, seed);
        let diagnosis = diagnosed(record);
        assert_eq!(diagnosis.verdict, Verdict::None, "{seed}: {}", diagnosis.to_text());
        let found = diagnosis.slow_noise.expect("slow noise");
        assert!((0.6..1.6).contains(&(found / WANDERS)), "{seed}: {found}");
    }
}

#[test]
fn a_cause_beside_a_level_that_wanders_is_named_alone() {
    let mut record = read(5, 1.02);
    wander(&mut record, 5);
    let diagnosis = diagnosed(record);
    named_alone(&diagnosis, EffectId::Pitch);
    let found = real(&diagnosis, "pitch.ratio");
    assert!((found - 1.02).abs() < 2e-3, "{found}");
}

#[test]
fn noise_of_each_reading_alone_is_no_slow_noise() {
    for seed in 11..=14 {
        let diagnosis = diagnosed(read(seed, 1.0));
        assert_eq!(diagnosis.verdict, Verdict::None, "{seed}");
        assert_eq!(diagnosis.slow_noise, None, "{seed}");
    }
}

/// Slow noise would make up for most of it, and the verdict would be that nothing is amiss.
#[test]
fn a_step_of_the_level_is_no_slow_noise() {
    for (seed, step) in [(21, 0.08), (22, -0.08), (23, 0.15)] {
        let mut record = read(seed, 1.0);
        times(&mut record, |number, count| if 2 * number > count { 1.0 + step } else { 1.0 });
        let diagnosis = diagnosed(record);
        assert_eq!(diagnosis.verdict, Verdict::Unexplained, "{step}: {}", diagnosis.to_text());
    }
}
