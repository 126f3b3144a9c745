//! Scans of one place: what is kept out of the fit is then a share of the drives, or of the time.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use fieldgap_acoustics::Vec3;
use fieldgap_diagnosis::{EffectId, HeldOutBy, diagnose};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_readings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const NOISE: f64 = 0.01;

/// Random phases for each drive; each place is read once with each of them, drive by drive.
fn record(side: usize, drives: usize, places: &[Vec3], effects: &str) -> RecordedScan {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut text = format!(
        "format = 1\nname = \"coded\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
         [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = {side}\nrows = {side}\nelement_diameter_mm = 10.0\nspacing_mm = 0.0\n\
         [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n"
    );
    for _ in 0..drives {
        let phases: Vec<String> =
            (0..side * side).map(|_| format!("{:.4}", random.random_range(0.0..TAU))).collect();
        writeln!(text, "[[focus]]\nphases_rad = [{}]", phases.join(", ")).expect("text");
    }
    let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("a set-up");
    let effects: toml::Table = effects.parse().expect("TOML");
    let mut samples = Vec::new();
    for drive in 0..drives {
        let simulation = setup.simulation(setup.simulator, drive).expect("a drive");
        let first = samples.len();
        let visit = |(n, place): (usize, &Vec3)| Visit {
            position_m: *place,
            velocity_m_s: Vec3::zeros(),
            time_s: 0.05 * (first + n) as f64,
        };
        let visits: Vec<Visit> = places.iter().enumerate().map(visit).collect();
        let levels = noise_free_readings(&simulation, &effects, 0.05, &visits, 3);
        for (visit, level) in visits.iter().zip(levels.expect("valid effects")) {
            let normal: f64 = StandardNormal.sample(&mut random);
            let reading = level * (1.0 + NOISE * normal);
            let Visit { position_m, time_s, .. } = *visit;
            samples.push(RecordedSample::measured(time_s, Some(drive), position_m, reading, None));
        }
    }
    RecordedScan { setup, samples }
}

#[test]
fn many_drives_of_one_place_are_checked_by_drives_that_were_kept_out() {
    let place = Vec3::new(4e-3, -3e-3, 0.15);
    // Each drive is read three times, one after another: repeats of a reading say nothing of a fit.
    let scan = record(6, 60, &[place, place, place], "[sound-speed]\nc_m_s = 358.0");
    let found = diagnose(&[scan], None).expect("comparable");
    assert_eq!(found.held_out_by, HeldOutBy::Drive);
    assert!(found.gap_before_held_out > 2.0 * NOISE, "{}", found.gap_before_held_out);
    let after = found.ranked[0].gap_after_held_out;
    assert!((0.7 * NOISE..2.0 * NOISE).contains(&after), "{after}");
    assert!(found.to_text().contains("held out: a fifth of the drives"), "{}", found.to_text());
}

/// Turned axes and axes of another scale do the same there, with fewer numbers.
#[test]
fn one_place_that_is_off_is_told_as_an_offset() {
    let place = Vec3::new(9.5e-3, 27e-3, 0.18);
    let scan = record(6, 60, &[place, place], "[offset]\nx_mm = -1.5\ny_mm = 0.0\nz_mm = 0.0");
    let found = diagnose(&[scan], None).expect("comparable");
    let named = found.ranked.iter().take(3).any(|ranked| ranked.effects == [EffectId::Offset]);
    assert!(named, "{}", found.sentence);
    let of_axes = [EffectId::Rotation, EffectId::Skew, EffectId::AxisScale];
    let named = |ids: &[EffectId]| of_axes.iter().any(|id| ids.contains(id));
    assert!(!found.ranked.iter().any(|ranked| named(&ranked.effects)), "{}", found.sentence);
}

#[test]
fn few_drives_of_neighbouring_places_are_checked_by_stretches_of_time() {
    let places: Vec<Vec3> =
        (0..60).map(|n| Vec3::new(1e-3 * f64::from(n % 3), 0.0, 0.15)).collect();
    let drift = "[gain-drift]\nrelative = -0.3\nover_s = 12.0";
    let scans = [&places[..], &places[..57]].map(|places| record(4, 4, places, drift));
    let found = diagnose(&scans, None).expect("comparable");
    assert_eq!(found.held_out_by, HeldOutBy::Time);
    assert!(found.gap_before_held_out > 2.0 * NOISE, "{}", found.gap_before_held_out);
    let after = found.ranked[0].gap_after_held_out;
    assert!((0.7 * NOISE..2.0 * NOISE).contains(&after), "{after} {}", found.sentence);
}
