//! The commands `study`, `characterize` and `transducers`.

mod program;
mod transducer_synthetic;

use program::fieldgap;
use transducer_synthetic::{Axis, log, write};

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text")
}

#[test]
fn a_study_writes_tables_pictures_and_its_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments =
        ["study", "height", "--set", "map.step_mm=5", "--maps", "--convention", "as-written"];
    for run in ["out/study-height", "out/study-height-2"] {
        let output = fieldgap(folder.path(), &arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(
            text(&output.stdout).contains("sub-peaks: at no value"),
            "{}",
            text(&output.stdout)
        );
        let made = folder.path().join(run);
        for file in
            ["study.csv", "study.txt", "study.toml", "study.png", "study.svg", "field-019.png"]
        {
            assert!(made.join(file).exists(), "{run}/{file}");
        }
    }
    // The written study file gives the same result.
    let own = "out/study-height/study.toml";
    let again = fieldgap(folder.path(), &["study", own, "--out", "again"]);
    assert!(again.status.success(), "{}", text(&again.stderr));
    let read = |path: &str| std::fs::read_to_string(folder.path().join(path)).expect("there");
    assert_eq!(read("again/study.csv"), read("out/study-height/study.csv"));
    assert!(read(own).contains("model = \"as-written\""));
}

#[test]
fn a_characterized_transducer_is_simulated_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let field = |distance_m: f64, _: f64, angle_deg: f64| {
        0.1 / distance_m * (-(angle_deg / 28.0).powi(2)).exp()
    };
    write(folder.path(), &log(Axis::default(), 1e-3, 2, field));
    std::fs::create_dir(folder.path().join("transducers")).expect("a folder");
    let characterized = fieldgap(
        folder.path(),
        &[
            "characterize",
            "log_19v_murata.csv",
            "--name",
            "mine",
            "--transducer",
            "transducers/mine.toml",
        ],
    );
    assert!(characterized.status.success(), "{}", text(&characterized.stderr));
    let said = text(&characterized.stdout);
    assert!(said.contains("best model: 1/r on the axis, Gaussian directivity"), "{said}");
    for file in [
        "curves.png",
        "polar.svg",
        "residuals.png",
        "models.csv",
        "profile.json",
        "transducer.toml",
    ] {
        assert!(folder.path().join("out/transducer-mine").join(file).exists(), "{file}");
    }
    let shown = fieldgap(folder.path(), &["study", "spacing", "--show"]);
    let study = text(&shown.stdout)
        .replace("spacing_mm = 0.0", "spacing_mm = 0.0\ntransducer = \"mine\"")
        .replace("model = \"corrected\"", "model = \"transducer\"")
        .replace("to = 20", "to = 2");
    std::fs::write(folder.path().join("mine.toml"), study).expect("written");
    let simulated = fieldgap(folder.path(), &["study", "mine.toml", "--json"]);
    assert!(simulated.status.success(), "{}", text(&simulated.stderr));
    let found: serde_json::Value = serde_json::from_slice(&simulated.stdout).expect("JSON");
    assert_eq!(found["rows"][0]["simulator"], "transducer");
    // 36 elements in phase, each 1/d times the lobe: the peak follows from the geometry.
    let expected: f64 = (0..36)
        .map(|n| (10.5 * (f64::from(n % 6) - 2.5), 10.5 * (f64::from(n / 6) - 2.5)))
        .map(|(x, y)| {
            let (aside, distance) = (x.hypot(y), (x * x + y * y + 1e4).sqrt());
            (-(aside.atan2(100.0).to_degrees() / 28.0).powi(2)).exp() / (distance * 1e-3)
        })
        .sum::<f64>()
        / 2f64.sqrt();
    let peak = found["rows"][0]["draws"][0]["peak"].as_f64().expect("a number");
    assert!((peak / expected - 1.0).abs() < 3e-3, "{peak} {expected}");
}

#[test]
fn errors_name_place_and_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("noise.csv"), {
        let mut noise = 1_u32;
        let mut text = "x,y,z,mag,unused\n0,0,0\n10,10,10\n2,2,2\n".to_owned();
        for point in 0..216 {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let (x, y, z) = (point % 6 * 2, point / 6 % 6 * 2, point / 36 * 2);
            text += &format!("{x},{y},{z},{},0\n", f64::from(noise >> 8) * 1e-9);
        }
        text
    })
    .expect("written");
    let cases: [(&[&str], &[&str]); 9] = [
        (&["study", "colour"], &["shape, height, count, spacing and comparison", "my-study.toml"]),
        (&["study", "none.toml"], &["none.toml", "cannot be read"]),
        (&["study", "count", "--set", "array.colums=3"], &["colums", "columns"]),
        (&["study", "shape", "--set", "draws=1000000000"], &["fields", "fewer `draws`"]),
        (&["study", "shape", "--set", "map.step_mm=0.02"], &["too many points"]),
        (&["study", "count", "--set", "map.step_mm=0"], &["0 is not a length above zero"]),
        (&["characterize", "none.csv"], &["none.csv", "cannot be read"]),
        (&["characterize", "noise.csv"], &["no model explains half", "at least four heights"]),
        (&["characterize", "noise.csv", "--from-mm", "90"], &["only 1 heights", "--from-mm"]),
    ];
    for (arguments, wanted) in cases {
        let output = fieldgap(folder.path(), arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        for words in wanted {
            assert!(said.contains(words), "{arguments:?}: no `{words}` in:\n{said}");
        }
        assert!(!folder.path().join("out").exists(), "{arguments:?} left files behind");
    }
}
