//! Exports read back as they were written: by this program, and by the libraries that people use for these formats.
//!
//! One test needs a Python with xarray, h5py, scipy and netCDF4, at `FIELDGAP_PYTHON` or as `python3`; without it the test says so
//! and is skipped. Another one needs GNU Octave as `octave-cli`.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use fieldgap::acoustics::Simulator;
use fieldgap::input::TomlSource;
use fieldgap::records::{RecordedScan, ScanSetup};

mod program;
mod small_record;
use program::fieldgap;
use small_record::{HEADER, SETUP};

const FORMATS: [&str; 5] = ["nc", "h5", "mat", "npz", "csv"];

fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let output = fieldgap(folder, arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {message}");
    String::from_utf8(output.stdout).expect("text")
}

/// A folder with the record `record`: two heights on grids of unequal sides, a second drive, silent readings and a repeated point.
fn home() -> tempfile::TempDir {
    let home = tempfile::tempdir().expect("a folder");
    let record = home.path().join("record");
    std::fs::create_dir(&record).expect("a folder");
    let setup_toml = format!("{SETUP}[[focus]]\nphases = \"all-zero\"\n");
    let setup =
        ScanSetup::parse(&TomlSource::new(Path::new("scan.toml"), &setup_toml)).expect("good");
    let mut rows = format!("{HEADER},std,count\n");
    let mut time_s = 0.125_f64;
    let mut add = |focus: i32, at_mm: [f64; 3]| {
        let at = fieldgap::acoustics::Vec3::from(at_mm) / 1e3;
        let reading = match usize::try_from(focus) {
            Ok(focus) => {
                let simulation = setup.simulation(Simulator::Corrected, focus).expect("a focus");
                // A little noise that no simulation has.
                0.7 * simulation.magnitudes(&[at])[0] + 1e-3 * (time_s * 7.0).sin().abs()
            }
            Err(_) => 1e-3,
        };
        let [x, y, z] = at_mm;
        writeln!(
            rows,
            "{time_s:?},{focus},{x:?},{y:?},{z:?},{reading:?},0.0015,{}",
            16 + (time_s as u32) % 3
        )
        .expect("a string");
        time_s += 1.1;
    };
    for z in [90.0, 100.0] {
        for y in 0..7 {
            for x in 0..9 {
                add(0, [f64::from(x) * 2.5 - 10.0, f64::from(y) * 2.0 - 6.0, z]);
            }
        }
        add(-1, [0.0, 0.0, z]);
        add(0, [0.0, 0.0, z]);
    }
    for x in 0..6 {
        add(1, [f64::from(x) * 3.1, 0.123456789, 120.0]);
    }
    std::fs::write(record.join("scan.toml"), setup_toml).expect("written");
    std::fs::write(record.join("samples.csv"), rows).expect("written");
    home
}

fn export_all(home: &Path) -> Vec<PathBuf> {
    let file = |format: &&str| {
        let name = format!("field.{format}");
        let said = succeeds(home, &["export", "record", &name]);
        assert!(said.starts_with("136 readings, with the simulation (corrected)"), "{said}");
        home.join(name)
    };
    FORMATS.iter().map(file).collect()
}

#[test]
fn exports_are_imported_as_the_same_readings() {
    let home = home();
    export_all(home.path());
    let original = RecordedScan::open(&home.path().join("record")).expect("a record");
    for format in FORMATS {
        let (file, out) = (format!("field.{format}"), format!("again-{format}"));
        let time = if format == "csv" { "time_s" } else { "time" };
        let mut arguments =
            vec!["import", "points", &file, "--columns", "x,y,z,reading", "--time-column", time];
        arguments.extend([
            "--drive-column",
            "drive",
            "--spread-columns",
            "std,count",
            "--setup",
            "record/scan.toml",
            "--yes",
        ]);
        // The archives of NumPy and MATLAB state no units for an array.
        if ["npz", "mat"].contains(&format) {
            arguments.extend(["--units", "mm,mm,mm,V"]);
        }
        arguments.extend(["--out", &out]);
        succeeds(home.path(), &arguments);
        let again = RecordedScan::open(&home.path().join(&out)).expect("a record");
        assert_eq!(again, original, "{format}");
    }
}

