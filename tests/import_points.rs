//! `fieldgap import points`: what it reads, what it shows before it writes, and what it refuses.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use fieldgap::records::RecordedScan;
use rustix::fs::{CWD, FileType, Mode, mknodat};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

const RIG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/rigs/virtual.toml");
const FOREIGN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/foreign_arrays");

/// Runs `import points FILE` for the rig of the project, in a folder.
fn import(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .args(["import", "points"])
        .args(arguments)
        .args(["--rig", RIG, "--focus-mm", "0,0,100"])
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

fn imported(folder: &Path, arguments: &[&str]) -> (String, RecordedScan) {
    let out = "out/imported";
    let output = import(folder, &[arguments, &["--yes", "--out", out]].concat());
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {message}");
    let record = RecordedScan::open(&folder.join(out)).expect("a record");
    std::fs::remove_dir_all(folder.join(out)).expect("removed");
    (String::from_utf8(output.stdout).expect("text"), record)
}

/// The message of an import that must be refused, and leave no record.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = import(folder, &[arguments, &["--yes", "--out", "out/refused"]].concat());
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    assert!(!folder.join("out/refused").exists(), "{arguments:?}");
    // Without the line breaks of the terminal.
    let message = String::from_utf8(output.stderr).expect("text");
    message.replace("\u{2502}", " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A folder with `points.csv`.
fn folder_with(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("points.csv"), text).expect("written");
    folder
}

/// A table of a plane with a peak off its centre, in the dialect of a German spreadsheet.
fn plane() -> String {
    let mut text = "Messung;vom 3. Mai\nx [mm];y [mm];z [mm];U [mV]\n".to_owned();
    for row in 0..15 {
        for column in 0..21 {
            let (x, y) = (f64::from(column) * 2.0 - 20.0, f64::from(row) * 2.0 - 14.0);
            let reading = 800.0 * (-((x - 4.0).powi(2) + (y - 2.0).powi(2)) / 60.0).exp() + 5.0;
            let reading = match (column, row) {
                (3, 2) | (7, 9) => "NaN".to_owned(),
                _ => format!("{reading:.2}"),
            };
            writeln!(text, "{x};{y};100,0;{}", reading.replace('.', ",")).expect("a string");
        }
    }
    text
}

#[test]
fn what_was_understood_is_shown() {
    let folder = folder_with(&plane());
    let (said, record) = imported(folder.path(), &["points.csv", "--columns", "x,y,z,U"]);
    insta::assert_snapshot!("understood_of_a_plane", said);
    assert_eq!(record.samples.len(), 15 * 21 - 2);
    assert!(said.lines().all(|line| line.chars().count() <= 80), "{said}");
}

#[test]
fn the_columns_are_asked_for() {
    let folder = folder_with(&plane());
    let message = refused(folder.path(), &["points.csv"]);
    assert!(
        message.contains("is a table of 4 columns: 1 `x [mm]`, 2 `y [mm]`, 3 `z [mm]`, 4 `U [mV]`"),
        "{message}"
    );
    let message = refused(folder.path(), &["points.csv", "--columns", "x,y,z,V"]);
    assert!(message.contains("no column `V`"), "{message}");
    let message =
        refused(folder.path(), &["points.csv", "--columns", "x,y,z,U", "--units", "m,mm,mm,mV"]);
    assert!(message.contains("states that x is in mm, but --units says m"), "{message}");
}

#[test]
fn nothing_is_written_without_agreement_or_over_a_record() {
    let folder = folder_with(&plane());
    let unasked = import(folder.path(), &["points.csv", "--columns", "x,y,z,U", "--out", "r"]);
    assert_eq!(unasked.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&unasked.stderr).contains("Nobody can be asked"));
    assert!(!folder.path().join("r").exists());
    let first =
        import(folder.path(), &["points.csv", "--columns", "x,y,z,U", "--out", "r", "--yes"]);
    assert!(first.status.success());
    let before = std::fs::read(folder.path().join("r/samples.csv")).expect("there");
    let again = import(
        folder.path(),
        &["points.csv", "--columns", "x,y,z,U", "--out", "r", "--yes", "--negative", "rectify"],
    );
    assert!(String::from_utf8_lossy(&again.stderr).contains("already contains a record"));
    assert_eq!(std::fs::read(folder.path().join("r/samples.csv")).expect("there"), before);
    let fresh = import(folder.path(), &["points.csv", "--columns", "x,y,z,U", "--yes"]);
    assert!(fresh.status.success() && folder.path().join("out/points/scan.toml").exists());
}

