use proptest::prelude::*;

use super::super::tests::transducers;
use super::*;
use crate::Propagation;
use crate::transducer::{MurataFit, Piston, Widened};

const EVERY: [Parameter; 9] = [
    Parameter::X,
    Parameter::Y,
    Parameter::Z,
    Parameter::SoundSpeed,
    Parameter::Frequency,
    Parameter::Spreading,
    Parameter::Attenuation,
    Parameter::LobeWidth,
    Parameter::LobeWidthByFace,
];

/// The field with one parameter changed, by making the whole set-up anew.
fn changed(
    array: &Array,
    phases_rad: &[f64],
    transducer: &dyn Transducer,
    paths: PathLengths,
    (parameter, change): (Parameter, f64),
    at_m: Vec3,
) -> Complex64 {
    let mut k = 732.7;
    let mut at_m = at_m;
    let mut phases_rad = phases_rad.to_vec();
    let mut widened = Widened { transducer, ratio: 1.0, by_face: false };
    let mut attenuation_np_m = 0.0;
    let mut on_axis = transducer.on_axis();
    match parameter {
        Parameter::X => at_m.x += change,
        Parameter::Y => at_m.y += change,
        Parameter::Z => at_m.z += change,
        Parameter::SoundSpeed => k *= (-change).exp(),
        Parameter::Frequency => {
            k *= change.exp();
            phases_rad.iter_mut().for_each(|phase| *phase *= change.exp());
        }
        Parameter::Spreading => {
            let exponent = match on_axis {
                OnAxis::Power { exponent } => exponent,
                _ => 1.0,
            };
            on_axis = OnAxis::Power { exponent: exponent + change };
        }
        Parameter::Attenuation => attenuation_np_m = change,
        Parameter::LobeWidth => widened.ratio += change,
        Parameter::LobeWidthByFace => {
            widened.ratio += change;
            widened.by_face = true;
        }
    }
    FieldKernel::new(array, &phases_rad, &widened, k, paths)
        .with_on_axis(on_axis)
        .with_propagation(Propagation { attenuation_np_m, ..Propagation::default() })
        .at(&[at_m])[0]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn every_derivative_is_the_limit_of_differences(
        at in (-0.04..0.04f64, -0.04..0.04f64, 0.05..0.2f64), model in 0usize..7,
        frozen in prop::option::of(0.05..0.2f64),
    ) {
        let array = Array::hexagonal(1, 10.5e-3);
        let phases: Vec<f64> = (0..array.len()).map(|n| 0.9 * n as f64).collect();
        let transducer = &*transducers()[model];
        let paths = frozen.map_or(PathLengths::Observed, PathLengths::FrozenAt);
        let at_m = Vec3::new(at.0, at.1, at.2);
        let kernel = DifferentiableKernel::new(&array, &phases, transducer, 732.7, paths);
        // Patches of a face do not widen as a whole: that is for the kernel that is made anew.
        let patches = transducer.patches(4.5e-3, 732.7).len() > 1;
        let tabled = !transducer.corners_rad().is_empty();
        for chosen in EVERY.chunks(4) {
            let found = kernel.derivatives_at(chosen, &[at_m])[0];
            prop_assert!((found.field - kernel.kernel().at(&[at_m])[0]).norm() < 1e-11 * found.field.norm().max(1.0));
            for (&parameter, &ours) in chosen.iter().zip(&found.by) {
                let of_lobe = matches!(parameter, Parameter::LobeWidth | Parameter::LobeWidthByFace);
                let of_spreading = parameter == Parameter::Spreading
                    && !matches!(transducer.on_axis(), OnAxis::Power { .. } | OnAxis::Spherical);
                if of_spreading || (patches && parameter != Parameter::X) || (tabled && of_lobe) {
                    continue;
                }
                let step = if matches!(parameter, Parameter::X | Parameter::Y | Parameter::Z) { 1e-6 } else { 1e-5 };
                let moved = |by: f64| changed(&array, &phases, transducer, paths, (parameter, by * step), at_m);
                let difference = (8.0 * (moved(1.0) - moved(-1.0)) - (moved(2.0) - moved(-2.0))) / (12.0 * step);
                let scale = difference.norm().max(array.len() as f64 / at_m.z);
                prop_assert!(
                    (ours - difference).norm() < 2e-5 * scale,
                    "{:?} of model {}: {} {}", parameter, model, ours, difference
                );
            }
        }
    }
}

#[test]
fn the_code_for_the_usual_cases_agrees_with_the_code_for_any_case() {
    let array = Array::hexagonal(2, 10.5e-3);
    let phases: Vec<f64> = (0..array.len()).map(|n| 0.9 * n as f64).collect();
    let points_m: Vec<Vec3> =
        (0..37).map(|n| Vec3::new(2e-3 * f64::from(n) - 0.03, 0.01, 0.08)).collect();
    let mut reversed = USUAL_PARAMETERS;
    reversed.reverse();
    let murata = MurataFit::CENTIMETRES;
    for set in InstructionSet::ALL.iter().copied().filter(|set| set.is_available()) {
        for transducer in [&Piston as &dyn Transducer, &murata] {
            let paths = PathLengths::Observed;
            let kernel = DifferentiableKernel::new(&array, &phases, transducer, 732.7, paths)
                .with_instructions(set);
            assert!(kernel.kernel().is_usual() != kernel.kernel().is_thesis());
            let usual = kernel.derivatives_at(&USUAL_PARAMETERS, &points_m);
            let any = kernel.derivatives_at(&reversed, &points_m);
            for (usual, any) in usual.iter().zip(&any) {
                assert!((usual.field - any.field).norm() < 1e-12 * 1e2, "{set:?}");
                for (n, ours) in usual.by.iter().enumerate() {
                    let apart = (ours - any.by[AT_ONCE - 1 - n]).norm();
                    assert!(apart < 1e-12 * ours.norm().max(1e4), "{set:?}, {n}: {apart:e}");
                }
            }
        }
    }
}

#[test]
fn a_lobe_with_a_corner_has_a_derivative_on_its_axis_too() {
    let array = Array::linear(1, 10.5e-3).expect("not empty");
    let murata = MurataFit::CENTIMETRES;
    let kernel = DifferentiableKernel::new(&array, &[0.0], &murata, 732.7, PathLengths::Observed);
    let found =
        kernel.derivatives_at(&[Parameter::X, Parameter::Z], &[Vec3::new(0.0, 0.0, 0.1)])[0];
    assert!(found.by[0].norm() < 1e-9 && found.by[1].norm() > 100.0, "{found:?}");
}
