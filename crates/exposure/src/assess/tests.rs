use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::*;
use crate::source::DataSheet;
use fieldgap_acoustics::Element;
use fieldgap_level::{KnownLimit, People, of_level_pa};

const FREQUENCY_HZ: f64 = 40e3;

fn sheet() -> DataSheet {
    DataSheet {
        of: "a transducer".to_owned(),
        db_at_300_mm: 120.0,
        at_v_rms: 10.0,
        drive_v_rms: 10.0,
        u_db: 1.0,
        drive_u_percent: 3.0,
    }
}

fn exposure(places: Vec<Place>) -> Exposure {
    Exposure {
        people: People { places, limits: vec![KnownLimit::Howard2004.limit()] },
        source: None,
        model_u_db: Some(0.0),
        temperature_u_c: Some(2.0),
        humidity_u_percent: Some(10.0),
    }
}

fn place(at_mm: [f64; 3], within_mm: f64) -> Place {
    Place { name: "head".to_owned(), at_mm, within_mm }
}

fn room() -> MediumSection {
    MediumSection::of_air(20.0, 50.0, 101.325).expect("a room")
}

fn source() -> SourceLevel {
    sheet().source_level(room().changed(0.0, 0.0, FREQUENCY_HZ).attenuation_np_m)
}

fn radiating<'a>(array: &'a Array, medium: &'a MediumSection) -> Radiating<'a> {
    Radiating { array, medium, frequency_hz: FREQUENCY_HZ, simulator: Simulator::Piston }
}

fn one_element() -> Array {
    Array::from_elements(vec![Element::at(0.0, 0.0)]).expect("one")
}

#[test]
fn one_element_on_its_axis_is_a_spherical_wave_in_absorbing_air() {
    let (array, medium) = (one_element(), room());
    for mm in [300.0, 600.0, 1000.0] {
        let exposure = exposure(vec![place([0.0, 0.0, mm], 0.0)]);
        let found =
            assess(&exposure, radiating(&array, &medium), Some(&source()), Drives::AtEachPlace);
        // 120 dB at 0.3 m, 20 lg of the distance, and 1.318 dB/m (ISO 9613-1).
        let closed = 120.0 - 20.0 * (mm / 300.0).log10() - 1.318 * (mm - 300.0) / 1e3;
        let level = found.places[0].level_db;
        assert!((level - closed).abs() < 2e-3, "{mm}: {level} {closed}");
        assert!((of_level_pa(level) / found.places[0].rms_pa - 1.0).abs() < 1e-12);
    }
}

#[test]
fn elements_in_phase_add_their_pressures() {
    let (array, medium) = (Array::square(6, 6, 10.5e-3).expect("not empty"), room());
    let far = exposure(vec![place([0.0, 0.0, 3000.0], 0.0)]);
    let of = |array: &Array| {
        assess(&far, radiating(array, &medium), Some(&source()), Drives::AtEachPlace).places[0]
            .level_db
    };
    // 20 lg 36 above one element, far away.
    assert!((of(&array) - of(&one_element()) - 20.0 * 36f64.log10()).abs() < 0.01);
}

#[test]
fn the_largest_level_of_a_ball_is_at_least_that_of_its_middle_and_bounded_by_a_focus() {
    let (array, medium) = (Array::square(6, 6, 10.5e-3).expect("not empty"), room());
    let drive = [Excitation::Focus(Vec3::new(0.0, 0.0, 0.15)), Excitation::Uniform];
    let level = |within_mm, drives| {
        let exposure = exposure(vec![place([60.0, -80.0, 400.0], within_mm)]);
        assess(&exposure, radiating(&array, &medium), Some(&source()), drives).places[0].clone()
    };
    let [middle, near] = [0.0, 80.0].map(|within| level(within, Drives::These(&drive)));
    let most = level(80.0, Drives::AtEachPlace);
    assert!(middle.level_db < near.level_db && near.level_db < most.level_db);
    assert_eq!((near.drive.is_some(), most.drive), (true, None));
    let off = Vec3::from(near.at_mm) - Vec3::new(60.0, -80.0, 400.0);
    assert!(off.norm() <= 80.0 + 1e-3);
}

#[test]
fn a_level_without_a_source_is_unknown() {
    let (array, medium) = (one_element(), room());
    let exposure = exposure(vec![place([0.0, 0.0, 300.0], 0.0)]);
    let found = assess(&exposure, radiating(&array, &medium), None, Drives::AtEachPlace);
    assert_eq!((found.standing(), found.places.len(), found.source), (None, 0, None));
}

#[test]
fn a_limit_is_held_against_level_and_uncertainty() {
    let (array, medium) = (one_element(), room());
    let standing = |mm| {
        let exposure = exposure(vec![place([0.0, 0.0, mm], 0.0)]);
        assess(&exposure, radiating(&array, &medium), Some(&source()), Drives::AtEachPlace)
            .standing()
    };
    // 110 dB are reached at about 0.88 m; the expanded uncertainty is 2.1 dB.
    assert_eq!(standing(500.0), Some(Standing::Above));
    assert_eq!(standing(950.0), Some(Standing::NotShown));
    assert_eq!(standing(1500.0), Some(Standing::Within));
}