#[test]
fn in_a_terminal_the_answer_decides() {
    for (answer, written) in [("y\n", true), ("n\n", false)] {
        let folder = folder_with(&plane());
        let terminal = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
        grantpt(&terminal).and_then(|()| unlockpt(&terminal)).expect("unlocked");
        let name = ptsname(&terminal, Vec::new()).expect("a name");
        let name = name.into_string().expect("text");
        let end = File::options().read(true).write(true).open(name).expect("opened");
        // Typed before the question; the terminal keeps it.
        let mut keys = File::from(terminal);
        keys.write_all(answer.as_bytes()).expect("typed");
        let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
            .args(["import", "points", "points.csv", "--columns", "x,y,z,U", "--out", "r"])
            .args(["--rig", RIG, "--unfocused"])
            .current_dir(folder.path())
            .stdin(end.try_clone().expect("a copy"))
            .stderr(end)
            .output()
            .expect("the program starts");
        assert_eq!(output.status.success(), written, "{answer:?}");
        assert_eq!(folder.path().join("r").exists(), written, "{answer:?}");
    }
}

#[test]
fn units_are_converted() {
    let text = "x,y,z,p\n1,2,3,40\n2,2,3,20\n";
    let folder = folder_with(text);
    for (units, at_mm, reading, unit) in [
        ("cm,cm,cm,mV", [10.0, 20.0, 30.0], 0.04, "V"),
        ("in,mm,mm,kPa", [25.4, 2.0, 3.0], 40_000.0, "Pa"),
        ("mm,mm,mm,dB:1mV", [1.0, 2.0, 3.0], 0.1, "V"),
        ("mm,mm,mm,dB", [1.0, 2.0, 3.0], 1.0, "relative"),
    ] {
        let (_, record) =
            imported(folder.path(), &["points.csv", "--columns", "x,y,z,p", "--units", units]);
        assert_eq!(<[f64; 3]>::from(record.samples[0].position_mm), at_mm, "{units}");
        assert!(
            (record.samples[0].reading / reading - 1.0).abs() < 1e-12,
            "{units}: {:?}",
            record.samples[0]
        );
        assert_eq!(record.setup.unit, unit, "{units}");
    }
}

#[test]
fn complex_readings_become_amplitudes() {
    let folder = folder_with("x,y,z,re,im,phase\n0,0,100,3,-4,1\n5,0,100,6,8,2\n");
    let (said, record) = imported(
        folder.path(),
        &["points.csv", "--columns", "x,y,z,re,im", "--units", "mm,mm,mm,V,V"],
    );
    assert_eq!([record.samples[0].reading, record.samples[1].reading], [5.0, 10.0]);
    assert!(said.contains("phase of the complex readings is left out"), "{said}");
    let (said, record) = imported(
        folder.path(),
        &["points.csv", "--columns", "x,y,z,re,phase", "--units", "mm,mm,mm,V,deg"],
    );
    assert_eq!(record.samples[1].reading, 6.0);
    assert!(said.contains("The phase (in degrees) is left out"), "{said}");
}

