//! A named cause held against readings that were taken after its fit.

use std::path::Path;

use fieldgap_acoustics::Vec3;
use fieldgap_diagnosis::{EffectId, Findings, Options, Verdict};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_readings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const NOISE: f64 = 0.01;

/// Time from one reading to the next, s.
const PACE_S: f64 = 0.1;

const SETUP: &str = "format = 1\nname = \"scattered\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
    [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 4\nrows = 4\nelement_diameter_mm = 10.0\nspacing_mm = 0.0\n\
    [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n\
    [[focus]]\nx_mm = 2.0\ny_mm = -1.0\nz_mm = 120.0\n";

/// Readings at scattered places, every fifth of them a repeat, with noise in proportion.
fn record(count: usize, effects: &str) -> RecordedScan {
    let setup =
        ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), SETUP)).expect("a set-up");
    let effects: toml::Table = effects.parse().expect("TOML");
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut places: Vec<Vec3> = Vec::new();
    for n in 0..count {
        let mut within = |low: f64, high: f64| random.random_range(low..high);
        let new = Vec3::new(within(-0.02, 0.02), within(-0.02, 0.02), within(0.09, 0.16));
        places.push(if n % 5 == 4 { places[n / 2] } else { new });
    }
    let visit = |(n, position_m): (usize, &Vec3)| Visit {
        position_m: *position_m,
        velocity_m_s: Vec3::zeros(),
        time_s: PACE_S * n as f64,
    };
    let visits: Vec<Visit> = places.iter().enumerate().map(visit).collect();
    let simulation = setup.simulation(setup.simulator, 0).expect("a focus");
    let levels = noise_free_readings(&simulation, &effects, PACE_S, &visits, 3).expect("valid");
    let samples = visits.iter().zip(levels).map(|(visit, level)| {
        let normal: f64 = StandardNormal.sample(&mut random);
        let reading = level * (1.0 + NOISE * normal);
        RecordedSample::measured(visit.time_s, Some(0), visit.position_m, reading, None)
    });
    let samples = samples.collect();
    RecordedScan { setup, samples }
}

/// A drift goes on after the readings that it was fitted to. A model that stopped it at the last of them, or that spread it over all, would be
/// seven times the noise off.
#[test]
fn a_drift_holds_on_readings_after_its_fit() {
    let whole = record(260, "[gain-drift]\nrelative = -0.3\nover_s = 26.0");
    let seen = RecordedScan { setup: whole.setup.clone(), samples: whole.samples[..200].to_vec() };
    let seen = [seen];
    let findings = Findings::of(&seen, &Options::default()).expect("comparable");
    assert_eq!(findings.named(), [[EffectId::GainDrift]]);
    let test = findings.on_fresh(&whole);
    assert_eq!(test.readings, 60);
    assert!(test.gap_before > 10.0 * NOISE, "{test:?}");
    assert!(test.chi_square < 1.0 + 4.0 * test.standard_error(), "{test:?}");
    assert!((0.6 * NOISE..1.7 * NOISE).contains(&test.gap_after), "{test:?}");
}

/// The same cause does not hold where the fresh readings have another.
#[test]
fn a_cause_that_has_gone_does_not_hold() {
    let with = record(200, "[sound-speed]\nc_m_s = 352.0");
    let without = record(260, "");
    let mut whole = with.clone();
    whole.samples.extend_from_slice(&without.samples[200..]);
    let seen = [with];
    let findings = Findings::of(&seen, &Options::default()).expect("comparable");
    // (With one focus a faster sound and a lower carrier look alike; either has gone.)
    assert!(findings.named()[0].len() == 1, "{:?}", findings.probabilities());
    let test = findings.on_fresh(&whole);
    assert!(test.chi_square > 3.0 && test.gap_after > 2.0 * test.noise, "{test:?}");
}

/// The first readings of a record.
fn first(whole: &RecordedScan, readings: usize) -> [RecordedScan; 1] {
    let samples = whole.samples[..readings].to_vec();
    [RecordedScan { setup: whole.setup.clone(), samples }]
}

/// Of few readings several sets are left in question. Fitted to all readings they stand to one another as after a search among all sets.
#[test]
fn sets_in_question_fitted_to_more_readings_stand_as_after_a_search() {
    let whole = record(260, "[pitch]\nratio = 1.02");
    let seen = first(&whole, 80);
    let before = Findings::of(&seen, &Options::default()).expect("comparable");
    assert!(before.probabilities()[0].1 < 0.9, "{:?}", before.probabilities());
    let all = std::slice::from_ref(&whole);
    let again = Findings::of_live(all, &Options::default(), &before.live_sets()).expect("as well");
    let searched = Findings::of(all, &Options::default()).expect("comparable");
    assert_eq!((again.verdict(), again.named()), (searched.verdict(), searched.named()));
    let odds = |findings: &Findings<'_>| {
        let probabilities = findings.probabilities();
        let of = |ids: &[EffectId]| {
            probabilities.iter().find(|(set, _)| set == ids).expect("it is in question").1
        };
        (of(&[EffectId::Pitch]) / of(&[])).ln()
    };
    let [again, searched] = [&again, &searched].map(odds);
    assert!(searched > 3.0 && (again - searched).abs() < 0.05, "{again} {searched}");
}

