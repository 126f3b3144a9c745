//! A study of growing arrays, whose fields are shared, against each array by itself, in the same run.

use criterion::{Criterion, criterion_group, criterion_main};
use fieldgap::acoustics::{Array, Excitation, Medium, PlaneGrid, Simulation, Simulator, Vec3};
use fieldgap::study::{Study, run};

const MOST: usize = 30;

fn count(criterion: &mut Criterion) {
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
    let mut group = criterion.benchmark_group("1 x 1 to 30 x 30 elements over 101 x 101 points");
    group.sample_size(10);
    group.bench_function("each array by itself, fields alone", |bencher| {
        bencher.iter(|| {
            simulations.iter().map(|simulation| simulation.magnitudes(&points)).collect::<Vec<_>>()
        })
    });
    group.bench_function("the study, figures and all", |bencher| {
        bencher.iter(|| run(&study, false).expect("a set-up at every value"))
    });
    group.finish();
}

criterion_group!(benches, count);
criterion_main!(benches);
