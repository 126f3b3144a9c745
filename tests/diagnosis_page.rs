//! The report of a diagnosis: files, text, reproducibility; and the first screen of a report with its cause.

mod diagnosis_synthetic;
mod first_screen;
mod page_words;
#[allow(dead_code)] // shared with the tests of the report
mod report_synthetic;

use std::collections::BTreeMap;

use diagnosis_synthetic::{ambiguous, explained, no_gap, two_causes};
use fieldgap::diagnosis::{Diagnosis, Verdict};
use fieldgap::report::{self, ReportContext};
use page_words::words;
use report_synthetic::context;

/// The files of a report, by name.
fn files(context: &ReportContext, diagnosis: &Diagnosis) -> BTreeMap<String, Vec<u8>> {
    let dir = tempfile::tempdir().expect("a folder");
    report::write_diagnosis(dir.path(), context, diagnosis).expect("written");
    let entries = std::fs::read_dir(dir.path()).expect("a folder");
    entries
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, std::fs::read(&path).expect("a file"))
        })
        .collect()
}

fn page(diagnosis: &Diagnosis) -> String {
    let index = files(&context(), diagnosis).remove("index.html").expect("a page");
    String::from_utf8(index).expect("UTF-8")
}

/// Without maps, which are slow to draw; for tests of the text.
fn without_maps(mut diagnosis: Diagnosis) -> Diagnosis {
    for plane in &mut diagnosis.planes {
        plane.x_m.clear();
        plane.y_m.clear();
    }
    diagnosis
}

#[test]
fn text_of_a_named_cause() {
    insta::assert_snapshot!(words(&page(&explained(&[50.0, 100.0], 5.0))));
}

#[test]
fn causes_are_compared_in_words_and_those_ruled_out_are_folded() {
    let diagnosis = without_maps(explained(&[100.0], 7.0));
    let files = files(&context(), &diagnosis);
    assert!(!files.keys().any(|name| name.starts_with("evidence")), "{:?}", files.keys());
    let page = std::str::from_utf8(&files["index.html"]).expect("UTF-8");
    let (before, folded) = page.split_once("<details>").expect("a fold");
    let folded = folded.split_once("</details>").expect("its end").0;
    assert!(folded.contains("<summary>5 causes or sets of causes are ruled out</summary>"));
    for words in
        ["160 times less likely than the best account", "1,200 times less likely", "0.0008"]
    {
        assert!(folded.contains(words) && !before.contains(words), "{words}: {folded}");
    }
    assert!(before.contains("the best account") && before.contains("0.993"), "{before}");
}

#[test]
fn text_of_rivals() {
    let words = words(&page(&without_maps(ambiguous(5.0))));
    let (before, after) = words.split_once("Before and after").expect("a section");
    let after = after.split_once("Causes ruled out").expect("a section").1;
    insta::assert_snapshot!(format!("{before}[...]{after}"));
}

#[test]
fn the_page_is_self_contained_and_its_links_are_valid() {
    for diagnosis in [two_causes(&[50.0, 100.0], 7.0), ambiguous(7.0), no_gap(7.0)] {
        let files = files(&context(), &diagnosis);
        let page = String::from_utf8(files["index.html"].clone()).expect("UTF-8");
        assert!(!page.contains("://") && !page.contains("<script") && !page.contains("@import"));
        assert!(!words(&page).contains("NaN"), "{}", words(&page));
        let targets = |attribute: &str| -> Vec<String> {
            let pieces = page.split(attribute).skip(1);
            pieces.map(|piece| piece.split('"').next().expect("a target").to_owned()).collect()
        };
        let pictures = targets(" src=\"");
        assert!(pictures.iter().all(|target| target.starts_with("data:image/png;base64,")));
        let told = targets(" alt=\"").iter().filter(|alt| alt.len() > 40).count();
        assert_eq!(pictures.len(), told);
        for target in targets(" href=\"") {
            match target.strip_prefix('#') {
                Some(anchor) => assert!(page.contains(&format!("id=\"{anchor}\"")), "{target}"),
                None => assert!(files.contains_key(&target), "{target}"),
            }
        }
    }
}

