//! The report: files, text, reproducibility.

mod in_browser;
mod page_words;
mod report_synthetic;
mod rounds_synthetic;

use std::collections::BTreeMap;
use std::path::Path;

use fieldgap::acoustics::Simulator;
use fieldgap::closed_loop::Round;
use fieldgap::comparison::{Comparison, Uncertain};
use fieldgap::report::{self, LoopOfRounds, ReportContext, ReportError};

use page_words::words;
use report_synthetic::{V_PER_PA, comparisons, context, with_levels};

const BOTH: [Simulator; 2] = [Simulator::AsWritten, Simulator::Corrected];

/// The files of a report, by name.
fn files(context: &ReportContext, comparisons: &[Comparison]) -> BTreeMap<String, Vec<u8>> {
    let dir = tempfile::tempdir().expect("a folder");
    report::write(dir.path(), context, comparisons, None).expect("written");
    read_all(dir.path())
}

fn read_all(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    entries
        .map(|entry| {
            let path = entry.expect("an entry").path();
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, std::fs::read(&path).expect("a file"))
        })
        .collect()
}

fn page(context: &ReportContext, comparisons: &[Comparison]) -> String {
    let index = files(context, comparisons).remove("index.html").expect("a page");
    String::from_utf8(index).expect("UTF-8")
}

/// Without maps, which are slow to draw; for tests of the text.
fn without_maps(mut comparisons: Vec<Comparison>) -> Vec<Comparison> {
    for plane in comparisons.iter_mut().flat_map(|comparison| &mut comparison.planes) {
        plane.map = None;
    }
    comparisons
}

#[test]
fn text_of_a_report() {
    let mut context = context();
    context.warnings.push("The scan is partial: it ended after 300 of 450 points.".to_owned());
    let page = page(&context, &comparisons(&BOTH, &[100.0, 200.0], 5.0));
    insta::assert_snapshot!(words(&page));
}

/// The files of the page of a loop, by name.
fn files_of_rounds(rounds: &[Round]) -> BTreeMap<String, Vec<u8>> {
    let dir = tempfile::tempdir().expect("a folder");
    let (record, settings) = (rounds_synthetic::record(rounds), rounds_synthetic::settings());
    let of = LoopOfRounds { rounds, record: &record, visits: &[], settings: &settings };
    report::write_rounds(dir.path(), &context(), of).expect("written");
    read_all(dir.path())
}

#[test]
fn text_of_rounds() {
    let files = files_of_rounds(&rounds_synthetic::rounds());
    let page = std::str::from_utf8(&files["index.html"]).expect("UTF-8");
    assert!(!page.contains("://") && !page.contains("<script") && !page.contains("@import"));
    assert_eq!(page.matches("data:image/png;base64,").count(), 8, "four pictures, also narrow");
    insta::assert_snapshot!(words(page));
    assert!(files == files_of_rounds(&rounds_synthetic::rounds()), "the same bytes again");
}

#[test]
fn a_loop_that_has_not_ended_has_a_page() {
    let rounds = rounds_synthetic::rounds();
    for until in 1..rounds.len() {
        let files = files_of_rounds(&rounds[..until]);
        let words = words(std::str::from_utf8(&files["index.html"]).expect("UTF-8"));
        assert!(words.starts_with("Not yet ended after"), "{words}");
        assert!(!words.contains("NaN") && !words.contains("inf "), "{words}");
        // Probabilities are known after the first round only.
        assert_eq!(files.contains_key("probabilities.png"), until > 1);
    }
}

#[test]
fn the_same_comparison_gives_the_same_bytes() {
    let all = comparisons(&BOTH, &[50.0, 100.0], 5.0);
    let (first, second) = (files(&context(), &all), files(&context(), &all));
    assert_eq!(first.keys().collect::<Vec<_>>(), second.keys().collect::<Vec<_>>());
    for (name, bytes) in &first {
        assert!(bytes == &second[name], "{name} differs");
    }
}

#[test]
fn the_page_is_self_contained_and_its_links_are_valid() {
    let files = files(&context(), &comparisons(&BOTH, &[50.0, 100.0], 5.0));
    let page = String::from_utf8(files["index.html"].clone()).expect("UTF-8");
    assert!(!page.contains("://") && !page.contains("<script") && !page.contains("@import"));
    let targets = |attribute: &str| -> Vec<String> {
        let pieces = page.split(attribute).skip(1);
        pieces.map(|piece| piece.split('"').next().expect("a target").to_owned()).collect()
    };
    assert!(targets(" src=\"").iter().all(|target| target.starts_with("data:image/png;base64,")));
    assert_eq!(
        targets(" src=\"").len(),
        targets(" alt=\"").iter().filter(|alt| alt.len() > 40).count()
    );
    for target in targets(" href=\"") {
        match target.strip_prefix('#') {
            Some(anchor) => assert!(page.contains(&format!("id=\"{anchor}\"")), "{target}"),
            None => assert!(files.contains_key(&target), "{target}"),
        }
    }
}

