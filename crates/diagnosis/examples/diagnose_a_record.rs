//! Makes a scan whose air is warmer than believed, and diagnoses it. With a folder as argument, diagnoses that recorded scan.
//!
//! ```text
//! cargo run --release --package fieldgap-diagnosis --example diagnose_a_record [SCAN]
//! ```

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use fieldgap_acoustics::{Array, Excitation, Medium, Simulation, Simulator, Vec3};
use fieldgap_diagnosis::diagnose;
use fieldgap_records::RecordedScan;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const BELIEVED_M_S: f64 = 343.0;
const TRUE_M_S: f64 = 348.0;
const FOCUS_MM: [f64; 3] = [5.0, 0.0, 100.0];

fn main() -> Result<(), Box<dyn Error>> {
    let (_made, folder) = match std::env::args().nth(1) {
        Some(folder) => (None, PathBuf::from(folder)),
        None => {
            let made = tempfile::tempdir()?;
            make_scan(made.path())?;
            let folder = made.path().to_owned();
            (Some(made), folder)
        }
    };
    let scan = RecordedScan::open(&folder)?;
    println!("{}", diagnose(&[scan], None)?.to_text());
    Ok(())
}

/// Three planes of a focused array, with 2 % of proportional noise and a tenth of that in quadrature.
fn make_scan(folder: &Path) -> Result<(), Box<dyn Error>> {
    let array = Array::square(6, 6, 10.5e-3)?;
    let believed = Medium { speed_of_sound_m_s: BELIEVED_M_S };
    let focus = Excitation::Focus(Vec3::from_column_slice(&FOCUS_MM) * 1e-3);
    // The driver computes its delays for the believed air.
    let phases_rad = focus.phases_rad(&array, &believed, 40e3);
    let truth = Simulation {
        simulator: Simulator::Piston,
        array,
        medium: Medium { speed_of_sound_m_s: TRUE_M_S },
        frequency_hz: 40e3,
        excitation: Excitation::Phases(phases_rad),
    };
    let mut points_mm = Vec::new();
    for z in [80.0, 100.0, 120.0] {
        for row in 0..25 {
            points_mm.extend(
                (0..25).map(|n| [f64::from(n) * 2.0 - 24.0, f64::from(row) * 2.0 - 24.0, z]),
            );
        }
    }
    let points_m: Vec<Vec3> =
        points_mm.iter().map(|at| Vec3::from_column_slice(at) * 1e-3).collect();
    let levels = truth.magnitudes(&points_m);
    let peak = levels.iter().copied().fold(0.0, f64::max);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut csv = "time_s,focus,x_mm,y_mm,z_mm,reading\n".to_owned();
    for n in 0..32 {
        let dark = (2e-3 * normal()).hypot(2e-3 * normal());
        writeln!(csv, "{},-1,0,0,100,{dark:.6}", 0.1 * f64::from(n))?;
    }
    for (n, ([x, y, z], level)) in points_mm.iter().zip(levels).enumerate() {
        let level = level / peak;
        let reading = (level + 2e-3 * normal()).hypot(2e-3 * normal()) * (1.0 + 0.02 * normal());
        writeln!(csv, "{},0,{x},{y},{z},{:.6}", 4.0 + 0.1 * n as f64, reading.abs())?;
    }
    std::fs::write(folder.join("samples.csv"), csv)?;
    let [x, y, z] = FOCUS_MM;
    let setup = format!(
        "format = 1\nname = \"warm-air\"\nrecorded = 2026-01-01T12:00:00Z\nreading = \"V\"\n\n\
         [array]\nfrequency_hz = 40000.0\nlayout = \"square\"\ncolumns = 6\nrows = 6\n\
         element_diameter_mm = 10.5\nspacing_mm = 0.0\n\n\
         [medium]\nspeed_of_sound_m_s = {BELIEVED_M_S:?}\n\n[simulator]\nmodel = \"piston\"\n\n\
         [[focus]]\nx_mm = {x:?}\ny_mm = {y:?}\nz_mm = {z:?}\n"
    );
    std::fs::write(folder.join("scan.toml"), setup)?;
    Ok(())
}
