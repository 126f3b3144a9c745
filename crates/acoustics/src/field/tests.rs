use proptest::prelude::*;

use super::*;
use crate::Element;
use crate::rayleigh::{DiscRule, Piston as PistonIntegral};
use crate::transducer::{
    DescribedTransducer, Directivity, MeasuredTable, MultiGaussian, MurataFit, Piston,
    RayleighPiston, SymmetricGaussian,
};

/// The defining sum, element by element and patch by patch, with the library's functions and no series.
pub(super) fn plain_sum(
    array: &Array,
    phases_rad: &[f64],
    transducer: &dyn Transducer,
    k: f64,
    paths: PathLengths,
    x: Vec3,
) -> Complex64 {
    let mut sum = Complex64::ZERO;
    for (e, phase) in array.elements().iter().zip(phases_rad) {
        let (first, second) = across(e.normal);
        for patch in transducer.patches(e.radius_m, k) {
            let centre_m = e.centre_m + e.radius_m * (patch.u * first + patch.v * second);
            let r = x - centre_m;
            let (d, h) = (r.norm(), r.dot(&e.normal));
            if h <= 0.0 {
                continue;
            }
            let theta = r.cross(&e.normal).norm().atan2(h);
            let on_axis = match transducer.on_axis() {
                OnAxis::Spherical => 1.0 / d,
                OnAxis::Exponential { amplitude, decay_per_m } => {
                    amplitude * (-decay_per_m * h).exp()
                }
                OnAxis::Power { exponent } => d.powf(-exponent),
                OnAxis::Absorbed { amplitude, attenuation_np_m } => {
                    amplitude * (-attenuation_np_m * d).exp() / d
                }
            };
            let path = match paths {
                PathLengths::Observed => d,
                PathLengths::FrozenAt(z) => Vec3::new(r.x, r.y, z - centre_m.z).norm(),
            };
            let directivity = transducer.directivity(theta, e.radius_m, k);
            let magnitude = e.amplitude * patch.weight * on_axis * directivity;
            sum += Complex64::from_polar(1.0, k * path + phase + e.phase_rad) * magnitude;
        }
    }
    sum
}

/// Faces cut into patches, heard by a receiver with a lobe, and their images in a plane.
#[test]
fn sources_that_are_moved_radiate_as_those_of_an_array_there() {
    let array = Array::hexagonal(1, 10.5e-3);
    let normal = Vec3::new(0.96, 0.0, 0.28);
    let place = |at_m: &Vec3| at_m + 2.0 * (0.1 - normal.dot(at_m)) * normal;
    let axis = |direction: &Vec3| direction - 2.0 * normal.dot(direction) * normal;
    let images = array.elements().iter().map(|element| Element {
        centre_m: place(&element.centre_m),
        normal: axis(&element.normal),
        ..*element
    });
    let images = Array::from_elements(images.collect()).expect("elements");
    let phases_rad: Vec<f64> = (0..array.len()).map(|n| 0.8 * n as f64).collect();
    let kernel = |array: &Array| {
        let transducer = RayleighPiston::FINE;
        FieldKernel::new(array, &phases_rad, &transducer, 733.0, PathLengths::Observed)
            .with_receiver_directivity(f64::cos)
    };
    let points_m: Vec<Vec3> =
        (0..20).map(|n| Vec3::new(2e-3 * f64::from(n) - 0.02, 5e-3, 0.2)).collect();
    let moved = kernel(&array).moved(place, axis).at(&points_m);
    // Patches of a rule lie elsewhere on a face that is turned: to the rule's own error.
    for (moved, there) in moved.iter().zip(kernel(&images).at(&points_m)) {
        assert!(there.norm() > 1.0 && (moved - there).norm() < 1e-3 * there.norm());
    }
}

/// One of each kind, with every decay on the axis.
pub(super) fn transducers() -> Vec<Box<dyn Transducer>> {
    let angles_deg: Vec<f64> = (0..=18).map(|n| 5.0 * f64::from(n)).collect();
    let pressures: Vec<f64> = angles_deg.iter().map(|deg| deg.to_radians().cos().powi(3)).collect();
    let table = MeasuredTable::new(&angles_deg, &pressures).expect("a table");
    vec![
        Box::new(Piston),
        Box::new(MultiGaussian),
        Box::new(SymmetricGaussian::MURATA),
        Box::new(MurataFit::CENTIMETRES),
        Box::new(RayleighPiston { tolerance: 0.02 }),
        Box::new(DescribedTransducer {
            on_axis: OnAxis::Absorbed { amplitude: 1.2, attenuation_np_m: 0.15 },
            directivity: Directivity::Table(table),
        }),
        Box::new(DescribedTransducer {
            on_axis: OnAxis::Power { exponent: 0.8 },
            directivity: Directivity::Even,
        }),
    ]
}