#[test]
fn grids_of_exports_are_imported_at_their_places() {
    let home = home();
    export_all(home.path());
    let original = RecordedScan::open(&home.path().join("record")).expect("a record");
    for format in ["nc", "h5", "mat", "npz"] {
        let (file, out) = (format!("field.{format}"), format!("grid-{format}"));
        let mut arguments =
            vec!["import", "points", &file, "--columns", "grid_x,grid_y,grid_z,grid_reading"];
        arguments.extend(["--units", "mm,mm,mm,V", "--rig"]);
        let rig = concat!(env!("CARGO_MANIFEST_DIR"), "/rigs/virtual.toml");
        arguments.extend([rig, "--focus-mm", "0,0,100", "--yes", "--out", &out]);
        succeeds(home.path(), &arguments);
        let again = RecordedScan::open(&home.path().join(&out)).expect("a record");
        assert_eq!(again.samples.len(), 2 * 7 * 9, "{format}");
        for sample in &again.samples {
            let same = original.samples.iter().filter(|known| {
                known.focus == Some(0) && (known.position_mm - sample.position_mm).norm() < 1e-9
            });
            let readings: Vec<f64> = same.map(|known| known.reading).collect();
            let mean = readings.iter().sum::<f64>() / readings.len() as f64;
            assert!((sample.reading - mean).abs() < 1e-12, "{format}: {sample:?}");
        }
    }
}

