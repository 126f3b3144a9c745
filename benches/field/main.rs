//! The field kernel against references in the same run: `cargo bench --bench field`.
//!
//! Each figure is the best of several runs, reference and kernel in turn, so that other load on the machine affects both.

mod autd3;
mod ceiling;
mod reference;

use std::hint::black_box;
use std::time::Instant;

use fieldgap::acoustics::transducer::{
    DescribedTransducer, Directivity, MeasuredTable, MultiGaussian, MurataFit, OnAxis, Piston,
    SymmetricGaussian, Transducer,
};
use fieldgap::acoustics::{
    Array, DifferentiableKernel, Excitation, FieldKernel, InstructionSet, Medium, Parameter,
    PathLengths, PlaneGrid, Precision, Vec3,
};
use num_complex::Complex64;
use rayon::{ThreadPool, ThreadPoolBuilder};

const ROUNDS: usize = 30;

/// A benchmark case.
struct Case {
    name: &'static str,
    array: Array,
    phases_rad: Vec<f64>,
    wavenumber_rad_m: f64,
    points_m: Vec<Vec3>,
}

impl Case {
    fn new(name: &'static str, side: usize, points_m: Vec<Vec3>) -> Self {
        let array = Array::square(side, side, 10.5e-3).expect("not empty");
        let medium = Medium { speed_of_sound_m_s: 343.0 };
        let focus = Excitation::Focus(Vec3::new(17.5e-3, -22.5e-3, 0.1));
        let phases_rad = focus.phases_rad(&array, &medium, 40e3);
        let wavenumber_rad_m = medium.wavenumber_rad_m(40e3);
        Self { name, array, phases_rad, wavenumber_rad_m, points_m }
    }

    fn kernel(&self, transducer: &dyn Transducer) -> FieldKernel {
        let k = self.wavenumber_rad_m;
        FieldKernel::new(&self.array, &self.phases_rad, transducer, k, PathLengths::Observed)
    }

    fn differentiable<'t>(&self, transducer: &'t dyn Transducer) -> DifferentiableKernel<'t> {
        let (phases, k) = (&self.phases_rad, self.wavenumber_rad_m);
        DifferentiableKernel::new(&self.array, phases, transducer, k, PathLengths::Observed)
    }

    /// Million pairs of point and element.
    fn pairs(&self) -> f64 {
        1e-6 * (self.points_m.len() * self.array.len()) as f64
    }
}

/// The best times of several functions called in turn, seconds.
fn best<const N: usize>(rounds: usize, mut works: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut best = [f64::INFINITY; N];
    for _ in 0..rounds {
        for (best, work) in best.iter_mut().zip(&mut works) {
            let start = Instant::now();
            work();
            *best = best.min(start.elapsed().as_secs_f64());
        }
    }
    best
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name"));
    model
        .map_or("unknown".to_owned(), |model| model.trim_start_matches(['\t', ' ', ':']).to_owned())
}

fn main() {
    let plane = PlaneGrid::square(50e-3, 1e-3, 0.1);
    let volume = (0..40).flat_map(|layer| {
        PlaneGrid::square(35e-3, 1e-3, 0.05 + 2.5e-3 * f64::from(layer)).points()
    });
    let wide = PlaneGrid::square(0.125, 0.5e-3, 0.1);
    let a = Case::new("a: 6 x 6, plane of 101 x 101", 6, plane.points());
    let b = Case::new("b: 6 x 6, volume of 71 x 71 x 40", 6, volume.collect());
    let c = Case::new("c: 30 x 30, plane of 501 x 501", 30, wide.points());

    println!("processor: {}, {:?}", processor(), InstructionSet::best());
    println!("million pairs of point and element a second, best of {ROUNDS} rounds\n");
    pool(1).install(|| {
        against_references(&a);
        against_emulator(&a, &plane);
        models(&a);
        derivatives(&a);
    });
    cases(&[&a, &b, &c]);
    structure(&c, &wide);
    many_drives(&a);
}

