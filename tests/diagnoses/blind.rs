//! Diagnoses of a small blind set: made, diagnosed and scored by the commands.
//!
//! The limits are those of a large set, less the scatter of few scans.

use std::path::Path;
use std::process::{Command, Stdio};

use fieldgap_text::percent;

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

/// Target of a rate.
enum Target {
    AtLeast(f64),
    AtMost(f64),
}

/// Compares a rate with its target, less two standard errors.
fn meets(score: &serde_json::Value, what: &str, target: Target) {
    let rates = score["rates"].as_array().expect("a list");
    let rate = rates.iter().find(|rate| rate["what"] == what).unwrap_or_else(|| panic!("{what}"));
    let [count, of] = ["count", "of"].map(|key| rate[key].as_u64().expect("a number") as f64);
    assert!(of > 0.0, "{what}: no case of it");
    let scatter = |share: f64| 2.0 * (share * (1.0 - share) / of).sqrt();
    let met = match target {
        Target::AtLeast(share) => count / of >= share - scatter(share),
        Target::AtMost(share) => count / of <= share + scatter(share),
    };
    assert!(met, "{what}: {count} of {of}");
}

#[test]
fn sealed_causes_are_found_without_false_alarms() {
    sealed_causes_are_found(8);
}

#[test]
#[ignore = "takes minutes"]
fn more_sealed_causes_are_found_without_false_alarms() {
    sealed_causes_are_found(48);
}

fn sealed_causes_are_found(count: u64) {
    let home = tempfile::tempdir().expect("a folder");
    let set = home.path().join("set");
    let set_name = set.to_str().expect("text");
    blind(&["make", "--count", &count.to_string(), "--seed", "7", set_name]);
    blind(&["run", set_name]);
    let score: serde_json::Value =
        serde_json::from_str(&blind(&["score", "--json", set_name])).expect("JSON");
    assert_eq!(score["scored"], count);

    let loud = |what: &str| format!("one effect, gap >= 0.5 sigma: {what}");
    meets(&score, &loud("named exactly"), Target::AtLeast(0.95));
    meets(&score, &loud("exactly or among two or three"), Target::AtLeast(0.98));
    let wrong = "one effect, any gap: explained with a wrong cause";
    meets(&score, wrong, Target::AtMost(0.01));
    meets(&score, "no effect: false alarms", Target::AtMost(0.01));
    meets(&score, "two effects: both exactly", Target::AtLeast(0.8));
    let named = "two effects, where explained: every named one true";
    meets(&score, named, Target::AtLeast(0.95));
    meets(&score, "outside: unexplained", Target::AtLeast(0.85));
    meets(&score, "outside: named with confidence", Target::AtMost(0.1));
    meets(&score, "parameters within two standard errors", Target::AtLeast(0.9));
}

#[test]
fn the_case_of_the_thesis_is_diagnosed_correctly() {
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
    // A gap a hundred times the noise shows that no formula for the field is exact. That share is not called noise.
    assert_eq!(said["verdict"], "mostly-explained");
    let (rest, sentence) = (&said["remainder"], said["sentence"].as_str().expect("a sentence"));
    let left = rest["gap"].as_f64().expect("a number");
    assert!((1e-3..1e-2).contains(&left) && sentence.contains(&percent(left)), "{sentence}");
    assert!(rest["share"].as_f64().expect("a number") < 3e-3, "{rest}");
    assert!(!rest["looks_like"].as_array().expect("a list").is_empty(), "{rest}");
    let named = said["effects"].as_array().expect("a list");
    // First the bugs of the simulator, then the remaining physics.
    assert_eq!(&named[..2], ["phase-plane", "on-axis-unit"], "{named:?}");
    assert!(said["explained_fraction"].as_f64().expect("a number") > 0.99);
}
