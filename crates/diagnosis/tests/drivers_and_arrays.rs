//! Drivers that round phases, arrays of many elements, and lobes of no formula. The readings are those of the virtual rig's vibrating pistons, or
//! a sum written here: neither shares anything with the diagnosis.

use std::f64::consts::TAU;

use fieldgap_acoustics::{Excitation, Simulation, Vec3};
use fieldgap_diagnosis::{EffectId, FittedParameter, Verdict, diagnose};
use fieldgap_records::RecordedScan;
use fieldgap_virtual_rig::{Visit, noise_free_readings};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use square_array::{NOISE, REPEATS, Scan, WAVENUMBER_RAD_M, named_alone, phases_rad, real};

mod square_array;

/// A scan of an array whose phases a driver changes, with causes that the set-up does not know.
fn read(scan: &Scan, causes: &str, seed: u64, driven: impl Fn(&[f64]) -> Vec<f64>) -> RecordedScan {
    let field = |focus: usize| levels(scan, causes, seed, &driven, focus);
    scan.record((0..scan.foci).map(field).collect(), seed)
}

/// The readings of one focus without noise.
fn levels(
    scan: &Scan,
    causes: &str,
    seed: u64,
    driven: impl Fn(&[f64]) -> Vec<f64>,
    focus: usize,
) -> Vec<f64> {
    let effects: toml::Table = causes.parse().expect("TOML");
    let believed = scan.believed(focus);
    let excitation = Excitation::Phases(driven(&phases_rad(&believed)));
    let visits: Vec<Visit> = scan
        .places_m
        .iter()
        .map(|at| Visit { position_m: *at, velocity_m_s: Vec3::zeros(), time_s: 0.0 })
        .collect();
    let simulation = Simulation { excitation, ..believed };
    noise_free_readings(&simulation, &effects, 0.05, &visits, seed).expect("valid")
}

/// How a driver rounds a phase, in steps, given those of all elements.
type Rounding = fn(f64, &[f64]) -> f64;

fn rounded(steps: u32, rounding: Rounding) -> impl Fn(&[f64]) -> Vec<f64> {
    let step_rad = TAU / f64::from(steps);
    move |phases_rad: &[f64]| {
        let in_steps: Vec<f64> = phases_rad.iter().map(|phase| phase / step_rad).collect();
        in_steps.iter().map(|phase| rounding(*phase, &in_steps) * step_rad).collect()
    }
}

#[test]
fn steps_are_named_whatever_the_driver_counts_from() {
    let foci = [[5.0, 0.0, 100.0], [-12.0, 8.0, 90.0]];
    let drivers: [(u32, Rounding); 4] = [
        (16, |phase, _| phase.round()),
        // Counted from the eighth element, by a counter that cuts.
        (16, |phase, all| all[7] + (phase - all[7]).floor()),
        // Counted from the least delay.
        (10, |phase, all| {
            let least = all.iter().copied().fold(f64::INFINITY, f64::min);
            least + (phase - least).round()
        }),
        // Counted from the centre of the array, a quarter of a step off.
        (32, |phase, all| {
            let mean = all.iter().sum::<f64>() / all.len() as f64 + 0.25;
            mean + (phase - mean).ceil()
        }),
    ];
    for (seed, (steps, rounding)) in drivers.into_iter().enumerate() {
        let scan = Scan::new(6, &foci, 23, &[100.0, 130.0]);
        let record = read(&scan, "", seed as u64, rounded(steps, rounding));
        let diagnosis = diagnose(&[record], None).expect("comparable");
        named_alone(&diagnosis, EffectId::PhaseQuantisation);
        assert_eq!(real(&diagnosis, "phase-quantisation.steps"), f64::from(steps));
    }
}

#[test]
fn six_steps_beside_unequal_elements_are_one_number_and_not_thirty_six_phases() {
    let scan = Scan::new(6, &[[15.0, -20.0, 100.0]], 26, &[60.0, 100.0, 140.0]);
    let record =
        read(&scan, "[element-gain]\nspread = 0.2\n", 3, rounded(6, |phase, _| phase.round()));
    let diagnosis = diagnose(&[record], None).expect("comparable");
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{}", diagnosis.to_text());
    let named: std::collections::BTreeSet<EffectId> = diagnosis.effects.iter().copied().collect();
    assert_eq!(named, [EffectId::ElementGain, EffectId::PhaseQuantisation].into());
}

