//! Registration of scans with known pose, from an independent kernel: pistons as rings of point sources on a rigid
//! baffle (Rayleigh integral), with noise.

use std::fmt::Write as _;

use fieldgap_acoustics::{Simulator, Vec3};
use fieldgap_comparison::{Comparison, Mirror, Pose, Registering, Registration, compare};
use fieldgap_records::RecordedScan;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const SPEED_M_S: f64 = 343.0;
const FREQUENCY_HZ: f64 = 40e3;
const RADIUS_M: f64 = 4.5e-3;

/// An element of the true array: position and phase.
struct Source {
    at_m: Vec3,
    phase_rad: f64,
}

/// Rayleigh integral over each face, by equal areas on three rings.
fn truth(sources: &[Source], point_m: &Vec3) -> f64 {
    let k = std::f64::consts::TAU * FREQUENCY_HZ / SPEED_M_S;
    let mut sum = Complex64::ZERO;
    for source in sources {
        for ring in 0..3 {
            let radius_m = RADIUS_M * ((f64::from(ring) + 0.5) / 3.0).sqrt();
            for spoke in 0..6 {
                let angle =
                    std::f64::consts::TAU * (f64::from(spoke) + 0.5 * f64::from(ring)) / 6.0;
                let patch = source.at_m + radius_m * Vec3::new(angle.cos(), angle.sin(), 0.0);
                let d = (point_m - patch).norm();
                sum += Complex64::from_polar(1.0 / (18.0 * d), k * d + source.phase_rad);
            }
        }
    }
    sum.norm()
}

/// Readings of a receiver: gain, proportional and additive noise, converter steps.
struct Receiver {
    gain: f64,
    relative: f64,
    floor: f64,
    converter_step: f64,
    draws: ChaCha8Rng,
}

impl Receiver {
    fn new(seed: u64) -> Self {
        let draws = ChaCha8Rng::seed_from_u64(seed);
        Self { gain: 5.0, relative: 0.02, floor: 0.2, converter_step: 0.01, draws }
    }

    fn read(&mut self, pressure: f64) -> f64 {
        let mut normal = || -> f64 { StandardNormal.sample(&mut self.draws) };
        let noisy = self.gain * pressure * (1.0 + self.relative * normal()) + self.floor * normal();
        (noisy.abs() / self.converter_step).round() * self.converter_step
    }
}

/// A scan folder, written and read back.
fn record(
    array: &str,
    elements: Option<String>,
    focus: &str,
    rows: &str,
    model: &str,
) -> RecordedScan {
    let folder = tempfile::tempdir().expect("a folder");
    let scan = format!(
        "format = 1\nname = \"synthetic\"\nrecorded = 2026-11-20T17:00:00Z\nreading = \"V\"\n\
         [array]\nfrequency_hz = 40000.0\n{array}\n[medium]\nspeed_of_sound_m_s = 343.0\n\
         [simulator]\nmodel = \"{model}\"\n[[focus]]\n{focus}\n"
    );
    let write =
        |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("scan.toml", &scan);
    write("samples.csv", &format!("time_s,focus,x_mm,y_mm,z_mm,reading\n{rows}"));
    if let Some(elements) = elements {
        write("elements.csv", &elements);
    }
    RecordedScan::open(folder.path()).expect("a recorded scan")
}

/// A serpentine over planes: rows of samples.csv, measured at the actual positions given by `pose`.
fn scan_planes(
    sources: &[Source],
    pose: &Pose,
    receiver: &mut Receiver,
    heights_mm: &[f64],
    half_width_mm: f64,
    steps: i32,
) -> String {
    let mut rows = String::new();
    let at_mm = |i: i32| half_width_mm * f64::from(2 * i - steps) / f64::from(steps);
    for z_mm in heights_mm {
        for row in 0..=steps {
            for along in 0..=steps {
                let column = if row % 2 == 0 { along } else { steps - along };
                let (x_mm, y_mm) = (at_mm(column), at_mm(row));
                let scan_m = Vec3::new(x_mm, y_mm, *z_mm) * 1e-3;
                let reading = receiver.read(truth(sources, &pose.to_array(&scan_m)));
                writeln!(rows, "0.0,0,{x_mm},{y_mm},{z_mm},{reading}").expect("to a string");
            }
        }
    }
    rows
}

