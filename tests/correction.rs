//! Set-ups corrected by a diagnosis: the next simulation includes the cause.

#[allow(dead_code)] // shared with the tests of text and page
mod diagnosis_synthetic;
#[allow(dead_code)] // shared with the tests of the report
mod report_synthetic;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use fieldgap::acoustics::{Array, Element, Excitation, Medium, Simulation, Simulator, Vec3};
use fieldgap::acquisition::RigSetup;
use fieldgap::correction::{Corrected, CorrectionError, correct_recorded_scan, correct_rig_file};
use fieldgap::diagnosis::{Diagnosis, EffectId, FittedParameter};
use fieldgap::input::TomlSource;
use fieldgap::records::{
    CalibratedChannel, CalibrationConditions, CalibrationFile, ChannelState, RecordedSample,
    RecordedScan, ScanSetup,
};
use nalgebra::{Rotation3, Vector3};

const SCAN_TOML: &str = r#"format = 1
name = "thesis-focus"
recorded = 2026-11-20T17:00:00Z
reading = "V"

[array]                     # what stood on the bench
frequency_hz = 40000.0
layout = "square"
columns = 6
rows = 6
element_diameter_mm = 10.5
spacing_mm = 0.0

[medium]
temperature_c = 20.0        # by the thermometer on the wall
humidity_percent = 40.0
pressure_kpa = 101.0

[simulator]
model = "corrected"

[[focus]]                   # the thesis's own
x_mm = 17.5
y_mm = -22.5
z_mm = 100.0
"#;

fn real(value: f64) -> FittedParameter {
    FittedParameter::Real { value, standard_error: value.abs() * 1e-9 }
}

fn elements(value: &[usize]) -> FittedParameter {
    FittedParameter::Elements { value: value.to_vec() }
}

/// A diagnosis that names one effect.
fn named(effect: &str, parameters: &[(&str, FittedParameter)]) -> Diagnosis {
    let effect: EffectId = effect.parse().expect("an effect");
    let mut diagnosis = diagnosis_synthetic::explained(&[100.0], 20.0);
    diagnosis.effects = vec![effect];
    let best = &mut diagnosis.ranked[0];
    best.effects = vec![effect];
    best.parameters = parameters
        .iter()
        .map(|(name, value)| (format!("{effect}.{name}"), value.clone()))
        .collect::<BTreeMap<_, _>>();
    diagnosis
}

/// A folder with a recorded scan, also for the written files.
struct Bench {
    dir: tempfile::TempDir,
    setup: ScanSetup,
}

impl Bench {
    fn new() -> Self {
        Self::with(SCAN_TOML)
    }

    fn with(scan_toml: &str) -> Self {
        let dir = tempfile::tempdir().expect("a folder");
        let source = TomlSource::new(Path::new("scan.toml"), scan_toml);
        let setup = ScanSetup::parse(&source).expect("good");
        let samples = points()
            .iter()
            .map(|at_m| RecordedSample::measured(0.0, Some(0), *at_m, 1.0, None))
            .collect();
        let scan = RecordedScan { setup: setup.clone(), samples };
        scan.write(&dir.path().join("scan")).expect("written");
        std::fs::write(dir.path().join("scan/scan.toml"), scan_toml).expect("written");
        Self { dir, setup }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn correct_scan(&self, diagnosis: &Diagnosis) -> Result<Corrected, CorrectionError> {
        correct_recorded_scan(diagnosis, &self.setup, &self.path("scan"), &self.path("corrected"))
    }

    fn correct_rig(&self, diagnosis: &Diagnosis) -> Result<(Corrected, RigSetup), CorrectionError> {
        let out = self.path("corrected.toml");
        let corrected = correct_rig_file(diagnosis, &self.setup, &rig_file(), &out)?;
        let rig_setup = RigSetup::read(&out).expect("a rig file");
        Ok((corrected, rig_setup))
    }

    /// The actual drive of the array: the delays of the nominal set-up, in seconds.
    fn driven(&self) -> Simulation {
        let mut simulation = self.setup.simulation(Simulator::Corrected, 0).expect("a focus");
        let phases_rad = simulation.excitation.phases_rad(
            &simulation.array,
            &simulation.medium,
            simulation.frequency_hz,
        );
        simulation.excitation = Excitation::Phases(phases_rad);
        simulation
    }
}

fn rig_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml")
}

