//! Two records on the command line: `compare A B` with alignment and page, `diagnose A B --change`.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

use fieldgap::acoustics::{Array, Excitation, Medium, Simulation, Simulator, Vec3};

mod small_record;
use small_record::{HEADER, SETUP};

fn fieldgap(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fieldgap")).args(arguments).output().expect("it runs")
}

fn output(of: &Output) -> String {
    assert!(of.status.success(), "{}", String::from_utf8_lossy(&of.stderr));
    String::from_utf8(of.stdout.clone()).expect("UTF-8")
}

/// A record of 29 by 29 places, 2 mm apart, with readings that scatter by about one percent; its places are reported `shifted_mm` along x
/// beside where they are.
fn record(folder: &Path, name: &str, hour: u32, silent: Option<usize>, shifted_mm: f64) {
    let mut elements = Array::square(6, 6, 10.5e-3).expect("not empty").elements().to_vec();
    for (n, element) in elements.iter_mut().enumerate() {
        element.amplitude *= 1.0 + 0.08 * (2.4 * (n * n) as f64).sin();
    }
    if let Some(n) = silent {
        elements[n].amplitude = 0.0;
    }
    let simulation = Simulation {
        simulator: Simulator::Corrected,
        array: Array::from_elements(elements).expect("elements"),
        medium: Medium { speed_of_sound_m_s: 343.0 },
        frequency_hz: 40e3,
        excitation: Excitation::Focus(Vec3::new(0.0, 0.0, 0.1)),
    };
    let places: Vec<Vec3> = (0..29 * 29)
        .map(|n| Vec3::new(f64::from(n % 29 - 14), f64::from(n / 29 - 14), 40.0) * 2e-3)
        .map(|at_m| Vec3::new(at_m.x, at_m.y, 0.08))
        .collect();
    let there: Vec<Vec3> = places.iter().map(|at_m| at_m + Vec3::x() * shifted_mm * 1e-3).collect();
    let levels = simulation.magnitudes(&there);
    let top = levels.iter().fold(0.0f64, |top, level| top.max(*level));
    let mut rows = format!("{HEADER}\n");
    // Even fractions of the golden ratio as draws: evenly spread, and not the same in both records.
    let mut draw = {
        let mut at = 0.1 + 0.37 * f64::from(hour);
        move || {
            at = (at + 0.618_033_988_749_895 * (1.0 + at)).fract();
            3.46 * (at - 0.5)
        }
    };
    for pass in 0..2 {
        for (n, (at_m, level)) in places.iter().zip(&levels).enumerate() {
            let reading = (level / top * (1.0 + 0.01 * draw()) + 0.003 * draw()).abs();
            let time_s = pass * 1000 + n;
            let (x, y, z) = (at_m.x * 1e3, at_m.y * 1e3, at_m.z * 1e3);
            writeln!(rows, "{time_s},0,{x:.3},{y:.3},{z:.3},{reading:.6}").expect("a string");
        }
    }
    let setup = SETUP
        .replace("\"small\"", &format!("\"{name}\""))
        .replace("T00:00:00Z", &format!("T{hour:02}:02:00Z"));
    std::fs::create_dir_all(folder).expect("a folder");
    std::fs::write(folder.join("scan.toml"), setup).expect("written");
    std::fs::write(folder.join("samples.csv"), rows).expect("written");
}

#[test]
fn a_dead_element_is_named_between_the_times_of_the_records() {
    let home = tempfile::tempdir().expect("a folder");
    let [a, b, out] = ["a", "b", "out"].map(|name| home.path().join(name));
    record(&a, "before", 10, None, 0.0);
    record(&b, "after", 11, Some(17), 0.0);
    let [a, b, out] = [&a, &b, &out].map(|path| path.to_str().expect("text"));
    let text = output(&fieldgap(&["diagnose", a, b, "--change"]));
    assert!(text.starts_with("Element 17 died between 10:02 and 11:02 UTC"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let json = output(&fieldgap(&["diagnose", a, b, "--change", "--json", "--report", out]));
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert!(json["verdict"].as_str().is_some_and(|verdict| verdict.ends_with("explained")));
    assert_ne!(json["verdict"], "unexplained");
    assert_eq!(json["effects"], serde_json::json!(["dead-elements"]));
    assert_eq!(
        json["ranked"][0]["parameters"]["dead-elements.elements"]["after"]["value"],
        serde_json::json!([17])
    );
    let page = std::fs::read_to_string(Path::new(out).join("index.html")).expect("a page");
    assert!(page.contains("<h1>Element 17 died between 10:02 and 11:02 UTC"), "{}", &page[..3000]);
    assert!(page.contains("alt=\"Three maps over x and y at height 80.0000 mm"));
    assert!(!page.contains("http://") && !page.contains("<script"));
    let same = output(&fieldgap(&["diagnose", a, a, "--change"]));
    assert!(same.starts_with("Nothing changed beyond noise."), "{same}");
    let one = fieldgap(&["diagnose", a, "--change"]);
    assert!(!one.status.success());
    assert!(String::from_utf8_lossy(&one.stderr).contains("--change takes two scans"));
}

#[test]
fn a_shift_is_found_removed_and_reported_and_the_limit_holds_for_what_is_left() {
    let home = tempfile::tempdir().expect("a folder");
    let [a, b, out] = ["a", "b", "out"].map(|name| home.path().join(name));
    record(&a, "before", 10, None, 0.0);
    record(&b, "after", 11, None, 1.5);
    let [a, b, out] = [&a, &b, &out].map(|path| path.to_str().expect("text"));
    let limited = |register: &str| {
        let of =
            fieldgap(&["compare", a, b, "--register", register, "--fail-above", "5", "--json"]);
        let json: serde_json::Value = serde_json::from_slice(&of.stdout).expect("JSON");
        (of.status.code(), json)
    };
    let (code, as_read) = limited("none");
    assert_eq!((code, &as_read["alignment"]), (Some(4), &serde_json::Value::Null));
    for register in ["shift", "gain-and-shift", "auto", "pose"] {
        let (code, json) = limited(register);
        assert_eq!(code, Some(0), "{register}: {}", json["alignment"]);
        let shift_m = &json["alignment"]["shift_m"][0];
        let [value, error] =
            ["value", "standard_error"].map(|key| shift_m[key].as_f64().expect("a number"));
        assert!((value - 1.5e-3).abs() < 4.0 * error && error < 0.05e-3, "{register}: {shift_m}");
    }
    // Without the option two records are compared as read, as ever.
    let plain = output(&fieldgap(&["compare", a, b]));
    assert!(!plain.contains("shifted by"), "{plain}");
    let text = output(&fieldgap(&["compare", a, b, "--register", "shift", "--report", out]));
    assert!(text.contains("B was shifted by"), "{text}");
    let page = std::fs::read_to_string(Path::new(out).join("index.html")).expect("a page");
    assert!(page.contains("Shift of B along x"), "the alignment is on the page");
    for name in ["difference.txt", "difference.csv", "difference.json", "change-drive0-z80mm.svg"] {
        assert!(Path::new(out).join(name).exists(), "{name}");
    }
}
