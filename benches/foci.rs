//! What a frame of several foci costs, by solver: each against the naive sum in the same run.

use criterion::{Criterion, criterion_group, criterion_main};
use fieldgap::acoustics::foci::{Solver, Transfer};
use fieldgap::acoustics::transducer::Piston;
use fieldgap::acoustics::{Array, Medium, Vec3};

fn solvers(criterion: &mut Criterion) {
    let array = Array::square(6, 6, 10.5e-3).expect("not empty");
    let wavenumber = Medium { speed_of_sound_m_s: 343.0 }.wavenumber_rad_m(40e3);
    let places: Vec<Vec3> = (0..4)
        .map(|n| std::f64::consts::FRAC_PI_2 * f64::from(n))
        .map(|angle: f64| Vec3::new(0.018 * angle.cos(), 0.018 * angle.sin(), 0.1))
        .collect();
    let transfer = Transfer::new(&array, &Piston, wavenumber, &places);
    let mut group = criterion.benchmark_group("four foci, 6 x 6 elements, 50 rounds");
    for solver in Solver::ALL {
        group.bench_function(solver.to_string(), |bencher| {
            bencher.iter(|| transfer.solve(solver, &[1.0; 4], 50))
        });
    }
    group.finish();
}

criterion_group!(benches, solvers);
criterion_main!(benches);
