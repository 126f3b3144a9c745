//! Pictures of `simulate`, `study` and `replay` in the size that a journal asks for.

mod program;
#[allow(dead_code)] // shared with the tests of the report
mod report_synthetic;

use std::path::Path;

use fieldgap::acoustics::Simulator;
use fieldgap::report::{self, PrintStyle, ReportContext};
use program::fieldgap;
use report_synthetic::{comparisons, context};

/// The SVG pictures of a folder, with their names.
fn pictures(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|extension| extension == "svg") {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            found.push((name, std::fs::read_to_string(&path).expect("text")));
        }
    }
    found
}

/// Width and height of a PNG file.
fn pixels(path: &Path) -> (u32, u32) {
    let file = std::io::BufReader::new(std::fs::File::open(path).expect("there"));
    let reader = png::Decoder::new(file).read_info().expect("a PNG");
    (reader.info().width, reader.info().height)
}

/// Whether a picture of this width has labels of this size, pt, and nothing beyond its right side.
fn is_printed(svg: &str, width_mm: f64, font_pt: f64) {
    assert!(svg.contains(&format!("<svg width=\"{width_mm}mm\"")), "{}", &svg[..200]);
    let number = |text: &str, before: &str| -> f64 {
        let rest = text.split_once(before).expect(before).1;
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').expect("an end");
        rest[..end].parse().expect("a number")
    };
    let whole = number(svg, "viewBox=\"0 0 ");
    let sizes_pt: Vec<f64> = svg
        .split("<text")
        .skip(1)
        .map(|text| number(text, "font-size=\"") * width_mm / whole / 25.4 * 72.0)
        .collect();
    // Labels are as large as asked for; numbers on axes are a little smaller, titles a little larger.
    assert!(sizes_pt.iter().any(|size_pt| (size_pt / font_pt - 1.0).abs() < 0.03), "{sizes_pt:?}");
    assert!(
        sizes_pt.iter().all(|size_pt| (0.9..1.1).contains(&(size_pt / font_pt))),
        "{sizes_pt:?}"
    );
    for text in svg.split("<text").skip(1) {
        assert!(number(text, " x=\"") < whole, "{text}");
    }
}

#[test]
fn simulated_fields_have_the_width_and_the_letters_of_a_journal() {
    let folder = tempfile::tempdir().expect("a folder");
    let rig = concat!(env!("CARGO_MANIFEST_DIR"), "/rigs/virtual.toml");
    let field =
        ["simulate", "--rig", rig, "--focus-mm", "0,0,100", "--z-mm", "100", "--step-mm", "5"];
    let style = ["--width-mm", "85", "--font-pt", "8", "--dpi", "300", "--out", "field"];
    let output = fieldgap(folder.path(), &[&field[..], &style].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let made = folder.path().join("field");
    let found = pictures(&made);
    assert_eq!(found.len(), 1);
    is_printed(&found[0].1, 85.0, 8.0);
    assert_eq!(pixels(&made.join("field-z100mm.png")).0, (85.0f64 / 25.4 * 300.0).round() as u32);

    let narrow =
        fieldgap(folder.path(), &[&field[..], &["--width-mm", "30", "--out", "no"]].concat());
    let said = String::from_utf8_lossy(&narrow.stderr);
    assert!(!narrow.status.success() && said.contains("--width-mm"), "{said}");
    let never = fieldgap(folder.path(), &[&field[..], &["--dpi", "nan", "--out", "no"]].concat());
    assert!(!never.status.success(), "no resolution");
}

#[test]
fn studies_have_the_width_and_the_letters_of_a_journal() {
    let folder = tempfile::tempdir().expect("a folder");
    let study = ["study", "height", "--set", "map.step_mm=5", "--maps"];
    for (width, font) in [("85", "7"), ("180", "8")] {
        let style = ["--width-mm", width, "--font-pt", font, "--out", width];
        let output = fieldgap(folder.path(), &[&study[..], &style].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let found = pictures(&folder.path().join(width));
        assert!(found.iter().any(|(name, _)| name == "study.svg") && found.len() > 10);
        for (_, svg) in found {
            is_printed(&svg, width.parse().expect("a number"), font.parse().expect("a number"));
        }
    }
}

#[test]
fn pictures_of_a_report_have_the_width_and_the_letters_of_a_journal() {
    let all = comparisons(&[Simulator::AsWritten, Simulator::Corrected], &[100.0, 150.0], 5.0);
    for (width_mm, font_pt) in [(85.0, 7.0), (180.0, 8.0)] {
        let folder = tempfile::tempdir().expect("a folder");
        let pictures_of = PrintStyle::new(Some(width_mm), Some(font_pt), None).expect("usual");
        let context = ReportContext { pictures: pictures_of, ..context() };
        report::write(folder.path(), &context, &all, None).expect("written");
        let found = pictures(folder.path());
        assert_eq!(found.len(), 5, "four maps and one picture of curves");
        for (_, svg) in found {
            is_printed(&svg, width_mm, font_pt);
        }
    }
}
