//! Faults of a rig as laboratories have them: a bowed board, crosstalk, a bent screw, a room that warms during the scan. The readings are
//! sums written here, and share nothing with the diagnosis.

use fieldgap_acoustics::{Element, Vec3};
use fieldgap_diagnosis::{Diagnosis, EffectId, FittedParameter, diagnose};
use fieldgap_records::RecordedScan;
use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

use square_array::{Scan, WAVENUMBER_RAD_M, named_alone, phases_rad, real};

mod square_array;

/// What a piston sends to a place at a wavenumber: 2 J1(x)/x over the distance.
fn piston(
    centre_m: Vec3,
    normal: Vec3,
    radius_m: f64,
    at: &Vec3,
    wavenumber_rad_m: f64,
) -> Complex64 {
    let way = at - centre_m;
    let cos = normal.dot(&way) / way.norm();
    let x = wavenumber_rad_m * radius_m * (1.0 - cos * cos).max(0.0).sqrt();
    let lobe = if x < 1e-6 { 1.0 } else { 2.0 * libm::j1(x) / x };
    Complex64::from_polar(lobe / way.norm(), wavenumber_rad_m * way.norm())
}

fn upright(element: &Element, at: &Vec3) -> Complex64 {
    piston(element.centre_m, Vec3::z(), element.radius_m, at, WAVENUMBER_RAD_M)
}

fn scan() -> Scan {
    Scan::new(6, &[[5.0, -10.0, 100.0], [-15.0, 10.0, 130.0]], 26, &[80.0, 120.0, 160.0])
}

fn diagnosed(record: RecordedScan) -> Diagnosis {
    diagnose(&[record], None).expect("comparable")
}

#[test]
fn a_bowed_array_is_told_with_its_sagitta() {
    const SAGITTA_M: f64 = -0.4e-3;
    let scan = scan();
    let believed = scan.believed(0);
    let elements = believed.array.elements().iter();
    let rim_m = elements.map(|element| element.centre_m.norm()).fold(0.0, f64::max);
    let record = scan.read_waves(61, |element, phase_rad, at| {
        let across = element.centre_m;
        let height_m = SAGITTA_M * across.norm_squared() / (rim_m * rim_m);
        let normal = (Vec3::z() - across * 2.0 * SAGITTA_M / (rim_m * rim_m)).normalize();
        let centre_m = across + Vec3::z() * height_m;
        piston(centre_m, normal, element.radius_m, at, WAVENUMBER_RAD_M) * Complex64::cis(phase_rad)
    });
    let diagnosis = diagnosed(record);
    named_alone(&diagnosis, EffectId::BowedArray);
    let found_mm = real(&diagnosis, "bowed-array.sagitta_mm");
    assert!((found_mm - 1e3 * SAGITTA_M).abs() < 0.02, "{found_mm}");
}

/// Of pistons whose axes lean at random in both directions.
#[test]
fn leaning_elements_are_told_each_with_its_angles() {
    const SPREAD_RAD: f64 = 0.12;
    let mut random = ChaCha8Rng::seed_from_u64(65);
    let mut angle = || -> f64 {
        let normal: f64 = StandardNormal.sample(&mut random);
        SPREAD_RAD * normal
    };
    let leans: Vec<[f64; 2]> = (0..36).map(|_| [angle(), angle()]).collect();
    let scan = scan();
    let places = scan.believed(0).array.elements().to_vec();
    let record = scan.read_waves(65, |element, phase_rad, at| {
        let number = places.iter().position(|other| other.centre_m == element.centre_m);
        let [about_x, about_y] = leans[number.expect("an element of the array")];
        let (sin_x, cos_x) = about_x.sin_cos();
        let (sin_y, cos_y) = about_y.sin_cos();
        let normal = Vec3::new(cos_x * sin_y, -sin_x, cos_x * cos_y);
        let wave = piston(element.centre_m, normal, element.radius_m, at, WAVENUMBER_RAD_M);
        wave * Complex64::cis(phase_rad)
    });
    let diagnosis = diagnosed(record);
    named_alone(&diagnosis, EffectId::ElementTilt);
    let spread_rad = real(&diagnosis, "element-tilt.spread_rad");
    assert!((spread_rad / SPREAD_RAD - 1.0).abs() < 0.3, "{spread_rad}");
    for (axis, name) in ["element-tilt.about_x_rad", "element-tilt.about_y_rad"].iter().enumerate()
    {
        let Some(FittedParameter::Each { value, standard_error }) =
            diagnosis.ranked[0].parameters.get(*name)
        else {
            panic!("{name} is told of each element")
        };
        let in_errors = value.iter().zip(standard_error).zip(&leans);
        let squares =
            in_errors.map(|((found, error), lean)| ((found - lean[axis]) / error).powi(2));
        let rms = (squares.sum::<f64>() / 36.0).sqrt();
        assert!((0.6..1.5).contains(&rms), "{name}: {rms} standard errors");
        let error_rad = standard_error.iter().sum::<f64>() / 36.0;
        assert!(error_rad < 0.5 * SPREAD_RAD, "{name}: {error_rad}");
    }
}