#[test]
fn phases_of_known_convention_are_kept() {
    let folder = folder_with("x,y,z,re,im,phase\n0,0,100,3,-4,90\n5,0,100,-6,8,180\n");
    let parts = ["points.csv", "--columns", "x,y,z,re,im", "--units", "mm,mm,mm,V,V"];
    let convention = ["--phase-convention", "exp(+iwt)"];
    let (said, record) = imported(folder.path(), &[&parts[..], &convention].concat());
    assert!(!said.contains("left out"), "{said}");
    // Both lie on the line through 3 - 4i.
    let phases = [0, 1].map(|n: usize| record.samples[n].phase_rad.expect("a phase"));
    assert!((phases[0] + (4.0f64 / 3.0).atan()).abs() < 1e-12, "{phases:?}");
    assert!((phases[1] - phases[0] - std::f64::consts::PI).abs() < 1e-12, "{phases:?}");
    let phase = record.setup.phase.expect("stated");
    assert_eq!(phase.named(), ("drive-sync", "exp(+iwt)"));
    let polar = ["points.csv", "--columns", "x,y,z,re,phase", "--units", "mm,mm,mm,V,deg"];
    let rectify = ["--negative", "rectify"];
    let (_, record) = imported(folder.path(), &[&polar[..], &convention, &rectify].concat());
    let phases =
        [0, 1].map(|n: usize| record.samples[n].phase_rad.expect("a phase") / std::f64::consts::PI);
    // -6 at 180 degrees is 6 at 360 degrees.
    assert_eq!(phases, [0.5, 2.0]);
}

#[test]
fn negative_readings_are_explained() {
    let rows = |reading: &dyn Fn(usize) -> f64| {
        let rows = (0..40).map(|n| format!("{},{},100,{}\n", n % 8 * 5, n / 8 * 5, reading(n)));
        format!("x_mm,y_mm,z_mm,U_V\n{}", rows.collect::<String>())
    };
    let columns = ["points.csv", "--columns", "x,y,z,U"];
    for (readings, likely) in [
        (rows(&|n| (n as f64).sin()), "instantaneous samples of the wave"),
        (rows(&|n| -3.0 - n as f64), "look like decibels"),
        (rows(&|n| n as f64 - 0.5), "noise about zero"),
    ] {
        let folder = folder_with(&readings);
        let message = refused(folder.path(), &columns);
        assert!(message.contains(likely) && message.contains("points.csv:"), "{message}");
        let (said, record) =
            imported(folder.path(), &[&columns[..], &["--negative", "rectify"]].concat());
        assert_eq!(record.samples.len(), 40);
        assert!(said.contains("rectified: their sign was removed"), "{said}");
    }
    let folder = folder_with(&rows(&|n| n as f64 - 0.5));
    let (said, record) =
        imported(folder.path(), &[&columns[..], &["--negative", "leave-out"]].concat());
    assert_eq!(record.samples.len(), 39);
    assert!(said.contains("1 negative readings left out: line 2."), "{said}");
}

#[test]
fn absurd_values_are_refused_with_their_likely_unit() {
    let columns = ["points.csv", "--columns", "x,y,z,U", "--units"];
    for (text, units, place, said) in [
        (
            "x,y,z,U\n1,2,3,1\n40000,2,100000,1\n",
            "mm,mm,mm,V",
            "points.csv:3:1:",
            "is the column in um?",
        ),
        ("x,y,z,U\n1,2,3,1\n1,2,3,1500\n", "mm,mm,mm,V", "points.csv:3:7:", "is the column in mV"),
        ("x,y,z,U\n1,2,3,1\n1,2,3,inf\n", "mm,mm,mm,V", "points.csv:3:7:", "infinite"),
        ("x,y,z,U\n1,2,3,1\n1,2,3,2e6\n", "mm,mm,mm,Pa", "points.csv:3:7:", "dB:20uPa"),
        (
            "x,y,z,U\n0,0,0.1,1\n0.01,0,0.1,2\n0.02,0,0.1,3\n0.03,0,0.1,4\n0.04,0,0.1,5\n",
            "mm,mm,mm,V",
            "points.csv:",
            "are the places in m?",
        ),
    ] {
        let folder = folder_with(text);
        let message = refused(folder.path(), &[&columns[..], &[units]].concat());
        assert!(message.contains(place) && message.contains(said), "{message}");
    }
}