fn points() -> Vec<Vec3> {
    let along = [-0.03, -0.01, 0.0, 0.0175, 0.03];
    let rows = along.iter().flat_map(|&y| along.iter().map(move |&x| (x, y)));
    rows.flat_map(|(x, y)| [0.06, 0.1, 0.17].map(|z| Vec3::new(x, y, z))).collect()
}

/// Compares the simulation of the corrected scan with the true field at the reported positions.
fn assert_reproduces(bench: &Bench, diagnosis: &Diagnosis, truth: &[f64]) {
    let corrected = bench.correct_scan(diagnosis).expect("corrected");
    assert!(corrected.unwritten.is_empty(), "{corrected:?}");
    let scan = RecordedScan::open(&bench.path("corrected")).expect("a recorded scan");
    assert_eq!(scan.samples.len(), points().len());
    let simulation = scan.setup.simulation(scan.setup.simulator, 0).expect("a focus");
    let largest = truth.iter().copied().fold(0.0, f64::max);
    for (simulated, truth) in simulation.magnitudes(&points()).iter().zip(truth) {
        assert!((simulated - truth).abs() < 1e-5 * largest, "{simulated} against {truth}");
    }
    let nominal = bench.setup.simulation(Simulator::Corrected, 0).expect("a focus");
    let before = nominal.magnitudes(&points());
    let moved = before.iter().zip(truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(moved > 1e-3 * largest, "the effect is visible: {moved} of {largest}");
}

fn with_elements(simulation: &mut Simulation, change: impl Fn(&mut Vec<Element>)) {
    let mut elements = simulation.array.elements().to_vec();
    change(&mut elements);
    simulation.array = Array::from_elements(elements).expect("not empty");
}

#[test]
fn a_speed_of_sound_with_unchanged_delays() {
    let bench = Bench::new();
    let mut truth = bench.driven();
    truth.medium = Medium { speed_of_sound_m_s: 349.0 };
    let diagnosis = named("sound-speed", &[("c_m_s", real(349.0))]);
    assert_reproduces(&bench, &diagnosis, &truth.magnitudes(&points()));
}

#[test]
fn a_frequency_with_unchanged_delays() {
    let bench = Bench::new();
    let mut truth = bench.driven();
    truth.frequency_hz *= 1.02;
    let Excitation::Phases(phases) = &mut truth.excitation else {
        unreachable!("a drive in phases")
    };
    phases.iter_mut().for_each(|phase| *phase *= 1.02);
    let diagnosis = named("drive-frequency", &[("ratio", real(1.02))]);
    assert_reproduces(&bench, &diagnosis, &truth.magnitudes(&points()));
}

/// A delay of more than a period is emitted as what is over whole periods, which at another frequency is another phase.
#[test]
fn a_frequency_of_a_driver_that_counts_within_its_period() {
    let bench = Bench::new();
    let mut truth = bench.driven();
    truth.frequency_hz *= 1.02;
    let Excitation::Phases(phases) = &mut truth.excitation else {
        unreachable!("a drive in phases")
    };
    let tau = std::f64::consts::TAU;
    assert!(phases.iter().any(|phase| *phase > tau), "{phases:?}");
    phases.iter_mut().for_each(|phase| *phase = 1.02 * phase.rem_euclid(tau));
    let parameters = [("ratio", real(1.02)), ("within_a_period", real(1.0))];
    let diagnosis = named("drive-frequency", &parameters);
    assert_reproduces(&bench, &diagnosis, &truth.magnitudes(&points()));
}

#[test]
fn a_larger_and_a_smaller_array() {
    for ratio in [1.03, 0.97] {
        let bench = Bench::new();
        let mut truth = bench.driven();
        with_elements(&mut truth, |all| all.iter_mut().for_each(|e| e.centre_m *= ratio));
        let diagnosis = named("pitch", &[("ratio", real(ratio))]);
        assert_reproduces(&bench, &diagnosis, &truth.magnitudes(&points()));
    }
}

#[test]
fn silent_reversed_and_swapped_elements() {
    type Case = (&'static str, &'static [usize], fn(&mut Vec<Element>));
    let cases: [Case; 3] = [
        ("dead-elements", &[3, 17], |all| {
            all[3].amplitude = 0.0;
            all[17].amplitude = 0.0;
        }),
        ("polarity", &[20], |all| all[20].amplitude = -1.0),
        ("swapped-channels", &[7, 30], |all| all.swap(7, 30)),
    ];
    for (effect, numbers, change) in cases {
        let bench = Bench::new();
        let mut truth = bench.driven();
        with_elements(&mut truth, change);
        let diagnosis = named(effect, &[("elements", elements(numbers))]);
        assert_reproduces(&bench, &diagnosis, &truth.magnitudes(&points()));
    }
}

#[test]
fn a_tilted_array() {
    let bench = Bench::new();
    let mut truth = bench.driven();
    let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), -0.02)
        * Rotation3::from_axis_angle(&Vector3::x_axis(), 0.03);
    with_elements(&mut truth, |all| {
        for element in all {
            element.centre_m = tilt * element.centre_m;
            element.normal = tilt * element.normal;
        }
    });
    let diagnosis =
        named("array-tilt", &[("about_x_rad", real(0.03)), ("about_y_rad", real(-0.02))]);
    assert_reproduces(&bench, &diagnosis, &truth.magnitudes(&points()));
}