fn unit_vector() -> impl Strategy<Value = Vec3> {
    (-0.5..0.5f64, -0.5..0.5f64).prop_map(|(x, y)| Vec3::new(x, y, 1.0).normalize())
}

fn element() -> impl Strategy<Value = Element> {
    (
        (-0.08..0.08f64, -0.08..0.08f64, -0.01..0.01f64),
        unit_vector(),
        prop_oneof![Just(4.5e-3), Just(8.0e-3)],
        0.0..1.5f64,
        -4.0..4.0f64,
    )
        .prop_map(|((x, y, z), normal, radius_m, amplitude, phase_rad)| Element {
            centre_m: Vec3::new(x, y, z),
            normal,
            radius_m,
            amplitude,
            phase_rad,
        })
}

/// The largest possible sum of the elements' magnitudes at the points, at a distance of 2 to 10 mm.
fn peak(array: &Array, transducer: &dyn Transducer, points_m: &[Vec3]) -> f64 {
    let strengths: f64 = array.elements().iter().map(|e| e.amplitude).sum();
    let distances =
        points_m.iter().flat_map(|x| array.elements().iter().map(move |e| (x - e.centre_m).norm()));
    let nearest_m = distances.fold(f64::INFINITY, f64::min).clamp(2e-3, 10e-3);
    let level = match transducer.on_axis() {
        OnAxis::Exponential { .. } => 1.0,
        OnAxis::Spherical | OnAxis::Absorbed { .. } => 1.0 / nearest_m,
        OnAxis::Power { exponent } => nearest_m.powf(-exponent),
    };
    1e-3 + strengths * level
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn every_instruction_set_agrees_with_the_plain_sum_in_either_precision(
        elements in prop::collection::vec((element(), -7.0..7.0f64), 1..12),
        points in prop::collection::vec((-0.1..0.1f64, -0.1..0.1f64, -0.02..0.3f64), 1..80),
        wavenumber in 400.0..1200.0f64,
        frozen in prop::option::of(0.05..0.2f64),
        model in 0usize..7,
    ) {
        let (elements, phases): (Vec<Element>, Vec<f64>) = elements.into_iter().unzip();
        let array = Array::from_elements(elements).expect("not empty");
        let points: Vec<Vec3> = points.into_iter().map(|(x, y, z)| Vec3::new(x, y, z)).collect();
        let clear = |x: &Vec3| array.elements().iter().all(|e| {
            let r = x - e.centre_m;
            // At a right angle to the axis the field of a source ends: there the twelfth digit is undefined.
            r.norm() > 2e-3 && r.dot(&e.normal).abs() > 1e-6
        });
        prop_assume!(points.iter().all(clear));
        let paths = frozen.map_or(PathLengths::Observed, PathLengths::FrozenAt);
        let transducer = &*transducers()[model];
        let kernel = FieldKernel::new(&array, &phases, transducer, wavenumber, paths);
        let peak = peak(&array, transducer, &points);
        let plain: Vec<Complex64> = points
            .iter()
            .map(|&x| plain_sum(&array, &phases, transducer, wavenumber, paths, x))
            .collect();
        for &set in InstructionSet::ALL.iter().filter(|set| set.is_available()) {
            for (precision, tolerance) in [(Precision::Double, 1e-12), (Precision::Single, 1e-5)] {
                let ours = kernel.clone().with_instructions(set).with_precision(precision).at(&points);
                for (n, (ours, plain)) in ours.into_iter().zip(&plain).enumerate() {
                    prop_assert!(
                        (ours - plain).norm() < tolerance * peak,
                        "{:?} {:?} model {}: {} {} at {}", set, precision, model, ours, plain, points[n]
                    );
                }
            }
        }
    }

    #[test]
    fn the_code_for_the_usual_case_agrees_with_the_plain_sum(
        places in prop::collection::vec((-0.08..0.08f64, -0.08..0.08f64, -0.01..0.01f64, any::<bool>(), -7.0..7.0f64), 1..12),
        points in prop::collection::vec((-0.1..0.1f64, -0.1..0.1f64, -0.03..0.3f64), 1..80),
        wavenumber in 400.0..1200.0f64,
    ) {
        let phases: Vec<f64> = places.iter().map(|place| place.4).collect();
        let element = |&(x, y, z, wide, phase): &(f64, f64, f64, bool, f64)| Element {
            centre_m: Vec3::new(x, y, z),
            radius_m: if wide { 8.0e-3 } else { 4.5e-3 },
            amplitude: 1.0 + 0.1 * phase,
            ..Element::at(x, y)
        };
        let array = Array::from_elements(places.iter().map(element).collect()).expect("not empty");
        let points: Vec<Vec3> = points.into_iter().map(|(x, y, z)| Vec3::new(x, y, z)).collect();
        let clear = |x: &Vec3| array.elements().iter().all(|e| (x - e.centre_m).norm() > 2e-3 && (x - e.centre_m).z.abs() > 1e-6);
        prop_assume!(points.iter().all(clear));
        let kernel = FieldKernel::new(&array, &phases, &Piston, wavenumber, PathLengths::Observed);
        prop_assert!(kernel.is_usual());
        let peak = peak(&array, &Piston, &points);
        let plain = |&x: &Vec3| plain_sum(&array, &phases, &Piston, wavenumber, PathLengths::Observed, x);
        let plain: Vec<Complex64> = points.iter().map(plain).collect();
        for &set in InstructionSet::ALL.iter().filter(|set| set.is_available()) {
            for (precision, tolerance) in [(Precision::Double, 1e-12), (Precision::Single, 1e-5)] {
                let ours = kernel.clone().with_instructions(set).with_precision(precision).at(&points);
                for (ours, plain) in ours.into_iter().zip(&plain) {
                    prop_assert!((ours - plain).norm() < tolerance * peak, "{:?} {:?}: {} {}", set, precision, ours, plain);
                }
            }
        }
    }

    #[test]
    fn air_and_receiver_act_on_every_path_of_the_plain_sum(
        points in prop::collection::vec((-0.05..0.05f64, -0.05..0.05f64, 0.05..0.25f64), 1..20),
        mach in (-0.03..0.03f64, -0.03..0.03f64), gradient in -0.3..0.3f64,
        attenuation_np_m in 0.0..2.0f64, exponent in 0.4..1.6f64, wavenumber in 600.0..900.0f64,
    ) {
        let array = Array::square(3, 3, 10.5e-3).expect("not empty");
        let propagation = Propagation {
            mach: Vec3::new(mach.0, mach.1, 0.0),
            gradient_per_m: Vec3::new(gradient, 0.0, -gradient),
            attenuation_np_m,
        };
        let sensitivity = |angle_rad: f64| (-0.8 * angle_rad * angle_rad).exp();
        let kernel = FieldKernel::new(&array, &[0.0; 9], &Piston, wavenumber, PathLengths::Observed)
            .with_on_axis(OnAxis::Power { exponent })
            .with_propagation(propagation)
            .with_receiver_directivity(sensitivity);
        let points: Vec<Vec3> = points.into_iter().map(|(x, y, z)| Vec3::new(x, y, z)).collect();
        for (sum, x) in kernel.sums_at(&points).into_iter().zip(&points) {
            let (mut field, mut power) = (Complex64::ZERO, 0.0);
            for element in array.elements() {
                let r = x - element.centre_m;
                let d = r.norm();
                let theta = (r.z / d).acos();
                let magnitude = d.powf(-exponent)
                    * Piston.directivity(theta, element.radius_m, wavenumber)
                    * (-attenuation_np_m * d).exp()
                    * sensitivity(theta);
                // The mean slowness along the ray, expanded about its middle: the next term is of the order of (g d)^4.
                let middle = 1.0 + propagation.gradient_per_m.dot(&(element.centre_m + 0.5 * r));
                let change = propagation.gradient_per_m.dot(&r) / middle;
                let slowness = (1.0 + change * change / 12.0)
                    / (middle * (1.0 + propagation.mach.dot(&r) / d));
                field += Complex64::from_polar(magnitude, wavenumber * d * slowness);
                power += magnitude * magnitude;
            }
            let scale = power.sqrt() * 3.0;
            prop_assert!((sum.field - field).norm() < 1e-11 * scale, "{} {field}", sum.field);
            prop_assert!((sum.incoherent_power - power).abs() < 1e-11 * power);
        }
    }

    #[test]
    fn the_field_at_a_point_does_not_depend_on_the_other_points(count in 1usize..2000) {
        let array = Array::square(3, 3, 10.5e-3).expect("not empty");
        let kernel = FieldKernel::new(&array, &[0.0; 9], &Piston, 732.7, PathLengths::Observed);
        let points: Vec<Vec3> = (0..count).map(|i| Vec3::new(i as f64 * 1e-5, 1e-3, 0.1)).collect();
        let last = *points.last().expect("at least one");
        let among = *kernel.at(&points).last().expect("at least one");
        prop_assert!((among - kernel.at(&[last])[0]).norm() < 1e-12 * 90.0);
    }
}