#[test]
fn user_text_is_escaped() {
    let evil = "<script>alert('\"&')</script>\u{1}";
    let mut all = comparisons(&[Simulator::Corrected], &[100.0, 200.0], 5.0);
    all[0].scan_name = evil.to_owned();
    all[0].reading_unit = evil.to_owned();
    all[0].planes[1].map = None;
    all[0].planes[1].why_no_map = Some(evil.to_owned());
    all[0].registration.why = evil.to_owned();
    all[0].registration.undetermined[0].explanation = evil.to_owned();
    let mut context = context();
    context.title = evil.to_owned();
    context.software = evil.to_owned();
    context.warnings.push(evil.to_owned());
    context.set_up.push((evil.to_owned(), evil.to_owned()));
    context.inputs[0].name = evil.to_owned();
    context.inputs[0].sha256 = evil.to_owned();
    for (name, bytes) in files(&context, &all) {
        if name.ends_with(".html") || name.ends_with(".svg") {
            let text = String::from_utf8(bytes).expect("UTF-8");
            // The page of interactive maps has its data, Plotly in two parts, and a script of its own.
            let own_scripts = if name == "explore.html" { 4 } else { 0 };
            assert_eq!(text.matches("<script").count(), own_scripts, "{name}");
            assert!(!text.contains('\u{1}'), "{name}");
            assert!(text.contains("&lt;script&gt;"), "{name}");
        }
    }
}

#[test]
fn the_maps_in_pascals_have_the_uncertainty_of_their_height() {
    let all = comparisons(&[Simulator::Corrected], &[50.0, 100.0], 5.0);
    assert!(!files(&context(), &all).contains_key("levels.csv"));
    let all: Vec<_> = all.into_iter().map(with_levels).collect();
    let map = all[0].planes[0].map.as_ref().expect("a map");
    let files = files(&context(), &all);
    let mut rows = csv::Reader::from_reader(&files["levels.csv"][..]);
    let names = rows.headers().expect("names").clone();
    let column = |name: &str| names.iter().position(|other| other == name).expect("a column");
    let mut count = 0;
    for (row, volts) in rows.records().zip(&map.scan) {
        let row = row.expect("a row");
        let number = |name: &str| row[column(name)].parse::<f64>().expect("a number");
        let rms_pa = volts / V_PER_PA * 10f64.powf(0.1);
        assert!((number("scan_pa") / rms_pa - 1.0).abs() < 1e-9);
        assert!((number("scan_db") - 20.0 * (rms_pa / 20e-6).log10()).abs() < 1e-9);
        assert!((number("peak_expanded_db") - 0.8).abs() < 1e-12);
        count += 1;
    }
    assert_eq!(count, map.scan.len(), "the second height has no level");
}

#[test]
fn a_plane_without_a_grid_is_reported_without_a_map() {
    let mut all = comparisons(&[Simulator::Corrected], &[50.0, 100.0], 5.0);
    all[0].planes[0].map = None;
    all[0].planes[0].why_no_map = Some("its points lie on a circle".to_owned());
    all[0].planes[0].scan.focal_radius = None;
    all[0].planes[0].scan.sub_peaks = None;
    let files = files(&context(), &all);
    assert!(!files.contains_key("map-z50mm-corrected.png"));
    assert!(files.contains_key("map-z100mm-corrected.png"));
    let words = words(std::str::from_utf8(&files["index.html"]).expect("UTF-8"));
    assert!(words.contains("No map for corrected: its points lie on a circle."), "{words}");
}

#[test]
fn an_empty_plane_is_reported() {
    let mut all = comparisons(&[Simulator::Corrected], &[50.0, 100.0], 5.0);
    let plane = &mut all[0].planes[0];
    let map = plane.map.as_mut().expect("a map");
    map.scan.fill(f64::NAN);
    let mut empty = report_synthetic::figured(0.05, map.clone());
    empty.points = 0;
    *plane = empty;
    let words = words(&page(&context(), &all));
    assert!(
        words.contains("At 50 mm, there are too few readings to compare the fields."),
        "{words}"
    );
    assert!(words.contains("225 of 225 points were not measured."), "{words}");
    assert!(!words.contains("NaN") && !words.contains("inf"), "{words}");
}

#[test]
fn the_finding_of_the_thesis_is_described() {
    let all = without_maps(comparisons(&BOTH, &[50.0, 100.0, 150.0, 200.0], 2.0));
    let words = words(&page(&context(), &all));
    let (as_written, corrected) =
        words.split_once("Compared with the corrected simulation").expect("both simulators");
    assert!(
        as_written.contains("At the focal height of 100 mm, scan and simulation agree"),
        "{as_written}"
    );
    assert!(as_written.contains("The peaks of scan and simulation are 9.3"), "{as_written}");
    let corrected = corrected.split_once("How to read").expect("a guide").0;
    assert!(
        corrected.contains("At 50, 100 (focal height), 150 and 200 mm, scan and simulation agree"),
        "{corrected}"
    );
    assert!(!corrected.contains("The peaks of scan and simulation are"), "{corrected}");
    assert!(words.contains("The corrected simulator agrees best with the scan"));
}

