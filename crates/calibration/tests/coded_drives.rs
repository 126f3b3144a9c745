//! Calibrations from coded drives, held against elements that are known. The readings come from the virtual rig's physics, the fit from
//! the far field of pistons: they share no field code.

mod support;

use fieldgap_acoustics::Simulation;
use fieldgap_calibration::design::{Design, candidates};
use fieldgap_calibration::{
    Calibration, CalibrationError, CodedReadings, Options, calibrate, verification,
};
use support::{Bench, simulation};

/// Noise of a reading, relative.
const NOISE: f64 = 0.02;

/// Readings a channel. Ten minutes allow ten and more.
const PER_CHANNEL: usize = 10;

fn calibrated(side: usize, faults: usize, seed: u64) -> (Bench, Calibration, verification::Gap) {
    let simulation = simulation(side);
    let bench = Bench::draw(&simulation, faults, seed);
    let readings = PER_CHANNEL * simulation.array.len();
    let places = candidates(&simulation.array);
    let design = Design::choose(&simulation, &places, &[], readings, seed).expect("places");
    let coded = bench.read(&simulation, &design, NOISE);
    let found = calibrate(&simulation, &coded, Options { seed, more_starts: 1 }).expect("enough");
    let others: Vec<_> =
        places.iter().filter(|place| !design.places_m.contains(place)).take(3).copied().collect();
    let check = Design::for_check(&simulation, &others, 60, seed + 1000).expect("places");
    let gap = verification::gap(&found, &simulation, &bench.read(&simulation, &check, NOISE));
    (bench, found, gap)
}

#[test]
fn the_elements_of_an_ordinary_array_are_found() {
    let (bench, found, gap) = calibrated(6, 0, 3);
    let [phase_deg, gain] = bench.errors(&found);
    assert!(phase_deg < 3.0 && gain < 0.03, "{phase_deg} {gain}");
    assert_eq!(bench.misjudged(&found), [0, 0]);
    assert!(gap.before > 4.0 * NOISE && gap.after < 1.5 * NOISE, "{gap:?}");
    assert!(found.starts.iter().all(|start| start.is_same), "{:?}", found.starts);
}

#[test]
fn dead_reversed_and_swapped_channels_are_found_and_none_is_invented() {
    let (bench, found, _) = calibrated(6, 1, 7);
    assert_eq!(bench.misjudged(&found), [0, 0], "{:?}", found.faults().collect::<Vec<_>>());
    let [phase_deg, gain] = bench.errors(&found);
    assert!(phase_deg < 3.0 && gain < 0.03, "{phase_deg} {gain}");
}

/// So many readings of an ordinary array.
fn read(simulation: &Simulation, readings: usize) -> CodedReadings {
    let places = candidates(&simulation.array);
    let design = Design::choose(simulation, &places, &[], readings, 1).expect("places");
    Bench::draw(simulation, 0, 1).read(simulation, &design, NOISE)
}

/// Weights of exchanged channels can come out ordinary (16, 47), or another pair is predicted to explain more (45).
#[test]
fn exchanged_channels_are_found_where_their_weights_do_not_show_it() {
    for seed in [16, 45, 47] {
        let (bench, found, _) = calibrated(6, 1, seed);
        assert_eq!(bench.misjudged(&found), [0, 0], "{seed}");
    }
}

#[test]
fn a_fit_that_leaves_far_more_than_the_noise_says_so() {
    let simulation = simulation(6);
    let mut coded = read(&simulation, 360);
    let is_said = |coded: &_| {
        let found = calibrate(&simulation, coded, Options::default()).expect("enough");
        found.ambiguities.iter().any(|text| text.contains("times the noise"))
    };
    assert!(!is_said(&coded));
    // Readings under other drives than the record says.
    let drives = coded.drives.len();
    coded.readings.iter_mut().for_each(|reading| reading.drive = (reading.drive + 1) % drives);
    assert!(is_said(&coded));
}

#[test]
fn too_few_readings_and_another_array_are_refused() {
    let simulation = simulation(6);
    let coded = read(&simulation, 70);
    let refused = calibrate(&simulation, &coded, Options::default()).expect_err("too few");
    assert_eq!(refused, CalibrationError::TooFew { readings: 70, elements: 36 });
    let other = support::simulation(5);
    let refused = calibrate(&other, &coded, Options::default()).expect_err("another array");
    assert_eq!(refused, CalibrationError::OtherArray { channels: 36, elements: 25 });
}

#[test]
#[ignore = "half a minute: 256 elements with three dead, three reversed and three swapped pairs"]
fn a_large_array_with_many_faults_is_calibrated() {
    let (bench, found, _) = calibrated(16, 3, 3);
    let [phase_deg, gain] = bench.errors(&found);
    assert!(phase_deg < 3.0 && gain < 0.03, "{phase_deg} {gain}");
    assert_eq!(bench.misjudged(&found), [0, 0]);
}

/// The accuracy that docs/calibration.md states for arrays of 256 elements, over 200 of them. Faults and set-ups differ from array to
/// array; every array is fitted as `calibrate` does it.
#[test]
#[ignore = "an hour: 200 arrays of 256 elements"]
fn faults_of_two_hundred_large_arrays_are_found_and_none_is_invented() {
    const ARRAYS: u64 = 200;
    /// Seeds from here on: no other test draws them.
    const FIRST_SEED: u64 = 20_261_801;
    let mut worst = [0.0_f64; 3];
    let mut misjudged = Vec::new();
    for n in 0..ARRAYS {
        let faults = usize::try_from(n % 4).expect("small");
        let (bench, found, gap) = calibrated(16, faults, FIRST_SEED + n);
        let [phase_deg, gain] = bench.errors(&found);
        let wrong = bench.misjudged(&found);
        println!(
            "{n} {faults} of each fault: phase {phase_deg:.3} deg, gain {gain:.4}, missed and invented {wrong:?}, gap {:.4} to {:.4}",
            gap.before, gap.after
        );
        for (worst, value) in worst.iter_mut().zip([phase_deg, gain, gap.after / NOISE]) {
            *worst = worst.max(value);
        }
        if wrong != [0, 0] {
            misjudged.push((n, wrong));
        }
    }
    println!("largest phase error, gain error and residual in units of the noise: {worst:?}");
    assert_eq!(misjudged, [], "array, faults missed and invented");
    assert!(worst[0] < 3.0 && worst[1] < 0.03, "{worst:?}");
}