#[test]
fn the_same_diagnosis_gives_the_same_bytes() {
    let diagnosis = two_causes(&[50.0, 100.0], 7.0);
    assert!(files(&context(), &diagnosis) == files(&context(), &diagnosis));
}

#[test]
fn user_text_is_escaped() {
    let evil = "<script>alert('\"&')</script>\u{1}";
    let mut diagnosis = ambiguous(7.0);
    for words in [
        &mut diagnosis.scan,
        &mut diagnosis.scans[0],
        &mut diagnosis.reading_unit,
        &mut diagnosis.sentence,
        &mut diagnosis.undetermined[0],
        &mut diagnosis.registration.why,
    ] {
        *words = evil.to_owned();
    }
    let next = diagnosis.next_measurement.as_mut().expect("a measurement");
    next.what = evil.to_owned();
    next.plan = Some(format!("name = \"{evil}\"\nsecond = 1\n"));
    diagnosis.ranked[0].readings[0] = evil.to_owned();
    for (name, bytes) in files(&context(), &diagnosis) {
        if name.ends_with(".html") || name.ends_with(".svg") {
            let text = String::from_utf8(bytes).expect("UTF-8");
            assert!(!text.contains("<script") && !text.contains('\u{1}'), "{name}");
        }
    }
    let page = page(&diagnosis);
    assert!(page.contains("\nsecond = 1</pre>"), "a plan keeps its lines");
}

#[test]
fn without_a_grid_the_page_has_numbers() {
    let mut diagnosis = without_maps(explained(&[50.0, 100.0], 7.0));
    diagnosis.planes[0].figures = None;
    let files = files(&context(), &diagnosis);
    assert!(!files.keys().any(|name| name.starts_with("residual")), "{:?}", files.keys());
    let words = words(std::str::from_utf8(&files["index.html"]).expect("UTF-8"));
    assert!(words.contains("No map: the points at this height do not form a grid."), "{words}");
}

#[test]
fn an_unexplained_gap_is_reported() {
    let mut diagnosis = without_maps(explained(&[100.0], 7.0));
    diagnosis.verdict = Verdict::Unexplained;
    diagnosis.effects.clear();
    diagnosis.sentence = "Nothing in the catalogue explains this gap.".to_owned();
    let words = words(&page(&diagnosis));
    assert!(
        words.contains("Unexplained. There is a gap, and no effect in the catalogue explains it."),
        "{words}"
    );
}

#[test]
fn several_scans_and_drives_are_shown_separately() {
    let mut diagnosis = explained(&[100.0], 7.0);
    diagnosis.scans.push("again".to_owned());
    let mut again = diagnosis.planes[0].clone();
    again.scan = 1;
    again.focus = 1;
    diagnosis.planes.push(again);
    let files = files(&context(), &diagnosis);
    for name in ["residual-scan0-drive0-z100mm.png", "residual-scan1-drive1-z100mm.svg"] {
        assert!(files.contains_key(name), "{name}: {:?}", files.keys());
    }
    let words = words(std::str::from_utf8(&files["index.html"]).expect("UTF-8"));
    assert!(words.contains("Scan again, Drive 1, z = 100 mm"), "{words}");
}

#[test]
fn the_data_are_written_beside_the_page() {
    let diagnosis = without_maps(explained(&[50.0, 100.0], 7.0));
    let files = files(&context(), &diagnosis);
    let text = String::from_utf8(files["diagnosis.txt"].clone()).expect("UTF-8");
    assert_eq!(text, diagnosis.to_text());
    let data: serde_json::Value = serde_json::from_slice(&files["diagnosis.json"]).expect("JSON");
    assert_eq!(data["effects"][0], "sound-speed");
}