/// Four steps make a gap of 25 %, beside which the wall is not seen. Where they are known it is. Its distance is told to 3.4 mm.
#[test]
fn a_wall_is_found_beside_coarse_steps() {
    let scan = Scan::new(8, &[[-8.0, 18.0, 140.0]], 20, &[80.0, 140.0, 200.0]);
    let wall = "[wall]\nnormal = [0.8, 0.6, 0.0]\ndistance_mm = 240.0\ncoefficient = [0.7, 0.0]\n";
    let record = read(&scan, wall, 5, rounded(4, |phase, _| phase.round()));
    let diagnosis = diagnose(&[record], None).expect("comparable");
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{}", diagnosis.to_text());
    let named: std::collections::BTreeSet<EffectId> = diagnosis.effects.iter().copied().collect();
    assert_eq!(named, [EffectId::PhaseQuantisation, EffectId::Wall].into());
    assert!((real(&diagnosis, "wall.distance_mm") - 240.0).abs() < 3.0 * 3.4);
}

/// A driver counts delays in steps of its period, so that whole periods are left out. With delays taken as they are commanded, rounding to 96 steps was
/// named beside the frequency.
#[test]
fn a_driver_off_its_frequency_emits_delays_within_its_period() {
    let scan = Scan::new(6, &[[17.5, -22.5, 80.0], [-25.0, 15.0, 70.0]], 23, &[80.0, 130.0]);
    // The farthest element has no delay, and some have more than a period, which the rig's driver leaves out.
    let delayed = |phases_rad: &[f64]| -> Vec<f64> {
        let farthest = phases_rad.iter().copied().fold(f64::INFINITY, f64::min);
        phases_rad.iter().map(|phase_rad| phase_rad - farthest).collect()
    };
    assert!(delayed(&phases_rad(&scan.believed(0))).iter().any(|phase_rad| *phase_rad > TAU));
    let record = read(&scan, "[drive-frequency]\nratio = 0.984\n", 17, delayed);
    let diagnosis = diagnose(&[record], None).expect("comparable");
    named_alone(&diagnosis, EffectId::DriveFrequency);
    assert!((real(&diagnosis, "drive-frequency.ratio") - 0.984).abs() < 1e-3);
    assert_eq!(real(&diagnosis, "drive-frequency.within_a_period"), 1.0);
}

/// A rig that warms up by an exponential law while it scans. By a linear one it was left unexplained, or a standing wave was named beside it.
#[test]
fn a_rig_that_warms_up_drifts_with_a_time_constant() {
    for (seed, change, constants) in [(31, 0.1, 4.0), (32, -0.06, 8.0)] {
        let scan = Scan::new(6, &[[5.0, 0.0, 100.0]], 26, &[80.0, 100.0, 120.0]);
        let believed = scan.believed(0);
        let visits: Vec<Visit> = scan
            .places_m
            .iter()
            .map(|at| Visit { position_m: *at, velocity_m_s: Vec3::zeros(), time_s: 0.0 })
            .collect();
        let field = noise_free_readings(&believed, &toml::Table::new(), 0.05, &visits, seed);
        let last = visits.len() as f64 - 1.0;
        let warm = |(n, level): (usize, f64)| {
            level * (1.0 - change * (-constants * n as f64 / last).exp())
        };
        let field = field.expect("no effects").into_iter().enumerate().map(warm).collect();
        let diagnosis = diagnose(&[scan.record(vec![field], seed)], None).expect("comparable");
        named_alone(&diagnosis, EffectId::GainDrift);
        // The first reading has 1 - change of the settled level, the last next to all of it, and each takes 0.1 s.
        let left = change * (-constants).exp();
        let drift = (1.0 - left) / (1.0 - change) - 1.0;
        let truth = [("relative", drift), ("time_constant_s", 0.1 * last / constants)];
        for (name, truth) in truth {
            let found = &diagnosis.ranked[0].parameters[&format!("gain-drift.{name}")];
            let FittedParameter::Real { value, standard_error } = found else {
                panic!("{name}: {found:?}")
            };
            assert!((value - truth).abs() < 3.0 * standard_error, "{name}: {value} {truth}");
            assert!(*standard_error < 0.5 * truth.abs(), "{name}: {value} ± {standard_error}");
        }
    }
}

