//! Large arrays calibrated at one place: hundreds of coded drives, one reading of each.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use fieldgap_acoustics::{Excitation, Vec3};
use fieldgap_diagnosis::{Diagnosis, EffectId, FittedParameter, Verdict, diagnose};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, ScanSetup};
use fieldgap_virtual_rig::{Visit, noise_free_readings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// An array calibrated at some places.
struct Coded<'c> {
    side: usize,
    drives: usize,
    /// How often each drive is read at each place.
    reads: usize,
    places_m: Vec<Vec3>,
    /// How far from each place the receiver stood along x, mm; empty where it stood there. All drives are then read at one place before the robot moves.
    off_mm: &'c [f64],
    /// Phases of a drive, rad, given the number of elements.
    drive: fn(usize, &mut ChaCha8Rng) -> Vec<f64>,
    /// What the driver makes of a phase, rad.
    driven: fn(f64) -> f64,
    causes: &'c str,
    noise: f64,
    seed: u64,
}

/// Each phase at random.
fn random_phases(elements: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    (0..elements).map(|_| random.random_range(0.0..TAU)).collect()
}

impl Coded<'_> {
    fn record(&self) -> RecordedScan {
        let Self { side, drives, reads, places_m, off_mm, drive, driven, causes, noise, seed } =
            self;
        let mut random = ChaCha8Rng::seed_from_u64(*seed);
        let mut text = format!(
            "format = 1\nname = \"coded\"\nrecorded = 2026-11-20T10:02:00Z\nreading = \"V\"\n\
             [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = {side}\nrows = {side}\nelement_diameter_mm = 10.0\nspacing_mm = 0.0\n\
             [medium]\nspeed_of_sound_m_s = 343.0\n[simulator]\nmodel = \"piston\"\n"
        );
        for _ in 0..*drives {
            let phases: Vec<String> =
                drive(side * side, &mut random).iter().map(|phase| format!("{phase:.4}")).collect();
            writeln!(text, "[[focus]]\nphases_rad = [{}]", phases.join(", ")).expect("text");
        }
        let setup =
            ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), text)).expect("a set-up");
        let causes: toml::Table = causes.parse().expect("TOML");
        let mut samples = Vec::new();
        for number in 0..*drives {
            let mut simulation = setup.simulation(setup.simulator, number).expect("a drive");
            if let Excitation::Phases(phases_rad) = &mut simulation.excitation {
                phases_rad.iter_mut().for_each(|phase_rad| *phase_rad = driven(*phase_rad));
            }
            let first = samples.len();
            let places = places_m.iter().flat_map(|place| std::iter::repeat_n(place, *reads));
            let visits: Vec<Visit> = places
                .enumerate()
                .map(|(n, place)| Visit {
                    position_m: *place,
                    velocity_m_s: Vec3::zeros(),
                    time_s: 0.05 * (first + n) as f64,
                })
                .collect();
            let stood = visits.iter().enumerate().map(|(n, visit)| {
                let off_mm = off_mm.get(n / reads).copied().unwrap_or(0.0);
                Visit { position_m: visit.position_m + Vec3::x() * 1e-3 * off_mm, ..*visit }
            });
            let stood: Vec<Visit> = stood.collect();
            let levels = noise_free_readings(&simulation, &causes, 0.05, &stood, *seed);
            for (visit, level) in visits.iter().zip(levels.expect("valid causes")) {
                let normal: f64 = StandardNormal.sample(&mut random);
                let reading = level * (1.0 + noise * normal);
                let Visit { position_m, time_s, .. } = *visit;
                let drive = Some(number);
                samples.push(RecordedSample::measured(time_s, drive, position_m, reading, None));
            }
        }
        if !off_mm.is_empty() {
            let place = |sample: &RecordedSample| {
                places_m.iter().position(|place_m| (place_m - sample.position_m()).norm() < 1e-6)
            };
            samples.sort_by_key(place);
            for (n, sample) in samples.iter_mut().enumerate() {
                sample.time_s = 0.05 * n as f64;
            }
        }
        RecordedScan { setup, samples }
    }

    /// `None` where there is nothing to compare.
    fn diagnosed(&self) -> Option<Diagnosis> {
        let record = self.record();
        let began = Instant::now();
        let found = diagnose(&[record], None).ok()?;
        println!(
            "{} elements, {} drives, {} readings: {:.1} s: {}",
            self.side * self.side,
            self.drives,
            found.points,
            began.elapsed().as_secs_f64(),
            found.sentence
        );
        Some(found)
    }
}

const PLACE: Vec3 = Vec3::new(4e-3, -3e-3, 0.15);

const NOTHING: Coded<'_> = Coded {
    side: 16,
    drives: 300,
    reads: 1,
    places_m: Vec::new(),
    off_mm: &[],
    drive: random_phases,
    driven: |phase_rad| phase_rad,
    causes: "",
    noise: 0.01,
    seed: 7,
};

