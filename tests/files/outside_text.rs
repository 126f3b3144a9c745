//! Text from files and devices on the terminal: its control characters are visible. A reader that leaves, and a fault of the program
//! itself, end in an exit code and no crash.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use crate::small_record::{HEADER, SETUP};

/// Clears the screen; sets the title; the same in one character; reverses what follows; begins a line of its own.
const HOSTILE: [&str; 5] = ["\x1b[2J", "\x1b]0;title\x07", "\u{9b}2J", "\u{202e}", "\x0d"];

const PLAN: &str = r#"name = "plain"
[simulator]
model = "corrected"
[[focus]]
x_mm = 0.0
y_mm = 0.0
z_mm = 100.0
[[plane]]
z_mm = 100.0
size_mm = [10.0, 10.0]
step_mm = 2.0
"#;

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_fieldgap"))
}

fn run(arguments: &[&str]) -> Output {
    program().args(arguments).stdin(Stdio::null()).output().expect("the program starts")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// Both outputs of a command, which must have nothing that a terminal would obey.
fn harmless(arguments: &[&str]) {
    let output = run(arguments);
    let both = [output.stdout, output.stderr].concat();
    let both = String::from_utf8(both).expect("text");
    let obeyed = |c: char| (c.is_control() && c != '\n' && c != '\t') || c == '\u{202e}';
    assert!(!both.chars().any(obeyed), "{arguments:?}: {both:?}");
    assert!(output.status.code().is_some_and(|code| code < 4), "{arguments:?}: {both}");
}

/// Text as a string of TOML.
fn quoted(text: &str) -> String {
    let escaped = text.chars().map(|c| format!("\\u{:04x}", u32::from(c)));
    format!("\"{}\"", escaped.collect::<String>())
}

fn written(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("written");
    path
}

fn record(folder: &Path, setup: &str, header: &str, rows: &str) {
    written(folder, "scan.toml", setup);
    written(folder, "samples.csv", &format!("{header}\n{rows}"));
}

fn rows() -> String {
    (0..49)
        .map(|n| {
            let (x, y) = (n % 7 * 3, n / 7 * 3);
            format!("{n},0,{x},{y},100,{}\n", 1.0 / (1 + x * x + y * y) as f64)
        })
        .collect()
}

#[test]
fn names_and_keys_of_plans_and_rigs_are_harmless() {
    let home = tempfile::tempdir().expect("a folder");
    for hostile in HOSTILE {
        let name = quoted(&format!("a{hostile}b"));
        for plan in [
            PLAN.replace("\"plain\"", &name),
            format!("{name} = 1\n{PLAN}"),
            format!("rig = {name}\n{PLAN}"),
            format!("{PLAN}unknown = \"{hostile}\" # {hostile}\n"),
        ] {
            let path = written(home.path(), "plan.toml", &plan);

            harmless(&["scan", text(&path), "--rig", "rigs/virtual.toml", "--dry-run"]);
        }
        let rig = std::fs::read_to_string("rigs/virtual.toml").expect("there");
        let rig = rig.replace("truth/", &format!("{}/rigs/truth/", env!("CARGO_MANIFEST_DIR")));
        for (from, to) in [
            ("name = \"virtual\"", format!("name = {name}")),
            ("\"array and its frame\"", name.clone()),
            ("settle_ms", format!("{name} = 1\nsettle_ms")),
        ] {
            let path = written(home.path(), "rig.toml", &rig.replace(from, &to));
            harmless(&["rig", "where", text(&path)]);
        }
    }
}

#[test]
fn names_and_cells_of_records_are_harmless() {
    for hostile in HOSTILE {
        let named = SETUP.replace("\"small\"", &quoted(&format!("a{hostile}b")));
        let unit = SETUP.replace("\"V\"", &quoted(&format!("V{hostile}")));
        for (setup, header, rows) in [
            (named.as_str(), HEADER.to_owned(), rows()),
            (unit.as_str(), HEADER.to_owned(), rows()),
            (SETUP, format!("{HEADER}{hostile}"), rows()),
            (SETUP, HEADER.to_owned(), format!("0,0,0,0,{hostile},1\n")),
        ] {
            let home = tempfile::tempdir().expect("a folder");
            record(home.path(), setup, &header, &rows);
            for command in ["compare", "replay", "distinguish"] {
                harmless(&[command, text(home.path())]);
            }
            harmless(&["compare", "--json", text(home.path())]);
            harmless(&["compare", "--format", "csv", text(home.path())]);
        }
    }
}

#[test]
fn an_answer_of_a_device_is_harmless() {
    let home = tempfile::tempdir().expect("a folder");
    record(home.path(), SETUP, HEADER, &rows());
    std::fs::copy("rigs/virtual.toml", home.path().join("rig.toml")).expect("copied");
    let wire = home.path().join("wire");
    std::fs::create_dir(&wire).expect("a folder");
    for hostile in HOSTILE {
        let log = format!(
            "0.1 @ mem{hostile} 2026-01-01T00:00:00Z 1\n0.2 < start {hostile}\\n\n0.3 < error {hostile}\\n\n0.4 = \"home\"\n0.5 : ok {hostile}\n"
        );
        written(&wire, "robot.log", &log);
        harmless(&["replay", "--wire", text(home.path())]);
    }
}

#[test]
fn a_path_of_the_command_line_is_harmless() {
    for hostile in HOSTILE {
        harmless(&["scan", &format!("no{hostile}.toml")]);
        harmless(&["replay", &format!("no{hostile}")]);
        harmless(&["rig", "where", &format!("no{hostile}.toml")]);
    }
}

#[test]
fn a_reader_that_leaves_is_no_crash() {
    let home = tempfile::tempdir().expect("a folder");
    record(home.path(), SETUP, HEADER, &rows());
    let folder = text(home.path());
    for arguments in [
        &["compare", folder][..],
        &["compare", folder, "--json"],
        &["replay", folder],
        &["distinguish", folder],
        &["completions", "bash"],
        &["--help"],
        &["study", "shape", "--show"],
        &["scan", "no-such-plan.toml"],
    ] {
        let (gone, end) = rustix::pipe::pipe().expect("a pipe");
        drop(gone);
        let other = end.try_clone().expect("the same pipe");
        let status = program().args(arguments).stdout(end).stderr(other).status();
        let code = status.expect("the program starts").code();
        assert!(matches!(code, Some(0 | 1)), "{arguments:?}: {code:?}");
    }
}
