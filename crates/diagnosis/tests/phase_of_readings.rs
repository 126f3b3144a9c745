//! Readings with a phase: what a diagnosis finds of the virtual rig's vibrating pistons, which share nothing with it, by amplitudes and by both.

use std::collections::BTreeSet;
use std::path::Path;

use fieldgap_acoustics::{Vec3, delays_s};
use fieldgap_diagnosis::{
    AlikeEffects, ChangeVerdict, Diagnosis, EffectId, FittedParameter, Options, Verdict,
    alike_effects, alike_effects_by_amplitudes, diagnose_change, diagnose_change_by_amplitudes,
    diagnose_with,
};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_coded_phasors};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Two planes, 40 mm wide, read row by row; a tenth of the places again.
fn places_mm() -> Vec<Vec3> {
    let mut places = Vec::new();
    for z_mm in [80.0, 130.0] {
        for row in 0..14 {
            for column in 0..14 {
                let column = if row % 2 == 1 { 13 - column } else { column };
                let along = |n: i32| 3.0 * (f64::from(n) - 6.5);
                places.push(Vec3::new(along(column), along(row), z_mm));
            }
        }
    }
    places.extend(places.clone().iter().step_by(10));
    places
}

/// The clock of the receiver beside that of the drives.
#[derive(Debug, Clone, Copy)]
struct Clock {
    offset_rad: f64,
    drift_rad: f64,
    /// Standard deviation at the end of the scan of what it moves at random.
    moves_rad: f64,
    noise_rad: f64,
}

const CLOCK: Clock = Clock { offset_rad: 2.9, drift_rad: 0.06, moves_rad: 0.0, noise_rad: 0.015 };

fn setup(convention: &str) -> ScanSetup {
    let text = format!(
        "format = 1\nname = \"phases\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
         [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0\n\
         [medium]\nspeed_of_sound_m_s = 343.0\n[phase]\nreference = \"drive-sync\"\nconvention = \"{convention}\"\n\
         [simulator]\nmodel = \"piston\"\n\
         [[focus]]\nx_mm = 8.0\ny_mm = -5.0\nz_mm = 100.0\n"
    );
    ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text.as_str())).expect("a set-up")
}

/// A scan of a rig with these causes, with 1 % and 0.5 % of the largest level of noise.
fn record(causes: &toml::Table, clock: Clock, convention: &str, seed: u64) -> RecordedScan {
    record_of_rig(seed, causes, clock, convention, seed)
}

/// The same of a rig whose elements are drawn by a seed of their own.
fn record_of_rig(
    rig: u64,
    causes: &toml::Table,
    clock: Clock,
    convention: &str,
    seed: u64,
) -> RecordedScan {
    let setup = setup(convention);
    let sign = if convention == "exp(+iwt)" { -1.0 } else { 1.0 };
    let simulation = setup.simulation(setup.simulator, 0).expect("focus 0");
    let visits: Vec<(usize, Visit)> = places_mm()
        .into_iter()
        .enumerate()
        .map(|(n, at_mm)| Visit {
            position_m: at_mm * 1e-3,
            velocity_m_s: Vec3::zeros(),
            time_s: n as f64,
        })
        .map(|visit| (0, visit))
        .collect();
    let (array, medium) = (&simulation.array, &simulation.medium);
    let drives_s = [delays_s(&simulation.excitation, array, medium, simulation.frequency_hz)];
    let field = noise_free_coded_phasors(&simulation, causes, 0.05, &drives_s, &visits, rig);
    let field = field.expect("the causes fit");
    let additive = 5e-3 * field.iter().fold(0.0f64, |most, (level, _)| most.max(*level));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut samples = Vec::new();
    for n in 0..30 {
        let (re, im): (f64, f64) = (additive * normal(), additive * normal());
        samples.push(
            RecordedSample::measured(
                f64::from(n) - 40.0,
                None,
                Vec3::z() * 0.13,
                re.hypot(im),
                None,
            )
            .with_phase(Some(im.atan2(re))),
        );
    }
    let last = visits.len() as f64 - 1.0;
    let mut steps = ChaCha8Rng::seed_from_u64(seed + 1000);
    let mut moved_rad = 0.0;
    for (n, ((_, visit), (level, phase_rad))) in visits.iter().zip(field).enumerate() {
        let re: f64 = level * (1.0 + 0.01 * normal()) + additive * normal();
        let im: f64 = additive * normal();
        let of_clock = clock.offset_rad
            + clock.drift_rad * n as f64 / last
            + moved_rad
            + clock.noise_rad * normal();
        let step: f64 = StandardNormal.sample(&mut steps);
        moved_rad += clock.moves_rad / last.sqrt() * step;
        let phase_rad = sign * (phase_rad + of_clock) + im.atan2(re);
        let Visit { position_m, time_s, .. } = *visit;
        // One phase in a hundred was lost.
        let phase_rad = (n % 100 != 57).then_some(phase_rad);
        samples.push(
            RecordedSample::measured(time_s, Some(0), position_m, re.hypot(im), None)
                .with_phase(phase_rad),
        );
    }
    RecordedScan { setup, samples }
}

