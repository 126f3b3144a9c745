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