#[test]
fn an_offset_and_rotated_robot() {
    let offset_mm = Vec3::new(1.5, -1.0, 2.0);
    let bench = Bench::new();
    let there: Vec<Vec3> = points().iter().map(|at| at + offset_mm / 1e3).collect();
    let diagnosis =
        named("offset", &[("x_mm", real(1.5)), ("y_mm", real(-1.0)), ("z_mm", real(2.0))]);
    assert_reproduces(&bench, &diagnosis, &bench.driven().magnitudes(&there));

    let bench = Bench::new();
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.04);
    let there: Vec<Vec3> = points().iter().map(|at| turn * at).collect();
    let diagnosis = named("rotation", &[("rad", real(0.04))]);
    assert_reproduces(&bench, &diagnosis, &bench.driven().magnitudes(&there));
}

#[test]
fn a_driver_with_few_steps() {
    let bench = Bench::new();
    let mut truth = bench.driven();
    let Excitation::Phases(phases) = &mut truth.excitation else {
        unreachable!("a drive in phases")
    };
    let step = std::f64::consts::TAU / 8.0;
    phases.iter_mut().for_each(|phase| *phase = (*phase / step).round() * step);
    let diagnosis = named("phase-quantisation", &[("steps", real(8.0))]);
    assert_reproduces(&bench, &diagnosis, &truth.magnitudes(&points()));
}

/// A driver that counts from an element has another zero for every drive.
#[test]
fn a_driver_that_counts_its_steps_from_elsewhere() {
    let bench = Bench::new();
    let mut truth = bench.driven();
    let Excitation::Phases(phases) = &mut truth.excitation else {
        unreachable!("a drive in phases")
    };
    let (step, zero) = (std::f64::consts::TAU / 8.0, 0.375);
    phases.iter_mut().for_each(|phase| *phase = ((*phase / step + zero).round() - zero) * step);
    let zeros = FittedParameter::Each { value: vec![zero], standard_error: vec![0.0] };
    let diagnosis = named("phase-quantisation", &[("steps", real(8.0)), ("zeros", zeros)]);
    assert_reproduces(&bench, &diagnosis, &truth.magnitudes(&points()));
}

#[test]
fn the_bugs_of_the_simulator() {
    let bench = Bench::with(&SCAN_TOML.replace("\"corrected\"", "\"as-written\""));
    bench.correct_scan(&named("phase-plane", &[])).expect("corrected");
    let setup = RecordedScan::open(&bench.path("corrected")).expect("a scan").setup;
    assert_eq!(setup.simulator, Simulator::Corrected);
    assert_eq!(setup.foci, bench.setup.foci);
}

#[test]
fn text_of_a_corrected_scan() {
    let bench = Bench::new();
    let mut diagnosis = named("sound-speed", &[]);
    let best = &mut diagnosis.ranked[0];
    best.effects = vec![EffectId::SoundSpeed, EffectId::Reflection, EffectId::DeadElements];
    best.parameters = BTreeMap::from([
        (
            "sound-speed.c_m_s".to_owned(),
            FittedParameter::Real { value: 347.1234, standard_error: 0.2061 },
        ),
        ("dead-elements.elements".to_owned(), elements(&[3, 17])),
        ("reflection.height_mm".to_owned(), real(412.0)),
    ]);
    diagnosis.effects = best.effects.clone();
    // Users may put control characters into names, but comments of TOML must not contain them.
    diagnosis.scans[0] = "thesis\u{1}focus\rformat = 2".to_owned();
    diagnosis.reading_unit = "V\nformat = 2".to_owned();
    let corrected = bench.correct_scan(&diagnosis).expect("corrected");
    assert_eq!(corrected.unwritten.len(), 1);
    let text = std::fs::read_to_string(bench.path("corrected/scan.toml")).expect("there");
    RecordedScan::open(&bench.path("corrected")).expect("a recorded scan");
    let (head, phases) = text.split_once("phases_rad").expect("drives as phases");
    assert_eq!(phases.split(',').count(), 36);
    insta::assert_snapshot!(head);
}