fn diagnosed(scan: &RecordedScan, amplitude_only: bool) -> Diagnosis {
    let options = Options { amplitude_only, ..Options::default() };
    diagnose_with(std::slice::from_ref(scan), &options).expect("comparable")
}

fn speed(diagnosis: &Diagnosis) -> (f64, f64) {
    let best = &diagnosis.ranked[0];
    match best.parameters.get("sound-speed.c_m_s") {
        Some(FittedParameter::Real { value, standard_error }) => (*value, *standard_error),
        other => panic!("{:?}: {other:?}", best.effects),
    }
}

#[test]
fn phases_tell_a_speed_of_sound_many_times_better_than_amplitudes() {
    let causes = toml::toml! { sound-speed = { c_m_s = 344.2 } };
    for convention in ["exp(-iwt)", "exp(+iwt)"] {
        let scan = record(&causes, CLOCK, convention, 3);
        let with = diagnosed(&scan, false);
        assert_eq!(
            (with.verdict, &with.effects[..]),
            (Verdict::Explained, &[EffectId::SoundSpeed][..]),
            "{}",
            with.sentence
        );
        let (value, error) = speed(&with);
        assert!((value - 344.2).abs() < 4.0 * error, "{value} ± {error}");
        let without = diagnosed(&scan, true);
        eprintln!("{}\n{}", with.sentence, without.sentence);
        if without.ranked[0].effects == [EffectId::SoundSpeed] {
            assert!(error < 0.3 * speed(&without).1, "{error} {:?}", speed(&without));
        } else {
            assert_ne!(without.verdict, Verdict::Explained, "{}", without.sentence);
        }
    }
}

/// The clock's offset, drift and noise are no cause.
#[test]
fn a_rig_without_a_cause_has_none_whatever_its_clock_does() {
    for (seed, clock) in [
        (1, CLOCK),
        (2, Clock { drift_rad: -0.15, ..CLOCK }),
        (3, Clock { offset_rad: -3.1, drift_rad: 0.0, noise_rad: 0.1, ..CLOCK }),
        (4, Clock { moves_rad: 0.1, ..CLOCK }),
        (5, Clock { moves_rad: 0.1, drift_rad: 0.0, ..CLOCK }),
    ] {
        let scan = record(&toml::Table::new(), clock, "exp(-iwt)", seed);
        let diagnosis = diagnosed(&scan, false);
        assert_eq!(diagnosis.verdict, Verdict::None, "{clock:?}: {}", diagnosis.sentence);
    }
}

/// Amplitudes alone: the record with its phases taken away, and its readings marked as averaged with their phases all the same.
#[test]
fn amplitudes_of_a_record_with_phases_are_judged_as_those_of_one_without() {
    let causes = toml::toml! { pitch = { ratio = 1.02 } };
    let scan = record(&causes, CLOCK, "exp(-iwt)", 5);
    let mut plain = scan.clone();
    plain.setup.phase = None;
    plain.samples.iter_mut().for_each(|sample| sample.phase_rad = None);
    let [one, other] = [diagnosed(&scan, true), diagnosed(&plain, false)];
    assert_eq!(one, other);
    assert_ne!(one, diagnosed(&scan, false));
}

fn pair(of: &[AlikeEffects], ids: [EffectId; 2]) -> &AlikeEffects {
    let pair = of.iter().find(|p| ids.contains(&p.effect) && ids.contains(&p.imitator));
    pair.expect("both act")
}

#[test]
fn phases_part_effects_that_amplitudes_confuse() {
    let scan = record(&toml::Table::new(), CLOCK, "exp(-iwt)", 7);
    let with = alike_effects(&scan, None).expect("comparable");
    let without = alike_effects_by_amplitudes(&scan, None).expect("comparable");
    use EffectId::{ArrayTilt, AxisScale, Flow, Pitch, SoundSpeed, TemperatureGradient};
    for (ids, most) in [
        ([AxisScale, Pitch], 0.2),
        ([SoundSpeed, AxisScale], 0.2),
        // From one plane to the next the reference may move, as far as repeats tell.
        ([SoundSpeed, Pitch], 0.5),
        ([Flow, ArrayTilt], 0.2),
        ([Flow, TemperatureGradient], 0.3),
        ([SoundSpeed, TemperatureGradient], 0.8),
    ] {
        let [a, b] = [&with, &without].map(|of| pair(of, ids).separable_gap_sigma);
        assert!(a < most * b, "{ids:?}: {a} with phases, {b} without");
    }
    let pairs = |of: &[AlikeEffects]| -> BTreeSet<[EffectId; 2]> {
        of.iter()
            .map(|pair| [pair.effect.min(pair.imitator), pair.effect.max(pair.imitator)])
            .collect()
    };
    assert_eq!(pairs(&with), pairs(&without));
    // The receiver's face and its lobe act on amplitudes.
    let receiver = [EffectId::Aperture, EffectId::ReceiverDirectivity];
    assert!(pair(&with, receiver).residual_share < 0.02);
}