/// One thread: the plain loop, each instruction set, and the hand-written ceiling.
fn against_references(case: &Case) {
    println!("{}, one thread, piston", case.name);
    let ka = case.wavenumber_rad_m * 4.5e-3;
    let elements = reference::Elements::new(&case.array, &case.phases_rad);
    let mut plain = || {
        black_box(reference::plain(&elements, case.wavenumber_rad_m, ka, &case.points_m));
    };
    for &set in InstructionSet::ALL.iter().filter(|set| set.is_available()) {
        let double = case.kernel(&Piston).with_instructions(set);
        let single = double.clone().with_precision(Precision::Single);
        let [slow, f64_s, f32_s] = best(
            ROUNDS,
            [
                &mut plain,
                &mut || {
                    black_box(double.at(&case.points_m));
                },
                &mut || {
                    black_box(single.at(&case.points_m));
                },
            ],
        );
        let pairs = case.pairs();
        println!(
            "  {:10} f64 {:6.0} = {:5.1} x plain loop with libm ({:.0}); f32 {:6.0} = {:5.1} x",
            format!("{set:?}"),
            pairs / f64_s,
            slow / f64_s,
            pairs / slow,
            pairs / f32_s,
            slow / f32_s
        );
    }
    let plain_field = reference::plain(&elements, case.wavenumber_rad_m, ka, &case.points_m);
    for ceiling in ceiling::all() {
        let run = |out: &mut [Vec<f64>; 2]| {
            (ceiling.run)(&elements, case.wavenumber_rad_m, ka, &case.points_m, out);
        };
        let mut out = [vec![0.0; case.points_m.len()], vec![0.0; case.points_m.len()]];
        run(&mut out);
        let apart =
            plain_field.iter().enumerate().map(|(n, p)| (p.re - out[0][n]).hypot(p.im - out[1][n]));
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < ceiling.tolerance * 300.0, "{}: off by {apart:e}", ceiling.name);
        let kernel =
            case.kernel(&Piston).with_instructions(ceiling.set).with_precision(ceiling.precision);
        let [top, ours] = best(
            ROUNDS,
            [&mut || run(black_box(&mut out)), &mut || {
                black_box(kernel.at(&case.points_m));
            }],
        );
        println!(
            "  {:14} hand-written ceiling {:6.0}; kernel {:6.0} = {:.2} of it",
            ceiling.name,
            case.pairs() / top,
            case.pairs() / ours,
            top / ours
        );
    }
}

/// One thread, f32: the emulator of AUTD3 against the kernel, which recomputes distances each time.
fn against_emulator(case: &Case, plane: &PlaneGrid) {
    println!("\n{}, one thread, f32, against autd3-emulator (monopoles)", case.name);
    let monopole =
        DescribedTransducer { on_axis: OnAxis::Spherical, directivity: Directivity::Even };
    let emulated = autd3::Recorded::new(case, plane);
    let mut kept = emulated.prepared();
    let [monopoles, pistons] = [&monopole as &dyn Transducer, &Piston]
        .map(|model| case.kernel(model).with_precision(Precision::Single));
    assert_alike(&monopoles.at(&case.points_m), &autd3::levels(&mut kept));
    let [period, prepared, monopoles, pistons] = best(
        ROUNDS,
        [
            &mut || {
                black_box(autd3::levels(&mut kept));
            },
            &mut || {
                black_box(autd3::levels(&mut emulated.prepared()));
            },
            &mut || {
                black_box(monopoles.at(&case.points_m));
            },
            &mut || {
                black_box(pistons.at(&case.points_m));
            },
        ],
    );
    let pairs = case.pairs();
    println!(
        "  its distances kept {:.0}, not kept {:.0}; kernel {:.0} = {:.1} and {:.1} x, its pistons {:.0} = {:.1} and {:.1} x",
        pairs / period,
        pairs / prepared,
        pairs / monopoles,
        period / monopoles,
        prepared / monopoles,
        pairs / pistons,
        period / pistons,
        prepared / pistons
    );
}

/// The same field up to a factor; with 256 phase steps the error is a hundredth of a radian.
fn assert_alike(ours: &[Complex64], theirs: &[f32]) {
    let ours: Vec<f64> = ours.iter().map(|pressure| pressure.norm()).collect();
    let peak = ours.iter().copied().fold(0.0, f64::max);
    let scale = peak / f64::from(theirs.iter().copied().fold(0.0, f32::max));
    let apart = ours.iter().zip(theirs).map(|(a, b)| (a - scale * f64::from(*b)).abs());
    let apart = apart.fold(0.0, f64::max) / peak;
    assert!(ours.len() == theirs.len() && apart < 0.02, "another field: {apart:.3} of the peak");
}

/// One thread: every transducer model.
fn models(case: &Case) {
    let angles_deg: Vec<f64> = (0..=18).map(|n| 5.0 * f64::from(n)).collect();
    let pressures: Vec<f64> = angles_deg.iter().map(|deg| deg.to_radians().cos().powi(3)).collect();
    let table = MeasuredTable::new(&angles_deg, &pressures).expect("a table");
    let table = DescribedTransducer {
        on_axis: OnAxis::Absorbed { amplitude: 1.0, attenuation_np_m: 0.15 },
        directivity: Directivity::Table(table),
    };
    let models: [(&str, &dyn Transducer); 5] = [
        ("piston", &Piston),
        ("multi-gaussian", &MultiGaussian),
        ("gaussian", &SymmetricGaussian::MURATA),
        ("exponential x Gaussian", &MurataFit::CENTIMETRES),
        ("table, absorbed", &table),
    ];
    println!("\nmodels, one thread");
    for (name, transducer) in models {
        let double = case.kernel(transducer);
        let single = double.clone().with_precision(Precision::Single);
        let [f64_s, f32_s] = best(
            ROUNDS,
            [
                &mut || {
                    black_box(double.at(&case.points_m));
                },
                &mut || {
                    black_box(single.at(&case.points_m));
                },
            ],
        );
        println!("  {name:24} f64 {:6.0}, f32 {:6.0}", case.pairs() / f64_s, case.pairs() / f32_s);
    }
}

