//! A scan of 100,000 points in constant memory.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// Largest increase of memory from the ten-thousandth to the last point, KiB.
const MORE_KIB: u64 = 8 << 10;

/// A volume of 50 x 50 x 40 points.
const PLAN: &str = r#"
name = "long"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[[volume]]
min_mm = [-24.5, -24.5, 60.0]
max_mm = [24.5, 24.5, 138.0]
step_mm = [1.0, 1.0, 2.0]
"#;

fn resident_kib(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("it runs");
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("its memory");
    line.split_whitespace().nth(1).expect("a number").parse().expect("a number")
}

#[test]
#[cfg(target_os = "linux")]
#[ignore = "takes minutes; run: cargo test --release --test rig long_scan -- --ignored"]
fn a_hundred_thousand_points_take_no_more_memory_than_ten_thousand() {
    let home = tempfile::tempdir().expect("a folder");
    let (plan, folder) = (home.path().join("plan.toml"), home.path().join("scan"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let mut scan = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .args(["scan", "--json"])
        .arg(&plan)
        .arg("--rig")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/virtual.toml"))
        .arg("--out")
        .arg(&folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the scan starts");
    let lines = BufReader::new(scan.stdout.take().expect("it is piped")).lines();
    let mut measured = 0;
    let mut resident = Vec::new();
    for line in lines {
        measured += usize::from(line.expect("text").contains("\"measured\""));
        if measured % 10_000 == 0 && measured / 10_000 > resident.len() {
            resident.push(resident_kib(scan.id()));
        }
    }
    assert!(scan.wait().expect("it ends").success());
    println!("KiB resident after each ten thousand points: {resident:?}");
    assert_eq!(resident.len(), 10);
    assert!(resident[9] <= resident[0] + MORE_KIB, "{resident:?}");
}
