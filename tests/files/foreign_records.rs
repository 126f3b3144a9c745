//! Records that contradict themselves or lead out of their folder are refused, and nothing is written.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const PLAN: &str = r#"
name = "foreign"
[simulator]
model = "corrected"
[[focus]]
x_mm = 10.0
y_mm = -5.0
z_mm = 100.0
[[plane]]
z_mm = 100.0
size_mm = [22.0, 22.0]
step_mm = 2.0
"#;

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn fieldgap(words: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fieldgap"));
    command.args(words).arg(folder).output().expect("the program runs")
}

/// A record of a scan that is not complete.
fn partial(home: &Path) -> PathBuf {
    let (plan, folder) = (home.join("plan.toml"), home.join("scan"));
    std::fs::write(&plan, PLAN).expect("the plan is written");
    let scanned = Command::new(env!("CARGO_BIN_EXE_fieldgap"))
        .arg("scan")
        .arg(&plan)
        .arg("--rig")
        .arg(here("rigs/virtual.toml"))
        .arg("--out")
        .arg(&folder)
        .output()
        .expect("the scan runs");
    assert!(scanned.status.success(), "{}", String::from_utf8_lossy(&scanned.stderr));
    // As after a kill behind the hundredth point.
    for (file, lines) in [("journal.csv", 101), ("samples.csv", 101)] {
        change(&folder, file, |text| text.split_inclusive('\n').take(lines).collect::<String>());
    }
    change(&folder, "state.toml", |text| text.replace("complete", "scanning"));
    folder
}

fn change(folder: &Path, file: &str, to: impl FnOnce(&str) -> String) {
    let path = folder.join(file);
    let text = std::fs::read_to_string(&path).expect("it is there");
    let changed = to(&text);
    assert_ne!(text, changed);
    std::fs::write(path, changed).expect("written");
}

fn refused(words: &[&str], folder: &Path, said: &[&str]) {
    let ended = fieldgap(words, folder);
    assert_eq!(ended.status.code(), Some(1), "{words:?}");
    let text = String::from_utf8_lossy(&ended.stderr);
    for words in said {
        assert!(text.contains(words), "no `{words}` in {text}");
    }
}

#[test]
fn a_resume_refuses_a_set_up_that_contradicts_the_plan() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = partial(home.path());
    let whole = std::fs::read_to_string(folder.join("scan.toml")).expect("the set-up");
    let samples = std::fs::read(folder.join("samples.csv")).expect("samples");
    let changes = [
        ("x_mm = 10.0", "x_mm = 11.5", "`focus[0].x_mm` is 11.5 and should be 10.0"),
        ("name = \"foreign\"", "name = \"other\"", "`name` is \"other\" and should be \"foreign\""),
        ("model = \"corrected\"", "model = \"piston\"", "`simulator.model` is \"piston\""),
        ("reading = \"V\"", "reading = \"Pa\"", "`reading` is \"Pa\" and should be \"V\""),
    ];
    for (from, to, said) in changes {
        std::fs::write(folder.join("scan.toml"), &whole).expect("written");
        change(&folder, "scan.toml", |text| text.replace(from, to));
        refused(&["resume"], &folder, &["contradicts the plan", said]);
        assert_eq!(std::fs::read(folder.join("samples.csv")).expect("samples"), samples, "{to}");
    }
    std::fs::write(folder.join("scan.toml"), &whole).expect("written");
    let resumed = fieldgap(&["resume"], &folder);
    assert!(resumed.status.success(), "{}", String::from_utf8_lossy(&resumed.stderr));
}

#[test]
fn a_path_or_link_that_leads_out_of_a_record_is_refused() {
    let home = tempfile::tempdir().expect("a folder");
    let folder = partial(home.path());
    let whole = std::fs::read_to_string(folder.join("scan.toml")).expect("the set-up");
    let elements = "x_mm,y_mm,z_mm,nx,ny,nz,radius_mm,amplitude,phase_rad\n0,0,0,0,0,1,5,1,0\n";
    let outside = home.path().join("elements.csv");
    std::fs::write(&outside, elements).expect("written");
    let commands: [&[&str]; 5] =
        [&["compare"], &["replay"], &["diagnose"], &["distinguish"], &["resume"]];
    for path in ["../elements.csv", &outside.to_string_lossy(), "link.csv"] {
        let array =
            format!("[array]\nfrequency_hz = 40000.0\nlayout = \"elements\"\nfile = \"{path}\"\n");
        let (before, after) = whole.split_once("[array]").expect("a section");
        let (_, after) = after.split_once("\n[").expect("a next section");
        std::fs::write(folder.join("scan.toml"), format!("{before}{array}\n[{after}"))
            .expect("written");
        if path == "link.csv" {
            symlink(&outside, folder.join(path)).expect("linked");
        }
        for command in commands {
            refused(command, &folder, &["leads out of the record"]);
        }
    }
    std::fs::remove_file(folder.join("link.csv")).expect("removed");
    std::fs::write(folder.join("scan.toml"), &whole).expect("written");

    // What `resume` and `replay` write must not go elsewhere either.
    for file in ["samples.csv", "environment.csv", "report"] {
        let kept = folder.with_file_name("kept");
        let moved = folder.join(file).exists();
        if moved {
            std::fs::rename(folder.join(file), &kept).expect("moved");
        } else {
            std::fs::write(&kept, "mine\n").expect("written");
        }
        let before = std::fs::read(&kept).expect("readable");
        symlink(&kept, folder.join(file)).expect("linked");
        for command in [&["resume"][..], &["replay"], &["replay", "--wire"]] {
            refused(command, &folder, &["leads out of the record"]);
        }
        assert_eq!(std::fs::read(&kept).expect("readable"), before, "{file}");
        std::fs::remove_file(folder.join(file)).expect("removed");
        if moved {
            std::fs::rename(&kept, folder.join(file)).expect("moved");
        }
    }
    let resumed = fieldgap(&["resume"], &folder);
    assert!(resumed.status.success(), "{}", String::from_utf8_lossy(&resumed.stderr));
}