/// The thesis's array with a focus: 6 x 6 on 10.5 mm.
fn focused(focus_m: Vec3) -> Vec<Source> {
    let k = std::f64::consts::TAU * FREQUENCY_HZ / SPEED_M_S;
    (0..36)
        .map(|n| {
            let at_m = Vec3::new(f64::from(n % 6) - 2.5, 2.5 - f64::from(n / 6), 0.0) * 10.5e-3;
            Source { at_m, phase_rad: -k * (focus_m - at_m).norm() }
        })
        .collect()
}

const SQUARE: &str =
    "layout = \"square\"\ncolumns = 6\nrows = 6\nelement_diameter_mm = 10.5\nspacing_mm = 0.0";

fn focused_scan(focus_mm: Vec3, pose: &Pose, heights_mm: &[f64], model: &str) -> RecordedScan {
    let mut receiver = Receiver::new(7);
    let rows = scan_planes(&focused(focus_mm * 1e-3), pose, &mut receiver, heights_mm, 35.0, 35);
    let focus =
        format!("x_mm = {:.1}\ny_mm = {:.1}\nz_mm = {:.1}", focus_mm.x, focus_mm.y, focus_mm.z);
    record(SQUARE, None, &focus, &rows, model)
}

const THESIS_FOCUS_MM: [f64; 3] = [17.5, -22.5, 100.0];
const THESIS_HEIGHTS_MM: [f64; 4] = [50.0, 100.0, 150.0, 200.0];

fn compared(scan: &RecordedScan, simulator: Simulator, registering: Registering) -> Comparison {
    compare(scan, simulator, registering).expect("something to compare")
}

/// 16 x 16 elements, each at its own height within a wavelength, driven in phase; scanned in a pose. The phases
/// have deviations of this standard deviation: a gap that no pose explains.
fn height_modulated(seed: u64, pose: &Pose, phase_spread_rad: f64) -> RecordedScan {
    let mut draws = ChaCha8Rng::seed_from_u64(seed);
    let mut sources = Vec::new();
    let mut elements = "x_mm,y_mm,z_mm,nx,ny,nz,radius_mm,amplitude,phase_rad\n".to_owned();
    for n in 0..256 {
        let (x, y) = (f64::from(n % 16) - 7.5, f64::from(n / 16) - 7.5);
        let at_mm = Vec3::new(x * 10.6667, y * 10.6667, 8.575 * draws.random::<f64>());
        let off: f64 = StandardNormal.sample(&mut draws);
        sources.push(Source { at_m: at_mm * 1e-3, phase_rad: phase_spread_rad * off });
        writeln!(elements, "{},{},{},0,0,1,4.5,1,0", at_mm.x, at_mm.y, at_mm.z)
            .expect("to a string");
    }
    let mut receiver = Receiver { converter_step: 2.0, floor: 5.0, ..Receiver::new(seed) };
    let rows = scan_planes(&sources, pose, &mut receiver, &[160.0], 85.0, 50);
    let layout = "layout = \"elements\"\nfile = \"elements.csv\"";
    record(layout, Some(elements), "phases = \"all-zero\"", &rows, "piston")
}

/// Largest distance between the corners of a map in two poses, metres.
fn corners_apart(a: &Pose, b: &Pose, half_width_m: f64) -> f64 {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| Vec3::new(x * half_width_m, y * half_width_m, 0.1))
        .map(|corner| (a.to_array(&corner) - b.to_array(&corner)).xy().norm())
        .into_iter()
        .fold(0.0, f64::max)
}

fn any_pose(draws: &mut ChaCha8Rng) -> Pose {
    let mut between = |range: f64| range * (2.0 * draws.random::<f64>() - 1.0);
    let shift_m = Vec3::new(between(20e-3), between(20e-3), between(10e-3));
    let quarter = (between(2.0).round() * 0.5 * std::f64::consts::PI).clamp(-1.6, 1.6);
    let turn_rad = quarter + between(0.08);
    let step_ratio = 1.0 + between(0.1);
    let mirror = [Mirror::None, Mirror::X, Mirror::Y][(between(1.5) + 1.5) as usize % 3];
    Pose { mirror, turn_rad, step_ratio, shift_m }
}