#[test]
fn crosstalk_is_told_with_its_coefficient() {
    let coefficient = Complex64::new(0.05, 0.04);
    let scan = scan();
    let elements = scan.believed(0).array.elements().to_vec();
    let fields: Vec<Vec<f64>> = (0..scan.foci)
        .map(|focus| {
            let drives: Vec<Complex64> =
                phases_rad(&scan.believed(focus)).into_iter().map(Complex64::cis).collect();
            // Six elements a row.
            let emitted: Vec<Complex64> = (0..36usize)
                .map(|n| {
                    let (row, column) = (n / 6, n % 6);
                    let mut sum = drives[n];
                    if column > 0 {
                        sum += coefficient * drives[n - 1];
                    }
                    if column < 5 {
                        sum += coefficient * drives[n + 1];
                    }
                    if row > 0 {
                        sum += coefficient * drives[n - 6];
                    }
                    if row < 5 {
                        sum += coefficient * drives[n + 6];
                    }
                    sum
                })
                .collect();
            let level = |at: &Vec3| {
                let waves =
                    elements.iter().zip(&emitted).map(|(e, weight)| weight * upright(e, at));
                1e-3 * waves.sum::<Complex64>().norm()
            };
            scan.places_m.iter().map(level).collect()
        })
        .collect();
    let diagnosis = diagnosed(scan.record(fields, 62));
    named_alone(&diagnosis, EffectId::Crosstalk);
    let Some(FittedParameter::Complex { value: [re, im], .. }) =
        diagnosis.ranked[0].parameters.get("crosstalk.coefficient")
    else {
        panic!("{}", diagnosis.to_text())
    };
    assert!((Complex64::new(*re, *im) - coefficient).norm() < 0.01, "{re} {im}");
}

#[test]
fn a_bent_screw_is_told_with_its_lead() {
    let record = scan().read_waves(63, |element, phase_rad, at| {
        let error_m = 0.4e-3 * (TAU * at.y / 12e-3 + 1.0).sin();
        upright(element, &(at + Vec3::y() * error_m)) * Complex64::cis(phase_rad)
    });
    let diagnosis = diagnosed(record);
    named_alone(&diagnosis, EffectId::LeadScrew);
    let parameters = &diagnosis.ranked[0].parameters;
    assert_eq!(parameters["lead-screw.axis"], FittedParameter::Word { value: "y" });
    for (name, expected, within) in
        [("amplitude_mm", 0.4, 0.03), ("lead_mm", 12.0, 0.2), ("phase_rad", 1.0, 0.1)]
    {
        let found = real(&diagnosis, &format!("lead-screw.{name}"));
        assert!((found - expected).abs() < within, "{name}: {found}");
    }
}

/// The room warms by eight kelvin during the scan, of which the array's delays know nothing.
#[test]
fn a_room_that_warms_is_told_with_its_rate() {
    const KELVIN: f64 = 8.0;
    let scan = scan();
    let (places, foci) = (scan.places_m.len(), scan.foci);
    let lasts_s = 0.1 * (places * foci) as f64;
    let mut waves = 0;
    let record = scan.read_waves(66, |element, phase_rad, at| {
        let reading = waves / 36;
        waves += 1;
        let (focus, place) = (reading / places, reading % places);
        let share = (place * foci + focus) as f64 / (places * foci) as f64;
        // 293 K at the beginning; the speed goes with the root.
        let began_k = 273.15 * (343.0f64 / 331.3).powi(2);
        let speed = (1.0 + KELVIN * share / began_k).sqrt();
        let wave =
            piston(element.centre_m, Vec3::z(), element.radius_m, at, WAVENUMBER_RAD_M / speed);
        wave * Complex64::cis(phase_rad)
    });
    let diagnosis = diagnosed(record);
    named_alone(&diagnosis, EffectId::TemperatureDrift);
    let found = real(&diagnosis, "temperature-drift.k_per_h") * lasts_s / 3600.0;
    assert!((found - KELVIN).abs() < 0.9, "{found} {}", diagnosis.to_text());
}

/// A leaning wall 6 cm beside the axis.
#[test]
fn a_wall_is_told_with_its_place() {
    let normal = Vec3::new(-0.5, 0.86, 0.06).normalize();
    let (distance_m, coefficient) = (0.062, Complex64::new(0.2, 0.25));
    let record = scan().read_waves(65, |element, phase_rad, at| {
        let image = at + 2.0 * (distance_m - normal.dot(at)) * normal;
        let sum = upright(element, at) + coefficient * upright(element, &image);
        sum * Complex64::cis(phase_rad)
    });
    let diagnosis = diagnosed(record);
    named_alone(&diagnosis, EffectId::Wall);
    let found = real(&diagnosis, "wall.distance_mm");
    assert!((found - 62.0).abs() < 0.5, "{}", diagnosis.to_text());
    let Some(FittedParameter::Each { value, .. }) =
        diagnosis.ranked[0].parameters.get("wall.normal")
    else {
        panic!("{}", diagnosis.to_text())
    };
    assert!((Vec3::from_column_slice(value) - normal).norm() < 0.02, "{value:?}");
}

/// A reading in two hundred is a click of the bench. A pitch that is off is found nonetheless, and how many readings were left out is told.
#[test]
fn clicks_are_left_out_and_told() {
    let mut record = scan().read_waves(67, |element, phase_rad, at| {
        let centre_m = 1.006 * element.centre_m;
        let wave = piston(centre_m, Vec3::z(), element.radius_m, at, WAVENUMBER_RAD_M);
        wave * Complex64::cis(phase_rad)
    });
    let largest = record.samples.iter().fold(0.0f64, |most, sample| most.max(sample.reading));
    let mut clicks = 0;
    for sample in record.samples.iter_mut().filter(|sample| sample.focus.is_some()).step_by(200) {
        sample.reading += 0.4 * largest;
        clicks += 1;
    }
    let diagnosis = diagnosed(record);
    named_alone(&diagnosis, EffectId::Pitch);
    let found = real(&diagnosis, "pitch.ratio");
    assert!((found - 1.006).abs() < 5e-4, "{found}");
    assert_eq!(diagnosis.outliers, clicks, "{}", diagnosis.to_text());
}