#[test]
fn another_maximum_is_distinguished_from_a_moved_peak() {
    let mut all = without_maps(comparisons(&[Simulator::Corrected], &[100.0], 5.0));
    let plane = &mut all[0].planes[0];
    plane.discrepancy.peak_distance_m = Uncertain { value: 0.03, standard_error: 1e-4 };
    assert!(
        words(&page(&context(), &all))
            .contains("The peaks of scan and simulation are 30.00 ± 0.10 mm apart")
    );
    all[0].planes[0].scan.sub_peaks = Some(2);
    assert!(words(&page(&context(), &all)).contains("the largest is not the same one"));
}

#[test]
fn a_difference_in_shape_alone_is_reported() {
    let mut all = without_maps(comparisons(&[Simulator::Corrected], &[100.0], 5.0));
    let agreement = &mut all[0].planes[0].agreement;
    agreement.correlation = 0.71;
    agreement.residual_rms_ratio = 0.38;
    agreement.residual_rms_ratio_own_gain = 0.37;
    let words = words(&page(&context(), &all));
    assert!(words.contains("but the fields differ in shape (correlation 0.710)"), "{words}");
}

#[test]
fn a_difference_in_level_alone_is_no_agreement() {
    let mut all = without_maps(comparisons(&[Simulator::Corrected], &[100.0], 5.0));
    let agreement = &mut all[0].planes[0].agreement;
    agreement.gain_ratio = 1.7;
    agreement.residual_rms_ratio = 0.42;
    agreement.residual_rms_ratio_own_gain = 0.06;
    let words = words(&page(&context(), &all));
    assert!(words.contains("peaks and shapes agree (correlation 0.998), but the level differs"));
    assert!(!words.contains("scan and simulation agree:"), "{words}");
}

#[test]
fn many_heights_are_given_as_a_range() {
    let heights: Vec<f64> = (10..=20).map(|z| f64::from(z) * 10.0).collect();
    let all = without_maps(comparisons(&[Simulator::Corrected], &heights, 7.0));
    let words = words(&page(&context(), &all));
    assert!(
        words.contains("At 11 heights from 100 to 200 mm, including the focal height of 100 mm,"),
        "{words}"
    );
}

#[test]
fn several_drives_are_shown_separately() {
    let mut all = comparisons(&[Simulator::Corrected], &[50.0, 100.0], 5.0);
    let mut second = all[0].planes.clone();
    for plane in &mut second {
        plane.focus = 1;
        plane.target_m = None;
        plane.target_in_scan_m = None;
    }
    all[0].planes.extend(second);
    let files = files(&context(), &all);
    for name in
        ["map-drive0-z50mm-corrected.svg", "map-drive1-z50mm-corrected.svg", "curves-drive1.png"]
    {
        assert!(files.contains_key(name), "{name}");
    }
    let words = words(std::str::from_utf8(&files["index.html"]).expect("UTF-8"));
    assert!(words.contains("Drive 0: At 50 and 100 (focal height) mm"), "{words}");
    assert!(words.contains("Drive 1: At 50 and 100 mm"), "{words}");
}

#[test]
fn a_single_height_has_no_curves() {
    let files = files(&context(), &comparisons(&[Simulator::Corrected], &[100.0], 5.0));
    assert!(!files.contains_key("curves.png"));
    assert!(!String::from_utf8_lossy(&files["index.html"]).contains("#curves"));
}

#[test]
fn the_data_can_be_read_back() {
    let all = without_maps(comparisons(&BOTH, &[50.0, 100.0], 5.0));
    let files = files(&context(), &all);
    let csv = String::from_utf8(files["comparison.csv"].clone()).expect("UTF-8");
    let begins: Vec<&str> =
        csv.lines().map(|line| line.split(",").next().expect("a cell")).collect();
    assert_eq!(begins, ["simulator", "as-written", "as-written", "corrected", "corrected"]);
    let data: serde_json::Value = serde_json::from_slice(&files["comparison.json"]).expect("JSON");
    assert_eq!(data[1]["simulator"], "corrected");
    assert_eq!(data[0]["planes"][1]["z_m"], 0.1);
}

#[test]
fn an_empty_comparison_and_an_invalid_folder_are_errors() {
    let dir = tempfile::tempdir().expect("a folder");
    let nothing = report::write(dir.path(), &context(), &[], None);
    assert!(matches!(nothing, Err(ReportError::NothingCompared)));
    let file = dir.path().join("taken");
    std::fs::write(&file, "").expect("written");
    let all = without_maps(comparisons(&[Simulator::Corrected], &[100.0], 7.0));
    let error =
        report::write(Path::new(&file), &context(), &all, None).expect_err("a file is no folder");
    assert!(error.to_string().contains("taken"), "{error}");
}