#[test]
fn an_existing_file_is_replaced_only_with_force() {
    let home = home();
    let file = home.path().join("field.csv");
    std::fs::write(&file, "mine").expect("written");
    let refused = fieldgap(home.path(), &["export", "record", "field.csv"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--force"));
    assert_eq!(std::fs::read_to_string(&file).expect("there"), "mine");
    succeeds(home.path(), &["export", "record", "field.csv", "--force", "--no-simulation"]);
    let text = std::fs::read_to_string(&file).expect("there");
    assert!(text.contains("# no_simulation: not requested\n"), "{text}");
    let unknown = fieldgap(home.path(), &["export", "record", "field.xlsx"]);
    assert!(String::from_utf8_lossy(&unknown.stderr).contains(".nc, .h5"));
    let left: Vec<_> = std::fs::read_dir(home.path()).expect("a folder").collect();
    assert_eq!(left.len(), 2, "no temporary file is left: {left:?}");
}

#[test]
fn the_libraries_of_other_programs_read_the_exports() {
    let python = std::env::var("FIELDGAP_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_libraries = Command::new(&python)
        .args(["-c", "import xarray, h5py, scipy, netCDF4"])
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if !has_libraries {
        println!(
            "skipped: {python} has not all of xarray, h5py, scipy and netCDF4; FIELDGAP_PYTHON names another one"
        );
        return;
    }
    let home = home();
    let mut files = export_all(home.path());
    succeeds(home.path(), &["export", "record", "grids.csv", "--grids"]);
    files.push(home.path().join("grids.csv"));
    let output = Command::new(&python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/export_round_trip.py"))
        .arg(home.path().join("record/samples.csv"))
        .args(&files)
        .output()
        .expect("python starts");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(said.lines().count(), 8, "{said}");
}

#[test]
fn octave_loads_the_same_values() {
    if !Command::new("octave-cli").arg("--version").output().is_ok_and(|run| run.status.success()) {
        println!("skipped: there is no octave-cli");
        return;
    }
    let home = home();
    succeeds(home.path(), &["export", "record", "field.mat"]);
    // 17 digits give every number back.
    let script = "d = load('field.mat');
        printf('%s %s %s\\n', d.units.reading, d.dimensions.grid_reading, mat2str(size(d.grid_reading)));
        printf('%.17g,%d,%.17g,%.17g,%.17g,%.17g,%.17g,%d\\n', [d.time, double(d.drive), d.x, d.y, d.z, d.reading, d.std, double(d.count)]');
        printf('%.17g\\n', permute(d.grid_reading, [2, 1, 3]));";
    let output = Command::new("octave-cli")
        .args(["--no-init-file", "--eval", script])
        .current_dir(home.path())
        .output()
        .expect("octave starts");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let numbers = |line: &str| -> Vec<f64> {
        line.split(',').map(|cell| cell.parse().expect("a number")).collect()
    };
    let mut lines = said.lines();
    assert_eq!(lines.next(), Some("V grid_y, grid_x, grid_z [7 9 2]"));
    let samples = std::fs::read_to_string(home.path().join("record/samples.csv")).expect("there");
    for row in samples.lines().skip(1) {
        assert_eq!(numbers(lines.next().expect("as many readings")), numbers(row));
    }
    let grid: Vec<f64> = lines.map(|line| numbers(line)[0]).collect();
    assert_eq!(grid.len(), 2 * 7 * 9);
    // The last row of the first height: none of its points was measured twice.
    let rows: Vec<Vec<f64>> = samples.lines().skip(1).map(numbers).collect();
    for x in 0..9 {
        assert_eq!(grid[6 * 9 + x], rows[6 * 9 + x][5], "column {x}");
    }
}

#[test]
fn simulated_fields_are_exported() {
    let home = tempfile::tempdir().expect("a folder");
    let rig = concat!(env!("CARGO_MANIFEST_DIR"), "/rigs/virtual.toml");
    let field = ["--rig", rig, "--focus-mm", "0,0,100", "--size-mm", "20", "--step-mm", "5"];
    let simulate =
        |more: &[&str]| succeeds(home.path(), &[&["simulate"][..], &field, more].concat());
    simulate(&["--z-mm", "95,100", "--out", "planes"]);
    simulate(&["--volume-mm", "95,100", "--out", "volume"]);
    for section in ["xy", "xz", "yz"] {
        let svg = home.path().join(format!("volume/section-{section}.svg"));
        let svg = std::fs::read_to_string(svg).expect("a picture");
        assert!(svg.contains("amplitude") && svg.contains("phase"), "{section}");
    }
    let mut readings = Vec::new();
    for (folder, columns) in [
        ("planes", "grid_x,grid_y,grid_z,grid_pressure"),
        ("planes", "x,y,z,pressure"),
        ("volume", "x,y,z,pressure"),
    ] {
        for format in ["nc", "h5"] {
            let (file, out) =
                (format!("{folder}.{format}"), format!("{folder}-{columns}-{format}"));
            succeeds(home.path(), &["export", folder, &file, "--force"]);
            let into = ["--rig", rig, "--unfocused", "--yes", "--out", &out];
            succeeds(
                home.path(),
                &[&["import", "points", &file, "--columns", columns][..], &into].concat(),
            );
            let record = RecordedScan::open(&home.path().join(out)).expect("a record");
            assert_eq!(record.samples.len(), 2 * 5 * 5, "{file} {columns}");
            readings.push(record.samples);
        }
    }
    for other in &readings[1..] {
        for (a, b) in readings[0].iter().zip(other) {
            assert!((a.position_mm - b.position_mm).norm() < 1e-9);
            assert!((a.reading - b.reading).abs() < 1e-6 * a.reading, "{a:?} {b:?}");
        }
    }
    succeeds(home.path(), &["export", "volume", "rows.csv", "--grids"]);
    let from_rows = ["import", "points", "rows.csv", "--columns", "x,y,z,pressure_1", "--rig", rig];
    succeeds(
        home.path(),
        &[
            &from_rows[..],
            &["--units", "mm,mm,mm,relative", "--unfocused", "--yes", "--out", "from-rows"],
        ]
        .concat(),
    );
    let record = RecordedScan::open(&home.path().join("from-rows")).expect("a record");
    assert_eq!(record.samples, readings[readings.len() - 1]);
    let table = fieldgap(home.path(), &["export", "volume", "volume.csv"]);
    assert!(String::from_utf8_lossy(&table.stderr).contains("a volume is no table of points"));
    assert!(!home.path().join("volume.csv").exists());
}