#[test]
fn one_piston_on_its_axis_is_a_spherical_wave() {
    let array = Array::linear(1, 10.5e-3).expect("not empty");
    let kernel = FieldKernel::new(&array, &[0.0], &Piston, 732.7, PathLengths::Observed);
    let p = kernel.at(&[Vec3::new(0.0, 0.0, 0.25)])[0];
    assert!((p - Complex64::from_polar(4.0, 732.7 * 0.25)).norm() < 1e-12);
}

#[test]
fn the_field_is_finite_at_the_centre_of_a_source() {
    let array = Array::linear(2, 10.5e-3).expect("not empty");
    for precision in [Precision::Single, Precision::Double] {
        let kernel = FieldKernel::new(&array, &[0.0; 2], &Piston, 732.7, PathLengths::Observed)
            .with_precision(precision);
        assert!(kernel.at(&[array.elements()[0].centre_m])[0].is_finite());
    }
}

#[test]
fn the_integral_over_a_tilted_face_agrees_with_the_independent_code() {
    let normal = Vec3::new(0.3, -0.2, 1.0).normalize();
    let element = Element { normal, ..Element::at(3e-3, -5e-3) };
    let array = Array::from_elements(vec![element]).expect("not empty");
    let k = 732.7;
    let kernel = FieldKernel::new(&array, &[0.0], &RayleighPiston::FINE, k, PathLengths::Observed);
    let rule = DiscRule::for_piston(k * element.radius_m, 2.0, 1e-4);
    let piston = PistonIntegral::new(element.centre_m, normal, element.radius_m, &rule);
    for at_m in
        [Vec3::new(0.0, 0.0, 0.012), Vec3::new(0.02, 0.01, 0.05), Vec3::new(-0.05, 0.0, 0.2)]
    {
        let ours = kernel.at(&[at_m])[0];
        assert!((ours - piston.field(at_m, k)).norm() < 1e-12 / at_m.z, "{at_m}");
    }
}

