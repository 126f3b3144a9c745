//! Receivers that noise comes in before: silence lacks the noise in proportion to the level, and what they compress scatters less.

use fieldgap_diagnosis::{EffectId, diagnose};
use num_complex::Complex64;

use piston::piston;
use square_array::{NOISE, REPEATS, Scan, named_alone, real};

mod piston;
mod square_array;

/// A scan of which `receiver` makes each reading from one that has its noise already, given the largest. The effect is named alone, its level is
/// this share of the largest reading before, and the noise in proportion to the level is found to 15 %. So many places are read again.
fn is_named_beside_its_noise(
    repeats: usize,
    seed: u64,
    effect: EffectId,
    parameter: &str,
    level: f64,
    receiver: impl Fn(f64, f64) -> f64,
) {
    let mut scan = Scan::new(6, &[[5.0, 0.0, 100.0]], 30, &[80.0, 100.0, 120.0]);
    scan.places_m.truncate(3 * 30 * 30 + repeats);
    let mut record = scan
        .read_waves(seed, |element, phase_rad, at| piston(element, at) * Complex64::cis(phase_rad));
    let largest = record.samples.iter().fold(0.0f64, |most, sample| most.max(sample.reading));
    for sample in &mut record.samples {
        sample.reading = receiver(sample.reading, largest);
    }
    let diagnosis = diagnose(&[record], None).expect("comparable");
    named_alone(&diagnosis, effect);
    let found = real(&diagnosis, parameter) / largest;
    assert!((found / level - 1.0).abs() < 0.05, "{found}");
    let share = diagnosis.noise.multiplicative;
    assert!((share / NOISE.0 - 1.0).abs() < 0.15, "{share}");
}

/// What the dark readings do not scatter was told as additive noise, and what strong readings scatter as that of the robot's position.
#[test]
fn a_floor_is_added_to_the_noise() {
    let floor = |reading: f64, largest: f64| reading.hypot(0.1 * largest);
    is_named_beside_its_noise(REPEATS, 56, EffectId::NoiseFloor, "noise-floor.level", 0.1, floor);
}

/// Strong readings have little noise left, and the others were left with as little: what they scatter was told as that of the robot's position.
#[test]
fn a_receiver_compresses_the_noise() {
    let compressed = |reading: f64, largest: f64| reading / (reading / (0.4 * largest)).hypot(1.0);
    is_named_beside_its_noise(
        REPEATS,
        56,
        EffectId::Saturation,
        "saturation.level",
        0.4,
        compressed,
    );
}

/// Sixteen repeats do not tell whether the noise came in before the receiver; all readings do. It was held to come in after it, and a scattered position beside the
/// saturation was told.
#[test]
fn all_readings_tell_that_noise_came_in_before_a_receiver_that_compresses() {
    let compressed = |reading: f64, largest: f64| reading / (reading / (0.4 * largest)).hypot(1.0);
    for seed in [2, 5] {
        is_named_beside_its_noise(
            16,
            seed,
            EffectId::Saturation,
            "saturation.level",
            0.4,
            compressed,
        );
    }
}