/// Sets that were in question before a cause appeared do not explain it; a search does.
#[test]
fn sets_in_question_leave_a_new_cause_unexplained() {
    let mut whole = record(400, "[dead-elements]\nelements = [5]");
    whole.samples.splice(..100, record(100, "").samples);
    let seen = first(&whole, 100);
    let before = Findings::of(&seen, &Options::default()).expect("comparable");
    assert_eq!(before.verdict(), Verdict::None);
    let all = std::slice::from_ref(&whole);
    let again = Findings::of_live(all, &Options::default(), &before.live_sets()).expect("as well");
    assert_eq!(again.verdict(), Verdict::Unexplained, "{:?}", again.probabilities());
}

/// The set-up of the records with this speed of sound, its drive kept as the phases that were emitted.
fn set_up_with(c_m_s: f64) -> ScanSetup {
    let believed = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), SETUP)).expect("good");
    let simulation = believed.simulation(believed.simulator, 0).expect("a focus");
    let phases_rad = simulation.excitation.phases_rad(
        believed.array.array(),
        &believed.medium.medium(),
        believed.array.frequency_hz(),
    );
    let text = SETUP
        .replace("x_mm = 2.0\ny_mm = -1.0\nz_mm = 120.0", &format!("phases_rad = {phases_rad:?}"))
        .replace("= 343.0", &format!("= {c_m_s}"));
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("good")
}

/// The true set-up in files leaves the noise and agrees with the fit; one with the opposite error does neither, though the fit holds.
#[test]
fn a_corrected_set_up_is_held_against_readings_and_fit() {
    let whole = record(260, "[sound-speed]\nc_m_s = 352.0");
    let seen = RecordedScan { setup: whole.setup.clone(), samples: whole.samples[..200].to_vec() };
    let seen = [seen];
    let findings = Findings::of(&seen, &Options::default()).expect("comparable");
    let as_fitted = findings.on_fresh(&whole);
    assert!(as_fitted.chi_square < 1.0 + 4.0 * as_fitted.standard_error(), "{as_fitted:?}");
    let right = findings.on_fresh_corrected(&whole, &set_up_with(352.0), &[]);
    assert!(right.chi_square < 1.0 + 4.0 * as_fitted.standard_error(), "{right:?}");
    assert!(right.departure < 0.5, "{right:?}");
    assert!(right.gap + 3.0 * right.gap_error < as_fitted.gap_before, "{right:?}");
    let wrong = findings.on_fresh_corrected(&whole, &set_up_with(334.0), &[]);
    assert!(wrong.chi_square > 3.0 && wrong.departure > 1.0, "{wrong:?}");
}

/// What no file holds acts as it was fitted: with the believed set-up it gives the fit again, and without it the gap is left.
#[test]
fn an_effect_without_a_file_is_accounted_for() {
    let whole = record(260, "[gain-drift]\nrelative = -0.3\nover_s = 26.0");
    let seen = RecordedScan { setup: whole.setup.clone(), samples: whole.samples[..200].to_vec() };
    let seen = [seen];
    let findings = Findings::of(&seen, &Options::default()).expect("comparable");
    let as_fitted = findings.on_fresh(&whole);
    let with = |accounted: &[EffectId]| {
        findings.on_fresh_corrected(&whole, &whole.setup.clone(), accounted)
    };
    let accounted = with(&[EffectId::GainDrift]);
    assert!(accounted.departure < 1e-6, "{accounted:?}");
    assert!((accounted.gap - as_fitted.gap_after).abs() < 1e-9);
    assert!(with(&[]).chi_square > 3.0, "{:?}", with(&[]));
}

/// The standard error of a gap against the scatter of gaps of many parts of a record.
#[test]
fn the_error_of_a_gap_is_the_scatter_of_gaps() {
    let whole = record(1240, "[sound-speed]\nc_m_s = 352.0");
    let seen = RecordedScan { setup: whole.setup.clone(), samples: whole.samples[..200].to_vec() };
    let seen = [seen];
    let findings = Findings::of(&seen, &Options::default()).expect("comparable");
    // Twenty times 52 places of their own: the first 42 of each part are no repeats of one another.
    let parts = whole.samples[200..].chunks(52).map(|part| {
        let samples = seen[0].samples.iter().chain(part).cloned().collect();
        findings.on_fresh(&RecordedScan { setup: whole.setup.clone(), samples })
    });
    let (mut gaps, mut errors) = ([Vec::new(), Vec::new()], [0.0; 2]);
    for test in parts {
        gaps[0].push(test.gap_before);
        gaps[1].push(test.gap_after);
        errors[0] += test.gap_before_error.powi(2);
        errors[1] += test.gap_after_error.powi(2);
    }
    for (gaps, errors) in gaps.iter().zip(errors) {
        let n = gaps.len() as f64;
        let mean = gaps.iter().sum::<f64>() / n;
        let scatter = gaps.iter().map(|gap| (gap - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let ratio = (scatter / (errors / n)).sqrt();
        // Of twenty draws a scatter is known to a sixth.
        assert!((0.6..1.6).contains(&ratio), "{ratio}");
    }
}