#[test]
fn warmer_air_is_thinner_and_absorbs_otherwise() {
    let (array, medium) = (one_element(), room());
    let exposure = exposure(vec![place([0.0, 0.0, 500.0], 0.0)]);
    let found = assess(&exposure, radiating(&array, &medium), Some(&source()), Drives::AtEachPlace);
    let lines = &found.places[0].budget.lines;
    let line = lines.iter().find(|line| line.source == "temperature of the air").expect("a line");
    let absorption_db_m = |temperature_c: f64| {
        fieldgap_acoustics::Air { temperature_c, humidity_percent: 50.0, pressure_kpa: 101.325 }
            .attenuation_db_m(FREQUENCY_HZ)
    };
    // The density falls by 1/293 per kelvin; the way is 0.5 m. Two kelvins to either side.
    let closed = -8.6859 / 293.15 - 0.5 * (absorption_db_m(22.0) - absorption_db_m(18.0)) / 4.0;
    assert!((line.sensitivity_db - closed).abs() < 1e-5, "{line:?} {closed}");
}

/// The budget against the propagation of distributions (JCGM 101:2008): every draw is a rig with another transducer, drive and air,
/// whose field is summed here.
#[test]
fn the_budget_agrees_with_a_monte_carlo_of_the_sound_itself() {
    const DRAWS: usize = 20_000;
    let (array, medium) = (Array::square(6, 6, 10.5e-3).expect("not empty"), room());
    let focus = Vec3::new(0.0, 0.0, 0.15);
    let at = Vec3::new(0.02, -0.03, 0.5);
    let exposure = exposure(vec![place((at * 1e3).into(), 0.0)]);
    let drive = [Excitation::Focus(focus)];
    let found =
        assess(&exposure, radiating(&array, &medium), Some(&source()), Drives::These(&drive));
    let found = &found.places[0];

    let mut draws = ChaCha8Rng::seed_from_u64(11);
    let normal = |u: f64| Normal::new(0.0, u).expect("a spread");
    let (sheet_db, drive_share, warm, wet) = (normal(1.0), normal(0.03), normal(2.0), normal(10.0));
    let levels: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let (temperature, humidity) =
                (20.0 + warm.sample(&mut draws), 50.0 + wet.sample(&mut draws));
            level_of_a_rig(
                array.elements(),
                [focus, at],
                120.0 + sheet_db.sample(&mut draws),
                1.0 + drive_share.sample(&mut draws),
                [temperature, humidity],
            )
        })
        .collect();
    let mean = levels.iter().sum::<f64>() / DRAWS as f64;
    let deviation = (levels.iter().map(|level| (level - mean).powi(2)).sum::<f64>()
        / (DRAWS - 1) as f64)
        .sqrt();
    assert!((mean - found.level_db).abs() < 0.05, "{mean} {}", found.level_db);
    // The scatter of the deviation itself is 1/√(2·20000), 0.5 %.
    assert!(
        (found.budget.combined_db / deviation - 1.0).abs() < 0.02,
        "{} {deviation}",
        found.budget.combined_db
    );
    let within = levels
        .iter()
        .filter(|level| (*level - found.level_db).abs() <= found.budget.expanded_db())
        .count();
    let covered = within as f64 / DRAWS as f64;
    assert!((0.945..0.965).contains(&covered), "{covered}");
}

/// Level at a place, summed element by element: pistons in absorbing air, delays set for 20 °C.
fn level_of_a_rig(
    elements: &[Element],
    [focus, at]: [Vec3; 2],
    sheet_db: f64,
    drive: f64,
    [temperature_c, humidity]: [f64; 2],
) -> f64 {
    let speed = |t: f64, h: f64| {
        MediumSection::of_air(t, h, 101.325).expect("air").medium().speed_of_sound_m_s
    };
    let stated = speed(20.0, 50.0);
    let [k, k_stated] =
        [speed(temperature_c, humidity), stated].map(|c| std::f64::consts::TAU * FREQUENCY_HZ / c);
    let absorption = |t: f64, h: f64| {
        fieldgap_acoustics::Air { temperature_c: t, humidity_percent: h, pressure_kpa: 101.325 }
            .attenuation_np_m(FREQUENCY_HZ)
    };
    let (alpha, alpha_stated) = (absorption(temperature_c, humidity), absorption(20.0, 50.0));
    let density = 293.15 / (273.15 + temperature_c);
    let amplitude = of_level_pa(sheet_db) * drive * density * 0.3 * (alpha_stated * 0.3).exp();
    let (mut real, mut imaginary) = (0.0, 0.0);
    for element in elements {
        let way = at - element.centre_m;
        let distance = way.norm();
        let x = k * element.radius_m * way.xy().norm() / distance;
        let lobe = if x < 1e-9 { 1.0 } else { 2.0 * libm::j1(x) / x };
        let phase = k * distance - k_stated * (focus - element.centre_m).norm();
        let level = amplitude * lobe * (-alpha * distance).exp() / distance;
        real += level * phase.cos();
        imaginary += level * phase.sin();
    }
    level_db(real.hypot(imaginary))
}

#[test]
fn a_drive_that_is_no_number_is_never_within_a_limit() {
    let (array, medium) = (one_element(), room());
    let exposure = exposure(vec![place([0.0, 0.0, 300.0], 20.0)]);
    let drives = [Excitation::Focus(Vec3::new(0.0, 0.0, 1.0)), Excitation::Phases(vec![f64::NAN])];
    let radiating = radiating(&array, &medium);
    let found = assess(&exposure, radiating, Some(&source()), Drives::These(&drives));
    assert_eq!(found.standing(), Some(Standing::Above));
}