#[test]
fn a_mirrored_rotated_scaled_and_shifted_scan_is_registered() {
    let pose = Pose {
        mirror: Mirror::X,
        turn_rad: 0.05,
        step_ratio: 0.96,
        shift_m: Vec3::new(-11e-3, 14e-3, 6e-3),
    };
    let found = compared(&height_modulated(3, &pose, 0.2), Simulator::Piston, Registering::Auto);
    let registration = &found.registration;
    assert_eq!(registration.chosen, Registering::Pose, "{}", registration.why);
    assert_eq!(registration.mirror, Mirror::X);
    assert!(corners_apart(&registration.pose(), &pose, 85e-3) < 0.5e-3, "{registration:#?}");
    assert!((registration.shift_m[2].value - 6e-3).abs() < 2e-3, "{registration:#?}");
    assert!(found.overall.correlation > 0.95, "{:?}", found.overall);
}

/// Random fields and poses, with phase deviations of 0.4 rad.
#[test]
fn random_poses_are_found() {
    let mut draws = ChaCha8Rng::seed_from_u64(1);
    for seed in 0..6 {
        let pose = any_pose(&mut draws);
        let scan = height_modulated(100 + seed, &pose, 0.4);
        let comparison = compared(&scan, Simulator::Piston, Registering::Auto);
        let apart_m = corners_apart(&comparison.registration.pose(), &pose, 85e-3);
        assert!(apart_m < 2e-3, "{seed}: {:.2} mm apart for {pose:?}", apart_m * 1e3);
    }
}

/// `as-written` freezes its phases at the focal height, so that a correct scan differs in shape. No pose may compensate for
/// this.
#[test]
fn a_difference_in_shape_is_not_removed_by_registration() {
    let scan =
        focused_scan(THESIS_FOCUS_MM.into(), &Pose::default(), &THESIS_HEIGHTS_MM, "as-written");
    let found = compared(&scan, Simulator::AsWritten, Registering::Auto);
    assert_ne!(found.registration.chosen, Registering::Pose, "{}", found.registration.why);
    let wandered = |plane: usize| found.planes[plane].discrepancy.peak_distance_m.value;
    assert!(wandered(1) < 1.5e-3, "good at the focal height: {}", wandered(1));
    for plane in [0, 2, 3] {
        assert!(wandered(plane) > 4e-3, "the scan wanders at the others: {}", wandered(plane));
    }

    let mended = compared(&scan, Simulator::Corrected, Registering::Auto);
    assert_eq!(
        mended.registration.chosen,
        Registering::GainAndShift,
        "{}",
        mended.registration.why
    );
    for plane in &mended.planes {
        assert!(plane.discrepancy.peak_distance_m.value < 2e-3, "{:?}", plane.discrepancy);
    }
}

#[test]
fn a_small_set_up_error_gives_only_a_small_shift() {
    let pose = Pose { shift_m: Vec3::new(0.3e-3, -0.2e-3, 0.0), ..Pose::default() };
    let scan = focused_scan(THESIS_FOCUS_MM.into(), &pose, &THESIS_HEIGHTS_MM, "piston");
    let found = compared(&scan, Simulator::Piston, Registering::Auto);
    let shift_m = found.registration.shift_m;
    assert_eq!(found.registration.chosen, Registering::GainAndShift, "{}", found.registration.why);
    assert!((shift_m[0].value - 0.3e-3).abs() < 0.1e-3, "{shift_m:?}");
    assert!((shift_m[1].value + 0.2e-3).abs() < 0.1e-3, "{shift_m:?}");
    assert!(found.overall.correlation > 0.99, "{:?}", found.overall);
}

