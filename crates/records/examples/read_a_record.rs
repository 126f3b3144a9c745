//! Reads a recorded scan and prints, for each height, the largest reading beside that of the simulation.
//!
//! `cargo run --package fieldgap-records --example read_a_record [FOLDER]`. Without a folder it first writes a small record into a
//! temporary one.

use std::error::Error;
use std::path::{Path, PathBuf};

use fieldgap_acoustics::{PlaneGrid, Vec3};
use fieldgap_input::TomlSource;
use fieldgap_records::{RecordedSample, RecordedScan, SAME_HEIGHT_MM, ScanSetup};

const SCAN_TOML: &str = r#"
format = 1
name = "two planes"
recorded = 2026-11-20T17:00:00Z
reading = "V"
[array]
frequency_hz = 40000.0
layout = "square"
columns = 6
rows = 6
element_diameter_mm = 10.5
spacing_mm = 0.0
[medium]
temperature_c = 22.0
humidity_percent = 45.0
pressure_kpa = 101.3
[simulator]
model = "piston"
[[focus]]
x_mm = 0.0
y_mm = 0.0
z_mm = 100.0
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let temporary = tempfile::tempdir()?;
    let folder = match std::env::args_os().nth(1) {
        Some(folder) => PathBuf::from(folder),
        None => {
            let folder = temporary.path().join("two-planes");
            example_scan()?.write(&folder)?;
            folder
        }
    };

    let scan = RecordedScan::open(&folder)?;
    let setup = &scan.setup;
    println!(
        "{}: {} samples of {}, unit {}",
        setup.name,
        scan.samples.len(),
        setup.array.layout(),
        setup.unit
    );
    for plane in scan.planes(SAME_HEIGHT_MM) {
        let simulation = setup.simulation(setup.simulator, plane.focus).ok_or("no such focus")?;
        let points: Vec<Vec3> = plane.samples.iter().map(|sample| sample.position_m()).collect();
        let simulated = simulation.magnitudes(&points).into_iter().fold(0.0, f64::max);
        let measured = plane.samples.iter().map(|sample| sample.reading).fold(0.0, f64::max);
        println!(
            "focus {}, z = {:.1} mm: {} points, largest reading {measured:.3}, simulated {simulated:.1} (arbitrary unit)",
            plane.focus,
            plane.z_mm,
            plane.samples.len()
        );
    }
    Ok(())
}

/// A record with simulated readings: 10 mV for each unit of the simulator.
fn example_scan() -> Result<RecordedScan, Box<dyn Error>> {
    let setup = ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), SCAN_TOML))?;
    let simulation = setup.simulation(setup.simulator, 0).ok_or("no focus")?;
    let points: Vec<Vec3> =
        [0.08, 0.1].iter().flat_map(|&z_m| PlaneGrid::square(30e-3, 2e-3, z_m).points()).collect();
    let samples = simulation
        .magnitudes(&points)
        .into_iter()
        .zip(&points)
        .enumerate()
        .map(|(n, (magnitude, at_m))| {
            RecordedSample::measured(n as f64, Some(0), *at_m, 0.01 * magnitude, None)
        })
        .collect();
    Ok(RecordedScan { setup, samples })
}
