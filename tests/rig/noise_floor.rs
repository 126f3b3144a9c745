//! A floor about as large as the noise of one sample, behind a receiver that averages 16 of them: the means say little, the scatter within
//! readings tells. The virtual rig's physics makes the field and the noise.

use std::path::Path;

use crate::program::fieldgap;

/// Of each quadrature of a sample, V.
const NOISE_V: f64 = 0.03;

const PLAN: &str = "name = \"floor\"\nrig = \"rig.toml\"\ndiagnose = true\n[simulator]\nmodel = \"piston\"\n\
                    [[focus]]\nx_mm = 10.0\ny_mm = -5.0\nz_mm = 100.0\n[dark]\nbefore = 24\nafter = 24\n\
                    [[plane]]\nz_mm = [80.0, 100.0, 130.0]\nsize_mm = [60.0, 60.0]\nstep_mm = 4.0\n\
                    [[plane]]\nz_mm = [90.0, 100.0]\nsize_mm = [60.0, 60.0]\nstep_mm = 12.0\n\
                    [[plane]]\nz_mm = [90.0, 100.0]\nsize_mm = [60.0, 60.0]\nstep_mm = 12.0\n";

/// What a scan with these effects is told to have.
fn diagnosed(folder: &Path, effects: &str) -> serde_json::Value {
    let rigs = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs");
    let rig = std::fs::read_to_string(rigs.join("virtual.toml")).expect("the rig file");
    let rig = rig
        .replace("truth/thesis-lab.toml", "truth.toml")
        .replace("[virtual.robot]", "[virtual.array]\nperiod_steps = 8192\n\n[virtual.robot]");
    let truth = format!(
        "[source]\npressure_pa_at_1_m = 4.0\n[microphone]\nsensitivity_v_pa = 0.003\n[noise]\nmultiplicative = 0.05\n\
         additive_v = {NOISE_V}\n{effects}"
    );
    for (name, text) in [("rig.toml", rig.as_str()), ("truth.toml", &truth), ("plan.toml", PLAN)] {
        std::fs::write(folder.join(name), text).expect("written");
    }
    let output = fieldgap(folder, &["run", "plan.toml", "--out", "scan"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json = std::fs::read(folder.join("scan/report/why/diagnosis.json")).expect("diagnosed");
    serde_json::from_slice(&json).expect("JSON")
}

#[test]
fn it_is_told_from_the_noise_and_where_there_is_none_none_is_told() {
    let folders = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    let floor_v = 1.2 * NOISE_V;
    let effects = format!("[effects.noise-floor]\nlevel = {floor_v}\n");
    let found = diagnosed(folders[0].path(), &effects);
    assert_eq!(found["effects"], serde_json::json!(["noise-floor"]), "{}", found["sentence"]);
    let level = &found["ranked"][0]["parameters"]["noise-floor.level"];
    let number = |key: &str| level[key].as_f64().expect("a number");
    let off = (number("value") - floor_v).abs();
    assert!(off < 0.15 * floor_v && off < 3.0 * number("standard_error"), "{level}");
    let none = diagnosed(folders[1].path(), "");
    assert_eq!(none["verdict"], "none", "{}", none["sentence"]);
}
