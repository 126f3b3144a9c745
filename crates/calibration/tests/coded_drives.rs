//! Calibrations from coded drives, held against elements that are known.

mod support;

use std::time::Instant;

use fieldgap_calibration::design::{Design, candidates};
use fieldgap_calibration::{Calibration, Options, calibrate, verification};
use support::{Bench, simulation};

/// Noise of a reading, relative.
const NOISE: f64 = 0.02;

/// Readings a channel: with four the phases of 16 x 16 elements take nine minutes.
const PER_CHANNEL: usize = 6;

fn calibrated(side: usize, faults: usize, seed: u64) -> (Bench, Calibration, verification::Gap) {
    let simulation = simulation(side);
    let bench = Bench::draw(&simulation, faults, seed);
    let readings = PER_CHANNEL * simulation.array.len();
    let places = candidates(&simulation.array);
    let design = Design::choose(&simulation, &places, &[], readings, seed).expect("places");
    let coded = bench.read(&simulation, &design, NOISE);
    let start = Instant::now();
    let found = calibrate(&simulation, &coded, Options { seed, more_starts: 1 }).expect("enough");
    eprintln!("{:.1} s", start.elapsed().as_secs_f64());
    let others: Vec<_> =
        places.iter().filter(|place| !design.places_m.contains(place)).take(3).copied().collect();
    let check = Design::for_check(&simulation, &others, 60, seed + 1000).expect("places");
    let gap = verification::gap(&found, &simulation, &bench.read(&simulation, &check, NOISE));
    eprintln!(
        "{:?} {:?} chi {:.2} noise {:.4} resid {:.4} setting {:?} gap {gap:?} starts {:?} promise {:?}",
        bench.errors(&found),
        bench.misjudged(&found),
        found.chi_square,
        found.relative_noise,
        found.residual,
        found.setting(),
        found.starts,
        design.promise,
    );
    (bench, found, gap)
}

#[test]
fn the_elements_of_an_ordinary_array_are_found() {
    let (bench, found, gap) = calibrated(6, 0, 3);
    let [phase_deg, gain] = bench.errors(&found);
    assert!(phase_deg < 3.0 && gain < 0.03, "{phase_deg} {gain}");
}

#[test]
#[ignore]
fn large() {
    let (bench, found, gap) = calibrated(16, 3, 3);
    let (bench, found, gap) = calibrated(16, 3, 4);
}
#[test]
#[ignore]
fn dbg() {
    for seed in [3] {
        let s = simulation(16);
        let mut b = Bench::draw(&s, 3, seed);
        eprintln!("dead {:?} rev {:?} swap {:?}", b.dead, b.reversed, b.swapped);
        if std::env::var("NOSWAP").is_ok() { for [x,y] in b.swapped.clone() { b.weights.swap(x,y);} b.swapped.clear(); }
        let per: usize = std::env::var("PER").ok().and_then(|v| v.parse().ok()).unwrap_or(6);
        let places = candidates(&s.array);
        let design = Design::choose(&s, &places, &[], per*256, seed).expect("places");
        eprintln!("{:?}", design.places_m);
        let coded = b.read(&s, &design, NOISE);
        let t = Instant::now();
        let found = calibrate(&s, &coded, Options { seed, more_starts: 0 }).expect("enough");
        eprintln!("{:?} {:?} chi {} out {} {:?}", b.errors(&found), b.misjudged(&found), found.chi_square, found.outliers, t.elapsed());
    }
}
