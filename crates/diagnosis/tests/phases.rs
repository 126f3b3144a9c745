//! The phases of a diagnosis depend one way, as the crate page says, and no two modules depend on each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The rooms and single files of the crate; each uses only those before it.
const ORDER: [&str; 22] = [
    "effect_id",
    "fitted_parameter",
    "remedy",
    "result",
    "decisive_limit",
    "limits",
    "statistics",
    "model",
    "effects",
    "preparation",
    "noise",
    "fit",
    "selection",
    "joint",
    "residual_structure",
    "verdict",
    "elements_account",
    "advice",
    "report",
    "text",
    "diagnose",
    "change",
];

/// Modules by their path, such as `model::receiver`, each with the paths that its product code names after `crate::`.
fn modules() -> BTreeMap<String, BTreeSet<String>> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut modules = BTreeMap::new();
    let mut folders = vec![src.clone()];
    while let Some(folder) = folders.pop() {
        for entry in folder.read_dir().expect("a folder of sources") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                modules.insert(name(&src, &path), named_in(&path));
            }
        }
    }
    modules
}

fn name(src: &Path, path: &Path) -> String {
    let relative: PathBuf = path.strip_prefix(src).expect("below src").with_extension("");
    let parts: Vec<_> = relative.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("::").trim_end_matches("::mod").to_owned()
}

fn named_in(path: &Path) -> BTreeSet<String> {
    let text = std::fs::read_to_string(path).expect("a source");
    let product = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let code = product.lines().filter(|line| !line.trim_start().starts_with("//"));
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == ':';
    let mut named = BTreeSet::new();
    for line in code {
        for after in line.split("crate::").skip(1) {
            let path: String = after.chars().take_while(|c| is_name(*c)).collect();
            let parts = path.split("::").take_while(|part| part.starts_with(char::is_lowercase));
            named.insert(parts.take(2).collect::<Vec<_>>().join("::"));
        }
    }
    named
}

/// The crate page, and the tests' own modules, which may use everything.
fn is_apart(module: &str) -> bool {
    ["lib", "effects::testing", "effects::independent_physics"].contains(&module)
}

#[test]
fn every_phase_uses_only_phases_before_it() {
    let place = |room: &str| ORDER.iter().position(|known| *known == room);
    for (module, named) in modules().iter().filter(|(module, _)| !is_apart(module)) {
        let room = module.split("::").next().unwrap_or_default();
        let own = place(room).unwrap_or_else(|| panic!("{module} is in no room of the order"));
        for used in named.iter().filter(|used| !used.is_empty()) {
            let used_room = used.split("::").next().unwrap_or_default();
            let before = place(used_room).is_some_and(|used| used <= own);
            assert!(before, "{module} uses {used}, which comes after it");
        }
    }
}

#[test]
fn no_modules_depend_on_each_other_in_a_circle() {
    let modules = modules();
    let is_circular = |start: &str| {
        let mut reached: BTreeSet<&str> = BTreeSet::new();
        let mut open = vec![start];
        while let Some(module) = open.pop() {
            for used in modules.get(module).into_iter().flatten() {
                if used != module && modules.contains_key(used) && reached.insert(used) {
                    open.push(used);
                }
            }
        }
        reached.contains(start)
    };
    let circular: Vec<&String> =
        modules.keys().filter(|module| !is_apart(module) && is_circular(module)).collect();
    assert!(circular.is_empty(), "{circular:?}");
    assert!(modules.len() > 60, "the sources were found");
}
