//! Uniformity and efficiency of the solvers for several foci.

use fieldgap::acoustics::foci::{Quality, Solver, Transfer};
use fieldgap::acoustics::transducer::Piston;
use fieldgap::acoustics::{Array, Medium, Vec3};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const DRAWS: usize = 200;
const ROUNDS: usize = 50;

/// Two to eight positions 100 mm above the array, within 30 mm of its axis along x and y, at least 12 mm apart.
fn places(draws: &mut ChaCha8Rng) -> Vec<Vec3> {
    let wanted = draws.random_range(2..=8);
    let mut places: Vec<Vec3> = Vec::new();
    while places.len() < wanted {
        let mut along = || 0.03 * (2.0 * draws.random::<f64>() - 1.0);
        let place = Vec3::new(along(), along(), 0.1);
        if places.iter().all(|other| (other - place).norm() >= 0.012) {
            places.push(place);
        }
    }
    places
}

/// Quality of every draw for each solver.
fn qualities() -> Vec<(Solver, Vec<Quality>)> {
    let array = Array::square(6, 6, 10.5e-3).expect("not empty");
    let wavenumber = Medium { speed_of_sound_m_s: 343.0 }.wavenumber_rad_m(40e3);
    let mut draws = ChaCha8Rng::seed_from_u64(2026);
    let transfers: Vec<Transfer> = (0..DRAWS)
        .map(|_| Transfer::new(&array, &Piston, wavenumber, &places(&mut draws)))
        .collect();
    let quality = |solver: Solver, transfer: &Transfer| {
        let wanted = vec![1.0; transfer.points()];
        let phases = transfer.solve(solver, &wanted, ROUNDS);
        let drives: Vec<Complex64> =
            phases.into_iter().map(|phase| Complex64::from_polar(1.0, phase)).collect();
        transfer.quality(&drives, &wanted)
    };
    Solver::ALL
        .into_iter()
        .map(|solver| {
            (solver, transfers.iter().map(|transfer| quality(solver, transfer)).collect())
        })
        .collect()
}

#[test]
fn the_weighted_solver_is_the_most_uniform() {
    let qualities = qualities();
    let mean =
        |of: &[Quality], read: fn(&Quality) -> f64| of.iter().map(read).sum::<f64>() / DRAWS as f64;
    let worst = |of: &[Quality], read: fn(&Quality) -> f64| of.iter().map(read).fold(1.0, f64::min);
    let uniformity = |quality: &Quality| quality.uniformity;
    let efficiency = |quality: &Quality| quality.efficiency;
    let mut table = String::new();
    for (solver, of) in &qualities {
        table += &format!(
            "{solver} | {:.2} | {:.2} | {:.2} | {:.2}\n",
            mean(of, uniformity),
            worst(of, uniformity),
            mean(of, efficiency),
            worst(of, efficiency)
        );
    }
    // The figures in the documentation of `acoustics::foci`.
    insta::assert_snapshot!(table);
    let [(_, naive), (_, plain), (_, weighted)] = &qualities[..] else { panic!("three solvers") };
    assert!(mean(weighted, uniformity) > mean(plain, uniformity));
    assert!(mean(plain, efficiency) >= mean(naive, efficiency));
    assert!(mean(weighted, efficiency) > 0.8 * mean(plain, efficiency));
}
