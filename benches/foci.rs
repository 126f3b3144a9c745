//! Time of a frame with several foci, by solver, relative to the naive sum in the same run: `cargo bench --bench foci`.
//!
//! Each figure is the best of several runs, the solvers in turn, so that other load on the machine affects all.

use std::hint::black_box;
use std::time::Instant;

use fieldgap::acoustics::foci::{Solver, Transfer};
use fieldgap::acoustics::transducer::Piston;
use fieldgap::acoustics::{Array, Medium, Vec3};

const RUNS: usize = 200;

/// Iterations of the solvers, the default of a display.
const ROUNDS: usize = 50;

fn main() {
    let array = Array::square(6, 6, 10.5e-3).expect("not empty");
    let wavenumber = Medium { speed_of_sound_m_s: 343.0 }.wavenumber_rad_m(40e3);
    let places: Vec<Vec3> = (0..4)
        .map(|n| std::f64::consts::FRAC_PI_2 * f64::from(n))
        .map(|angle: f64| Vec3::new(0.018 * angle.cos(), 0.018 * angle.sin(), 0.1))
        .collect();
    let transfer = Transfer::new(&array, &Piston, wavenumber, &places);
    let mut best_s = Solver::ALL.map(|_| f64::INFINITY);
    for _ in 0..RUNS {
        for (best_s, solver) in best_s.iter_mut().zip(Solver::ALL) {
            let start = Instant::now();
            black_box(transfer.solve(solver, black_box(&[1.0; 4]), ROUNDS));
            *best_s = best_s.min(start.elapsed().as_secs_f64());
        }
    }
    println!("four foci, 6 x 6 elements, {ROUNDS} rounds");
    for (solver, seconds) in Solver::ALL.into_iter().zip(best_s) {
        println!("{solver:>17} {:>9.1} us {:>7.1} times naive", seconds * 1e6, seconds / best_s[0]);
    }
}