#[test]
fn text_of_a_corrected_rig_file() {
    let bench = Bench::with(&SCAN_TOML.replace("temperature_c = 20.0        # by the thermometer on the wall\nhumidity_percent = 40.0\npressure_kpa = 101.0", "speed_of_sound_m_s = 343.0"));
    let mut diagnosis = named("sound-speed", &[]);
    let best = &mut diagnosis.ranked[0];
    best.effects = vec![EffectId::SoundSpeed, EffectId::Offset, EffectId::Pitch];
    let fitted = |value, standard_error| FittedParameter::Real { value, standard_error };
    best.parameters = BTreeMap::from([
        ("sound-speed.c_m_s".to_owned(), fitted(347.1234, 0.2061)),
        ("pitch.ratio".to_owned(), fitted(1.0212, 0.0011)),
        ("offset.x_mm".to_owned(), fitted(0.812, 0.03)),
        ("offset.y_mm".to_owned(), fitted(-0.2, 0.03)),
        ("offset.z_mm".to_owned(), fitted(1.5, 0.2)),
    ]);
    diagnosis.effects = best.effects.clone();
    let (_, rig_setup) = bench.correct_rig(&diagnosis).expect("corrected");
    assert_eq!(rig_setup.nominal_medium().speed_of_sound_m_s, 347.12);
    let origin = rig_setup.rig.motion.origin_mm.map(|along| along.get());
    assert_eq!(origin, [149.188, 150.2, -21.5]);
    let text = std::fs::read_to_string(bench.path("corrected.toml")).expect("there");
    let before = std::fs::read_to_string(rig_file()).expect("there");
    let kept: Vec<&str> = before.lines().collect();
    let new: Vec<&str> = text.lines().filter(|line| !kept.contains(line)).collect();
    let folder = env!("CARGO_MANIFEST_DIR");
    insta::assert_snapshot!(new.join("\n").replace(folder, "[folder]"));
    // Everything else is unchanged.
    let gone: Vec<&str> = kept.into_iter().filter(|line| !text.contains(line)).collect();
    assert_eq!(gone.len(), 4, "{gone:?}");
}

#[test]
fn elements_of_a_rig_are_written_beside_its_file() {
    let bench = Bench::new();
    let diagnosis = named("dead-elements", &[("elements", elements(&[3]))]);
    let (corrected, rig_setup) = bench.correct_rig(&diagnosis).expect("corrected");
    assert_eq!(corrected.files[0], bench.path("corrected-elements.csv"));
    assert_eq!(rig_setup.nominal_array().elements()[3].amplitude, 0.0);
    // A corrected set-up can be corrected again; its elements are kept.
    let again = named("pitch", &[("ratio", real(1.01))]);
    let mut setup = bench.setup.clone();
    setup.array = rig_setup.array.clone();
    let out = bench.path("again.toml");
    correct_rig_file(&again, &setup, &bench.path("corrected.toml"), &out).expect("corrected");
    let rig_setup = RigSetup::read(&out).expect("a rig file");
    assert_eq!(rig_setup.nominal_array().elements()[3].amplitude, 0.0);
    let x_mm = rig_setup.nominal_array().elements()[0].centre_m.x * 1e3;
    assert!((x_mm + 26.25 * 1.01).abs() < 1e-9, "{x_mm}");
}

#[test]
fn existing_files_are_not_overwritten() {
    let bench = Bench::new();
    let diagnosis = named("sound-speed", &[("c_m_s", real(347.1))]);
    bench.correct_rig(&diagnosis).expect("corrected");
    let first = std::fs::read(bench.path("corrected.toml")).expect("there");
    let again = bench.correct_rig(&named("sound-speed", &[("c_m_s", real(350.0))]));
    assert!(matches!(again, Err(CorrectionError::Exists(_))));
    assert_eq!(std::fs::read(bench.path("corrected.toml")).expect("there"), first);
    std::fs::create_dir(bench.path("corrected")).expect("made");
    assert!(matches!(bench.correct_scan(&diagnosis), Err(CorrectionError::Exists(_))));
}