/// Two millimetres are a gap (an `offset`) to be reported, not an error to be removed by registration.
#[test]
fn a_shift_beyond_the_set_up_tolerance_remains_in_the_gap() {
    let pose = Pose { shift_m: Vec3::new(2e-3, 0.0, 0.0), ..Pose::default() };
    let scan = focused_scan(THESIS_FOCUS_MM.into(), &pose, &THESIS_HEIGHTS_MM, "piston");
    let found = compared(&scan, Simulator::Piston, Registering::Auto);
    assert_eq!(found.registration.chosen, Registering::GainOnly, "{}", found.registration.why);
    assert!(found.registration.why.contains("left in the gap"), "{}", found.registration.why);
    let shift_m = found.planes[1].discrepancy.peak_shift_m;
    // The scan's peak is at the robot's coordinates, which are 2 mm too small.
    assert!(shift_m[0].value < -0.5e-3, "{shift_m:?}");
    assert!((shift_m[0].value + 2e-3).abs() < 3.0 * shift_m[0].standard_error, "{shift_m:?}");
    let asked = compared(&scan, Simulator::Piston, Registering::Pose);
    assert!(
        (asked.registration.shift_m[0].value - 2e-3).abs() < 0.2e-3,
        "{:#?}",
        asked.registration
    );
}

/// Side lobes give the search several optima, half a wavelength and more apart.
#[test]
fn shifts_up_to_several_millimetres_are_found_and_left_in_the_gap() {
    for shift_mm in [1.0, 2.0, 3.0, 5.0, 8.0] {
        for direction in [Vec3::new(1.0, 0.0, 0.0), Vec3::new(-0.6, 0.8, 0.0)] {
            let pose = Pose { shift_m: direction * shift_mm * 1e-3, ..Pose::default() };
            let scan = focused_scan(THESIS_FOCUS_MM.into(), &pose, &THESIS_HEIGHTS_MM, "piston");
            // The other simulator has a gap of its own, of a quarter of the scan's rms, which displaces the optimum.
            for (simulator, least_mm, tolerance_mm) in
                [(Simulator::Piston, 1.0, 0.1), (Simulator::Corrected, 3.0, 1.0)]
            {
                if shift_mm < least_mm {
                    continue;
                }
                let Registration { chosen, tried, why, .. } =
                    compared(&scan, simulator, Registering::Auto).registration;
                assert_eq!(chosen, Registering::GainOnly, "{simulator} {shift_mm} mm: {why}");
                let found = tried.iter().find(|one| one.registering == Registering::Shift);
                let found_m = found.expect("a shift was searched").pose.shift_m;
                let off_mm = 1e3 * (found_m - pose.shift_m).xy().norm();
                assert!(off_mm < tolerance_mm, "{simulator} {shift_mm} mm: off by {off_mm} mm");
                assert!(why.contains("left in the gap"), "{why}");
            }
        }
    }
}

/// In a field full of interference fringes, a descent from the recorded place ends in a wrong fringe.
#[test]
fn a_shift_of_many_fringes_is_found_where_asked_for() {
    let pose = Pose { shift_m: Vec3::new(-12e-3, 9e-3, 0.0), ..Pose::default() };
    let scan = height_modulated(3, &pose, 0.0);
    let found = compared(&scan, Simulator::Piston, Registering::Shift).registration;
    let off_mm = 1e3 * (found.pose().shift_m - pose.shift_m).xy().norm();
    assert!(off_mm < 0.1, "{off_mm} mm: {}", found.why);
}

/// On the plane of symmetry, a shift across it changes nothing to first order.
#[test]
fn a_direction_that_the_readings_do_not_determine_is_named() {
    let pose = Pose { shift_m: Vec3::new(3e-3, 0.0, 0.0), ..Pose::default() };
    let sources = focused(Vec3::new(0.0, 0.0, 0.1));
    let rows = scan_planes(&sources, &pose, &mut Receiver::new(7), &THESIS_HEIGHTS_MM, 36.0, 36);
    let mut scan = record(SQUARE, None, "x_mm = 0.0\ny_mm = 0.0\nz_mm = 100.0", &rows, "piston");
    scan.samples.retain(|sample| sample.position_m().y == 0.0);
    let why = compared(&scan, Simulator::Piston, Registering::Auto).registration.why;
    assert!(why.contains("not determined along y"), "{why}");
    scan.samples.retain(|sample| sample.position_m().z == 0.1);
    let why = compared(&scan, Simulator::Piston, Registering::Shift).registration.why;
    assert!(why.contains("at least 60 are needed"), "{why}");
}