/// Without repeats the noise is an estimate. Of ten such scans, turbulence took up its error in these two.
#[test]
fn no_fluctuation_is_inferred_where_no_place_was_read_again() {
    for seed in [7, 8] {
        let mut scan = Scan::new(6, &[[5.0, 0.0, 100.0]], 36, &[80.0, 100.0, 120.0]);
        scan.places_m.truncate(scan.places_m.len() - REPEATS);
        let record =
            read(&scan, "[sound-speed]\nc_m_s = 348.0\n", seed, |phases_rad| phases_rad.to_vec());
        let diagnosis = diagnose(&[record], None).expect("comparable");
        named_alone(&diagnosis, EffectId::SoundSpeed);
    }
}

/// 76 readings all over a volume, of 64 unequal elements whose array is tilted. A flow of 8 m/s shifts the field as the tilt does.
fn tilted(seed: u64) -> RecordedScan {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut place_m = || {
        let [x, y, z] = [(); 3].map(|()| random.random::<f64>());
        Vec3::new(0.08 * x - 0.04, 0.08 * y - 0.04, 0.1 + 0.1 * z)
    };
    let places_m: Vec<Vec3> = (0..64).map(|_| place_m()).collect();
    let mut scan = Scan::new(8, &[[5.0, -10.0, 150.0]], 2, &[100.0]);
    scan.places_m = places_m.iter().chain(&places_m[..12]).copied().collect();
    let causes = "[array-tilt]\nabout_x_rad = -0.0194\nabout_y_rad = 0.0174\n[element-gain]\nspread = 0.11\n";
    read(&scan, causes, seed, <[f64]>::to_vec)
}

/// The flow was found first; departures of the elements that were fitted without either imitate both, so that the tilt was not found beside them.
#[test]
fn a_tilt_is_found_beside_departures_that_were_fitted_beside_a_flow() {
    let diagnosis = diagnose(&[tilted(4)], None).expect("comparable");
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{}", diagnosis.to_text());
    let named: std::collections::BTreeSet<EffectId> = diagnosis.effects.iter().copied().collect();
    assert_eq!(named, [EffectId::ArrayTilt, EffectId::ElementGain].into());
    let tilt_rad = real(&diagnosis, "array-tilt.about_x_rad");
    assert!((tilt_rad + 0.0194).abs() < 0.003, "{tilt_rad}");
}

/// These readings do not tell the two apart. That the flow is faster than a fan makes it less likely.
#[test]
fn a_breeze_is_a_less_likely_cause_than_a_tilt_that_explains_as_much() {
    let diagnosis = diagnose(&[tilted(7)], None).expect("comparable");
    let probability = |id: EffectId| {
        let with = diagnosis.ranked.iter().filter(|set| set.effects.contains(&id));
        with.map(|set| set.probability).sum::<f64>()
    };
    let [tilt, flow] = [EffectId::ArrayTilt, EffectId::Flow].map(probability);
    assert!(tilt > 4.0 * flow && flow > 0.01, "{tilt} {flow}");
}

/// The noise of 24 places that were read again is 0.4 of what it usually is. The set that explains the gap leaves one and a half times the chi-square of such a noise,
/// and was held to be far from the readings.
#[test]
fn a_cause_is_named_where_few_repeats_agree_better_than_the_noise() {
    const AGAIN: usize = 24;
    let mut scan = Scan::new(6, &[[5.0, 0.0, 100.0]], 30, &[100.0, 130.0]);
    scan.places_m.truncate(2 * 30 * 30 + AGAIN);
    let again = scan.places_m[2 * 30 * 30..].to_vec();
    let tilt = "[array-tilt]\nabout_x_rad = 0.02\nabout_y_rad = 0.01\n";
    let mut record = read(&scan, tilt, 6, <[f64]>::to_vec);
    let levels = levels(&scan, tilt, 6, <[f64]>::to_vec, 0);
    let driven = record.samples.iter_mut().filter(|sample| sample.focus.is_some());
    for ((sample, level), place_m) in driven.zip(levels).zip(&scan.places_m) {
        if again.contains(place_m) {
            sample.reading = level + 0.4 * (sample.reading - level);
        }
    }
    let diagnosis = diagnose(&[record], None).expect("comparable");
    named_alone(&diagnosis, EffectId::ArrayTilt);
    assert!((diagnosis.noise.multiplicative / NOISE.0 - 1.0).abs() < 0.1, "{:?}", diagnosis.noise);
}

