//! The interactive maps and the page of rounds in a real browser, where one is installed.

use std::path::{Path, PathBuf};
use std::process::Command;

use fieldgap::acoustics::Simulator;
use fieldgap::comparison::Comparison;
use fieldgap::report::{self, LoopOfRounds, SimulatedMap};

use crate::report_synthetic::{comparisons, context, simulated_map, with_levels};
use crate::rounds_synthetic;

/// Chromium or Chrome on the search path.
fn browser() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let paths = std::env::var_os("PATH")?;
    std::env::split_paths(&paths)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|path| path.is_file())
}

/// The document after its scripts have run.
fn document(browser: &Path, page: &Path) -> String {
    let profile = tempfile::tempdir().expect("a folder");
    let done = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg("--dump-dom")
        .arg(page)
        .output()
        .expect("the browser starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).expect("UTF-8")
}

#[test]
fn the_interactive_maps_are_drawn_without_a_network() {
    let Some(browser) = browser() else {
        eprintln!("skipped: neither chromium nor google-chrome is installed");
        return;
    };
    let both = [Simulator::AsWritten, Simulator::Corrected];
    let all = comparisons(&both, &[100.0, 200.0], 5.0);
    let folder = tempfile::tempdir().expect("a folder");
    report::write(folder.path(), &context(), &all, None).expect("written");
    let page = folder.path().join("explore.html");
    let source = std::fs::read_to_string(&page).expect("a page");
    assert!(!source.contains("src=\"http") && !source.contains("href=\"http"));

    let document = document(&browser, &page);
    assert!(document.contains("data-drawn-ms="), "the script did not reach its end");
    // Three maps, the phase and three cross-sections, and the first height is the worst one.
    assert_eq!(document.matches("class=\"js-plotly-plot\"").count(), 7);
    assert!(document.contains("200) mm: scan "), "no values of the worst height");
    for title in [
        "simulation (as-written)",
        "scan − simulation",
        "phase of the simulation",
        "z (mm)",
        "reading (V)",
    ] {
        assert!(document.contains(title), "no {title}");
    }
}

#[test]
fn maps_are_shown_in_pascals_and_decibels_where_the_level_is_known() {
    let Some(browser) = browser() else {
        eprintln!("skipped: neither chromium nor google-chrome is installed");
        return;
    };
    let all = comparisons(&[Simulator::Corrected], &[100.0, 200.0], 5.0);
    let plain = report_of(&all).1;
    assert!(!plain.contains("value=\"pascal\""), "pascals of an unknown sensitivity");
    let all: Vec<_> = all.into_iter().map(with_levels).collect();
    let (folder, source) = report_of(&all);
    let map = all[0].planes[0].map.as_ref().expect("a map");
    let volts = map.scan.iter().copied().fold(0.0, f64::max);
    // 2 dB more than the reading of 3 mV/Pa says.
    let db = 20.0 * (volts / 0.003 / 20e-6).log10() + 2.0;
    for (scale, titles) in [
        ("pascal", [">Pa rms</text>", "pressure (Pa rms)"]),
        ("level", [">dB re 20 µPa</text>", "pressure (Pa rms)"]),
    ] {
        let option = format!("<option value=\"{scale}\"");
        let chosen = source.replace(&option, &format!("{option} selected"));
        assert_ne!(chosen, source);
        // The first height is shown, which has a level.
        let chosen =
            chosen.replace("\"z_mm\":200.0},\"comparisons\"", "\"z_mm\":100.0},\"comparisons\"");
        let page = folder.path().join("explore.html");
        std::fs::write(&page, chosen).expect("written");
        let document = document(&browser, &page);
        assert!(document.contains("data-complete=\"yes\""), "the script did not reach its end");
        let said = format!(" Pa rms = {db:.1} dB, simulation ");
        assert!(document.contains(&said), "no {said}");
        assert!(document.contains("± 0.8 dB, k = 2)"), "no uncertainty");
        for title in titles {
            assert!(document.contains(title), "{scale}: no {title}");
        }
    }
}

fn report_of(comparisons: &[Comparison]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    report::write(folder.path(), &context(), comparisons, None).expect("written");
    let source = std::fs::read_to_string(folder.path().join("explore.html")).expect("a page");
    (folder, source)
}

#[test]
fn simulated_fields_are_drawn_with_their_phase_and_in_three_dimensions() {
    let Some(browser) = browser() else {
        eprintln!("skipped: neither chromium nor google-chrome is installed");
        return;
    };
    let planes: Vec<SimulatedMap> = [0.05, 0.1, 0.15].map(simulated_map).to_vec();
    let folder = tempfile::tempdir().expect("a folder");
    let files = report::write_simulation(
        folder.path(),
        "a field",
        Simulator::Corrected,
        &planes,
        Default::default(),
    );
    let files = files.expect("written");
    assert_eq!(files.pictures.len(), 6);
    let page = files.page.expect("a page");
    // The fold is opened as a reader does.
    let source = std::fs::read_to_string(&page).expect("a page");
    let opened = source.replace("id=\"volume-fold\" hidden", "id=\"volume-fold\" open");
    assert_ne!(source, opened);
    std::fs::write(&page, opened).expect("written");

    let document = document(&browser, &page);
    assert!(document.contains("data-complete=\"yes\""), "the script did not reach its end");
    // Amplitude, phase, three cross-sections and the view in three dimensions.
    assert_eq!(document.matches("class=\"js-plotly-plot\"").count(), 6);
    assert!(document.contains("100) mm: amplitude "), "the height of the focus comes first");
    assert!(document.contains(" dB of the largest at this height, phase of the simulation "));
    assert!(!document.contains("id=\"difference\""));
}

/// A page is laid out without anything that is wider than a phone but for tables, which scroll by themselves.
#[test]
fn the_page_of_rounds_fits_a_phone_and_a_desk() {
    let Some(browser) = browser() else {
        eprintln!("skipped: neither chromium nor google-chrome is installed");
        return;
    };
    let rounds = rounds_synthetic::rounds();
    let (record, settings) = (rounds_synthetic::record(&rounds), rounds_synthetic::settings());
    let of = LoopOfRounds { rounds: &rounds, record: &record, visits: &[], settings: &settings };
    let folder = tempfile::tempdir().expect("a folder");
    report::write_rounds(folder.path(), &context(), of).expect("written");
    // A window is never as narrow as a phone; a frame in it is. It tells how wide its content came out.
    let measure = "<script>addEventListener('load', () => { const all = document.documentElement; parent.postMessage([\
                   innerWidth, all.scrollWidth, document.querySelectorAll('figure img').length, [...document.images]\
                   .filter(image => !image.complete || image.naturalWidth === 0).length], '*') })</script></body>";
    let page = std::fs::read_to_string(folder.path().join("index.html")).expect("a page");
    std::fs::write(folder.path().join("measured.html"), page.replace("</body>", measure))
        .expect("written");
    for width in [360, 1160] {
        let frame = format!(
            "<body><script>addEventListener('message', told => document.body.dataset.told = told.data.join(' '))</script>\
             <iframe src=\"measured.html\" width=\"{width}\" height=\"800\" frameborder=\"0\"></iframe></body>"
        );
        let path = folder.path().join("frame.html");
        std::fs::write(&path, frame).expect("written");
        let document = document(&browser, &path);
        let told = document.split("data-told=\"").nth(1).expect("it was measured");
        let told: Vec<&str> = told.split('"').next().expect("a value").split(' ').collect();
        let [inner, content, pictures, broken] = told[..] else { panic!("{told:?}") };
        assert_eq!((inner, pictures, broken), (width.to_string().as_str(), "4", "0"));
        let content: u32 = content.parse().expect("a width");
        assert!(content <= width, "{content} in {width}");
    }
}
