//! A study of growing arrays, which share their sums, against separate arrays: `cargo bench --bench study`.
//!
//! Both are the best of several runs, in turn, on all threads.

use std::hint::black_box;
use std::time::Instant;

use fieldgap::acoustics::{Array, Excitation, Medium, PlaneGrid, Simulation, Simulator, Vec3};
use fieldgap::study::{Study, run};

const ROUNDS: usize = 8;
const MOST: usize = 30;

fn main() {
    let source = Study::of_thesis("count").expect("a study of the thesis");
    let study = Study::read(source).expect("a good file");
    let points = PlaneGrid::square(50e-3, 1e-3, 0.1).points();
    let simulations: Vec<Simulation> = (1..=MOST)
        .map(|side| Simulation {
            simulator: Simulator::Corrected,
            array: Array::square(side, side, 10.5e-3).expect("not empty"),
            medium: Medium { speed_of_sound_m_s: 343.0 },
            frequency_hz: 40e3,
            excitation: Excitation::Focus(Vec3::new(0.0, 0.0, 0.1)),
        })
        .collect();
    let (mut alone, mut shared) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..ROUNDS {
        let start = Instant::now();
        for simulation in &simulations {
            black_box(simulation.magnitudes(&points));
        }
        alone = alone.min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        black_box(run(&study, false).expect("a set-up at every value"));
        shared = shared.min(start.elapsed().as_secs_f64());
    }
    println!(
        "1 x 1 to 30 x 30 elements over 101 x 101 points: study, figures and all, {:.0} ms; each field by itself {:.0} ms; \
         {:.1} x",
        shared * 1e3,
        alone * 1e3,
        alone / shared
    );
}