/// Of 3,000 readings of 256 elements a search uses half, which hold a quarter of the repeats.
#[test]
fn the_noise_of_a_large_array_is_that_of_all_its_repeats() {
    let foci = [[5.0, 0.0, 100.0], [-12.0, 8.0, 90.0]];
    let scan = Scan::new(16, &foci, 26, &[90.0, 130.0]);
    let causes = "[dead-elements]\nelements = [119, 165, 224]\n";
    let record = read(&scan, causes, 5, |phases_rad| phases_rad.to_vec());
    let diagnosis = diagnose(&[record], None).expect("comparable");
    named_alone(&diagnosis, EffectId::DeadElements);
    assert!((diagnosis.noise.multiplicative / NOISE.0 - 1.0).abs() < 0.1, "{:?}", diagnosis.noise);
    assert!(diagnosis.points > 2900, "all readings count: {}", diagnosis.points);
}

/// 256 amplitudes of one focus. Steps of phase came nearest while so many elements were not fitted.
#[test]
fn unequal_elements_of_a_large_array_are_told() {
    const SPREAD: f64 = 0.07;
    let scan = Scan::new(16, &[[5.0, -10.0, 120.0]], 26, &[90.0, 130.0]);
    let causes = format!("[element-gain]\nspread = {SPREAD}\n");
    let diagnosis =
        diagnose(&[read(&scan, &causes, 8, <[f64]>::to_vec)], None).expect("comparable");
    named_alone(&diagnosis, EffectId::ElementGain);
    let spread = real(&diagnosis, "element-gain.spread");
    assert!((spread / SPREAD - 1.0).abs() < 0.3, "{spread}");
}

/// Lobes as data sheets have them, in decibels at every ten degrees, between which a cubic is laid: neither is that of a piston, and neither is the
/// other's stretched.
#[test]
fn a_lobe_of_no_formula_is_not_taken_for_unequal_elements() {
    let lobes_db = [
        [0.0, -0.3, -1.6, -4.4, -7.2, -8.6, -10.0, -13.5, -17.0, -19.0],
        [0.0, -0.6, -1.9, -3.0, -3.9, -5.6, -8.9, -12.6, -15.0, -16.0],
    ];
    for (seed, lobe_db) in lobes_db.into_iter().enumerate() {
        let scan = Scan::new(6, &[[8.0, -5.0, 110.0]], 36, &[90.0, 130.0]);
        let lobe =
            |theta_rad: f64| 10f64.powf(between(&lobe_db, theta_rad.to_degrees() / 10.0) / 20.0);
        let record = scan.read_waves(40 + seed as u64, |element, phase_rad, at| {
            let way = at - element.centre_m;
            let amplitude = lobe((way.z / way.norm()).acos()) / way.norm();
            Complex64::from_polar(amplitude, WAVENUMBER_RAD_M * way.norm() + phase_rad)
        });
        let diagnosis = diagnose(&[record], None).expect("comparable");
        named_alone(&diagnosis, EffectId::Directivity);
    }
}

/// A cubic through four points (Catmull and Rom), even about the first.
fn between(table: &[f64], place: f64) -> f64 {
    let last = table.len() as i64 - 1;
    let at = |n: i64| table[n.abs().min(last) as usize];
    let (whole, part) = (place.floor() as i64, place.fract());
    let [a, b, c, d] = [-1, 0, 1, 2].map(|n| at(whole + n));
    b + 0.5
        * part
        * (c - a + part * (2.0 * a - 5.0 * b + 4.0 * c - d + part * (3.0 * (b - c) + d - a)))
}
