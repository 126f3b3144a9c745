//! A virtual rig with a dead element, which no simulation knows.

use std::path::Path;
use std::process::Output;

/// An element is dead, which is no gap of the usual simulator.
const TRUTH: &str = "[source]\npressure_pa_at_1_m = 4.0\n[microphone]\nsensitivity_v_pa = 0.003\n\
                     [noise]\nmultiplicative = 0.04\nadditive_v = 0.01\n[effects.dead-elements]\nelements = [14]\n";

/// All that a program said.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout)
}

/// A folder with the rig, and a plan for it.
pub fn bench(plan: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
    let rig = std::fs::read_to_string(rigs.join("virtual.toml")).expect("the rig file");
    let rig = rig.replace("truth/thesis-lab.toml", "truth.toml");
    // The steps of the usual controller are a gap of their own.
    let rig =
        rig.replace("[virtual.robot]", "[virtual.array]\nperiod_steps = 8192\n\n[virtual.robot]");
    for (name, text) in [("rig.toml", rig.as_str()), ("truth.toml", TRUTH), ("plan.toml", plan)] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    folder
}

/// Copies the files of a folder into another, which may be new.
pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder").flatten() {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), to.join(entry.file_name())).expect("a copy");
        }
    }
}
