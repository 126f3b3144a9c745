//! `fieldgap history` as people and programs use it.

#[path = "../crates/archive/tests/synthetic/mod.rs"]
mod synthetic;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use synthetic::{write_record, write_records};

fn fieldgap(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .args(arguments)
        .current_dir(folder)
        .env("USER", "ada")
        .env("XDG_CACHE_HOME", folder)
        .output()
        .expect("the program starts")
}

fn printed(folder: &Path, arguments: &[&str]) -> String {
    let output = fieldgap(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

fn lab(count: u64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    write_records(&folder.path().join("out"), count);
    folder
}

#[test]
fn conditions_choose_and_the_formats_agree() {
    let lab = lab(40);
    let conditions = ["history", "--gap-above", "15", "--rig", "bench a", "--sort", "gap"];
    let json = printed(lab.path(), &[&conditions[..], &["--format", "json"]].concat());
    let entries: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let gaps: Vec<f64> = entries
        .as_array()
        .expect("a list")
        .iter()
        .map(|entry| {
            assert_eq!(entry["rig"], "bench A");
            entry["gap"]["value"].as_f64().expect("a number")
        })
        .collect();
    assert!(gaps.len() > 3 && gaps[0] > 0.15 && gaps.is_sorted(), "{gaps:?}");
    let csv = printed(lab.path(), &[&conditions[..], &["--format", "csv"]].concat());
    let mut rows = csv.lines();
    let head: Vec<&str> = rows.next().expect("a head").split(',').collect();
    let place = head.iter().position(|name| *name == "gap").expect("a column");
    let in_csv: Vec<f64> = rows
        .map(|row| row.split(',').nth(place).expect("a cell").parse().expect("a number"))
        .collect();
    assert_eq!(in_csv, gaps);
    let text = printed(lab.path(), &conditions);
    assert_eq!(text.lines().count(), gaps.len() + 1);
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
}

#[test]
fn a_wrong_condition_says_what_is_right() {
    let lab = lab(1);
    let refused = |arguments: &[&str]| {
        let output = fieldgap(lab.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        String::from_utf8(output.stderr).expect("text")
    };
    assert!(refused(&["history", "--verdict", "good"]).contains("mostly-explained"));
    assert!(refused(&["history", "--since", "yesterday"]).contains("2026-11-20"));
    assert!(refused(&["history", "--effect", "magic"]).contains("catalogue"));
    assert!(refused(&["history", "--parameter", "a b"]).contains("sound-speed.c_m_s"));
    let output = fieldgap(lab.path(), &["history", "nowhere"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("nowhere"));
}

#[test]
fn a_note_of_a_kind_is_found_and_marked_on_the_page() {
    let lab = lab(12);
    let record = "out/week-000/scan-00003";
    fs::write(lab.path().join(record).join("report/index.html"), "the report").expect("written");
    let kind = ["--kind", "calibration", "--by", "Ada"];
    printed(lab.path(), &[&["note", record, "Calibrated with 114 dB"][..], &kind].concat());
    assert!(
        printed(lab.path(), &["note", record])
            .contains("Ada (calibration): Calibrated with 114 dB")
    );
    let found = printed(lab.path(), &["history", "--noted", "114 db"]);
    assert!(found.contains("scan-00003") && found.lines().count() == 2, "{found}");

    printed(
        lab.path(),
        &["history", "--page", "pages/trend.html", "--parameter", "z100.focus0.gap"],
    );
    let page = fs::read_to_string(lab.path().join("pages/trend.html")).expect("a page");
    assert!(page.contains("href=\"../out/week-000/scan-00003/report/index.html\""), "no link");
    assert!(page.contains("Calibrated with 114 dB") && !page.contains("<script"));
    for picture in ["gap", "correlation", "level", "air.temperature_c", "z100.focus0.gap"] {
        let file = |end: &str| lab.path().join(format!("pages/trend-{picture}.{end}"));
        assert!(fs::read(file("png")).expect("a picture").starts_with(b"\x89PNG"));
        assert!(fs::read_to_string(file("svg")).expect("a picture").contains("<svg"));
    }
    printed(lab.path(), &["history", "--page", "pages/folder", "--limit", "0"]);
    let empty = fs::read_to_string(lab.path().join("pages/folder/index.html")).expect("a page");
    assert!(empty.contains("nothing to draw"));
}

/// Records that were never compared are compared, and keep their figures.
#[test]
fn records_that_were_never_compared_are_compared() {
    let lab = tempfile::tempdir().expect("a folder");
    let never = (0..100).find(|number| {
        let record = lab.path().join(format!("out/{number}"));
        write_record(&record, *number);
        !record.join("report/figures.json").exists()
    });
    let figures = lab.path().join(format!("out/{}/report/figures.json", never.expect("one")));
    let before = printed(lab.path(), &["history"]);
    assert!(before.contains("not compared"), "{before}");
    let after = printed(lab.path(), &["history", "--compare"]);
    assert!(figures.is_file() && !after.contains("not compared"), "{after}");
}
