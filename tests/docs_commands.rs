//! The commands of the documentation run as documented.

mod page_commands;
mod program;

use std::path::{Path, PathBuf};
use std::process::Output;

use page_commands::{Step, What, steps};
use program::fieldgap;

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Copies a folder recursively, without pictures.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let target = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy(&path, &target);
        } else if path.extension().is_none_or(|ending| ending != "png") {
            std::fs::copy(&path, &target).expect("a copy");
        }
    }
}

/// Runs the steps of a page in order, in a folder with copies of `scans` and `rigs`.
fn follow(page: &str) {
    let markdown = std::fs::read_to_string(repository().join(page)).expect("a page");
    let folder = tempfile::tempdir().expect("a folder");
    for inputs in ["scans", "rigs"] {
        copy(&repository().join(inputs), &folder.path().join(inputs));
    }
    for step in steps(&markdown) {
        if let Err(why) = take(&step.what, folder.path()) {
            panic!("{page}:{}: {:?}\n{why}", step.line, step.what);
        }
    }
}

fn take(what: &What, folder: &Path) -> Result<(), String> {
    let exists = |paths: &[PathBuf]| match paths.iter().any(|path| repository().join(path).exists())
    {
        true => Ok(()),
        false => Err(format!("none of {paths:?} exists")),
    };
    match what {
        What::Run(arguments) => succeeded(fieldgap(folder, arguments)),
        What::Parse(arguments) => parses(arguments),
        What::File { path, text } => {
            std::fs::write(folder.join(path), text).map_err(|error| error.to_string())
        }
        What::Test(name) => {
            exists(&[format!("tests/{name}.rs").into(), format!("tests/{name}/main.rs").into()])
        }
        What::Bench(name) => {
            exists(&[format!("benches/{name}.rs").into(), format!("benches/{name}/main.rs").into()])
        }
    }
}

/// Checks that the command and its options exist and that values are valid: all are parsed before `--help`.
fn parses(arguments: &[String]) -> Result<(), String> {
    let arguments = [arguments, &["--help".to_owned()]].concat();
    succeeded(fieldgap(repository(), &arguments))
}

fn succeeded(output: Output) -> Result<(), String> {
    match output.status.success() {
        true => Ok(()),
        false => Err(format!("{}: {}", output.status, String::from_utf8_lossy(&output.stderr))),
    }
}

macro_rules! pages {
    ($($name:ident: $page:literal,)*) => {
        const PAGES: &[&str] = &[$($page),*];
        $(#[test] fn $name() { follow($page) })*
    };
}

pages! {
    readme: "README.md",
    architecture: "ARCHITECTURE.md",
    contributing: "CONTRIBUTING.md",
    contents: "docs/README.md",
    adaptive_maps: "docs/adaptive-maps.md",
    blind_sets: "docs/blind-sets.md",
    calibration: "docs/calibration.md",
    campaign_page: "docs/campaign-page.md",
    campaigns: "docs/campaigns.md",
    closed_loop: "docs/closed-loop.md",
    comparing: "docs/comparing.md",
    devices: "docs/devices.md",
    diagnosing: "docs/diagnosing.md",
    displays: "docs/displays.md",
    exchange: "docs/exchange.md",
    first_scan: "docs/first-scan.md",
    gallery: "docs/gallery.md",
    history: "docs/history.md",
    levels: "docs/levels.md",
    many_computers: "docs/many-computers.md",
    monitoring: "docs/monitoring.md",
    own_rig: "docs/own-rig.md",
    performance: "docs/performance.md",
    phase: "docs/phase.md",
    plans: "docs/plans.md",
    python: "docs/python.md",
    records: "docs/records.md",
    releasing: "docs/releasing.md",
    reliability: "docs/reliability.md",
    sensing: "docs/sensing.md",
    serve: "docs/serve.md",
    studies: "docs/studies.md",
    summary: "docs/SUMMARY.md",
    tutorials: "docs/tutorials.md",
    figures_of_the_thesis: "src/thesis.md",
    transducer_models: "src/transducer_models.md",
}

#[test]
fn the_commands_of_every_page_run() {
    for entry in std::fs::read_dir(repository().join("docs")).expect("a folder") {
        let page = format!("docs/{}", entry.expect("an entry").file_name().to_string_lossy());
        assert!(page == "docs/pictures" || PAGES.contains(&page.as_str()), "{page}");
    }
}

#[test]
fn unknown_commands_and_options_are_detected() {
    let folder = tempfile::tempdir().expect("a folder");
    let step = |command: &str| steps(&format!("```sh pattern\n{command}\n```"));
    for wrong in [
        "fieldgap no-such-command",
        "fieldgap run PLAN --no-such-option",
        "fieldgap simulate --rig RIG --focus-mm here",
        "cargo test --release --test no_such_test",
        "cargo bench --bench no_such_bench",
    ] {
        let [Step { what, .. }] = &step(wrong)[..] else { panic!("one step: {wrong}") };
        assert!(take(what, folder.path()).is_err(), "{wrong}");
    }
}

#[test]
fn steps_are_located_in_their_page() {
    let page = "\
`fieldgap run PLAN` and `run`

```sh
fieldgap scan plan.toml   # a remark
```
<!-- run: fieldgap import --help -->

| command | what it does |
|---|---|
| `rig home\\|stop RIG` | `never` |
| `fieldgap scan PLAN` | with `--dry-run` |
";
    let arguments = |words: &str| words.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let expected = [
        (1, What::Parse(arguments("run PLAN"))),
        (4, What::Run(arguments("scan plan.toml"))),
        (6, What::Run(arguments("import --help"))),
        (10, What::Parse(arguments("rig home RIG"))),
        (10, What::Parse(arguments("rig stop RIG"))),
        (11, What::Parse(arguments("scan PLAN"))),
        (11, What::Parse(arguments("scan PLAN --dry-run"))),
    ];
    assert_eq!(steps(page), expected.map(|(line, what)| Step { line, what }));
}
