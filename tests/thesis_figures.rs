//! The thesis's table and figures, row by row, compared with figures from its own listings.
//!
//! The rows are in `../shared/thesis/reproduced.csv`; without that file the test is skipped with a message. A few rows are
//! also here, so that something is always checked.

use std::io::Write;
use std::path::Path;

use fieldgap::acoustics::metrics::{
    Convention, PlaneMap, THESIS_THRESHOLD, focal_radius, peak, sub_peaks,
};
use fieldgap::acoustics::{Array, Excitation, Medium, PlaneGrid, Simulation, Simulator, Vec3};

#[derive(Debug)]
struct Row {
    study: String,
    array: String,
    spacing_mm: f64,
    focus_mm: Vec3,
    observation_z_mm: f64,
    convention: String,
    focal_radius_mm: f64,
    peak: f64,
    peak_mm: (f64, f64),
    sub_peaks: usize,
}

fn parse(line: &str) -> Row {
    let cells: Vec<&str> = line.split(',').collect();
    let number = |index: usize| -> f64 { cells[index].parse().expect("a number") };
    Row {
        study: cells[0].to_owned(),
        array: cells[1].to_owned(),
        spacing_mm: number(2),
        focus_mm: Vec3::new(number(4), number(5), number(6)),
        observation_z_mm: number(7),
        convention: cells[8].to_owned(),
        focal_radius_mm: number(9),
        peak: number(10),
        peak_mm: (number(11), number(12)),
        sub_peaks: cells[13].parse().expect("a count"),
    }
}

fn array(row: &Row) -> Array {
    let pitch_m = (10.5 + row.spacing_mm) * 1e-3;
    match row.array.split_once('-').expect("a name and a size") {
        ("linear", count) => Array::linear(count.parse().expect("a count"), pitch_m),
        ("hexagonal", _) => Array::hexagonal_thesis(3, pitch_m),
        ("square", size) => {
            let side = size.split('x').next().expect("a side").parse().expect("a count");
            Array::square(side, side, pitch_m)
        }
        _ => panic!("no such array: {}", row.array),
    }
    .expect("an array")
}

fn check(row: &Row) {
    let (simulator, convention) = match row.convention.as_str() {
        "as-written" => (Simulator::AsWritten, Convention::AsWritten),
        _ => (Simulator::Corrected, Convention::Corrected),
    };
    // The studies map 10 cm x 10 cm, the comparison with the scan 7 cm x 7 cm.
    let half_width_mm = if row.study == "comparison" { 35.0 } else { 50.0 };
    let grid = PlaneGrid::square(half_width_mm * 1e-3, 1e-3, row.observation_z_mm * 1e-3);
    let simulation = Simulation {
        simulator,
        array: array(row),
        medium: Medium { speed_of_sound_m_s: 343.0 },
        frequency_hz: 40e3,
        excitation: Excitation::Focus(row.focus_mm * 1e-3),
    };
    let values = simulation.magnitudes(&grid.points());
    let map = PlaneMap::new(grid.x_m, grid.y_m, values).expect("a map");
    let found = peak(&map).expect("measured");
    let radius = focal_radius(&map, THESIS_THRESHOLD, convention).expect("measured");
    let radius_mm = radius.radius_m.map_or(0.0, |radius_m| radius_m * 1e3);
    assert!((radius_mm - row.focal_radius_mm).abs() < 0.6e-4, "{radius_mm} for {row:?}");
    assert!((found.value - row.peak).abs() < 0.6e-6, "{} for {row:?}", found.value);
    // A symmetric field has several equal peaks; rounding determines which is first.
    let pixel = |at_mm: f64| (at_mm + half_width_mm).round() as usize;
    let at_row_peak = map.at(pixel(row.peak_mm.0), pixel(row.peak_mm.1)).expect("inside the map");
    assert!((at_row_peak - row.peak).abs() < 0.6e-6, "{found:?} for {row:?}");
    assert_eq!(sub_peaks(&map, THESIS_THRESHOLD).len(), row.sub_peaks, "{row:?}");
}

/// Bypasses the test harness, which captures the output of passing tests.
fn skipped(path: &Path) {
    let _ = writeln!(std::io::stderr(), "skipped: {} is not here", path.display());
}

#[test]
fn the_printed_figures_of_the_thesis_reproduce() {
    // The thesis prints peaks 9.2998, 24.2389, 23.6878 and radii 22.5, 9.0, 8.0 mm.
    for line in [
        "shape,linear-36,0,36,0,0,100,100,as-written,22.5000,9.299776,0,0,0",
        "shape,hexagonal-37,0,37,0,0,100,100,as-written,9.0000,24.238941,0,0,0",
        "shape,square-6x6,0,6,0,0,100,100,as-written,8.0000,23.687785,0,0,0",
        "shape,square-6x6,0,6,46,32,100,100,as-written,10.1446,12.628975,44,31,1",
        "comparison,square-6x6,0,6,17.5,-22.5,100,200,corrected,15.2888,5.829558,31,-35,0",
    ] {
        check(&parse(line));
    }
}

#[test]
fn every_reproduced_row_agrees_to_the_given_digits() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/thesis/reproduced.csv");
    let Ok(text) = std::fs::read_to_string(&path) else {
        skipped(&path);
        return;
    };
    let rows: Vec<Row> = text.lines().skip(1).filter(|line| !line.is_empty()).map(parse).collect();
    assert!(rows.len() >= 170, "only {} rows", rows.len());
    rows.iter().for_each(check);
}