/// Shapes as a first try may have them. None may stop the program, and none shows a cause that is not there.
#[test]
fn odd_calibrations_are_diagnosed_without_a_panic() {
    let alike: fn(usize, &mut ChaCha8Rng) -> Vec<f64> = |elements, _| vec![0.5; elements];
    let odd = [
        Coded { side: 6, drives: 40, drive: alike, ..NOTHING },
        Coded { side: 6, drives: 40, drive: alike, reads: 2, ..NOTHING },
        Coded { side: 6, drives: 1, reads: 40, ..NOTHING },
        Coded { side: 6, drives: 1, ..NOTHING },
        Coded { side: 6, drives: 2, ..NOTHING },
        Coded { side: 6, drives: 50, ..NOTHING },
        Coded { side: 1, drives: 30, ..NOTHING },
        Coded { side: 6, drives: 50, noise: 0.0, ..NOTHING },
    ];
    for coded in odd {
        if let Some(found) = (Coded { places_m: vec![PLACE], ..coded }).diagnosed() {
            assert!(!found.verdict.names_a_cause(), "{}", found.sentence);
        }
    }
}

/// One zero for 120 drives, that is no sixteenth of a step: one a thirty-second of a step off rounds an element of each drive to the other side.
#[test]
fn steps_of_many_drives_are_counted_from_one_zero() {
    const STEP_RAD: f64 = TAU / 10.0;
    const ZERO: f64 = 0.169;
    let driven: fn(f64) -> f64 =
        |phase_rad| ((phase_rad / STEP_RAD + ZERO).round() - ZERO) * STEP_RAD;
    let places_m = [[0.0, 0.0, 0.15], [15.0, -8.0, 0.15], [-9.0, 12.0, 0.17]]
        .map(|[x_mm, y_mm, z_m]| Vec3::new(1e-3 * x_mm, 1e-3 * y_mm, z_m));
    let coded =
        Coded { side: 6, drives: 120, reads: 2, places_m: places_m.into(), driven, ..NOTHING };
    let found = coded.diagnosed().expect("comparable");
    assert_eq!(found.verdict, Verdict::Explained, "{}", found.sentence);
    assert_eq!(found.effects, [EffectId::PhaseQuantisation], "{}", found.sentence);
    let parameters = &found.ranked[0].parameters;
    let steps =
        |p: &FittedParameter| matches!(p, FittedParameter::Real { value, .. } if *value == 10.0);
    assert!(steps(&parameters["phase-quantisation.steps"]), "{parameters:?}");
    let FittedParameter::Each { value, .. } = &parameters["phase-quantisation.zeros"] else {
        panic!("{parameters:?}")
    };
    assert!(value.len() == 1 && (value[0] - ZERO).abs() < 1e-3, "{value:?}");
}

/// To the first of four places the robot came from below or from above, which no record says: with play it stood to one side of it.
#[test]
fn play_is_named_whichever_side_the_first_place_was_approached_from() {
    let places_m = [-0.016, 0.012, -0.005, 0.027].map(|x_m| Vec3::new(x_m, 0.4 * x_m, 0.15));
    for first_mm in [-0.4, 0.4] {
        let coded = Coded {
            side: 6,
            drives: 60,
            reads: 2,
            places_m: places_m.into(),
            off_mm: &[first_mm, -0.4, 0.4, -0.4],
            ..NOTHING
        };
        let found = coded.diagnosed().expect("comparable");
        assert_eq!(found.verdict, Verdict::Explained, "{}", found.sentence);
        assert_eq!(found.effects, [EffectId::Backlash], "{}", found.sentence);
        let play = &found.ranked[0].parameters["backlash.mm"];
        let FittedParameter::Real { value, .. } = play else { panic!("{play:?}") };
        assert!((value - 0.8).abs() < 0.08, "{value}");
    }
}

/// More elements than the readings of one drive would tell, each with a departure of its own.
#[test]
fn a_calibration_tells_that_many_elements_differ() {
    for (causes, id) in [
        ("[element-gain]\nspread = 0.1", EffectId::ElementGain),
        ("[element-phase]\nspread_rad = 0.15", EffectId::ElementPhase),
    ] {
        let places_m = vec![PLACE];
        let coded = Coded { side: 11, drives: 80, reads: 3, causes, places_m, ..NOTHING };
        let found = coded.diagnosed().expect("comparable");
        assert!(found.verdict.names_a_cause(), "{}", found.sentence);
        assert_eq!(found.effects, [id], "{}", found.sentence);
    }
}

#[test]
#[ignore = "times a calibration of 256 elements"]
fn hundreds_of_drives_of_256_elements_take_seconds() {
    for causes in [
        "",
        "[sound-speed]\nc_m_s = 346.0",
        "[element-gain]\nspread = 0.1",
        "[element-phase]\nspread_rad = 0.15",
        "[dead-elements]\nelements = [30, 77, 200]",
    ] {
        for reads in [1, 4] {
            let coded = Coded { causes, reads, places_m: vec![PLACE], ..NOTHING };
            coded.diagnosed().expect("comparable");
        }
    }
}