#[test]
fn uncorrectable_causes_are_reported() {
    let bench = Bench::new();
    let message = |error: CorrectionError| error.to_string();
    let ambiguous = diagnosis_synthetic::ambiguous(20.0);
    let words = message(bench.correct_scan(&ambiguous).expect_err("no one cause"));
    assert!(words.contains("equally well"), "{words}");
    let lag = named("lag", &[("s", real(0.02))]);
    let words = message(bench.correct_rig(&lag).map(|_| ()).expect_err("no key"));
    assert!(words.contains("lag: increase settle_ms"), "{words}");
    let steps = named("phase-quantisation", &[("steps", real(8.0))]);
    let words = message(bench.correct_rig(&steps).map(|_| ()).expect_err("no key"));
    assert!(words.contains("no key for the steps"), "{words}");
    let defect = named("on-axis-unit", &[]);
    let words = message(bench.correct_rig(&defect).map(|_| ()).expect_err("no key"));
    assert!(words.contains("--simulator corrected"), "{words}");
    let nameless = named("dead-elements", &[]);
    let words = message(bench.correct_scan(&nameless).expect_err("no elements"));
    assert!(words.contains("names no elements"), "{words}");
    let beyond = named("dead-elements", &[("elements", elements(&[36]))]);
    let words = message(bench.correct_scan(&beyond).expect_err("no such element"));
    assert!(words.contains("element 36; the array has 36"), "{words}");
    for name in ["corrected", "corrected.toml", "corrected-elements.csv"] {
        assert!(!bench.path(name).exists(), "{name}");
    }
}

#[test]
fn another_array_than_the_scanned_one_is_refused() {
    let bench = Bench::with(&SCAN_TOML.replace("spacing_mm = 0.0", "spacing_mm = 0.5"));
    let diagnosis = named("sound-speed", &[("c_m_s", real(347.1))]);
    let error = bench.correct_rig(&diagnosis).map(|_| ()).expect_err("another array");
    assert!(error.to_string().contains("the positions of its elements"), "{error}");
}

#[test]
fn drives_of_as_written_are_kept() {
    let bench = Bench::with(&SCAN_TOML.replace("\"corrected\"", "\"as-written\""));
    let diagnosis = named("sound-speed", &[("c_m_s", real(347.1))]);
    let error = bench.correct_scan(&diagnosis).expect_err("as-written needs its focus");
    assert!(error.to_string().contains("freezes its path lengths"), "{error}");
}

/// The elements of a calibrated rig are those of its calibration, and its drive makes up for their phases: a file of elements beside it would
/// apply both again.
#[test]
fn single_elements_of_a_calibrated_rig_are_left_to_its_calibration() {
    let bench = Bench::new();
    let channel = |drives| CalibratedChannel {
        gain: 1.0,
        gain_error: 0.01,
        phase_rad: 0.2,
        phase_error_rad: 0.01,
        state: ChannelState::Sound,
        drives,
    };
    let conditions = CalibrationConditions {
        array: "virtual".to_owned(),
        measured: "2026-11-20T17:00:00Z".parse().expect("a date"),
        setup_sha256: "00ff".to_owned(),
        speed_of_sound_m_s: 343.0,
        readings: 900,
        noise: 0.02,
        residual: 0.02,
    };
    let calibration = CalibrationFile::new(conditions, (0..36).map(channel).collect());
    std::fs::write(bench.path("calibration.toml"), calibration.text()).expect("written");
    let rig = std::fs::read_to_string(rig_file()).expect("the rig file");
    let rig = rig.replace("[medium]", "calibration = \"calibration.toml\"\n\n[medium]");
    std::fs::write(bench.path("rig.toml"), rig).expect("written");
    let correct = |diagnosis: &Diagnosis| {
        correct_rig_file(diagnosis, &bench.setup, &bench.path("rig.toml"), &bench.path("new.toml"))
    };
    let refused = correct(&named("dead-elements", &[("elements", elements(&[3]))]));
    let Err(CorrectionError::NoKey { unwritten, .. }) = refused else { panic!("{refused:?}") };
    assert!(unwritten[0].to_string().contains("fieldgap calibrate"), "{}", unwritten[0]);
    // What is not of single elements is corrected, and the calibration stays.
    correct(&named("sound-speed", &[("c_m_s", real(346.0))])).expect("corrected");
    let text = std::fs::read_to_string(bench.path("new.toml")).expect("written");
    assert!(text.contains("calibration = \"calibration.toml\""), "{text}");
}