#[test]
fn an_undetermined_mirroring_is_reported() {
    let focus_mm = Vec3::new(0.0, 0.0, 100.0);
    let scan = focused_scan(focus_mm, &Pose::default(), &[100.0], "piston");
    let found = compared(&scan, Simulator::Piston, Registering::Pose);
    let left_open = &found.registration.undetermined;
    assert_eq!(found.registration.mirror, Mirror::None);
    assert!(left_open.iter().any(|open| open.parameters == ["mirror"]), "{left_open:#?}");
}

#[test]
fn results_are_bit_identical_on_any_number_of_threads() {
    let pose = Pose { mirror: Mirror::Y, shift_m: Vec3::new(4e-3, 0.0, 0.0), ..Pose::default() };
    let scan = focused_scan(THESIS_FOCUS_MM.into(), &pose, &[50.0, 100.0], "piston");
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let found = pool.install(|| compared(&scan, Simulator::Piston, Registering::Auto));
        serde_json::to_string(&found).expect("serialises")
    };
    let one = on(1);
    assert_eq!(one, on(3));
    assert!(one.contains("\"turn_rad\"") && one.contains("\"z_m\":0.05"));
}

#[test]
fn text_and_csv_have_a_line_for_each_height() {
    let scan = focused_scan(THESIS_FOCUS_MM.into(), &Pose::default(), &[50.0, 100.0], "piston");
    let found = compared(&scan, Simulator::Piston, Registering::GainOnly);
    let csv = found.to_csv();
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let headers = reader.headers().expect("a header").clone();
    let of = |row: &csv::StringRecord, name: &str| -> f64 {
        let column = headers.iter().position(|header| header == name).expect("a column");
        row[column].parse().expect("a number")
    };
    let rows: Vec<csv::StringRecord> =
        reader.records().map(|row| row.expect("as wide as the header")).collect();
    assert_eq!(rows.len(), 2);
    assert_eq!(of(&rows[1], "z_mm"), 100.0);
    assert!((of(&rows[1], "scan_peak_x_mm") - 17.0).abs() < 1.5);
    assert!(of(&rows[1], "scan_peak_x_mm_error") > 0.0);
    let text = found.to_text();
    assert!(text.contains("correlation") && text.lines().count() >= 5, "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let headings = |text: &str| text.lines().find(|line| line.contains("corr.")).map(str::len);
    assert!(headings(&found.to_wide_text()) > headings(&text));
}

#[test]
fn points_off_a_grid_are_compared_without_a_map() {
    let mut draws = ChaCha8Rng::seed_from_u64(5);
    let mut receiver = Receiver::new(5);
    let sources = focused(Vec3::from(THESIS_FOCUS_MM) * 1e-3);
    let mut rows = String::new();
    for _ in 0..300 {
        let [x, y] = [0, 1].map(|_| 60.0 * draws.random::<f64>() - 30.0);
        let reading = receiver.read(truth(&sources, &(Vec3::new(x, y, 100.0) * 1e-3)));
        writeln!(rows, "0.0,0,{x},{y},100.0,{reading}").expect("to a string");
    }
    let scan = record(SQUARE, None, "x_mm = 17.5\ny_mm = -22.5\nz_mm = 100.0", &rows, "piston");
    let found = compared(&scan, Simulator::Piston, Registering::Auto);
    let plane = &found.planes[0];
    assert!(plane.map.is_none() && plane.why_no_map.is_some());
    assert!(plane.agreement.correlation > 0.99, "{:?}", plane.agreement);
    assert!(plane.scan.focal_radius.is_none() && plane.scan.peak.value > 0.0);
}

#[test]
fn a_scan_without_driven_readings_is_refused_with_a_remedy() {
    let scan =
        record(SQUARE, None, "phases = \"all-zero\"", "0.0,-1,0.0,0.0,100.0,0.1\n", "piston");
    let refused = compare(&scan, Simulator::Piston, Registering::Auto).expect_err("nothing driven");
    assert!(refused.to_string().contains("samples.csv"), "{refused}");
}