/// A record before and one after a change, of a rig with causes that neither set-up knows, each by a clock and a convention of its own.
fn before_and_after(change: &toml::Table, after: Clock, seed: u64) -> [RecordedScan; 2] {
    let mut causes = toml::toml! {
        sound-speed = { c_m_s = 344.0 }
        directivity = { width_ratio = 0.93 }
        element-gain = { spread = 0.06 }
        element-phase = { spread_rad = 0.1 }
    };
    let a = record_of_rig(seed, &causes, CLOCK, "exp(-iwt)", 2 * seed);
    causes.extend(change.clone());
    [a, record_of_rig(seed, &causes, after, "exp(+iwt)", 2 * seed + 1)]
}

const OTHER_CLOCK: Clock = Clock { offset_rad: -1.1, drift_rad: -0.08, ..CLOCK };

#[test]
fn phases_tell_a_wind_that_rose_from_an_array_that_was_tilted() {
    let wind = toml::toml! { flow = { vx_m_s = 0.5, vy_m_s = 0.0 } };
    let [a, b] = before_and_after(&wind, OTHER_CLOCK, 1);
    let with = diagnose_change(&a, &b, None).expect("comparable");
    let named = (with.verdict, &with.effects[..]);
    assert_eq!(named, (ChangeVerdict::Explained, &[EffectId::Flow][..]), "{}", with.sentence);
    let along_x = with.ranked[0].parameters["flow.vx_m_s"].change.expect("a number");
    let off = (along_x.value - 0.5).abs();
    assert!(off < 4.0 * along_x.standard_error && along_x.standard_error < 0.1, "{along_x:?}");
    let without = diagnose_change_by_amplitudes(&a, &b, None).expect("comparable");
    assert_eq!(without.verdict, ChangeVerdict::Ambiguous, "{}", without.sentence);
}

#[test]
fn phases_tell_a_change_that_amplitudes_do_not_show() {
    let warmer = toml::toml! { sound-speed = { c_m_s = 344.8 } };
    let [a, b] = before_and_after(&warmer, OTHER_CLOCK, 1);
    let with = diagnose_change(&a, &b, None).expect("comparable");
    assert_eq!(with.effects, [EffectId::SoundSpeed], "{}", with.sentence);
    let faster = with.ranked[0].parameters["sound-speed.c_m_s"].change.expect("a number");
    let off = (faster.value - 0.8).abs();
    assert!(off < 4.0 * faster.standard_error && faster.standard_error < 0.2, "{faster:?}");
    let without = diagnose_change_by_amplitudes(&a, &b, None).expect("comparable");
    assert_eq!(without.verdict, ChangeVerdict::None, "{}", without.sentence);
    assert!((0.7..1.3).contains(&with.chi_square_after), "{}", with.chi_square_after);
    // One record without phases leaves the amplitudes.
    let mut plain = b.clone();
    plain.setup.phase = None;
    plain.samples.iter_mut().for_each(|sample| sample.phase_rad = None);
    let one_sided = diagnose_change(&a, &plain, None).expect("comparable");
    assert_eq!(one_sided.verdict, ChangeVerdict::None, "{}", one_sided.sentence);
}

#[test]
fn a_copy_with_another_phase_of_the_clock_is_a_copy() {
    let [a, _] = before_and_after(&toml::Table::new(), OTHER_CLOCK, 5);
    let mut copy = a.clone();
    let turn = |sample: &mut RecordedSample| {
        sample.phase_rad = sample.phase_rad.map(|phase_rad| phase_rad + 1.0);
    };
    copy.samples.iter_mut().for_each(turn);
    let found = diagnose_change(&a, &copy, None).expect("comparable");
    assert_eq!(found.verdict, ChangeVerdict::None, "{}", found.sentence);
    assert!((0.0..0.1).contains(&found.chi_square_unchanged), "{}", found.chi_square_unchanged);
}

#[test]
fn clocks_that_differ_are_no_change() {
    for (seed, drift_rad, noise_rad) in [(3, 0.12, 0.015), (4, -0.15, 0.06)] {
        let clock = Clock { offset_rad: 3.0, drift_rad, noise_rad, ..CLOCK };
        let [a, b] = before_and_after(&toml::Table::new(), clock, seed);
        let found = diagnose_change(&a, &b, None).expect("comparable");
        assert_eq!(found.verdict, ChangeVerdict::None, "{seed}: {}", found.sentence);
        assert!((0.6..1.4).contains(&found.chi_square_unchanged), "{}", found.chi_square_unchanged);
    }
}
