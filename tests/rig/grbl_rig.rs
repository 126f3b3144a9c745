//! Scans with GRBL robots over pseudo-terminals: the same field as with Marlin.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use fieldgap::records::{RecordedSample, RecordedScan};

const PLAN: &str = r#"
name = "three-by-three"
[simulator]
model = "corrected"
[[focus]]
x_mm = 5.0
y_mm = -5.0
z_mm = 100.0
[[plane]]
z_mm = 100.0
size_mm = [20.0, 20.0]
step_mm = 10.0
"#;

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Scans on a rig of the project, with a replacement in its file.
fn scan(home: &Path, rig: &str, from: &str, to: &str) -> (Output, PathBuf) {
    let text = std::fs::read_to_string(here("rigs").join(rig)).expect("the rig file is there");
    assert!(text.contains(from), "{rig} has {from:?}");
    let truth = here("rigs/truth/thesis-lab.toml");
    let text =
        text.replace(from, to).replace("truth/thesis-lab.toml", truth.to_str().expect("text"));
    let (plan, rig, out) = (home.join("plan.toml"), home.join("rig.toml"), home.join("out"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    std::fs::write(&rig, text).expect("the rig file is written");
    let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .arg("scan")
        .arg(&plan)
        .arg("--rig")
        .arg(&rig)
        .arg("--out")
        .arg(&out)
        .output()
        .expect("it runs");
    (output, out)
}

fn readings(rig: &str, from: &str, to: &str) -> Vec<(String, f64)> {
    let home = tempfile::tempdir().expect("a folder");
    let (output, out) = scan(home.path(), rig, from, to);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let scan = RecordedScan::open(&out).expect("a whole record");
    let place = |sample: &RecordedSample| {
        let [x, y, z]: [f64; 3] = sample.position_mm.into();
        format!("({x:.2}, {y:.2}, {z:.2})")
    };
    scan.samples.iter().map(|sample| (place(sample), sample.reading)).collect()
}

#[test]
fn each_firmware_measures_the_same_field() {
    let marlin = readings("virtual.toml", "seed = 1", "seed = 1");
    let grbl = readings("virtual-grbl.toml", "seed = 1", "seed = 1");
    let hal = readings("virtual-grbl.toml", "firmware = \"grbl\"", "firmware = \"grblhal\"");
    assert!(marlin.len() >= 9, "{marlin:?}");
    for other in [grbl, hal] {
        assert_eq!(other.len(), marlin.len());
        for ((at, magnitude), (there, same)) in marlin.iter().zip(&other) {
            assert_eq!(at, there);
            // The noise of 16 readings is a percent of the peak at most.
            assert!((magnitude - same).abs() < 0.05, "at {at}: {magnitude} V and {same} V");
        }
    }
}

#[test]
fn a_driver_for_another_firmware_names_the_one_that_answers() {
    let home = tempfile::tempdir().expect("a folder");
    let (output, _) = scan(home.path(), "virtual-grbl.toml", "[motion.auto]", "[motion.marlin]");
    let said = String::from_utf8_lossy(&output.stderr).replace("\n  │", "");
    assert!(!output.status.success());
    assert!(said.contains("names Marlin") && said.contains("[motion.grbl]"), "{said}");
    let (output, _) = scan(home.path(), "virtual.toml", "[motion.marlin]", "[motion.grbl]");
    let said = String::from_utf8_lossy(&output.stderr).replace("\n  │", "");
    assert!(!output.status.success());
    assert!(said.contains("names GRBL") && said.contains("[motion.marlin]"), "{said}");
}
