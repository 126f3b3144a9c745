//! The crate dependencies are those of ARCHITECTURE.md, in one direction.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

type Dependencies = BTreeMap<String, BTreeSet<String>>;

/// Dependencies between the library crates, from the manifests.
fn in_manifests() -> Dependencies {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let library = packages.iter().filter_map(|package| {
        let name = package["name"].as_str()?.strip_prefix("fieldgap-")?;
        let dependencies = package["dependencies"].as_array()?.iter();
        let own = dependencies
            .filter(|dependency| dependency["kind"].is_null())
            .filter_map(|dependency| dependency["name"].as_str()?.strip_prefix("fieldgap-"))
            .map(str::to_owned);
        (!["benches", "fuzz"].contains(&name)).then(|| (name.to_owned(), own.collect()))
    });
    library.collect()
}

/// The rows of the table in ARCHITECTURE.md, in its order.
fn in_document() -> Vec<(String, BTreeSet<String>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md");
    let text = std::fs::read_to_string(path).expect("it is there");
    let table = text.lines().skip_while(|line| !line.starts_with("| crate |")).skip(2);
    table
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let [name, _, dependencies] = cells[..] else { panic!("three columns: {line}") };
            let names = dependencies.split(", ").filter(|name| *name != "-").map(str::to_owned);
            (name.to_owned(), names.collect())
        })
        .collect()
}

#[test]
fn the_document_lists_the_dependencies_of_each_crate() {
    let documented: Dependencies = in_document().into_iter().collect();
    assert_eq!(documented, in_manifests());
}

#[test]
fn a_crate_depends_only_on_crates_above_it_in_the_table() {
    let mut above = BTreeSet::new();
    for (name, dependencies) in in_document() {
        let below: Vec<_> = dependencies.difference(&above).collect();
        assert!(below.is_empty(), "{name} depends on {below:?}, which are below it");
        above.insert(name);
    }
    assert!(above.len() > 10, "the table was read");
}

/// What each module at the top of a crate uses of the others at its top. Tests are left out.
fn uses_within(source: &Path) -> Dependencies {
    let mut uses = Dependencies::new();
    for file in rust_files(source) {
        let relative = file.strip_prefix(source).expect("below the source");
        let parts: Vec<String> =
            relative.with_extension("").iter().map(|part| part.to_string_lossy().into()).collect();
        let [top, inner @ ..] = &parts[..] else { continue };
        if ["lib", "main"].contains(&top.as_str()) || parts.iter().any(|part| part.contains("test"))
        {
            continue;
        }
        // `super` as often as leads from this file to the top of the crate.
        let depth = inner.iter().filter(|part| *part != "mod").count();
        let to_the_top = format!(" {}::", "::super".repeat(depth + 1));
        let text = std::fs::read_to_string(&file).expect("it is there");
        let text = text.split("#[cfg(test)]").next().expect("a first part");
        let used = uses.entry(top.clone()).or_default();
        for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
            let paths = line.replace([' ', '(', '<', '{', '&', '!'], " ::");
            for start in [" ::crate::", &to_the_top] {
                used.extend(paths.split(start).skip(1).map(|rest| {
                    rest.chars()
                        .take_while(|letter| letter.is_alphanumeric() || *letter == '_')
                        .collect()
                }));
            }
        }
        used.remove(top);
    }
    let tops: BTreeSet<String> = uses.keys().cloned().collect();
    uses.values_mut().for_each(|used| used.retain(|name| tops.contains(name)));
    uses
}

/// All Rust files below a folder.
fn rust_files(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("it is there").path());
    let mut files = Vec::new();
    for entry in entries {
        if entry.is_dir() {
            files.extend(rust_files(&entry));
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            files.push(entry);
        }
    }
    files
}

/// Takes away what uses nothing that is left, again and again: what remains is a circle, or leads to one.
fn circle(mut uses: Dependencies) -> Dependencies {
    loop {
        let left: BTreeSet<String> = uses.keys().cloned().collect();
        uses.values_mut().for_each(|used| used.retain(|name| left.contains(name)));
        let count = uses.len();
        uses.retain(|_, used| !used.is_empty());
        if uses.len() == count {
            return uses;
        }
    }
}

#[test]
fn no_modules_of_a_crate_use_each_other_in_a_circle() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = std::fs::read_dir(root.join("crates")).expect("a folder");
    let mut checked = 0;
    for folder in crates.map(|entry| entry.expect("it is there").path()) {
        let uses = uses_within(&folder.join("src"));
        checked += uses.values().map(BTreeSet::len).sum::<usize>();
        let circle = circle(uses);
        assert!(circle.is_empty(), "{}: {circle:?}", folder.display());
    }
    assert!(checked > 200, "uses were read: {checked}");
}

#[test]
fn a_circle_is_found() {
    let uses = [("a", vec!["b"]), ("b", vec!["c"]), ("c", vec!["b"]), ("d", vec![])];
    let uses =
        uses.map(|(name, used)| (name.into(), used.into_iter().map(str::to_owned).collect()));
    assert_eq!(circle(Dependencies::from(uses)).keys().collect::<Vec<_>>(), ["a", "b", "c"]);
}
