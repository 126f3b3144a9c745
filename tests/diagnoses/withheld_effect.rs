//! A run on a rig with a sealed truth: scanned, diagnosed, corrected, and compared again. The truth is not stated here either: it
//! is unsealed and compared with the named cause.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use fieldgap::comparison::{GapReduction, Registering, compare};
use fieldgap::records::RecordedScan;
use fieldgap::virtual_rig::Truth;
use fieldgap_text::percent;

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn run(plan: &Path, out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .arg("run")
        .arg(plan)
        .arg("--out")
        .arg(out)
        .output()
        .expect("it runs")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn the_withheld_effect_is_named_and_the_gap_reduced_to_the_noise() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = home.path().join("scan");
    let output = run(&here("scans/withheld-effect.toml"), &folder);
    let said = said(&output);
    assert!(output.status.success(), "{said}");

    let json = std::fs::read(folder.join("report/why/diagnosis.json")).expect("it is diagnosed");
    let diagnosis: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    assert_eq!(diagnosis["verdict"], "explained", "{said}");
    let named: Vec<&str> = diagnosis["effects"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|effect| effect.as_str())
        .collect();
    let truth = Truth::read(&here("rigs/truth/withheld.sealed")).expect("its key lies beside it");
    let [(withheld, _)] = truth.effects.as_slice() else { panic!("one effect is withheld") };
    let steps = diagnosis["waterfall"].as_array().expect("steps");
    let largest = steps.iter().find(|step| step["part"] == "effect").expect("the largest effect");
    assert_eq!(largest["effect"], *withheld, "{named:?}");
    // The controller has 256 steps per period, which no set-up states; this is visible, too.
    assert_eq!(named, [*withheld, "phase-quantisation"]);
    assert_eq!(diagnosis["ranked"][0]["parameters"]["phase-quantisation.steps"]["value"], 256.0);
    assert!(largest["share"].as_f64().expect("a share") > 0.9, "{steps:?}");
    let alone = diagnosis["noise_floor"].as_f64().expect("a noise");
    assert!(
        said.contains(&format!("noise alone: {}", percent(alone).replace('\u{a0}', " "))),
        "{said}"
    );
    let gaps = said.lines().find(|line| line.trim_start().starts_with("all readings"));
    let gaps = gaps.expect("a table of gaps").trim_end();
    assert!(gaps.ends_with(&percent(alone).replace('\u{a0}', " ")), "{gaps}: one noise, one value");

    // The printed figures are those of the library for the two folders.
    let open = |folder: &Path| RecordedScan::open(folder).expect("a recorded scan");
    let (scan, corrected) = (open(&folder), open(&folder.join("corrected")));
    assert_eq!(scan.samples, corrected.samples);
    let gap = |scan: &RecordedScan| {
        compare(scan, scan.setup.simulator, Registering::Auto).expect("comparable")
    };
    let planes = diagnosis["where"]["planes"].as_array().expect("a list");
    let noise_at = |_: usize, z_mm: f64| {
        planes.iter().find(|plane| plane["z_mm"] == z_mm).and_then(|plane| plane["noise"].as_f64())
    };
    let reduction =
        GapReduction::between(&scan, &gap(&scan), &gap(&corrected)).with_noise(alone, noise_at);
    assert!(said.contains(&reduction.to_text()), "{said}");
    let kept = std::fs::read_to_string(folder.join("corrected/gaps.txt")).expect("it is kept");
    assert_eq!(kept, reduction.to_text());
    assert_eq!(reduction.planes.len(), 4);
    for gaps in reduction.planes.iter().map(|plane| plane.gaps).chain([reduction.overall]) {
        assert!(gaps.before > 3.0 * gaps.noise, "{kept}");
        assert!(gaps.after < 1.3 * gaps.noise, "{kept}");
    }
    for page in ["report/index.html", "report/why/index.html", "corrected/report/index.html"] {
        assert!(folder.join(page).exists(), "{page}");
    }
}

const RIGHT: &str = r#"
name = "right"
rig = "RIG"
diagnose = true
[simulator]
model = "piston"
[[focus]]
x_mm = 17.5
y_mm = -22.5
z_mm = 100.0
[dark]
before = 8
[[plane]]
z_mm = [100.0, 140.0]
centre_mm = [17.5, -22.5]
size_mm = [30.0, 30.0]
step_mm = 5.0
"#;

#[test]
fn a_run_without_a_correctable_cause_reports_it() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    let rig = here("rigs/virtual.toml").display().to_string();
    std::fs::write(&plan, RIGHT.replace("RIG", &rig)).expect("written");
    let output = run(&plan, &folder);
    let said = said(&output);
    assert!(output.status.success(), "{said}");
    assert!(folder.join("report/why/index.html").exists(), "{said}");
    assert!(said.contains("not corrected: "), "{said}");
    assert!(!said.contains("noise alone leaves"), "{said}");
    assert!(!folder.join("corrected").exists());
}

#[test]
fn an_invalid_seal_ends_a_run_before_any_move() {
    let home = tempfile::tempdir().expect("a folder");
    let at = |name: &str| home.path().join(name);
    let rig = std::fs::read_to_string(here("rigs/withheld.toml")).expect("there");
    std::fs::write(at("rig.toml"), rig.replace("truth/withheld", "withheld")).expect("written");
    std::fs::write(at("plan.toml"), RIGHT.replace("RIG", "rig.toml")).expect("written");
    std::fs::copy(here("rigs/truth/withheld.key"), at("withheld.key")).expect("copied");
    let mut sealed = std::fs::read(here("rigs/truth/withheld.sealed")).expect("there");
    sealed[40] ^= 1;
    std::fs::write(at("withheld.sealed"), sealed).expect("written");
    let output = run(&at("plan.toml"), &at("scan"));
    assert_eq!(output.status.code(), Some(1));
    let said = said(&output);
    assert!(said.contains("withheld.sealed: does not open"), "{said}");
    assert!(!at("scan").exists());
}
