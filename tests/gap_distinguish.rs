//! Which effects a scan can tell apart, against figures of another program for the same scan.

use std::path::Path;

use fieldgap::acoustics::{PlaneGrid, Simulator, Vec3};
use fieldgap::gap::diagnosis::alike_effects;
use fieldgap::input::TomlSource;
use fieldgap::scan::{RecordedScan, Sample, ScanSetup};
use fieldgap::virtual_rig::luck::Luck;

const SETUP: &str = r#"
format = 1
name = "thesis-planes"
recorded = 2026-01-01T00:00:00Z
reading = "V"

[array]
frequency_hz = 40000.0
layout = "square"
columns = 6
rows = 6
element_diameter_mm = 10.5
spacing_mm = 0.0

[medium]
speed_of_sound_m_s = 343.0

[simulator]
model = "piston"

[[focus]]
x_mm = 17.5
y_mm = -22.5
z_mm = 100.0
"#;

/// Speed of the robot, along rows and between planes alike.
const SPEED_MM_S: f64 = 20.0;

/// Four planes of 71 mm by serpentine, with silence before and noise on every reading.
fn scan() -> RecordedScan {
    let source = TomlSource::new(Path::new("scan.toml"), SETUP);
    let setup = ScanSetup::parse(&source).expect("a good set-up");
    let simulation = setup.simulation(Simulator::Piston, 0).expect("one focus");
    let mut places_mm: Vec<Vec3> = Vec::new();
    for z_mm in [50.0, 100.0, 150.0, 200.0] {
        let mut points = PlaneGrid::square(35e-3, 2e-3, z_mm * 1e-3).points();
        for (number, row) in points.chunks_mut(36).enumerate() {
            if number % 2 == 1 {
                row.reverse();
            }
        }
        places_mm.extend(points.into_iter().map(|point_m| point_m * 1e3));
    }
    let places_m: Vec<Vec3> = places_mm.iter().map(|mm| mm * 1e-3).collect();
    let levels = simulation.magnitudes(&places_m);
    let largest = levels.iter().copied().fold(0.0, f64::max);
    let luck = Luck::new(1);
    let noise = |n: usize, part: u64| luck.normal(2 * n as u64 + part);
    let silent = (0..64).map(|n| {
        let silent = n + places_mm.len();
        (None, places_mm[0], 0.005 * noise(silent, 0).hypot(noise(silent, 1)))
    });
    let driven = places_mm.iter().zip(levels).enumerate().map(|(n, (place_mm, level))| {
        let level = level / largest + 0.005 * noise(n, 0);
        (Some(0), *place_mm, (level * (1.0 + 0.02 * noise(n, 1))).max(0.0))
    });
    let (mut time_s, mut before_mm) = (0.0, places_mm[0]);
    let samples = silent
        .chain(driven)
        .map(|(focus, position_mm, reading)| {
            time_s += ((position_mm - before_mm).norm() / SPEED_MM_S).max(0.01);
            before_mm = position_mm;
            Sample { time_s, focus, position_mm, reading, spread: None }
        })
        .collect();
    RecordedScan { setup, samples }
}

/// A prototype in Python found so much of an effect's signature, in amplitude, that another cannot imitate, on the same planes of
/// the same array. It left the near field out of what is open; the order of magnitude is what both must share. (Sound speed and drive
/// frequency are left out, of which it has 0.03: delays that are kept in seconds keep the focus where it is at any frequency, and at
/// another speed of sound they do not.)
#[test]
fn the_pairs_that_are_hard_to_tell_apart_are_those_that_another_program_found() {
    let alike = alike_effects(&scan(), None).expect("enough to compare");
    for (one, other, published) in [
        ("receiver-directivity", "directivity", 0.02),
        ("aperture", "directivity", 0.06),
        ("aperture", "receiver-directivity", 0.10),
        ("backlash", "lag", 0.11),
        ("absorption", "spreading", 0.19),
        ("array-tilt", "temperature-gradient", 0.33),
    ] {
        let pair = alike
            .iter()
            .find(|pair| {
                [pair.effect, pair.imitator] == [one, other]
                    || [pair.effect, pair.imitator] == [other, one]
            })
            .unwrap_or_else(|| panic!("{one} and {other} are compared"));
        let amplitude = pair.left_over.sqrt();
        assert!((0.2..4.0).contains(&(amplitude / published)), "{one} {other} {amplitude}");
    }
}

/// A gain that drifts from plane to plane is nothing like play, which shifts every other row.
#[test]
fn what_has_nothing_in_common_is_told_apart_from_far_below_the_noise() {
    let alike = alike_effects(&scan(), None).expect("enough to compare");
    let pair = alike
        .iter()
        .find(|pair| {
            [pair.effect, pair.imitator].contains(&"backlash")
                && [pair.effect, pair.imitator].contains(&"gain-drift")
        })
        .expect("both are in the catalogue");
    assert!(pair.left_over > 0.9, "{pair:?}");
    assert!(pair.told_from_sigma < 0.06, "{pair:?}");
}
