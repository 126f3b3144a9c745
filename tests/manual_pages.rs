//! The man pages: one for each command, with its options, and readable by `man`.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

fn fieldgap(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .args(arguments)
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The commands below one command, as its help lists them.
fn subcommands(of: &[&str]) -> Vec<String> {
    let help = fieldgap(&[of, &["--help"]].concat());
    let Some((_, list)) = help.split_once("Commands:\n") else { return Vec::new() };
    list.lines()
        .take_while(|line| !line.is_empty())
        // A description may go on in a further line, which is indented by more.
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}

fn pages(of: &[&str], found: &mut BTreeSet<String>) {
    let name: Vec<&str> = ["fieldgap"].into_iter().chain(of.iter().copied()).collect();
    found.insert(format!("{}.1", name.join("-")));
    for inner in subcommands(of) {
        pages(&[of, &[&inner]].concat(), found);
    }
}

fn manual(folder: &Path) {
    fieldgap(&["manual", folder.to_str().expect("text")]);
}

#[test]
fn each_command_has_a_page() {
    let home = tempfile::tempdir().expect("a folder");
    manual(home.path());
    let mut wanted = BTreeSet::new();
    pages(&[], &mut wanted);
    assert!(wanted.len() > 20, "the help was not understood: {wanted:?}");
    let written: BTreeSet<String> = std::fs::read_dir(home.path().join("man"))
        .expect("the folder")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("text"))
        .collect();
    assert_eq!(written, wanted);
    let page =
        std::fs::read_to_string(home.path().join("man/fieldgap-simulate.1")).expect("a page");
    // The hyphens of options are escaped in roff.
    assert!(page.contains("\\-\\-focus\\-mm"), "{page}");
    for script in ["fieldgap.bash", "_fieldgap", "fieldgap.fish"] {
        let script = home.path().join("completions").join(script);
        assert!(std::fs::read_to_string(&script).expect("a script").contains("simulate"));
    }
}

#[test]
fn man_shows_every_page_without_a_warning() {
    if Command::new("man").arg("--version").output().is_err() {
        eprintln!("skipped: there is no program man");
        return;
    }
    let home = tempfile::tempdir().expect("a folder");
    manual(home.path());
    for entry in std::fs::read_dir(home.path().join("man")).expect("the folder") {
        let page = entry.expect("an entry").path();
        let shown = Command::new("man")
            .args(["--warnings", "-E", "UTF-8", "-l"])
            .arg(&page)
            .env("MANWIDTH", "80")
            .env("MANPAGER", "cat")
            .output()
            .expect("man starts");
        let warnings = String::from_utf8_lossy(&shown.stderr);
        assert!(shown.status.success() && warnings.is_empty(), "{}: {warnings}", page.display());
        let text = String::from_utf8_lossy(&shown.stdout);
        assert!(text.contains("SYNOPSIS") && text.contains("fieldgap"), "{text}");
    }
}
