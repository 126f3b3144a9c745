//! The plans of the project.

use std::path::Path;

use fieldgap::acoustics::Simulator;
use fieldgap::records::{Plan, VisitKind};
use serde_json::Value;

fn plan(name: &str) -> Plan {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans").join(name);
    Plan::read(&path).unwrap_or_else(|fault| panic!("{fault}"))
}

#[test]
fn the_thesis_plan_scans_four_planes_of_36_by_36_points() {
    let plan = plan("thesis-focus.toml");
    assert_eq!(plan.simulator, Simulator::AsWritten);
    assert_eq!(plan.also, [Simulator::Corrected]);
    let visits = plan.visits();
    let of = |kind| visits.iter().filter(|visit| visit.kind == kind).collect::<Vec<_>>();
    assert_eq!(of(VisitKind::Dark).len(), 16);
    assert_eq!(of(VisitKind::Reference).len(), 1 + (4 * 36 * 36usize).div_ceil(400));
    let points = of(VisitKind::Point);
    assert_eq!(points.len(), 4 * 36 * 36);
    let mut heights_mm: Vec<i64> =
        points.iter().map(|visit| (visit.position_m.z * 1e3).round() as i64).collect();
    heights_mm.dedup();
    assert_eq!(heights_mm, [50, 100, 150, 200]);
    let reach_m = points.iter().map(|visit| visit.position_m.xy().amax()).fold(0.0, f64::max);
    assert!((reach_m - 0.035).abs() < 1e-12);
}

#[test]
fn the_withheld_effect_is_scanned_at_four_heights_and_diagnosed() {
    let plan = plan("withheld-effect.toml");
    assert!(plan.diagnose);
    assert!(plan.visits().len() < 1000);
}

#[test]
fn the_quick_look_is_small() {
    assert!(plan("quick-look.toml").visits().len() < 200);
}

#[test]
fn a_program_reads_the_gap_and_a_gap_above_its_limit_ends_with_code_4() {
    let home = tempfile::tempdir().expect("a folder");
    let fieldgap = |words: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_fieldgap"));
        command.current_dir(env!("CARGO_MANIFEST_DIR")).args(words).output().expect("it runs")
    };
    let record = home.path().join("look");
    let record = record.to_str().expect("text");
    let run = ["run", "scans/quick-look.toml", "--yes", "--json", "--out", record];
    let ran = fieldgap(&[&run[..], &["--fail-above", "99"]].concat());
    assert_eq!(ran.status.code(), Some(0), "{}", String::from_utf8_lossy(&ran.stderr));
    let printed = String::from_utf8(ran.stdout).expect("text");
    let lines: Vec<Value> =
        printed.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let told = lines.last().expect("a line");
    assert_eq!(told["event"], "compared");
    let gap = told["gap_percent"].as_f64().expect("a number");

    // It is the root mean square of scan minus simulation over that of the scan, from the numbers of the maps themselves.
    let compared = fieldgap(&["compare", record, "--json"]);
    let compared: Value = serde_json::from_slice(&compared.stdout).expect("JSON");
    let overall = &compared[0]["overall"];
    let [residual, scan] =
        ["residual_rms", "scan_rms"].map(|key| overall[key].as_f64().expect("a number"));
    assert!((gap - 100.0 * residual / scan).abs() < 1e-9 * gap, "{gap} % for {overall}");
    assert_eq!(
        told["heights"].as_array().map(Vec::len),
        compared[0]["planes"].as_array().map(Vec::len)
    );

    for (limit, code) in [(gap * 1.01, 0), (gap * 0.99, 4)] {
        let ended = fieldgap(&["compare", record, "--fail-above", &limit.to_string()]);
        assert_eq!(ended.status.code(), Some(code));
        let said = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(said.contains("is above the limit of"), code == 4, "{said}");
    }
    assert_eq!(fieldgap(&["compare", record, "--fail-above", "-1"]).status.code(), Some(2));
}
