//! The field kernel against the plain sum with library functions, in the same run.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use fieldgap::acoustics::transducer::{MurataFit, Piston, Transducer};
use fieldgap::acoustics::{Array, Excitation, FieldKernel, Medium, PathLengths, PlaneGrid, Vec3};
use num_complex::Complex64;

/// The defining sum for pistons, one pair at a time.
fn plain_sum(array: &Array, phases_rad: &[f64], wavenumber: f64, x: Vec3) -> Complex64 {
    array
        .elements()
        .iter()
        .zip(phases_rad)
        .map(|(element, phase_rad)| {
            let r = x - element.centre_m;
            let d = r.norm();
            let sine = (1.0 - (r.dot(&element.normal) / d).powi(2)).max(0.0).sqrt();
            let ka = wavenumber * element.radius_m * sine;
            let directivity = if ka < 1e-4 { 1.0 } else { 2.0 * libm::j1(ka) / ka };
            Complex64::from_polar(directivity / d, wavenumber * d + phase_rad)
        })
        .sum()
}

fn direct(criterion: &mut Criterion) {
    let array = Array::square(6, 6, 10.5e-3).expect("not empty");
    let medium = Medium { speed_of_sound_m_s: 343.0 };
    let wavenumber = medium.wavenumber_rad_m(40e3);
    let focus = Excitation::Focus(Vec3::new(17.5e-3, -22.5e-3, 0.1));
    let phases_rad = focus.phases_rad(&array, &medium, 40e3);
    let points = PlaneGrid::square(50e-3, 1e-3, 0.1).points();
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");

    let mut group = criterion.benchmark_group("plane of 101 x 101, 6 x 6 elements, one thread");
    group.throughput(Throughput::Elements((points.len() * array.len()) as u64));
    group.bench_function("plain sum, library functions", |bencher| {
        bencher.iter(|| {
            points
                .iter()
                .map(|&x| plain_sum(&array, &phases_rad, wavenumber, x))
                .collect::<Vec<_>>()
        })
    });
    let models: [(&str, &dyn Transducer); 2] =
        [("kernel, piston", &Piston), ("kernel, exponential x Gaussian", &MurataFit::CENTIMETRES)];
    for (name, transducer) in models {
        let kernel =
            FieldKernel::new(&array, &phases_rad, transducer, wavenumber, PathLengths::Observed);
        group.bench_function(name, |bencher| {
            bencher.iter(|| one_thread.install(|| kernel.at(&points)))
        });
    }
    group.finish();
}

criterion_group!(benches, direct);
criterion_main!(benches);