#[test]
fn a_set_up_gives_array_medium_and_drives() {
    let folder = folder_with("x_mm,y_mm,z_mm,U_V,d\n0,0,100,1,0\n5,0,100,2,1\n0,0,100,0.1,-1\n");
    let (_, record) = imported(folder.path(), &["points.csv", "--columns", "x,y,z,U"]);
    let mut setup = record.setup.clone();
    setup.foci.push(setup.foci[0].clone());
    let path = folder.path().join("setup.toml");
    std::fs::write(&path, setup.to_toml().expect("TOML")).expect("written");
    let with_setup = |more: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_fieldgap"))
            .args([
                "import",
                "points",
                "points.csv",
                "--columns",
                "x,y,z,U",
                "--setup",
                "setup.toml",
                "--yes",
                "--out",
                "r",
            ])
            .args(more)
            .current_dir(folder.path())
            .output()
            .expect("the program starts")
    };
    let of_drives = with_setup(&["--drive-column", "d"]);
    assert!(of_drives.status.success(), "{}", String::from_utf8_lossy(&of_drives.stderr));
    let record = RecordedScan::open(&folder.path().join("r")).expect("a record");
    let drives: Vec<Option<usize>> = record.samples.iter().map(|sample| sample.focus).collect();
    assert_eq!(drives, [Some(0), Some(1), None]);
    std::fs::remove_dir_all(folder.path().join("r")).expect("removed");
    let beyond = with_setup(&["--focus", "2"]);
    assert!(String::from_utf8_lossy(&beyond.stderr).contains("has 2 drives"));
}

#[test]
fn arrays_of_other_programs_hold_the_same_field() {
    let folder = tempfile::tempdir().expect("a folder");
    let units = ["--units", "mm,mm,mm,V"];
    for (file, columns, missing) in [
        ("matlab-5.mat", "x,y,z,p", 0),
        ("matlab-5-plain.mat", "data:1,data:2,data:3,data:4", 0),
        ("matlab-7.3.mat", "x,y,z,p", 0),
        ("points.npy", "1,2,3,4", 0),
        ("grid.npz", "x,y,z,p", 0),
        ("netcdf-3.nc", "x,y,z,p", 1),
        ("netcdf-5.nc", "x,y,z,p", 1),
        ("netcdf-4.nc", "x,y,z,p", 1),
        ("netcdf-4-square.nc", "x,y,z,p", 8),
        ("h5py.h5", "scan/x,scan/y,scan/z,scan/p", 0),
    ] {
        let path = format!("{FOREIGN}/{file}");
        // h5py.h5 states its units, metres and volts.
        let units = if file == "h5py.h5" { &[][..] } else { &units };
        let (_, record) =
            imported(folder.path(), &[&[path.as_str(), "--columns", columns], units].concat());
        assert_eq!(record.samples.len(), 40 - missing, "{file}");
        for sample in &record.samples {
            let at = sample.position_mm;
            let expected =
                0.1 + (at.x + 4.0) / 100.0 + (at.y + 6.0) / 1000.0 + (at.z - 80.0) / 10.0;
            assert!((sample.reading - expected).abs() < 1e-6, "{file}: {sample:?}");
        }
    }
}

#[test]
fn arrays_that_do_not_fit_are_listed_with_their_shapes() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = format!("{FOREIGN}/matlab-5.mat");
    let message = refused(folder.path(), &[&path]);
    assert!(
        message.contains("`x` (1 x 5), `y` (1 x 4), `z` (1 x 2), `p` (4 x 5 x 2, complex)"),
        "{message}"
    );
    let message = refused(folder.path(), &[&path, "--columns", "x,y,x,p", "--units", "mm,mm,mm,V"]);
    assert!(message.contains("do not fit each other"), "{message}");
    // An order that contradicts the lengths.
    let ordered = [&path, "--columns", "x,y,z,p", "--units", "mm,mm,mm,V", "--order", "x,y,z"];
    assert!(refused(folder.path(), &ordered).contains("do not fit each other"));
    let (_, record) = imported(folder.path(), &[&ordered[..6], &["y,x,z"]].concat());
    assert_eq!(record.samples.len(), 40);
}

#[test]
fn pipes_and_devices_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe.mat");
    mknodat(CWD, &pipe, FileType::Fifo, Mode::from_raw_mode(0o600), 0).expect("a pipe");
    for path in [pipe.to_str().expect("text"), "/dev/zero"] {
        let message =
            refused(folder.path(), &[path, "--columns", "x,y,z,p", "--units", "mm,mm,mm,V"]);
        assert!(message.contains("not a regular file"), "{message}");
    }
}
