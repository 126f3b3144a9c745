//! Every missing and unknown key is told, with table, unit and an example that the parser accepts.

use std::path::Path;

use miette::Diagnostic;
use serde::Deserialize;
use toml::Spanned;

use crate::{Fault, Length, SoundSpeed, toml_text};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct Rig {
    name: String,
    array: Spanned<Array>,
    medium: Medium,
    #[serde(default)]
    plane: Vec<Plane>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct Array {
    columns: u32,
    pitch_mm: Length,
    kind: Kind,
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Dense,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct Medium {
    speed_of_sound_m_s: SoundSpeed,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
struct Plane {
    size_mm: [Length; 2],
    z_mm: Length,
}

fn refused(text: &str) -> Fault {
    toml_text::<Rig>(Path::new("rig.toml"), text).expect_err("keys are missing")
}

fn help(fault: &Fault) -> String {
    fault.help().expect("a remedy").to_string()
}

const TWO_TABLES: &str = "name = \"a\"\n[array]\ncolumns = 3\n[medium]\n[[plane]]\nz_mm = 50.0\n";

#[test]
fn keys_missing_in_several_tables_are_told_at_once() {
    let fault = refused(TWO_TABLES);
    assert_eq!(
        fault.problem(),
        "4 keys are missing: `pitch_mm` (mm) in [array], `kind` in [array], \
         `speed_of_sound_m_s` (m/s) in [medium], `size_mm` (mm) in [plane]"
    );
    assert_eq!(fault.line_column().map(|at| at.0), Some(2), "the line of the first table");
    assert_eq!(
        help(&fault),
        "add what is missing, with your values:\n\
         [array]  # is there, line 2\npitch_mm = 1.0  # mm\nkind = \"dense\"\n\
         [medium]  # is there, line 4\nspeed_of_sound_m_s = 343.0  # m/s\n\
         [plane]  # is there, line 5\nsize_mm = [100.0, 100.0]  # mm"
    );
}

#[test]
fn the_example_of_a_file_without_any_key_is_a_valid_file() {
    let help = help(&refused(""));
    let (_, example) = help.split_once('\n').expect("lines");
    let rig = toml_text::<Rig>(Path::new("rig.toml"), example).expect("valid");
    assert_eq!(rig.array.get_ref().columns, 6);
}

#[test]
fn unknown_keys_are_told_with_the_missing_ones() {
    let fault = refused(
        "name = \"a\"\nnaem = 1\n[array]\ncolums = 3\nkind = \"dense\"\n[medium]\nspeed_of_sound_m_s = 343\n",
    );
    let problem = fault.problem();
    for words in [
        "unknown field `naem`",
        "(line 2)",
        "unknown field `colums`",
        "(line 4)",
        "2 keys are missing: `columns` in [array], `pitch_mm` (mm) in [array]",
    ] {
        assert!(problem.contains(words), "no {words} in {problem}");
    }
}

#[test]
fn a_wrong_value_after_a_missing_key_is_told_too() {
    let fault = refused(
        "name = \"a\"\n[array]\ncolumns = 3\nkind = \"dense\"\n[medium]\nspeed_of_sound_m_s = 343000\n",
    );
    let problem = fault.problem();
    assert!(problem.contains("343000") && problem.contains("(line 6)"), "{problem}");
    assert!(problem.contains("`pitch_mm` (mm) in [array]"), "{problem}");
}

#[test]
fn a_single_wrong_value_is_told_as_before() {
    let fault = refused("name = 3\n");
    assert_eq!(fault.line_column(), Some((1, 8)));
}

proptest::proptest! {
    #[test]
    fn any_text_ends(text in "(name = 1\n|\\[array\\]\n|\\[\\[plane\\]\\]\n|columns = 1\n|x = \\{y=[1,\\{\\}]\\}\n|medium = [0-9]\n){0,6}") {
        let _ = toml_text::<Rig>(Path::new("rig.toml"), &text);
    }
}
