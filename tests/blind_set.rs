//! Blind sets on the command line: made, sealed, opened; refused after any change.

use std::path::Path;
use std::process::{Command, Stdio};

/// Runs `fieldgap blind`; returns success, standard output and standard error.
fn blind(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .arg("blind")
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.success(), text(output.stdout), text(output.stderr))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).expect("there")
}

#[test]
fn a_set_is_made_scored_and_refused_after_a_change() {
    let home = tempfile::tempdir().expect("a folder");
    let (set, key) = (home.path().join("set"), home.path().join("elsewhere.key"));
    let (set_name, key_name) = (set.to_str().expect("text"), key.to_str().expect("text"));
    let make = ["make", "--count", "1", "--none", "1", "--pairs", "0", "--outside", "0"];
    let (good, said, error) = blind(&[&make[..], &["--key", key_name, set_name]].concat());
    assert!(good, "{error}");
    let commitment = said.trim().strip_prefix("commitment ").expect("it is printed");
    assert!(key.exists() && !set.join("answers.key").exists());

    let (good, _, error) = blind(&["open", set_name]);
    assert!(!good && error.contains("answers.key"), "{error}");

    let held = ["--key", key_name, "--commitment", commitment];
    let (_, _, error) = blind(&[&["score", set_name], &held[..]].concat());
    assert!(error.contains("holds no diagnosis"), "{error}");
    std::fs::create_dir(set.join("diagnoses")).expect("made");
    std::fs::write(set.join("diagnoses/0000.json"), r#"{"verdict":"none"}"#).expect("written");
    let (good, said, error) = blind(&[&["score", set_name], &held[..]].concat());
    assert!(good && said.contains("no effect: false alarms"), "{said}{error}");

    let samples = set.join("0000/samples.csv");
    let changed = read(&samples).replacen("0,-35.0,-35.0", "0,-35.0,-35.5", 1);
    std::fs::write(&samples, changed).expect("written");
    let (good, said, error) = blind(&[&["score", set_name], &held[..]].concat());
    assert!(!good && said.is_empty(), "{said}");
    assert!(error.contains("0000/samples.csv is not as it was"), "{error}");

    // A second set in the same folder is refused.
    let (good, _, error) = blind(&["make", "--count", "1", set_name]);
    assert!(!good && error.contains("is not empty"), "{error}");
}

/// A scan of another program, and answers that are not its own.
#[test]
fn answers_of_another_program_are_sealed_and_wrong_ones_refused() {
    let home = tempfile::tempdir().expect("a folder");
    let (set, file) = (home.path().join("set"), home.path().join("answers.json"));
    let (set_name, file_name) = (set.to_str().expect("text"), file.to_str().expect("text"));
    std::fs::create_dir_all(set.join("a")).expect("made");
    std::fs::write(set.join("a/scan.toml"), "format = 1\n").expect("written");
    let seal = |name: &str, category: &str, effects: &str, gaps: &str| {
        let answers = format!(
            r#"{{"format":1,"seed":7,"answers":[{{"name":"{name}","category":"{category}","effects":{effects},"parameters":{{}},
            "gap_sigma":2.0,"gaps_alone_sigma":{gaps},"elements":null,"noise":[0.02,0.004],"peak_v":1.0}}]}}"#
        );
        std::fs::write(&file, answers).expect("written");
        blind(&["seal", set_name, file_name])
    };
    for (name, category, effects, gaps, said) in [
        ("b", "one", r#"["pitch"]"#, "[2.0]", "b: there is no such scan"),
        ("../a", "one", r#"["pitch"]"#, "[2.0]", "no name of a folder"),
        ("a", "two", r#"["pitch"]"#, "[2.0]", "1 effects do not fit"),
        ("a", "one", r#"["gremlins"]"#, "[2.0]", "`gremlins` is no effect"),
        ("a", "one", r#"["pitch"]"#, "[]", "0 numbers for 1 effects"),
        ("a", "whole-bench", r#"["pitch","skew","lag","flow"]"#, "[]", "`dominant` names none"),
    ] {
        let (good, _, error) = seal(name, category, effects, gaps);
        assert!(!good && error.contains(said), "{error}");
        assert!(!set.join("answers.sealed").exists());
    }
    std::fs::create_dir(set.join("b")).expect("made");
    std::fs::write(set.join("b/scan.toml"), "format = 1\n").expect("written");
    let (good, _, error) = seal("a", "one", r#"["pitch"]"#, "[2.0]");
    assert!(!good && error.contains("b has no answer"), "{error}");
    std::fs::remove_dir_all(set.join("b")).expect("removed");

    let (good, said, error) = seal("a", "one", r#"["pitch"]"#, "[2.0]");
    assert!(good && said.starts_with("commitment "), "{error}");
    let (good, said, error) = blind(&["open", set_name]);
    assert!(good && said.contains("\"pitch\""), "{error}");
    let (good, _, error) = seal("a", "one", r#"["pitch"]"#, "[2.0]");
    assert!(!good && error.contains("answers.sealed exists already"), "{error}");
}

/// Diagnoses that are there from a run that was stopped are kept; the others are made.
#[test]
fn limits_are_halved_and_doubled() {
    let home = tempfile::tempdir().expect("a folder");
    let set = home.path().join("set");
    let name = set.to_str().expect("text");
    let shares = ["--seed", "3", "--none", "1", "--pairs", "0", "--outside", "0"];
    let (good, _, error) = blind(&[&["make", "--count", "1"][..], &shares, &[name]].concat());
    assert!(good, "{error}");
    for (folder, verdict) in [("as-it-is", "none"), ("pattern-limit-halved", "unexplained")] {
        let folder = set.join("varied").join(folder);
        std::fs::create_dir_all(&folder).expect("made");
        let diagnosis = format!(r#"{{"verdict":"{verdict}"}}"#);
        std::fs::write(folder.join("0000.json"), diagnosis).expect("written");
    }
    let (good, said, error) = blind(&["vary", name, "--limits", "pattern-limit"]);
    assert!(good, "{error}");
    let made = read(&set.join("varied/pattern-limit-doubled/0000.json"));
    assert!(made.contains(r#""verdict":"none""#), "{made}");
    insta::assert_snapshot!(said, @"
    1 scans, with every limit as it is:

      A  no effect: false alarms                                                0 of 1

    limit                          usual        varied  changed        A
    pattern-limit                   4.00          2.00        1       +1
    pattern-limit                   4.00          8.00        0        0

    changed: scans with another verdict, or for which other causes are named. Under each letter: by how many scans its count moves,
    or the new count where it is of another number of scans.
    ");

    let (good, _, error) = blind(&["vary", name, "--limits", "patience"]);
    assert!(
        !good && error.contains("no limit of the diagnosis has the name `patience`"),
        "{error}"
    );
}