#[test]
fn contributions_of_the_elements_add_up_to_the_field() {
    let array = Array::hexagonal(2, 10.5e-3);
    let phases: Vec<f64> = (0..array.len()).map(|n| 0.7 * n as f64).collect();
    let kernel = FieldKernel::new(&array, &phases, &Piston, 732.7, PathLengths::Observed);
    let points = [Vec3::new(0.01, 0.0, 0.08), Vec3::new(-0.03, 0.02, 0.15)];
    let contributions = kernel.contributions_at(&points);
    assert_eq!(contributions.len(), array.len());
    for (n, field) in kernel.at(&points).into_iter().enumerate() {
        let sum: Complex64 = contributions.iter().map(|element| element[n]).sum();
        assert!((sum - field).norm() < 1e-11);
    }
}

/// Far field with and without the near-field term against the integral: the remaining phase error is that of the next term.
#[test]
fn the_near_field_term_brings_the_far_field_to_the_integral() {
    let array = Array::from_elements(vec![Element::at(0.0, 0.0)]).expect("not empty");
    let (k, radius_m) = (732.7, array.elements()[0].radius_m);
    let far = FieldKernel::new(&array, &[0.0], &Piston, k, PathLengths::Observed);
    let near = far.clone().with_near_field(1.0);
    let rule = DiscRule::for_piston(k * radius_m, 2.0, 1e-6);
    let piston = PistonIntegral::new(Vec3::zeros(), Vec3::z(), radius_m, &rule);
    for degrees in [0.0, 10.0, 20.0] {
        for distance_m in [0.05, 0.1, 0.2] {
            let (sine, cosine) = f64::to_radians(degrees).sin_cos();
            let at_m = distance_m * Vec3::new(sine, 0.0, cosine);
            let truth = piston.field(at_m, k);
            let phase_error =
                |kernel: &FieldKernel| (kernel.at(&[at_m])[0] * truth.conj()).arg().abs();
            let [without, with] = [phase_error(&far), phase_error(&near)];
            let closed_form =
                k * radius_m.powi(2) * (3.0 * cosine * cosine - 1.0) / (8.0 * distance_m);
            assert!((without / closed_form - 1.0).abs() < 0.1, "{at_m}: {without} {closed_form}");
            assert!(with < 0.1 * without, "{at_m}: {with} {without}");
        }
    }
}