/// One thread: four derivatives with the field, over the field.
fn derivatives(case: &Case) {
    const FOUR: [Parameter; 4] = [Parameter::X, Parameter::Y, Parameter::Z, Parameter::SoundSpeed];
    println!(
        "\nfield and four derivatives (x, y, z, speed of sound) over the field alone, one thread"
    );
    let models: [(&str, &dyn Transducer); 2] =
        [("piston", &Piston), ("exponential x Gaussian", &MurataFit::CENTIMETRES)];
    for (name, transducer) in models {
        let kernel = case.differentiable(transducer);
        let [field, all] = best(
            ROUNDS,
            [
                &mut || {
                    black_box(kernel.kernel().at(&case.points_m));
                },
                &mut || {
                    black_box(kernel.derivatives_at(&FOUR, &case.points_m));
                },
            ],
        );
        println!("  {name:24} {:.2} x", all / field);
    }
}

/// The cases with one and two threads, and in two independent simultaneous runs, which show the capacity of the cores.
fn cases(cases: &[&Case]) {
    println!("\ncases, piston, one thread, two threads, and two runs of one thread at once");
    let [one, other, two] = [1, 1, 2].map(pool);
    for case in cases {
        for precision in [Precision::Double, Precision::Single] {
            let kernel = case.kernel(&Piston).with_precision(precision);
            let rounds = if case.pairs() > 100.0 { 10 } else { 100 };
            let field = || {
                black_box(kernel.at(&case.points_m));
            };
            let both = || {
                std::thread::scope(|scope| {
                    scope.spawn(|| other.install(field));
                    one.install(field);
                });
            };
            let [alone, shared, apart] = best(
                rounds,
                [&mut || one.install(field), &mut || two.install(field), &mut || both()],
            );
            println!(
                "  {:34} {precision:?}: {:6.0} and {:6.0} = {:.2} x, apart {:.2} x",
                case.name,
                case.pairs() / alone,
                case.pairs() / shared,
                alone / shared,
                2.0 * alone / apart
            );
        }
    }
}

/// A plane by its structure against the direct sum.
fn structure(case: &Case, grid: &PlaneGrid) {
    println!("\n{}, by structure over direct, one thread", case.name);
    let models: [(&str, &dyn Transducer); 3] = [
        ("piston", &Piston),
        ("gaussian", &SymmetricGaussian::MURATA),
        ("exponential x Gaussian", &MurataFit::CENTIMETRES),
    ];
    pool(1).install(|| {
        for (name, transducer) in models {
            let kernel = case.kernel(transducer);
            let direct_field = kernel.at(&case.points_m);
            let sum = kernel.on_plane(grid);
            let peak = direct_field.iter().map(|p| p.norm()).fold(0.0, f64::max);
            let apart = direct_field.iter().zip(&sum.field).map(|(a, b)| (a - b).norm());
            let error = apart.fold(0.0, f64::max) / peak;
            let [direct, by_structure] = best(
                4,
                [
                    &mut || {
                        black_box(kernel.at(&case.points_m));
                    },
                    &mut || {
                        black_box(kernel.on_plane(grid));
                    },
                ],
            );
            println!(
                "  {name:24} {:?}: {:.1} ms = {:.0} x, error {error:.0e} of the peak",
                sum.method,
                1e3 * by_structure,
                direct / by_structure
            );
        }
    });
}

/// Many drives of one geometry: one matrix against separate sums.
fn many_drives(case: &Case) {
    let drives: Vec<Vec<f64>> = (0..50)
        .map(|n| (0..case.array.len()).map(|e| 0.1 * f64::from(n) * e as f64).collect())
        .collect();
    let k = case.wavenumber_rad_m;
    let still = vec![0.0; case.array.len()];
    let kernel_of = |phases_rad: &[f64]| {
        FieldKernel::new(&case.array, phases_rad, &Piston, k, PathLengths::Observed)
    };
    pool(1).install(|| {
        let [each, matrix] = best(
            3,
            [
                &mut || {
                    for drive in &drives {
                        black_box(kernel_of(drive).at(&case.points_m));
                    }
                },
                &mut || {
                    let transfer = kernel_of(&still).transfer_at(&case.points_m);
                    for drive in &drives {
                        black_box(transfer.driven(drive));
                    }
                },
            ],
        );
        println!(
            "\n50 drives of one geometry by one matrix over 50 sums, one thread: {:.1} x",
            each / matrix
        );
    });
}
