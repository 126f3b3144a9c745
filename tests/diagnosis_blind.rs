//! Diagnoses of a small set whose causes are sealed away: made, diagnosed and scored by the commands that anybody uses.
//!
//! The bounds are those that hold of a large set, less what ten scans scatter by; a cause that is not there must never be
//! named, and nothing may be named where nothing is.

use std::path::Path;
use std::process::{Command, Stdio};

fn blind(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .arg("blind")
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// Count and number of cases of a rate.
fn rate(score: &serde_json::Value, what: &str) -> (u64, u64) {
    let rates = score["rates"].as_array().expect("a list");
    let rate = rates.iter().find(|rate| rate["what"] == what).unwrap_or_else(|| panic!("{what}"));
    (rate["count"].as_u64().expect("a number"), rate["of"].as_u64().expect("a number"))
}

#[test]
fn causes_that_are_sealed_away_are_found_and_none_is_made_up() {
    let home = tempfile::tempdir().expect("a folder");
    let set = home.path().join("set");
    let set_name = set.to_str().expect("text");
    blind(&["make", "--count", "10", "--seed", "7", set_name]);
    blind(&["run", set_name]);
    let score: serde_json::Value =
        serde_json::from_str(&blind(&["score", "--json", set_name])).expect("JSON");
    assert_eq!(score["scored"], 10);

    let (made_up, empty) = rate(&score, "no effect: false alarms");
    assert!(made_up == 0 && empty > 0, "{made_up} of {empty}");
    let (wrong, one) = rate(&score, "one effect, any gap: explained with a wrong cause");
    assert!(wrong == 0 && one >= 4, "{wrong} of {one}");
    let (named, loud) = rate(&score, "one effect, gap >= 0.5 sigma: exactly or among two or three");
    assert_eq!(named, loud);
    let (true_pairs, pairs) = rate(&score, "two effects, where explained: every named one true");
    assert_eq!(true_pairs, pairs);
    let (confident, _) = rate(&score, "outside: named with confidence");
    assert_eq!(confident, 0);
}

#[test]
fn the_thesiss_own_case_is_told_right() {
    let scan = Path::new(env!("CARGO_TARGET_TMPDIR")).join("thesis-case");
    let _ = std::fs::remove_dir_all(&scan);
    let plan = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/thesis-focus.toml");
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
            .args(arguments)
            .stdin(Stdio::null())
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    let scan_name = scan.to_str().expect("text");
    run(&["scan", plan.to_str().expect("text"), "--out", scan_name]);
    let said: serde_json::Value =
        serde_json::from_str(&run(&["diagnose", scan_name, "--json"])).expect("JSON");
    assert_eq!(said["verdict"], "explained");
    let named = said["effects"].as_array().expect("a list");
    // The simulator's own slips first, then the physics that remains.
    assert_eq!(&named[..2], ["phase-plane", "on-axis-unit"], "{named:?}");
    assert!(said["explained_fraction"].as_f64().expect("a number") > 0.99);
}
