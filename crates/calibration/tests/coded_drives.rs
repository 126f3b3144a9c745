//! Calibrations from coded drives, held against elements that are known. The readings come from the virtual rig's physics, the fit from
//! the far field of pistons: they share no field code.

mod support;

use fieldgap_calibration::design::{Design, candidates};
use fieldgap_calibration::{Calibration, CalibrationError, Options, calibrate, verification};
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

#[test]
fn too_few_readings_and_another_array_are_refused() {
    let simulation = simulation(6);
    let bench = Bench::draw(&simulation, 0, 1);
    let places = candidates(&simulation.array);
    let design = Design::choose(&simulation, &places, &[], 70, 1).expect("places");
    let coded = bench.read(&simulation, &design, NOISE);
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
