//! Maps of readings whose field is known: from the virtual rig's own physics, not from the simulation that the map begins with.

use fieldgap_acoustics::Vec3;
use fieldgap_adaptive_map::{FieldMap, map};
use fieldgap_input::TomlSource;
use fieldgap_records::{MapPrior, RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_readings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const SETUP: &str = "format = 1\nname = \"map\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n[array]\nfrequency_hz = 40000.0\n\
                     layout = \"square\"\ncolumns = 4\nrows = 4\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
                     [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
                     [[focus]]\nx_mm = 5.0\ny_mm = 0.0\nz_mm = 100.0\n";

/// Noise of a reading: in proportion to it, and of each quadrature over the peak.
const SHARE: f64 = 0.02;
const ADDITIVE: f64 = 0.004;

/// Readings at random places of two planes, silent ones and repeats, of a field with these effects; the map, and the truth on it.
fn mapped(effects: &toml::Table, prior: MapPrior) -> (FieldMap, Vec<f64>) {
    let source = TomlSource::new(std::path::Path::new("scan.toml"), SETUP);
    let setup = ScanSetup::parse(&source).expect("a set-up");
    let simulation = setup.simulation(setup.simulator, 0).expect("one focus");
    let mut draws = ChaCha8Rng::seed_from_u64(5);
    let mut at_m: Vec<Vec3> = (0..260)
        .map(|n| {
            let [x, y] = [(); 2].map(|()| draws.random_range(-0.02..0.02));
            Vec3::new(x, y, if n % 2 == 0 { 0.08 } else { 0.11 })
        })
        .collect();
    at_m.extend_from_within(..40);
    let grid: Vec<(Vec3, usize)> = [0.08, 0.11]
        .into_iter()
        .flat_map(|z| {
            (0..169).map(move |n| {
                let along = |n: usize| 3e-3 * (n as f64 - 6.0);
                (Vec3::new(along(n % 13), along(n / 13), z), 0)
            })
        })
        .collect();
    let visit = |(n, position_m): (usize, Vec3)| Visit {
        position_m,
        velocity_m_s: Vec3::zeros(),
        time_s: 0.1 * n as f64,
    };
    let true_at = |places: Vec<Vec3>| {
        let visits: Vec<Visit> = places.into_iter().enumerate().map(visit).collect();
        noise_free_readings(&simulation, effects, 0.02, &visits, 7).expect("the effects fit")
    };
    let truth = true_at(grid.iter().map(|(at_m, _)| *at_m).collect());
    let peak = truth.iter().copied().fold(0.0, f64::max);
    let mut normal = || -> f64 { StandardNormal.sample(&mut draws) };
    let mut read = |level: f64| {
        let in_phase = level * (1.0 + SHARE * normal()) + ADDITIVE * peak * normal();
        in_phase.hypot(ADDITIVE * peak * normal())
    };
    let dark = (0..30).map(|n| (f64::from(n) - 40.0, None, at_m[0], 0.0));
    let driven = true_at(at_m.clone()).into_iter().zip(&at_m).enumerate();
    let driven = driven.map(|(n, (level, at_m))| (0.1 * n as f64, Some(0), *at_m, level));
    let samples = dark
        .chain(driven)
        .map(|(s, focus, at_m, level)| RecordedSample::measured(s, focus, at_m, read(level), None))
        .collect();
    let record = RecordedScan { setup, samples };
    (map(&record, &grid, prior, None).expect("a map"), truth)
}

/// Root mean square error over the peak, and the share of places within 1.96 standard errors.
fn held_against(made: &FieldMap, truth: &[f64]) -> [f64; 2] {
    let peak = truth.iter().copied().fold(0.0, f64::max);
    let n = truth.len() as f64;
    let errors = made.estimates.iter().zip(truth).map(|(e, truth)| (e.amplitude - truth, e));
    let squares: f64 = errors.clone().map(|(error, _)| error * error).sum();
    let within = errors.filter(|(error, e)| error.abs() <= 1.96 * e.standard_error).count();
    [(squares / n).sqrt() / peak, within as f64 / n]
}

#[test]
fn a_field_that_the_simulation_spans_is_known_better_than_any_reading() {
    let (made, truth) = mapped(&toml::Table::new(), MapPrior::Simulation);
    let [rms, within] = held_against(&made, &truth);
    // A reading has 0.6 % of the peak and more.
    assert!(rms < 2.5e-3, "{rms}");
    assert!(within > 0.8, "{within}");
    assert!(made.errors().rms < 5e-3 * made.errors().peak);
}

#[test]
fn elements_that_differ_are_learnt_and_the_process_alone_needs_more() {
    let effects = toml::toml! { element-gain = { spread = 0.15 } };
    let (made, truth) = mapped(&effects, MapPrior::Simulation);
    let [rms, within] = held_against(&made, &truth);
    assert!(rms < 6e-3, "{rms}");
    assert!(within > 0.8, "{within}");
    let (alone, truth) = mapped(&effects, MapPrior::Process);
    let [alone_rms, alone_within] = held_against(&alone, &truth);
    assert!(alone_rms > 1.5 * rms, "{alone_rms} {rms}");
    assert!(alone_rms < 0.06 && alone_within > 0.8, "{alone_rms} {alone_within}");
    assert!(alone.effects.is_empty());
}
